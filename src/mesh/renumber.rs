//! Triangles without the vertices that they do not use.

/// Triangles over their own vertices alone, numbered by first use, and which vertex of the
/// `vertices` given each of these is.
pub fn renumber(triangles: &[[u32; 3]], vertices: usize) -> (Vec<[u32; 3]>, Vec<u32>) {
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; vertices];
    let mut used: Vec<u32> = Vec::with_capacity(vertices.min(3 * triangles.len()));
    let mut result = Vec::with_capacity(triangles.len());
    for &[a, b, c] in triangles {
        let mut number = |vertex: u32| {
            let index = &mut new_index[vertex as usize];
            if *index == UNUSED {
                *index = used.len() as u32;
                used.push(vertex);
            }
            *index
        };
        result.push([number(a), number(b), number(c)]);
    }
    (result, used)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_numbered_by_first_use() {
        let (triangles, used) = renumber(&[[7, 2, 5], [5, 2, 9]], 10);
        assert_eq!((triangles, used), (vec![[0, 1, 2], [2, 1, 3]], vec![7, 2, 5, 9]));
    }
}

//! Boxes that are found by where they are.

use std::ops::Range;

/// Least and greatest coordinates.
pub type Corners = [[f64; 3]; 2];

/// Members of a leaf, at most.
const LEAF: usize = 4;

/// A bounding-volume hierarchy over numbered boxes, halved at the median of the longest side that
/// their centres span.
#[derive(Debug, Default)]
pub struct BoxTree {
    boxes: Vec<Corners>,
    /// Numbers of the boxes, those of a node side by side.
    order: Vec<usize>,
    /// Each node is followed by its first child.
    nodes: Vec<Node>,
}

#[derive(Debug)]
struct Node {
    bounds: Corners,
    /// Places in the order.
    members: Range<usize>,
    /// `None` of leaves.
    second_child: Option<usize>,
}

impl BoxTree {
    /// Over boxes, numbered from 0.
    pub fn new(boxes: Vec<Corners>) -> Self {
        let count = boxes.len();
        let mut tree = Self { boxes, order: (0..count).collect(), nodes: Vec::new() };
        if count > 0 {
            tree.build(0..count);
        }
        tree
    }

    fn build(&mut self, members: Range<usize>) {
        let Self { boxes, order, nodes } = self;
        let of_members = &mut order[members.clone()];
        let bounds = joined(of_members.iter().map(|&number| boxes[number]));
        let number = nodes.len();
        let middle = members.start + members.len() / 2;
        nodes.push(Node { bounds, members: members.clone(), second_child: None });
        if members.len() <= LEAF {
            return;
        }
        // Twice the centre.
        let centre = |number: usize, axis: usize| boxes[number][0][axis] + boxes[number][1][axis];
        let centres = joined(
            of_members.iter().map(|&number| [[0, 1, 2].map(|axis| centre(number, axis)); 2]),
        );
        let side = |axis: usize| centres[1][axis] - centres[0][axis];
        let axis = (1..3).fold(0, |best, axis| if side(axis) > side(best) { axis } else { best });
        of_members.select_nth_unstable_by(middle - members.start, |&a, &b| {
            centre(a, axis).total_cmp(&centre(b, axis)).then(a.cmp(&b))
        });
        self.build(members.start..middle);
        self.nodes[number].second_child = Some(self.nodes.len());
        self.build(middle..members.end);
    }

    /// The numbers of the boxes that match, in no particular order. What matches a box must match
    /// every box around it.
    pub fn matching(&self, matches: impl Fn(&Corners) -> bool) -> impl Iterator<Item = usize> {
        let mut open: Vec<usize> = (0..self.nodes.len().min(1)).collect();
        let mut members = 0..0;
        std::iter::from_fn(move || {
            loop {
                if let Some(place) = members.next() {
                    let number = self.order[place];
                    if matches(&self.boxes[number]) {
                        return Some(number);
                    }
                    continue;
                }
                let number = open.pop()?;
                let node = &self.nodes[number];
                if !matches(&node.bounds) {
                    continue;
                }
                match node.second_child {
                    Some(second) => open.extend([second, number + 1]),
                    None => members = node.members.clone(),
                }
            }
        })
    }
}

/// The box around some boxes.
fn joined(boxes: impl Iterator<Item = Corners>) -> Corners {
    let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    boxes.fold(empty, |[low, high], [other_low, other_high]| {
        [
            std::array::from_fn(|axis| low[axis].min(other_low[axis])),
            std::array::from_fn(|axis| high[axis].max(other_high[axis])),
        ]
    })
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::random::Random;

    fn meets(own: &Corners, other: &Corners) -> bool {
        (0..3).all(|axis| own[0][axis] <= other[1][axis] && other[0][axis] <= own[1][axis])
    }

    #[test]
    fn what_matches_is_found_as_by_looking_at_all() {
        let mut random = Random::new(3, 0);
        for count in [0, 1, 4, 5, 63, 200] {
            let mut corner = |size: f64| [0; 3].map(|_| random.unit() * size);
            let boxes: Vec<Corners> = (0..count)
                .map(|_| {
                    let (low, size) = (corner(50.0), corner(9.0));
                    [low, [0, 1, 2].map(|axis| low[axis] + size[axis])]
                })
                .collect();
            let tree = BoxTree::new(boxes.clone());
            for own in &boxes {
                let mut found: Vec<usize> = tree.matching(|other| meets(own, other)).collect();
                found.sort_unstable();
                let all = (0..boxes.len()).filter(|&other| meets(own, &boxes[other]));
                assert_eq!(found, all.collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn few_boxes_are_looked_at() {
        let looked = |across: usize| {
            let square = |at: usize| {
                let low = [(at % across) as f64, (at / across) as f64, 0.0];
                [low, low.map(|side| side + 0.9)]
            };
            let boxes: Vec<Corners> = (0..across * across).map(square).collect();
            let tree = BoxTree::new(boxes.clone());
            let count = Cell::new(0usize);
            for own in &boxes {
                let matches = |other: &Corners| {
                    count.set(count.get() + 1);
                    meets(own, other)
                };
                assert_eq!(tree.matching(matches).count(), 1);
            }
            count.get()
        };
        // Sixteen times as many, each found by a few steps more.
        let [some, many] = [16, 64].map(looked);
        assert!(many < 32 * some, "{some} {many}");
    }
}

//! What 16 bits hold: positions in steps from a node's own origin (`KHR_mesh_quantization`), and
//! texture coordinates within 0–1.
//!
//! Nothing is rounded here but texture coordinates. A build that asks for steps has its vertices on
//! their multiples long before; a node whose vertices are not, or which is too large, keeps 32 bits.

use super::node_mesh::{NodeImage, NodeMesh, Primitive};

/// The largest number that 16 bits hold.
const MOST: f64 = 65535.0;

/// Pictures up to this side take texture coordinates of 16 bits: they are off by a 32nd of a texel
/// then, at most.
const MOST_TEXELS: u32 = 4096;

/// The origin of a node with these least coordinates: the greatest one not above them that is a
/// multiple of the step and fits in f32, as glTF's translation does.
fn origin(low: [f64; 3], step: f64) -> [f64; 3] {
    low.map(|coordinate| {
        let nearest = coordinate as f32;
        let single = if f64::from(nearest) > coordinate { nearest.next_down() } else { nearest };
        // Fewer digits than before, if any are lost. Adding 0 turns -0 into 0.
        (f64::from(single) / step).floor() * step + 0.0
    })
}

/// Whether a node with these least and greatest source coordinates, multiples of the step, can be
/// stored in 16 bits.
pub fn fits_in_steps(low: [f64; 3], high: [f64; 3], step: f64) -> bool {
    let origin = origin(low, step);
    (0..3).all(|axis| (high[axis] - origin[axis]) / step <= MOST)
}

/// Gives a mesh an origin from which 16 bits reach all its vertices, where there is one.
pub(super) fn place(mesh: &mut NodeMesh, step: f64) {
    let on_lattice = |coordinate: f64| (coordinate / step).fract() == 0.0;
    let positions = || mesh.primitives.iter().flat_map(|primitive| &primitive.positions);
    if !mesh.origin.into_iter().all(on_lattice)
        || !positions().flatten().all(|&coordinate| on_lattice(coordinate.into()))
    {
        return;
    }
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for position in positions() {
        for axis in 0..3 {
            let coordinate = mesh.origin[axis] + f64::from(position[axis]);
            (low[axis], high[axis]) = (low[axis].min(coordinate), high[axis].max(coordinate));
        }
    }
    if low[0] > high[0] || !fits_in_steps(low, high, step) {
        return;
    }
    let origin = origin(low, step);
    let before = std::mem::replace(&mut mesh.origin, origin);
    for position in mesh.primitives.iter_mut().flat_map(|primitive| &mut primitive.positions) {
        *position = std::array::from_fn(|axis| {
            ((before[axis] - origin[axis]) + f64::from(position[axis])) as f32
        });
    }
}

/// A coordinate in steps, where it is a whole number of them that 16 bits hold.
fn steps(coordinate: f32, step: f64) -> Option<u16> {
    let steps = f64::from(coordinate) / step;
    (steps.fract() == 0.0 && (0.0..=MOST).contains(&steps)).then_some(steps as u16)
}

/// True where all positions can be stored in steps.
pub(super) fn is_in_steps(mesh: &NodeMesh, step: f64) -> bool {
    let mut positions = mesh.primitives.iter().flat_map(|p| p.positions.as_flattened());
    positions.all(|&coordinate| steps(coordinate, step).is_some())
}

/// Positions in steps, and a number that fills each up to 8 bytes.
pub(super) fn in_steps(positions: &[[f32; 3]], step: f64) -> Vec<[u16; 4]> {
    let whole = |coordinate: f32| steps(coordinate, step).unwrap_or(0);
    positions.iter().map(|p| [whole(p[0]), whole(p[1]), whole(p[2]), 0]).collect()
}

/// A position from steps.
pub(super) fn from_steps([x, y, z]: [u16; 3], step: f32) -> [f32; 3] {
    [x, y, z].map(|steps| f32::from(steps) * step)
}

/// A texture coordinate from 65,535ths.
pub(super) fn from_share(share: u16) -> f32 {
    f32::from(share) / MOST as f32
}

fn share(coordinate: f32) -> u16 {
    (coordinate * MOST as f32).round() as u16
}

/// Rounds texture coordinates to 65,535ths, where all of the primitive lie within 0–1 and its
/// picture is not too large for that.
pub(super) fn round_texcoords(primitive: &mut Primitive, images: &[NodeImage]) {
    let picture = primitive.surface.image.and_then(|image| images.get(image));
    let is_small = picture.is_some_and(|picture| picture.width.max(picture.height) <= MOST_TEXELS);
    let within = |texcoord: &f32| (0.0..=1.0).contains(texcoord);
    if is_small && primitive.texcoords.as_flattened().iter().all(within) {
        let texcoords = primitive.texcoords.as_flattened_mut();
        texcoords.iter_mut().for_each(|value| *value = from_share(share(*value)));
    }
}

/// Texture coordinates in 65,535ths, where all are whole numbers of them.
pub(super) fn in_shares(texcoords: &[[f32; 2]]) -> Option<Vec<[u16; 2]>> {
    let whole = |value: &f32| from_share(share(*value)).to_bits() == value.to_bits();
    texcoords
        .as_flattened()
        .iter()
        .all(whole)
        .then(|| texcoords.iter().map(|texcoord| texcoord.map(share)).collect())
}

#[cfg(test)]
mod tests {
    use super::super::test_mesh::mesh;
    use super::*;

    #[test]
    fn origins_are_below_on_the_lattice_and_fit_in_f32() {
        let step = 1.0 / 128.0;
        for low in [678_016.0 + 13.0 * step, 5_403_456.75 + step, -5_403_456.75 - step, -step, 0.0]
        {
            let [at, ..] = origin([low; 3], step);
            assert!(at <= low && low - at <= 1.0, "{low}: {at}");
            assert_eq!(f64::from(at as f32), at);
            assert_eq!((at / step).fract(), 0.0);
        }
    }

    #[test]
    fn a_mesh_on_the_lattice_is_moved_without_loss() {
        let step = 0.25;
        let mut mesh = mesh();
        let all = |mesh: &NodeMesh| -> Vec<[f64; 3]> {
            let positions = mesh.primitives.iter().flat_map(|p| &p.positions);
            let at = |p: &[f32; 3]| std::array::from_fn(|i| mesh.origin[i] + f64::from(p[i]));
            positions.map(at).collect()
        };
        place(&mut mesh, step);
        assert_eq!(mesh.origin, super::super::test_mesh::mesh().origin, "not on the lattice");
        for position in mesh.primitives.iter_mut().flat_map(|p| &mut p.positions) {
            *position = position.map(|c| (c / 0.25).round() * 0.25 - 7.5);
        }
        let before = all(&mesh);
        place(&mut mesh, step);
        assert_eq!(all(&mesh), before);
        assert!(is_in_steps(&mesh, step));
        for primitive in &mesh.primitives {
            for (steps, position) in
                in_steps(&primitive.positions, step).iter().zip(&primitive.positions)
            {
                assert_eq!(from_steps([steps[0], steps[1], steps[2]], step as f32), *position);
            }
        }
    }

    #[test]
    fn nodes_of_more_steps_than_16_bits_hold_do_not_fit() {
        let high = |steps: f64| [8.0, 8.0 + steps * 0.5, 8.0];
        assert!(fits_in_steps([8.0; 3], high(65535.0), 0.5));
        assert!(!fits_in_steps([8.0; 3], high(65536.0), 0.5));
    }

    #[test]
    fn every_share_is_itself_again() {
        for number in 0..=u16::MAX {
            assert_eq!(share(from_share(number)), number);
        }
        assert_eq!(in_shares(&[[0.0, 1.0]]), Some(vec![[0, 65535]]));
        assert_eq!(in_shares(&[[0.3, 1.0]]), None);
        assert_eq!(in_shares(&[[-0.0, 1.0]]), None);
        assert_eq!(in_shares(&[[2.0, 1.0]]), None);
    }
}

//! A map of the sphere onto a square: an octahedron whose lower half is folded outwards.

use glam::{DVec2, DVec3};

/// Values at the nodes of a square grid; the edges are nodes.
#[derive(Clone, Debug)]
pub struct OctahedralMap<T> {
    side: u32,
    values: Vec<T>,
}

/// Unit directions of the nodes of a grid, row by row.
pub fn directions(side: u32) -> Vec<DVec3> {
    let place = |node: u32| 2.0 * f64::from(node) / f64::from(side - 1) - 1.0;
    (0..side * side).map(|index| direction(DVec2::new(place(index % side), place(index / side)))).collect()
}

/// The unit direction at a place of the square, -1..=1: x and z in the plane, y up.
fn direction(place: DVec2) -> DVec3 {
    let height = 1.0 - place.x.abs() - place.y.abs();
    let folded = (1.0 - DVec2::new(place.y, place.x).abs()) * sign(place);
    let [x, z] = if height >= 0.0 { place } else { folded }.to_array();
    DVec3::new(x, height, z).normalize()
}

/// The place of a unit direction.
fn place(direction: DVec3) -> DVec2 {
    let [x, y, z] = (direction / direction.abs().element_sum()).to_array();
    let upper = DVec2::new(x, z);
    if y >= 0.0 { upper } else { (1.0 - DVec2::new(z, x).abs()) * sign(upper) }
}

fn sign(place: DVec2) -> DVec2 {
    DVec2::new(1.0_f64.copysign(place.x), 1.0_f64.copysign(place.y))
}

impl OctahedralMap<DVec3> {
    /// A map of `side`² values at [`directions`].
    pub fn new(side: u32, values: Vec<DVec3>) -> Self {
        assert_eq!(values.len(), (side * side) as usize, "a value for each node");
        Self { side, values }
    }

    /// The value in a direction; bilinear.
    pub fn at(&self, direction: DVec3) -> DVec3 {
        let node = (0.5 * place(direction) + 0.5) * f64::from(self.side - 1);
        let low = node.floor().clamp(DVec2::ZERO, DVec2::splat(f64::from(self.side - 2)));
        let [x, y] = (node - low).to_array();
        let first = low.y as usize * self.side as usize + low.x as usize;
        let row = |first: usize| self.values[first].lerp(self.values[first + 1], x);
        row(first).lerp(row(first + self.side as usize), y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_directions_are_inverse() {
        for direction in directions(17) {
            assert!((self::direction(place(direction)) - direction).length() < 1e-12, "{direction}");
        }
        let map = OctahedralMap::new(65, directions(65));
        for of in [DVec3::Y, DVec3::NEG_Y, DVec3::new(0.48, -0.6, 0.64), DVec3::new(-0.6, 0.0, -0.8)] {
            assert!((map.at(of).normalize() - of).length() < 2e-3, "{of} {}", map.at(of));
        }
    }
}

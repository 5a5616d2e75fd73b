//! A map of the sphere onto a square: an octahedron whose lower half is folded outwards. Mirrors
//! `octahedral_cell` in `glsl/include/octahedral.glsl`.

use glam::{DVec2, DVec3};

/// Unit directions spread over a cell of a table of `side`² cells: `samples` of them. They are no
/// grid, because the horizon runs along the diagonals of cells.
pub fn directions_in(cell: u32, side: u32, samples: u32) -> impl Iterator<Item = DVec3> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let first = DVec2::new(f64::from(cell % side), f64::from(cell / side));
    (0..samples).map(move |sample| {
        let number = f64::from(sample) + 0.5;
        let inside = DVec2::new(number / f64::from(samples), (number * GOLDEN).fract());
        direction(2.0 * (first + inside) / f64::from(side) - 1.0)
    })
}

/// Solid angle of a small piece of the square around a unit direction, over that of the same area
/// at a corner of the octahedron: 1/r³ at the distance r of its face.
pub fn relative_solid_angle(direction: DVec3) -> f64 {
    direction.abs().element_sum().powi(3)
}

/// The cell of a table of `side`² cells that holds a unit direction.
pub fn cell(direction: DVec3, side: u32) -> u32 {
    let place = (0.5 * place(direction) + 0.5) * f64::from(side);
    let [column, row] = place.to_array().map(|place| (place as u32).min(side - 1));
    row * side + column
}

/// The unit direction at a place of the square, -1..=1: x and z in the plane, y up.
fn direction(place: DVec2) -> DVec3 {
    let height = 1.0 - place.x.abs() - place.y.abs();
    let folded = (1.0 - DVec2::new(place.y, place.x).abs()) * sign(place);
    let flat = if height >= 0.0 { place } else { folded };
    DVec3::new(flat.x, height, flat.y).normalize()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_lie_in_their_cells() {
        for side in [1, 2, 7, 32] {
            for index in 0..side * side {
                for towards in directions_in(index, side, 16) {
                    assert!((towards.length() - 1.0).abs() < 1e-12);
                    assert_eq!(cell(towards, side), index, "{towards}");
                }
            }
        }
    }
}

//! Light meters in the window: new ones, and what the user wants them to read.

use std::collections::{HashMap, HashSet};

use glam::Vec3;

use crate::scene::meter::{Meter, MeterPoint, MeterShape};

/// Distance of a new meter from its surface, in scene sizes.
const RAISED: f32 = 1e-3;
/// Side of a new plane, in scene sizes, and at most, metres.
const SIDE: f32 = 0.1;
const SIDE_M: f32 = 1.0;

/// State of the panel that is no part of the scene.
#[derive(Default)]
pub(super) struct Meters {
    /// Wanted mean illuminance of each meter by its name, lx; 0: any.
    pub(super) wanted: HashMap<String, f64>,
    /// Lights that the search does not change.
    pub(super) kept: HashSet<u64>,
    /// The meter whose numbers are shown.
    pub(super) chosen: Option<usize>,
    pub(super) is_open: bool,
    /// Drags paint the region of a meter.
    pub(super) paints: bool,
    /// The panel opens.
    pub(super) opens: bool,
}

impl Meters {
    /// Wanted mean of a meter, lx; 0: any.
    pub(super) fn wants(&self, meter: &Meter) -> f64 {
        self.wanted.get(&meter.name).copied().unwrap_or(0.0)
    }
}

/// A meter with a free name on a surface, at this place and with this normal. `size`: diagonal of
/// the scene, metres.
pub(super) fn fresh(others: &[Meter], (place, normal): (Vec3, Vec3), size: f32, is_plane: bool) -> Meter {
    let (position, normal) = raised((place, normal), size);
    let shape = match is_plane {
        true => MeterShape::on_surface(position, normal, (SIDE * size).min(SIDE_M)),
        false => MeterShape::Point { position, normal },
    };
    Meter { name: free_name(others), shape }
}

/// A measuring point above a surface, at this place and with this normal. `size`: length of the
/// scene's diagonal, metres.
pub(super) fn raised((place, normal): MeterPoint, size: f32) -> MeterPoint {
    (place + RAISED * size * normal, normal)
}

/// A name that no meter has.
pub(super) fn free_name(others: &[Meter]) -> String {
    let is_free = |name: &String| others.iter().all(|meter| meter.name != *name);
    (1..).map(|number| format!("meter{number}")).find(is_free).expect("numbers do not end")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_meters_face_away_from_their_surface() {
        for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::new(1.0, 2.0, -3.0).normalize()] {
            let place = (Vec3::new(1.0, 2.0, 3.0), normal);
            let others = [fresh(&[], place, 5.0, false)];
            let meter = fresh(&others, place, 5.0, true);
            assert_eq!((others[0].name.as_str(), meter.name.as_str()), ("meter1", "meter2"));
            let MeterShape::Plane { edge_u, edge_v, grid, .. } = meter.shape else { panic!("a plane") };
            assert!((edge_u.cross(edge_v).normalize() - normal).length() < 1e-6, "{normal}");
            assert!((edge_u.length() - 0.5).abs() < 1e-6 && grid[0] > 1 && grid[0] == grid[1]);
            // Its middle is five millimetres above the clicked place.
            let middle = meter.points().iter().map(|(at, _)| *at).sum::<Vec3>() / meter.count() as f32;
            assert!((middle - place.0 - 0.005 * normal).length() < 1e-5, "{middle}");
        }
    }
}

//! Conversion between coordinates of the scene file and recentred ones.

use glam::{DVec3, Vec3};

use super::Scene;
use super::value::unit;

impl Scene {
    /// The position in memory of a position in the scene file. Both are in metres.
    pub fn recentred(&self, in_file: DVec3) -> Vec3 {
        (in_file - self.origin).as_vec3()
    }

    /// The position in the scene file of a position in memory. Both are in metres.
    pub fn in_file(&self, recentred: Vec3) -> DVec3 {
        recentred.as_dvec3() + self.origin
    }

    /// A layer of positions in the coordinates of the scene file. Pixels without a normal show no
    /// surface, and stay zero.
    #[doc(hidden)]
    pub fn layer_in_file(&self, mut layer: Vec<[f32; 3]>, normals: &[[f32; 3]]) -> Vec<[f32; 3]> {
        for (position, _) in layer.iter_mut().zip(normals).filter(|(_, normal)| **normal != [0.0; 3]) {
            *position = self.in_file(Vec3::from(*position)).as_vec3().to_array();
        }
        layer
    }
}

/// The direction of three numbers, as a scene file's is read: one of unit length keeps its bits.
/// `None` if it is zero or not finite.
pub fn unit_direction(direction: DVec3) -> Option<Vec3> {
    unit(direction).map(DVec3::as_vec3)
}

//! Reference of the sums over lights.

use glam::{DVec3, Vec3};

/// Sums the values of the lights, each a colour times the light's emission, and
/// scales the sums.
pub fn light_sum(lights: &[(Vec3, &[Vec3])], count: usize, scale: f32) -> Vec<DVec3> {
    let light = |value: usize| {
        move |&(emission, values): &(Vec3, &[Vec3])| values[value].as_dvec3() * emission.as_dvec3()
    };
    (0..count).map(|value| f64::from(scale) * lights.iter().map(light(value)).sum::<DVec3>()).collect()
}

//! Reference of the sums over lights.

use glam::{DVec3, Vec3};

/// Sums the values of the lights' rows, each a colour times the light's emission, and
/// scales the sums.
pub fn light_sum(rows: &[(Vec3, &[Vec3])], count: usize, scale: f32) -> Vec<DVec3> {
    let light =
        |value: usize| move |&(emission, row): &(Vec3, &[Vec3])| row[value].as_dvec3() * emission.as_dvec3();
    (0..count).map(|value| f64::from(scale) * rows.iter().map(light(value)).sum::<DVec3>()).collect()
}

//! Twin of the sums over lights.

use glam::{DVec3, Vec3};

/// Each value of the lights' rows times the light's emission, summed and scaled.
pub fn light_sum(rows: &[(Vec3, &[f32])], count: usize, scale: f32) -> Vec<DVec3> {
    let light =
        |value: usize| move |&(emission, row): &(Vec3, &[f32])| f64::from(row[value]) * emission.as_dvec3();
    (0..count).map(|value| f64::from(scale) * rows.iter().map(light(value)).sum::<DVec3>()).collect()
}

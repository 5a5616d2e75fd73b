//! Reference of what becomes of form factors beside a light.

/// A form factor of which that share is kept, and to which that is added, 1/m².
pub fn near_factor(found: f32, kept: f32, added: f32) -> f64 {
    f64::from(kept) * f64::from(found) + f64::from(added)
}

//! Reference of the near-light correction of form factors.

/// A corrected form factor, 1/m²: `kept` times the one `found`, plus `added`.
pub fn near_factor(found: f32, kept: f32, added: f32) -> f64 {
    f64::from(kept) * f64::from(found) + f64::from(added)
}

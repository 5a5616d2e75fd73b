//! Reference of the passes of glossy surfaces.

use crate::cpu::brdf::{lobe_term, reflected_fraction};
use crate::types::Reflectance;
use glam::{DVec3, Vec3};

/// Light that arrives at a path vertex.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Unit mirror direction of the light.
    pub mirror: DVec3,
    /// Flux of the beam, W.
    pub flux: DVec3,
}

/// Outgoing flux after the first bounce of a path in the direction `departure`, W; `colour` is that
/// of the image there.
pub fn reflected_flux(material: &Reflectance, colour: DVec3, beams: &[Beam], departure: Vec3) -> DVec3 {
    let diffuse = material.diffuse * colour.as_vec3();
    let material = Reflectance { diffuse, ..*material };
    let fraction = |beam: &Beam| {
        reflected_fraction(&material, 0.5 * (beam.mirror - departure.as_dvec3()).length_squared())
    };
    beams.iter().map(|beam| beam.flux * fraction(beam)).sum()
}

/// π times the flux that the Phong lobes at vertices send in a unit direction, W; each vertex has
/// a material and a beam.
pub fn lobe_sum<'a>(vertices: impl IntoIterator<Item = (&'a Reflectance, Beam)>, toward: DVec3) -> DVec3 {
    vertices.into_iter().map(|(material, beam)| beam.flux * lobe_term(material, beam.mirror, toward)).sum()
}

//! Reference of the passes of glossy surfaces.

use crate::cpu::brdf::{lobe_term, reflected_fraction};
use crate::types::Reflectance;
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

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

/// Merged gather rays of a record: their number, mean direction and radiance.
pub type LobeRay = (f64, DVec3, DVec3);

/// Radiance that a lobe of unit specular albedo reflects at a record, from the rays of its
/// hemisphere, of which `total` were traced. If all of them met something, the lobe's albedo times
/// the mean radiance along them, weighted by the lobe.
pub fn lobe_at_record(rays: &[LobeRay], total: u32, mirror: DVec3, normal: DVec3, exponent: f64) -> DVec3 {
    let lobe = |direction: DVec3| mirror.dot(direction).max(0.0).powf(exponent);
    let sum: DVec3 =
        rays.iter().map(|&(count, direction, radiance)| count * lobe(direction) * radiance).sum();
    let weights: f64 = rays.iter().map(|&(count, direction, _)| count * lobe(direction)).sum();
    if rays.iter().map(|ray| ray.0).sum::<f64>() == f64::from(total) && weights > 0.0 {
        return lobe_albedo(exponent, mirror.dot(normal)) * sum / weights;
    }
    0.5 * (exponent + 2.0) / f64::from(total) * sum
}

/// Albedo of a lobe by brute force: the integral over the sphere around the mirror direction.
pub fn lobe_albedo(exponent: f64, cosine: f64) -> f64 {
    const STEPS: u32 = 600;
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let at = |step: u32| (f64::from(step) + 0.5) / f64::from(STEPS);
    let ring = |polar: f64| {
        let cosines = (0..STEPS).map(|step| (TAU * at(step)).cos());
        let above = cosines.map(|azimuth| (cosine * polar.cos() + sine * polar.sin() * azimuth).max(0.0));
        polar.cos().powf(exponent) * polar.sin() * above.sum::<f64>() * TAU / f64::from(STEPS)
    };
    let integral: f64 = (0..STEPS).map(|step| ring(FRAC_PI_2 * at(step))).sum();
    (exponent + 2.0) / TAU * integral * FRAC_PI_2 / f64::from(STEPS)
}

/// A lobe at a record that a pixel reads.
#[derive(Clone, Copy, Debug)]
pub struct LobeRecord {
    /// Splat weight of the record at the pixel.
    pub weight: f64,
    /// Radiance of the lobe, per unit of specular albedo.
    pub radiance: DVec3,
    /// Unit mirror direction.
    pub mirror: DVec3,
    /// Column c: gradient of channel c as the mirror direction turns.
    pub change: DMat3,
}

/// Radiance of a pixel's lobe from lobes at records: each is turned to the pixel's direction, and
/// counts by its splat weight and by the lobe between both directions.
pub fn lobe_from_records(records: &[LobeRecord], mirror: DVec3, exponent: f64) -> DVec3 {
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for record in records {
        let cosine = mirror.dot(record.mirror);
        let weight = record.weight * (-exponent * (1.0 - cosine)).exp().max(1e-4);
        let change = record.change.transpose() * (mirror - cosine * record.mirror);
        sum += weight * (record.radiance + change).max(DVec3::ZERO);
        total += weight;
    }
    sum / total.max(1e-12)
}

//! Mirrors `glsl/include/brdf.glsl`: Lambert plus the energy-normalised modified Phong lobe.
//! [Lafortune 1994] Directions are unit and point away from the surface.

use crate::cpu::hemisphere::frame;
use crate::cpu::sampling::sample_cosine;
use crate::types::Reflectance;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Luminance of linear Rec.709.
pub fn luminance(rgb: Vec3) -> f64 {
    rgb.as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

fn mirror(normal: DVec3, outgoing: DVec3) -> DVec3 {
    2.0 * normal.dot(outgoing) * normal - outgoing
}

/// cosⁿα between two unit directions, zero from 90° on.
pub(in crate::cpu) fn phong_lobe(mirror: DVec3, direction: DVec3, exponent: f64) -> f64 {
    mirror.dot(direction).clamp(0.0, 1.0).powf(exponent)
}

fn reflected(material: &Reflectance, lobe: f64) -> DVec3 {
    material.diffuse.as_dvec3() / PI + lobe_scale(material, lobe) / PI
}

fn lobe_scale(material: &Reflectance, lobe: f64) -> DVec3 {
    material.specular.as_dvec3() * (0.5 * lobe * (f64::from(material.exponent) + 2.0))
}

/// π times the Phong term of the BRDF.
pub fn lobe_term(material: &Reflectance, mirror: DVec3, toward: DVec3) -> DVec3 {
    lobe_scale(material, phong_lobe(mirror, toward, f64::from(material.exponent)))
}

/// π times the BRDF, for a direction whose 1 − cosα off the mirror direction is `off_mirror`.
pub fn reflected_fraction(material: &Reflectance, off_mirror: f64) -> DVec3 {
    let lobe = (1.0 - off_mirror).clamp(0.0, 1.0).powf(f64::from(material.exponent));
    material.diffuse.as_dvec3() + lobe_scale(material, lobe)
}

/// BRDF, 1/sr, of light from `incident` that leaves along `outgoing`; zero for light from
/// below the surface.
pub fn brdf(material: &Reflectance, normal: DVec3, outgoing: DVec3, incident: DVec3) -> DVec3 {
    if normal.dot(incident) <= 0.0 {
        return DVec3::ZERO;
    }
    reflected(material, phong_lobe(mirror(normal, outgoing), incident, f64::from(material.exponent)))
}

/// A direction around `mirror`, of density (n+1)/(2π)·cosⁿα.
pub fn sample_phong_lobe(mirror: DVec3, exponent: f64, u: DVec2) -> DVec3 {
    let height = -((1.0 - u.x).max(1e-8).ln() / (exponent + 1.0)).exp_m1();
    let (sin, cos) = (TAU * u.y).sin_cos();
    let radius = (height * (2.0 - height)).sqrt();
    frame(mirror.as_vec3()) * DVec3::new(radius * cos, radius * sin, 1.0 - height)
}

/// A direction that light may have come from.
#[derive(Clone, Copy, Debug)]
pub struct BrdfSample {
    /// Unit, away from the surface.
    pub incident: DVec3,
    /// Probability density, 1/sr.
    pub pdf: f64,
    /// brdf·cosθ/pdf; zero below the surface.
    pub weight: DVec3,
}

/// Samples one of the two lobes, chosen by luminance, with the pdf of their mixture.
pub fn sample_brdf(material: &Reflectance, normal: DVec3, outgoing: DVec3, u: DVec2) -> BrdfSample {
    let gloss = luminance(material.specular);
    let total = gloss + luminance(material.diffuse);
    if total <= 0.0 {
        return BrdfSample { incident: normal, pdf: 1.0 / PI, weight: DVec3::ZERO };
    }
    let (fraction, exponent) = (gloss / total, f64::from(material.exponent));
    let mirror = mirror(normal, outgoing);
    let incident = if u.x < fraction {
        sample_phong_lobe(mirror, exponent, DVec2::new(u.x / fraction, u.y))
    } else {
        frame(normal.as_vec3()) * sample_cosine(DVec2::new((u.x - fraction) / (1.0 - fraction), u.y))
    };
    let cosine = normal.dot(incident);
    let lobe = phong_lobe(mirror, incident, exponent);
    let pdf = (1.0 - fraction) * cosine.max(0.0) / PI + fraction * lobe * (exponent + 1.0) / TAU;
    let is_above = cosine > 0.0 && pdf > 0.0;
    let weight = if is_above { reflected(material, lobe) * cosine / pdf } else { DVec3::ZERO };
    BrdfSample { incident, pdf, weight }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::sample_3d;

    fn material(diffuse: f32, specular: f32, exponent: f32) -> Reflectance {
        Reflectance { diffuse: Vec3::splat(diffuse), exponent, specular: Vec3::splat(specular), flags: 0 }
    }

    /// Albedo by sampling, and by midpoint quadrature of brdf·cosθ over the hemisphere.
    fn albedos(material: &Reflectance, outgoing: DVec3) -> [f64; 2] {
        let samples = 1 << 14;
        let weight = |index| {
            let u = sample_3d(index, 9).truncate().as_dvec2();
            sample_brdf(material, DVec3::Z, outgoing, u).weight.x
        };
        let sampled = (0..samples).map(weight).sum::<f64>() / f64::from(samples);
        let steps = 700;
        let mut summed = 0.0;
        for i in 0..steps {
            // Uniform in cosθ and azimuth: equal solid angles.
            let z = (f64::from(i) + 0.5) / f64::from(steps);
            for j in 0..steps {
                let (sin, cos) = (TAU * (f64::from(j) + 0.5) / f64::from(steps)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                summed += brdf(material, DVec3::Z, outgoing, DVec3::new(r * cos, r * sin, z)).x * z;
            }
        }
        [sampled, summed * TAU / f64::from(steps * steps)]
    }

    #[test]
    fn samples_and_quadrature_agree_and_reflect_the_albedo_at_normal_incidence() {
        for (diffuse, specular, exponent) in
            [(0.5, 0.0, 1.0), (0.0, 0.8, 1.0), (0.3, 0.5, 40.0), (0.0, 1.0, 100.0)]
        {
            let material = material(diffuse, specular, exponent);
            for angle in [0.0, 0.6, 1.2, 1.5] {
                let (sin, cos) = f64::sin_cos(angle);
                let [sampled, summed] = albedos(&material, DVec3::new(sin, 0.0, cos));
                let albedo = f64::from(diffuse + specular);
                assert!((sampled - summed).abs() < 5e-3, "{exponent} at {angle}: {sampled}, {summed}");
                assert!(sampled <= albedo + 5e-3, "{exponent} at {angle}: {sampled} of {albedo}");
                assert!(angle > 0.0 || (sampled - albedo).abs() < 2e-3, "{exponent}: {sampled}, {albedo}");
            }
        }
    }

    #[test]
    fn black_reflects_nothing_and_nothing_is_reflected_from_below() {
        let black = sample_brdf(&material(0.0, 0.0, 5.0), DVec3::Z, DVec3::Z, DVec2::splat(0.5));
        assert_eq!(black.weight, DVec3::ZERO);
        assert_eq!(brdf(&material(0.5, 0.5, 5.0), DVec3::Z, DVec3::Z, DVec3::NEG_Z), DVec3::ZERO);
    }
}

//! Reference of the final gathering.

use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::textures::unpack_colour;
use crate::types::{MOVEMENT_EXPONENT, MergedRay};
use glam::{DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Irradiance at a cache point and its gradients, as [`crate::types::Record`] has them.
#[derive(Clone, Copy, Debug)]
pub struct Gathered {
    /// Irradiance at the point, W/m².
    pub irradiance: DVec3,
    /// Column c: gradient of channel c under movement, W/m³.
    pub translation: DMat3,
    /// Column c: its dot product with a normal is the change of channel c under rotation, W/m².
    pub rotation: DMat3,
}

/// Packing of merged rays, and the lists that they read.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Albedo of each material.
    pub albedos: &'a [Vec3],
    /// Irradiance of each cluster, W/m².
    pub irradiance: &'a [Vec3],
    /// Cluster and material of each gather target, packed.
    pub targets: &'a [u32],
    /// Bits of the gather target in a merged ray.
    pub target_bits: u32,
    /// Bits of the cluster's number in a target.
    pub cluster_bits: u32,
    /// Unit of the rays' gradients, metres.
    pub min_distance: f32,
    /// Unit of their packed rotational gradients.
    pub rotation_unit: f32,
    /// Gloss bins, the targets beyond the clusters: cluster of each, and its glossy
    /// flux there, W/m².
    pub bins: &'a [(u32, DVec3)],
}

/// Gathers the rays of one point with that shading normal. `colours`: packed colours of the images
/// at the merged rays' hits; empty without images.
pub fn gather(
    sources: Sources<'_>,
    strata: Strata,
    normal: Vec3,
    merged_rays: &[MergedRay],
    colours: &[u32],
) -> Gathered {
    let frame = frame(normal);
    let stratum = PI / f64::from(strata.rays());
    let mut irradiance = DVec3::ZERO;
    let [mut translation, mut rotated] = [[DVec3::ZERO; 3]; 2];
    for (index, merged_ray) in merged_rays.iter().enumerate() {
        let target_index = merged_ray.target_index & ((1 << sources.target_bits) - 1);
        let rays = f64::from(merged_ray.target_index >> sources.target_bits) + 1.0;
        let target = sources.targets[target_index as usize];
        // Above a bit that tells whether the hit is far away.
        let material = target >> (sources.cluster_bits + 1);
        let read = (target & ((1 << sources.cluster_bits) - 1)) as usize;
        let (cluster, gloss) = match sources.irradiance.len() {
            clusters if read < clusters => (read, DVec3::ZERO),
            clusters => (sources.bins[read - clusters].0 as usize, sources.bins[read - clusters].1),
        };
        let colour = colours.get(index).map_or(DVec3::ONE, |&packed| unpack_colour(packed));
        let albedo = colour * sources.albedos[material as usize].as_dvec3();
        let radiance = (albedo * sources.irradiance[cluster].as_dvec3() + gloss) / PI;
        irradiance += stratum * rays * radiance;

        // [Krivanek]
        let [movement, rotation_fraction] = unpack_change(merged_ray.change);
        let across = frame * (f64::from(sources.rotation_unit) * rotation_fraction).extend(0.0);
        let movement = movement / f64::from(sources.min_distance);
        for channel in 0..3 {
            translation[channel] += radiance[channel] * (frame * movement.extend(0.0));
            rotated[channel] += stratum * radiance[channel] * across;
        }
    }
    let rotation = rotated.map(|gradient| gradient.cross(normal.as_dvec3()));
    Gathered {
        irradiance,
        translation: DMat3::from_cols(translation[0], translation[1], translation[2]),
        rotation: DMat3::from_cols(rotation[0], rotation[1], rotation[2]),
    }
}

/// Weights of a merged ray in the translational gradient (in 1/min_distance) and in the rotational
/// gradient (in rotation units).
pub fn unpack_change(word: u32) -> [DVec2; 2] {
    let signed = |bits: u32, width: u32| f64::from((bits << (32 - width)) as i32 >> (32 - width));
    let pair = |bits: u32, width: u32, exponent: u32| {
        2f64.powi(exponent as i32) * DVec2::new(signed(bits, width), signed(bits >> width, width))
    };
    [2f64.powi(MOVEMENT_EXPONENT) * pair(word, 8, word >> 16 & 31), pair(word >> 21, 4, word >> 29)]
}

/// Two to a power from -1022 to 1023. `powi` is a loop.
pub const fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// The two halves of a word, low bits first.
pub fn unpack(word: u32) -> DVec2 {
    let half = |bits: u32| {
        let (sign, exponent, fraction) = (bits >> 15, bits >> 10 & 31, f64::from(bits & 0x3ff) / 1024.0);
        let size = match exponent {
            0 => fraction * power_of_two(-14),
            31 => f64::NAN,
            _ => (1.0 + fraction) * power_of_two(exponent as i32 - 15),
        };
        if sign == 1 { -size } else { size }
    };
    DVec2::new(half(word & 0xffff), half(word >> 16))
}

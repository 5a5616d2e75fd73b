//! The cells of one hierarchy level as a colour image. Neighbours differ in hue; a cell's
//! brightness is the irradiance that gather rays read in it.

use std::f32::consts::PI;

use glam::Vec3;

use super::panels::PALETTE;
use crate::cpu::sampling::hash_pair;
use crate::cpu::tonemap::display_value;
use crate::error::Result;
use crate::renderer::Renderer;

/// Fraction of a cell's brightness that is independent of light.
const FLOOR: f32 = 0.08;

/// sRGB codes R, G, B, 255 of each pixel; transparent where the view leaves the scene.
pub(super) fn colours(renderer: &Renderer, level: u32, exposure_stops: f32) -> Result<Vec<[u8; 4]>> {
    let clusters = renderer.cluster_colours(level)?;
    let scale = exposure_stops.exp2();
    let colour = |cluster: u32, irradiance: Vec3| {
        // The brightness of a white surface in that light.
        let light = FLOOR + scale * irradiance.max_element() / PI;
        let hue = PALETTE[hash_pair(cluster, level) as usize % PALETTE.len()];
        let [r, g, b] = [hue.r(), hue.g(), hue.b()].map(|code| (f32::from(code) / 255.0).powf(2.2));
        let [r, g, b] = [r, g, b].map(|channel| display_value(light * channel));
        [r, g, b, 255]
    };
    let pixel = |found: &Option<crate::renderer::ClusterAt>| match found {
        Some(found) => colour(found.cluster, found.irradiance),
        None => [0; 4],
    };
    Ok(clusters.iter().map(pixel).collect())
}

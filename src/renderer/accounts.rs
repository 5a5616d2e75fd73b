//! What the passes of a frame have to move and trace, from their inputs.

use super::Renderer;
use crate::gpu::{Buffer, PassTiming};
use crate::passes::frame::{
    antialias::Antialias, blend::Blend, compose::Compose, direct::Direct, form_factors::FormFactors,
    gather::Gather, hvds::Pyramid, path_scan::PathScan, pixel_colours::PixelColours, primary::Primary,
    splat::Splat, tonemap::Tonemap,
};
use std::collections::BTreeMap;

type Account = BTreeMap<&'static str, u64>;

impl Renderer {
    /// Bytes and rays of the passes that ran. Bytes count every stored input and output once, whatever the caches do; what
    /// a traced ray reads of the scene is not counted, its pass is judged by rays per second.
    pub(super) fn accounts(&self, passes: &[PassTiming]) -> (Account, Account) {
        let pixels = u64::from(self.size()[0]) * u64::from(self.size()[1]);
        let paths = u64::from(self.form_factors.point_count());
        let lights = self.scene.lights.len() as u64;
        let records = self.gather.records.bytes();
        let surface = self.primary.pixels.bytes();
        let clusters = self.pyramid.irradiance.bytes();
        let deposits = self.path_scan.deposits.bytes();
        let [steps, step_colours] = self.path_scan.step_bytes();
        let colours = [&self.pixel_colours.of_pixels, &self.pixel_colours.of_edges].map(Buffer::bytes);
        let weights = self.splat.weight_bytes();
        let image = 12 * pixels;
        let mut bytes = Account::new();
        let mut rays = Account::new();
        for pass in passes {
            let moved = match pass.name {
                Primary::STEM => surface,
                Direct::STEM => surface + image,
                FormFactors::STEM => lights * 20 * paths,
                FormFactors::FLUX_STEM => (4 * lights + 12) * paths,
                // Steps are read twice, deposits written one vec3 at a time.
                PathScan::STEM => 2 * steps + step_colours + deposits,
                Pyramid::STEM => deposits + 12 * paths + 3 * clusters,
                Gather::STEM => self.gather.rays.bytes() + clusters + records,
                Blend::STEM => self.blend.list_bytes() + 2 * records + self.gather.cache_points.bytes(),
                Splat::STEM => {
                    surface + self.gather.cache_points.bytes() + 4 * self.splat.pair_bytes() + weights
                }
                Splat::APPLY_STEM => surface + weights + records + image,
                Antialias::STEM => surface + image + 8 * pixels + self.antialias.edge_samples.bytes(),
                PixelColours::STEM => surface + self.antialias.edge_samples.bytes() + colours[0] + colours[1],
                Compose::STEM => {
                    let samples = self.antialias.edge_samples.bytes() + colours[1];
                    surface + 3 * image + 4 * pixels + colours[0] + samples
                }
                Tonemap::STEM => image + 4 * pixels,
                _ => continue,
            };
            bytes.insert(pass.name, moved);
            let traced = match pass.name {
                Primary::STEM => pixels,
                Direct::STEM => lights * pixels,
                FormFactors::STEM => lights * paths,
                _ => continue,
            };
            rays.insert(pass.name, traced);
        }
        (bytes, rays)
    }
}

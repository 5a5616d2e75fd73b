//! Tone map: radiance to 8-bit sRGB. In: radiance (W/m²/sr), or two pictures whose weighted sum is
//! shown; a display transform. Out: four bytes a pixel, the last 255.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::scene::{DisplayTransform, ToneCurve};
use glam::{Mat3, Vec3};
use std::sync::Arc;

gpu_struct! {
    pub struct TonemapPush {
        pub pixel_count: u32,
        /// Exposure factor, 2^exposure stops.
        pub scale: f32,
        /// 1: the rows are the white balance.
        pub is_balanced: u32,
        /// Rows of the white balance, linear Rec.709 from linear Rec.709.
        pub red: Vec3,
        pub green: Vec3,
        pub blue: Vec3,
        /// Weight of the first of two pictures in each channel; the rest is that of the second.
        pub gains: Vec3,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[TonemapPush::LAYOUT];

/// A pipeline for each tone curve; those in use are compiled.
pub struct Curves([Pipeline; ToneCurve::ALL.len()]);

/// The pipelines and the displayed image.
pub struct Tonemap {
    curves: Curves,
    pixel_count: u32,
    /// sRGB codes of each pixel: R, G, B, 255.
    pub display: Buffer,
}

impl Curves {
    /// Prepares pipelines, which may mix two pictures.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>, mixes: bool) -> Result<Self> {
        let pipeline = |curve: ToneCurve| {
            Pipeline::new(context, Tonemap::STEM, &[("CURVE", curve.code()), ("MIXES", mixes.into())])
        };
        let [a, b, c, d, e] = ToneCurve::ALL.map(pipeline);
        Ok(Self([a?, b?, c?, d?, e?]))
    }
}

impl Tonemap {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "tonemap";

    /// Allocates an image of `pixel_count` pixels.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32) -> Result<Self> {
        Ok(Self {
            curves: Curves::new(context, false)?,
            pixel_count,
            display: Buffer::storage(
                context,
                GrowsWith::Pixels.named("display"),
                u64::from(pixel_count) * 4,
            )?,
        })
    }

    /// Maps all pixels.
    pub fn record(&self, rec: &mut Recorder, radiance: &Buffer, display: &DisplayTransform) {
        self.record_mix(rec, &self.curves, [radiance; 2], Vec3::ONE, display);
    }

    /// Maps all pixels of `gains` times the first picture and 1 - `gains` times the second.
    pub fn record_mix(
        &self,
        rec: &mut Recorder,
        curves: &Curves,
        [with, without]: [&Buffer; 2],
        gains: Vec3,
        display: &DisplayTransform,
    ) {
        let constants = display.constants();
        let rows = constants.white_balance.unwrap_or(Mat3::IDENTITY);
        rec.pass(Self::STEM).dispatch(
            &curves.0[constants.tone.code() as usize],
            [self.pixel_count, 1, 1],
            &TonemapPush {
                pixel_count: self.pixel_count,
                scale: constants.scale,
                is_balanced: constants.white_balance.is_some().into(),
                red: rows.row(0),
                green: rows.row(1),
                blue: rows.row(2),
                gains,
            },
            &[("Radiance", with), ("Without", without), ("Display", &self.display)],
        );
    }
}

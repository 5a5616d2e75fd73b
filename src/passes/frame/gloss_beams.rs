//! Light straight from the lights at entry points that may shine: beams of each light, and the first reflection into the paths. [Yue §1]
//! In: lights. Out: beams, free of the light's colour; reflected flux of paths (W).

use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, PassScope, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::gloss::{Gloss, GlossLight};
use crate::passes::{OneLight, SceneBuffers};
use glam::Vec3;

gpu_struct! {
    /// Push constants of `gloss_beams`.
    pub struct GlossBeamsPush {
        /// Entry points that may shine.
        pub entry_count: u32,
        /// Which light.
        pub light: u32,
        /// That each entry point stands for, in the mean.
        pub area_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_entries`.
    pub struct GlossEntriesPush {
        /// Emission of the light, times the area that each entry point stands for, in the mean.
        pub emission: Vec3,
        /// Entry points that may shine.
        pub entry_count: u32,
        /// Beams of an entry point.
        pub beam_count: u32,
        /// 1: adds to the flux so far.
        pub adds: u32,
    }
}

/// What these passes share with their shaders.
pub const LAYOUTS: &[Layout] = &[GlossBeamsPush::LAYOUT, GlossEntriesPush::LAYOUT];

impl Gloss {
    /// What tracing the beams is called in timings.
    pub const BEAMS_STEM: &str = "gloss_beams";
    /// What the first reflection is called in timings.
    pub const ENTRIES_STEM: &str = "gloss_entries";

    /// Traces a light's beams. Records into an open pass.
    pub fn record_beams(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        beams: &Buffer,
    ) {
        pass.dispatch(
            &self.trace,
            [self.entry_count * light.samples, 1, 1],
            &GlossBeamsPush { entry_count: self.entry_count, light: light.index, area_m2: self.area_m2 },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Lights", light.table),
                ("GlossEntries", &self.entries),
                ("GlossBeams", beams),
            ],
        );
    }

    /// The first reflection at entry points that may shine. Other paths' reflected flux is their path flux.
    pub fn record_entries(&self, rec: &mut Recorder, materials: &Buffer, lights: &[GlossLight<'_>]) {
        let mut pass = rec.pass(Self::ENTRIES_STEM);
        for (index, light) in lights.iter().enumerate() {
            if index > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.reflect,
                [self.entry_count, 1, 1],
                &GlossEntriesPush {
                    emission: self.area_m2 * light.emission,
                    entry_count: self.entry_count,
                    beam_count: light.samples,
                    adds: u32::from(index > 0),
                },
                &[
                    ("Materials", materials),
                    ("GlossEntries", &self.entries),
                    ("GlossBeams", light.beams),
                    ("ReflectedFlux", &self.reflected_flux),
                ],
            );
        }
    }
}

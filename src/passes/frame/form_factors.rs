//! Form factors and the flux that enters the light paths. [Yue §3] In: entry points, lights. Out:
//! the form factors of each light, one an entry point; on request the flux (W) of each path.
//!
//! Form factors are per unit emission, so that a change of colour traces no ray. The point samples
//! of an area light share a colour, and so one list of form factors.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_TRANSFER};
use crate::gpu::{Buffer, Chunk, Context, PassScope, Pipeline, Recorder, SplitBuffer};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::gloss::{Gloss, GlossLight};
use crate::passes::frame::light_sum::LightSum;
use crate::passes::frame::shafts::{BATCH, ShaftKernel, Shafts};
use crate::passes::frame::sky_factors::SkyFactors;
use crate::passes::{OneLight, SceneBuffers};
use crate::types::PathVertex;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// The first vertex of a light path.
    pub struct EntryPoint {
        /// Point on the surface.
        pub position: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
    }
}

gpu_struct! {
    pub struct FormFactorsPush {
        /// First index of the bound buffer of the entry points.
        pub first_point: u32,
        /// Entry points in the bound buffer.
        pub point_count: u32,
        /// Row of the part of the light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// Sum of `TRACES_ALL` and `ADDS`.
        pub flags: u32,
        /// First batch of the bound buffer.
        pub first_batch: u32,
        /// Area of an entry point.
        pub area_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of `entry_batches`.
    pub struct EntryBatchesPush {
        /// First batch of the bound buffer of the entry points.
        pub first_batch: u32,
        /// Entry points in the bound buffer.
        pub point_count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[EntryPoint::LAYOUT, FormFactorsPush::LAYOUT, EntryBatchesPush::LAYOUT];

/// The pipelines and the entry points.
pub struct FormFactors {
    kernel: ShaftKernel,
    shafts: Shafts,
    sum: LightSum,
    entry_points: SplitBuffer,
    weights: Vec<f32>,
    point_count: u32,
    area_m2: f32,
    /// `None` if the scene has no sky.
    sky: Option<SkyFactors>,
}

/// Number of batches of these entry points.
fn batches(points: &[EntryPoint]) -> u32 {
    points.len().div_ceil(BATCH as usize) as u32
}

impl FormFactors {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "form_factors";
    /// Stem of the shader that runs once, before the first frame.
    pub const BATCHES_STEM: &str = "entry_batches";
    /// Timing name of the sum over the lights.
    pub const FLUX_STEM: &str = "path_flux";

    /// Uploads the entry points, with a mean area of `area_m2`, and bounds batches of them. Each
    /// comes with the random stream index of its path.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        entry_points: (&[PathVertex], &[u32]),
        area_m2: f32,
    ) -> Result<Self> {
        Self::in_chunks(context, scene, entry_points, area_m2, SplitBuffer::longest::<EntryPoint>(context))
    }

    /// As [`Self::new`], with at most `most` entry points in each buffer.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn in_chunks(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        (entry_points, streams): (&[PathVertex], &[u32]),
        area_m2: f32,
        most: u32,
    ) -> Result<Self> {
        let points: Vec<EntryPoint> =
            entry_points.iter().map(|v| EntryPoint { position: v.position, side: v.side }).collect();
        let mut made = Self {
            kernel: ShaftKernel::new(context, Self::STEM)?,
            shafts: Shafts::new(context, points.chunks(most as usize).map(batches).sum())?,
            sum: LightSum::new(context)?,
            entry_points: SplitBuffer::cut(
                context,
                GrowsWith::EntryPoints.named("entry points"),
                &points,
                most,
            )?,
            weights: entry_points.iter().map(|point| point.weight).collect(),
            point_count: entry_points.len() as u32,
            area_m2,
            sky: None,
        };
        made.bound_batches(context, scene)?;
        if scene.emission.has_sky() {
            made.sky = Some(SkyFactors::new(context, scene, &made.entry_points, streams)?);
        }
        Ok(made)
    }

    /// The buffers of the entry points, and the first batch of each.
    fn chunks(&self) -> impl Iterator<Item = (&Chunk, u32)> {
        self.entry_points.iter().scan(0, |next, chunk| {
            let first = *next;
            *next += (chunk.items.len() as u32).div_ceil(BATCH);
            Some((chunk, first))
        })
    }

    fn bound_batches(&self, context: &Arc<Context>, scene: &SceneBuffers) -> Result<()> {
        let entry_batches = Pipeline::new(context, Self::BATCHES_STEM, &[])?;
        context.run(|rec| {
            let mut pass = rec.pass(Self::BATCHES_STEM);
            for (chunk, first_batch) in self.chunks() {
                let point_count = chunk.items.len() as u32;
                if first_batch > 0 {
                    pass.barrier(COMPUTE_TO_COMPUTE);
                }
                pass.dispatch(
                    &entry_batches,
                    [point_count.div_ceil(BATCH), 1, 1],
                    &EntryBatchesPush { first_batch, point_count },
                    &[
                        ("Nodes", &scene.nodes),
                        ("Triangles", &scene.triangles),
                        ("Surfaces", &scene.surfaces),
                        ("EntryPoints", &chunk.buffer),
                        ("PointBatches", &self.shafts.batches),
                    ],
                );
            }
        })?;
        Ok(())
    }

    /// Number of entry points.
    pub fn point_count(&self) -> u32 {
        self.point_count
    }

    /// Mean area of an entry point, m².
    pub fn area_m2(&self) -> f32 {
        self.area_m2
    }

    /// Area of each entry point, over the mean area.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The entry points themselves.
    ///
    /// # Errors
    /// The device failed.
    pub fn entry_points(&self) -> Result<Vec<EntryPoint>> {
        self.entry_points.read()
    }

    /// Returns one entry point. Panics if the index is out of range.
    ///
    /// # Errors
    /// The device failed.
    pub fn entry_point(&self, index: u32) -> Result<EntryPoint> {
        self.entry_points.read_one(index)
    }

    /// Fills the form factors of a light, by a shadow ray from each entry point to each point
    /// sample in front of it. Records into an open pass with barriers between its own dispatches.
    /// The caller records a barrier to transfers between two lights.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        factors: &Buffer,
    ) {
        if let Some(sky) = &self.sky {
            sky.record(pass, scene, light, &self.entry_points, factors);
        }
        for part in light.parts() {
            // Bright spots of a sky add to the rest of it.
            let part = OneLight { adds: part.adds || light.sky.is_some(), ..part };
            if part.adds {
                pass.barrier(COMPUTE_TO_TRANSFER);
            }
            self.record_part(pass, scene, part, factors);
        }
    }

    /// Writes the beams of the sky at entry points that may be glossy. Records into an open pass.
    /// Does nothing for other lights.
    pub fn record_sky_beams(
        &self,
        pass: &mut PassScope<'_>,
        light: OneLight<'_>,
        gloss: &Gloss,
        found: &GlossLight<'_>,
    ) {
        if let Some(sky) = &self.sky {
            sky.record_beams(
                pass,
                light,
                &self.entry_points,
                (&gloss.entries, gloss.entry_count),
                found.beams,
            );
        }
    }

    fn record_part(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        factors: &Buffer,
    ) {
        if self.kernel.has_shafts(light) {
            self.shafts.record(pass, scene, light);
        }
        for (first_sample, end_sample) in light.spans() {
            for (chunk, first_batch) in self.chunks() {
                let (first_point, point_count) = (chunk.items.start, chunk.items.len() as u32);
                let push = FormFactorsPush {
                    first_point,
                    point_count,
                    light: light.row,
                    first_sample,
                    end_sample,
                    flags: light.flags(),
                    first_batch,
                    area_m2: self.area_m2,
                };
                let bindings = [
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Lights", light.table),
                    ("EntryPoints", &chunk.buffer),
                    ("ShaftRoots", &self.shafts.roots),
                    ("ShaftList", &self.shafts.list),
                    ("FormFactors", factors),
                    light.map(),
                    ("RayCount", &scene.ray_counts[2]),
                    ("TruncatedLoops", &scene.truncated_loops),
                ];
                self.kernel.record(pass, light, (&self.shafts, point_count), &push, &bindings);
            }
        }
    }

    /// Sums the form factors of the lights, weighted by the emissions, in order: the flux that
    /// enters each path, W, three floats. No frame needs it.
    pub fn record_entry_flux(&self, rec: &mut Recorder, lights: &[(Vec3, &Buffer)], flux: &Buffer) {
        let mut pass = rec.pass(Self::FLUX_STEM);
        self.sum.record(&mut pass, lights, self.point_count, self.area_m2, flux);
    }
}

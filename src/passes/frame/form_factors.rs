//! Form factors and the flux that enters the light paths. [Yue §3]
//! In: entry points, lights (W/sr). Out: a form factor (1/m²) for each light and entry point; flux (W) of each path.
//!
//! Form factors are free of the light's colour, so that a change of colour traces no ray.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::types::PathVertex;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// Where a light path begins.
    pub struct EntryPoint {
        /// Point on the surface.
        pub position: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
    }
}

gpu_struct! {
    /// Push constants of the form factors.
    pub struct FormFactorsPush {
        /// The light.
        pub light_position: Vec3,
        /// Entry points.
        pub point_count: u32,
        /// Where this light's form factors start.
        pub first: u32,
        /// That each entry point stands for.
        pub area_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of the path flux.
    pub struct PathFluxPush {
        /// Paths.
        pub path_count: u32,
        /// Lights.
        pub light_count: u32,
        /// That each entry point stands for.
        pub area_m2: f32,
    }
}

/// What these passes share with their shaders.
pub const LAYOUTS: &[Layout] = &[EntryPoint::LAYOUT, FormFactorsPush::LAYOUT, PathFluxPush::LAYOUT];

/// The pipelines, the entry points and what is known of the light on them.
pub struct FormFactors {
    form_factors: Pipeline,
    path_flux: Pipeline,
    entry_points: Buffer,
    point_count: u32,
    area_m2: f32,
    /// Form factor of each light and entry point, a row a light, 1/m².
    pub factors: Buffer,
    /// Flux of each path's first vertex, W; three floats.
    pub flux: Buffer,
}

impl FormFactors {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "form_factors";
    /// The name that the second shader, twin and timing share.
    pub const FLUX_STEM: &str = "path_flux";

    /// Uploads the entry points, each of which stands for `area_m2`; `shines` where some of them may shine.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        entry_points: &[PathVertex],
        area_m2: f32,
        light_count: u32,
        shines: bool,
    ) -> Result<Self> {
        let points: Vec<EntryPoint> =
            entry_points.iter().map(|v| EntryPoint { position: v.position, side: v.side }).collect();
        let count = entry_points.len() as u64;
        Ok(Self {
            form_factors: Pipeline::new(context, Self::STEM, &[])?,
            path_flux: Pipeline::new(context, Self::FLUX_STEM, &[("SHINES", u32::from(shines))])?,
            entry_points: Buffer::from_slice(context, "entry points", &points)?,
            point_count: count as u32,
            area_m2,
            factors: Buffer::storage(context, "form factors", count * u64::from(light_count) * 4)?,
            flux: Buffer::storage(context, "path flux", count * 12)?,
        })
    }

    /// That each entry point stands for, in the mean.
    pub fn area_m2(&self) -> f32 {
        self.area_m2
    }

    /// Entry points.
    pub fn point_count(&self) -> u32 {
        self.point_count
    }

    /// One shadow ray from each entry point that faces the light, for each of the lights that moved: (index, position).
    pub fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, moved: &[(u32, Vec3)]) {
        let mut pass = rec.pass(Self::STEM);
        for &(light, light_position) in moved {
            let push = FormFactorsPush {
                light_position,
                point_count: self.point_count,
                first: light * self.point_count,
                area_m2: self.area_m2,
            };
            if light != moved[0].0 {
                pass.barrier(crate::gpu::barrier::COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.form_factors,
                [self.point_count, 1, 1],
                &push,
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("EntryPoints", &self.entry_points),
                    ("FormFactors", &self.factors),
                ],
            );
        }
    }

    /// Sums the lights: flux that enters each path, and a copy of it where some entry points may shine.
    pub fn record_flux(
        &self,
        rec: &mut Recorder,
        lights: &Buffer,
        light_count: u32,
        reflected_flux: Option<&Buffer>,
    ) {
        let push = PathFluxPush { path_count: self.point_count, light_count, area_m2: self.area_m2 };
        rec.pass(Self::FLUX_STEM).dispatch(
            &self.path_flux,
            [self.point_count, 1, 1],
            &push,
            &[
                ("Lights", lights),
                ("FormFactors", &self.factors),
                ("PathFlux", &self.flux),
                ("ReflectedFlux", reflected_flux.unwrap_or(&self.flux)),
            ],
        );
    }
}

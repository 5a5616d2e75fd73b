//! Accessibility of path vertices: the share of what a vertex reflects that leaves its
//! surroundings. [after Zhukov] In: vertices of the light paths. Out: how much of each counts for
//! readers from afar, and for how much area clusters show.
//!
//! Rays from afar meet what is open more often, and more light comes to it. A mean in which all
//! area counts alike would be too dark for them: in the atrium's mouldings by several per cent.

use super::Chunks;
use super::gather_rays::Hemisphere;
use super::path_orders::Vertex;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::{SceneBuffers, loop_limit};
use crate::scene::{hvds::Hvds, unweighted::NEARBY};
use crate::types::{LOOP_TRUNCATED, NO_CLUSTER, OPEN};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A point that is asked for.
    pub struct AccessibilityPoint {
        /// On the surface.
        pub position: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
    }
}

gpu_struct! {
    pub struct AccessibilityPush {
        /// Points in the dispatch.
        pub point_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// What is further away does not count, metres.
        pub reach: f32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[AccessibilityPoint::LAYOUT, AccessibilityPush::LAYOUT];

/// Stem of shader and reference.
pub const STEM: &str = "accessibility";

/// Rays of an entry point, which tells how much area shows, and of other vertices.
const RAYS: [u32; 2] = [16, 4];

/// What a vertex counts for whose rays all end nearby, of what an open one does: where all are like
/// that, they count alike.
const MIN_WEIGHT: f32 = 1.0 / 16.0;

/// Finds the accessibility, within [`NEARBY`], of vertices in clusters with an unweighted one, and
/// with it the area for which these clusters show.
///
/// # Errors
/// The device lacks memory or failed.
pub fn measure(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    hvds: &mut Hvds,
    vertices: &mut [Vertex],
    seed: u32,
) -> Result<()> {
    let reach = NEARBY * hvds.grid.cell_size() as f32;
    let is_asked = |vertex: &Vertex| {
        vertex.cluster != NO_CLUSTER && hvds.unweighted[vertex.cluster as usize] != NO_CLUSTER
    };
    for (is_entry, rays) in [true, false].into_iter().zip(RAYS) {
        let mut asked: Vec<&mut Vertex> =
            vertices.iter_mut().filter(|vertex| vertex.is_entry() == is_entry && is_asked(vertex)).collect();
        let point =
            |vertex: &&mut Vertex| AccessibilityPoint { position: vertex.position, side: vertex.side };
        let points: Vec<_> = asked.iter().map(point).collect();
        let open = open_rays(context, scene, &points, Hemisphere::new(rays), reach, seed)?;
        for (vertex, open) in asked.iter_mut().zip(open) {
            let counts = MIN_WEIGHT + (1.0 - MIN_WEIGHT) * open as f32 / rays as f32;
            vertex.accessibility = (counts * OPEN as f32).round() as u32;
        }
    }
    let mut samples = vec![[0.0; 2]; hvds.unweighted.len()];
    for vertex in vertices.iter().filter(|vertex| vertex.is_entry() && is_asked(vertex)) {
        let weight = f64::from(vertex.weight);
        let [shown, all] = &mut samples[vertex.cluster as usize];
        *shown += weight * f64::from(vertex.accessibility) / f64::from(OPEN);
        *all += weight;
    }
    hvds.show(&samples);
    Ok(())
}

/// How many of each point's rays meet nothing within `reach` metres.
///
/// # Errors
/// The device lacks memory or failed.
pub fn open_rays(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    points: &[AccessibilityPoint],
    hemisphere: Hemisphere,
    reach: f32,
    seed: u32,
) -> Result<Vec<u32>> {
    /// Points of one dispatch at most, where the device binds as many.
    const LIMIT: u64 = 1 << 17;
    let bindable = context.limits().storage_range_bytes / size_of::<AccessibilityPoint>() as u64;
    let limit = (points.len() as u64).min(LIMIT).min(bindable).max(1);
    let pipeline = Pipeline::new(context, STEM, &hemisphere.constants())?;
    let asked =
        Buffer::storage(context, "accessibility points", limit * size_of::<AccessibilityPoint>() as u64)?;
    let answered = Buffer::storage(context, "open rays", 4 * limit)?;
    let mut open = Vec::with_capacity(points.len());
    Chunks::new(1 << 13, limit as u32).run(points.len() as u32, |first, count| {
        asked.write(&points[first as usize..(first + count) as usize])?;
        let ((), timings) = context.run(|rec| {
            rec.pass(STEM).dispatch(
                &pipeline,
                [count, 1, 1],
                &AccessibilityPush { point_count: count, seed, reach },
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("AccessibilityPoints", &asked),
                    ("OpenRays", &answered),
                ],
            );
        })?;
        open.extend(answered.read_range::<u32>(0, count as usize)?);
        loop_limit::refuse(open[first as usize..].contains(&LOOP_TRUNCATED), STEM, 0)?;
        Ok(timings[0].ms)
    })?;
    Ok(open)
}

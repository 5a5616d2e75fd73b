//! Ambient accessibility of path vertices [after Zhukov]: the fraction of a vertex's reflected
//! light that leaves its surroundings. In: vertices of the light paths. Out: the weight of each
//! vertex for distant readers, and the area that clusters show to them.
//!
//! Distant rays meet accessible surface more often, and it receives more light. An unweighted mean
//! over the area is too dark for them: by several per cent in the mouldings of the atrium.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, HostBlock, HostUpload, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::kept::{Kept, names::name_of};
use crate::passes::precompute::path_orders::Vertex;
use crate::passes::precompute::{Chunks, each_part};
use crate::passes::{SceneBuffers, loop_limit};
use crate::scene::{Naming, hvds::Hvds, unweighted::NEARBY};
use crate::types::{LOOP_TRUNCATED, NO_CLUSTER, OPEN, Surface};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A point to measure.
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
        /// Bits of a side that name it.
        pub side_bits: u32,
        /// Distance beyond which hits do not count, metres.
        pub reach: f32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[AccessibilityPoint::LAYOUT, AccessibilityPush::LAYOUT];

/// Stem of shader and reference.
pub const STEM: &str = "accessibility";

/// Rays of an entry point, which also determines the shown area, and of other vertices.
const RAYS: [u32; 2] = [16, 4];

/// Weight of a vertex whose rays all end nearby, relative to an accessible one. If all vertices of
/// a cluster are like that, their weights are equal.
const MIN_WEIGHT: f32 = 1.0 / 16.0;

/// Accessible path vertices and clusters.
pub struct Accessibility {
    /// All vertices, each with its accessibility.
    pub vertices: Vec<Vertex>,
    /// Area of each cluster that distant readers see, m².
    pub shown_m2: Vec<f32>,
}

/// Measures the accessibility, within [`NEARBY`], of vertices in clusters that have an unweighted
/// one, and derives the area that these clusters show. `kept`: results of the precomputation
/// before, and the surface of each triangle.
///
/// # Errors
/// The device lacks memory or failed.
pub fn measure(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    hvds: &Hvds,
    mut vertices: Vec<Vertex>,
    names: (u32, Naming),
    kept: Option<(&Kept, &[Surface])>,
) -> Result<Accessibility> {
    let is_asked = |vertex: &Vertex| {
        vertex.cluster != NO_CLUSTER && hvds.unweighted[vertex.cluster as usize] != NO_CLUSTER
    };
    let largest = hvds.cell_levels.iter().max().map_or(0, |&level| level);
    let kinds =
        (0..=largest).flat_map(|level| [true, false].into_iter().zip(RAYS).map(move |kind| (level, kind)));
    for (level, (is_entry, rays)) in kinds {
        let reach = NEARBY * hvds.grid.cell_size() as f32 * (1u32 << level) as f32;
        let is_of_kind = |vertex: &&mut Vertex| {
            vertex.is_entry() == is_entry
                && is_asked(vertex)
                && hvds.cell_levels[vertex.cluster as usize] == level
        };
        let mut asked: Vec<&mut Vertex> = vertices.iter_mut().filter(is_of_kind).collect();
        if asked.is_empty() {
            continue;
        }
        let point =
            |vertex: &&mut Vertex| AccessibilityPoint { position: vertex.position, side: vertex.side };
        let points: Vec<_> = asked.iter().map(point).collect();
        let find = |points: &[AccessibilityPoint]| {
            open_rays(context, scene, points, Hemisphere::new(rays), reach, names)
        };
        let open = match kept {
            None => find(&points)?,
            Some((kept, surfaces)) => {
                let name = |point: &AccessibilityPoint| {
                    let normal = surfaces[point.side as usize / 2].normal_of(point.side % 2 == 1);
                    name_of([point.position, normal], [rays, reach.to_bits()])
                };
                let is_kept = |point: &AccessibilityPoint, _: &u32| kept.is_clear([point.position; 2], reach);
                kept.all("accessibilities", &points, name, is_kept, find)?
            }
        };
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
    Ok(Accessibility { vertices, shown_m2: hvds.shown_m2(&samples) })
}

/// Returns how many of each point's rays meet nothing within `reach` metres.
///
/// # Errors
/// The device lacks memory or failed.
pub fn open_rays(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    points: &[AccessibilityPoint],
    hemisphere: Hemisphere,
    reach: f32,
    (seed, naming): (u32, Naming),
) -> Result<Vec<u32>> {
    /// Maximum number of points of one dispatch.
    const LIMIT: u64 = 1 << 17;
    let bindable = context.limits().storage_range_bytes / size_of::<AccessibilityPoint>() as u64;
    let limit = (points.len() as u64).min(LIMIT).min(bindable).max(1);
    let pipeline = Pipeline::new(context, STEM, &hemisphere.constants())?;
    let side_bits = naming.side_bits();
    let asked =
        Buffer::storage(context, "accessibility points", limit * size_of::<AccessibilityPoint>() as u64)?;
    let answered = Buffer::storage(context, "open rays", 4 * limit)?;
    let from_host = HostUpload::of(context, "accessibility points on the host", &asked)?;
    let to_host = HostBlock::of(context, "open rays on the host", &answered)?;
    let mut open = Vec::with_capacity(points.len());
    Chunks::new(1 << 13, limit as u32).run_batches(points.len() as u32, |first, parts| {
        let count = parts.last().map_or(0, |part| part.end);
        from_host.write(&points[first as usize..(first + count) as usize]);
        let ((), timings) = context.run(|rec| {
            each_part(rec, parts, |rec, part| {
                let point_count = part.end - part.start;
                rec.copy_from_host::<AccessibilityPoint>(&from_host, part.clone(), &asked);
                rec.barrier(TRANSFER_TO_COMPUTE);
                rec.pass(STEM).dispatch(
                    &pipeline,
                    [point_count, 1, 1],
                    &AccessibilityPush { point_count, seed, side_bits, reach },
                    &[
                        ("Nodes", &scene.nodes),
                        ("Triangles", &scene.triangles),
                        ("Surfaces", &scene.surfaces),
                        ("AccessibilityPoints", &asked),
                        ("OpenRays", &answered),
                    ],
                );
                rec.barrier(COMPUTE_TO_TRANSFER);
                rec.copy_elements_to_host::<u32>(&answered, &to_host, part);
            });
        })?;
        open.extend(to_host.read::<u32>(count as usize));
        loop_limit::refuse(open[first as usize..].contains(&LOOP_TRUNCATED), STEM, 0)?;
        Ok(timings)
    })?;
    Ok(open)
}

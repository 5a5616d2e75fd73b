//! Entry points: uniform over the area that light can reach, stratified. [Yue §1]
//! In: triangles, active sides. Out: the first vertex of every light path, in Morton order.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::Triangle;
use crate::types::{Grid, PathVertex, Surface};
use std::sync::Arc;

gpu_struct! {
    /// Push constants.
    pub struct EntryPointsPush {
        /// Base grid.
        pub grid: Grid,
        /// Entry points.
        pub point_count: u32,
        /// Active sides.
        pub side_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[EntryPointsPush::LAYOUT];

/// The name that shader, twin and timing share.
pub const STEM: &str = "entry_points";

/// Active sides and the running number of entry points on them.
pub struct Strata {
    /// 2·triangle + (1 if the back side), of each active side.
    pub sides: Vec<u32>,
    /// First entry point of each active side, and the total.
    pub first_points: Vec<u32>,
    /// Area of all active sides, m².
    pub area_m2: f64,
}

impl Strata {
    /// Deals `count` points to the active sides in proportion to their area, the running sum in f64: point i goes to the
    /// side that holds the fraction (i + ½) / count of the area.
    pub fn new(triangles: &[Triangle], surfaces: &[Surface], count: u32) -> Self {
        let active = |side: &u32| surfaces[*side as usize / 2].side_is_active(side % 2 == 1);
        let sides: Vec<u32> = (0..2 * triangles.len() as u32).filter(active).collect();
        let areas: Vec<f64> = sides.iter().map(|&side| triangles[side as usize / 2].area_m2()).collect();
        let area_m2: f64 = areas.iter().sum();
        let mut first_points = vec![0];
        let mut running = 0.0;
        for area in &areas {
            running += area;
            let end = (running / area_m2 * f64::from(count) + 0.5).floor() as u32;
            first_points.push(end.min(count));
        }
        if let Some(last) = first_points.last_mut() {
            *last = count;
        }
        Self { sides, first_points, area_m2 }
    }
}

/// Places the points and sorts them along a Morton curve, which makes neighbours in the list neighbours in space.
///
/// # Errors
/// The device lacks memory or failed.
pub fn place(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    clusters: &ClusterBuffers,
    strata: &Strata,
) -> Result<Vec<PathVertex>> {
    let point_count = strata.first_points.last().copied().unwrap_or(0);
    if strata.sides.is_empty() || point_count == 0 {
        return Ok(Vec::new());
    }
    let pipeline = Pipeline::new(context, STEM, &[])?;
    let sides = Buffer::from_slice(context, "active sides", &strata.sides)?;
    let first_points = Buffer::from_slice(context, "first points", &strata.first_points)?;
    let points =
        Buffer::storage(context, "entry points", u64::from(point_count) * size_of::<PathVertex>() as u64)?;
    let push = EntryPointsPush { grid: clusters.grid, point_count, side_count: strata.sides.len() as u32 };
    context.run(|rec| {
        rec.pass(STEM).dispatch(
            &pipeline,
            [point_count, 1, 1],
            &push,
            &[
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("ActiveSides", &sides),
                ("FirstPoints", &first_points),
                ("CellFirst", &clusters.cell_first),
                ("CellClusters", &clusters.cell_clusters),
                ("EntryPoints", &points),
            ],
        );
    })?;
    let mut placed: Vec<PathVertex> = points.read()?;
    sort_along_curve(&mut placed, &clusters.grid, |vertex| vertex.position);
    Ok(placed)
}

/// Sorts items by the Morton index of their position, stably. 1024 steps along the grid's longest axis.
pub fn sort_along_curve<T>(items: &mut [T], grid: &Grid, position: impl Fn(&T) -> glam::Vec3) {
    let scale = 1023.0 * grid.inverse_cell / grid.cells.max_element() as f32;
    items.sort_by_cached_key(|item| {
        let cell = ((position(item) - grid.low) * scale).max(glam::Vec3::ZERO).as_uvec3();
        let spread = |v: u32| (0..10).fold(0u32, |m, bit| m | (v >> bit & 1) << (3 * bit));
        spread(cell.z) << 2 | spread(cell.y) << 1 | spread(cell.x)
    });
}

//! Third step: cache points, where indirect irradiance is gathered.

use super::hierarchy::Hierarchy;
use super::meters;
use super::surfaces::Reachable;
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::{GatherTargetPacking, TargetCounts};
use crate::passes::precompute::cache_points::{self, Placed, Placement, SizeField};
use crate::passes::precompute::geometry::Geometry;
use crate::passes::precompute::neighbours::Neighbourhoods;
use crate::passes::precompute::visibility::near_clusters;
use crate::passes::precompute::{Progress, entry_points};
use crate::renderer::quality_warnings::uncovered;
use crate::scene::{Measure, Naming, Scene};
use crate::types::CachePoint;
use glam::Vec3;
use std::sync::Arc;

/// A cache point sees near-field patches if its clearance is below this many base cells.
const SEES_NEAR: f32 = 2.0;
/// A cache point stands in a narrow cavity, where light is reflected to and fro, if its clearance
/// is below this many base cells.
const NARROW: f32 = 0.5;

/// The cache points. Points that see near clusters come first, and among these the points
/// in narrow cavities. Measuring points come last: their records have no neighbours, and pixels do
/// not read them.
pub(super) struct Points {
    pub(super) placement: Placement,
    pub(super) points: Vec<CachePoint>,
    /// The same on the device.
    pub(super) buffer: Buffer,
    pub(super) neighbourhoods: Neighbourhoods,
    /// Number of points in narrow cavities.
    pub(super) narrow_count: u32,
    /// Number of points that see near clusters.
    pub(super) near_count: u32,
    /// Clusters that take the irradiance of the record beside them.
    pub(super) near_clusters: Vec<NearCluster>,
    /// Bit layout of gather rays as traced: they read clusters and the sky alone.
    pub(super) hits: GatherTargetPacking,
}

impl Points {
    pub(super) fn place(
        context: &Arc<Context>,
        scene: &Scene,
        reachable: &Reachable,
        (size_field, geometry): (&SizeField<'_>, &Geometry<'_>),
        hierarchy: &Hierarchy,
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        let (quality, hvds, cell_size) = (&scene.quality, &hierarchy.hvds, hierarchy.cell_size);
        let mut placement = cache_points::place(size_field, &reachable.buffers, geometry, quality, progress)?;
        entry_points::sort_along_curve(&mut placement.points, &hvds.grid, |placed| placed.point.position);
        let places: Vec<Vec3> = placement.points.iter().map(|placed| placed.point.position).collect();
        let naming = scene.naming();
        let streams = entry_points::streams_along_curve(&places, &hvds.grid, (quality, naming));
        for (placed, stream) in placement.points.iter_mut().zip(streams) {
            placed.point.stream = stream;
        }
        let within =
            |cells: f32| move |placed: &Placed| placed.clearance < cells * cell_size * placed.spacing;
        let has_gaps = quality.gap_rounds > 0;
        let [is_narrow, is_near] =
            [NARROW, SEES_NEAR].map(|cells| within(if has_gaps { cells } else { 0.0 }));
        placement.points.sort_by_key(|placed| (!is_near(placed), !is_narrow(placed)));
        if naming == Naming::Number {
            (0..).zip(&mut placement.points).for_each(|(number, placed)| placed.point.stream = number);
        }
        let mut points: Vec<CachePoint> = placement.points.iter().map(|placed| placed.point).collect();
        let mut neighbourhoods = Neighbourhoods::new(&placement.points);
        if scene.measuring_points()[0] > 0 {
            let first = naming.pick(points.len() as u32, || 0);
            let meters =
                meters::points(scene, &reachable.buffers, size_field, (placement.min_radius, first))?;
            meters.iter().for_each(|_| neighbourhoods.push_alone());
            points.extend(meters);
        }
        let patches = &hierarchy.patches[..hierarchy.extent.end(hvds)];
        Ok(Self {
            buffer: Buffer::from_slice(context, GrowsWith::GatherRays.named("cache points"), &points)?,
            neighbourhoods,
            narrow_count: placement.points.partition_point(is_narrow) as u32,
            near_count: placement.points.partition_point(is_near) as u32,
            near_clusters: match quality.takes(Measure::NearClusters) {
                true => near_clusters::find(patches, hierarchy.extent, cell_size, &placement.points),
                false => Vec::new(),
            },
            hits: GatherTargetPacking::of_counts(
                TargetCounts {
                    clusters: hvds.cluster_count(),
                    sky_side: scene.emission.sky_side(),
                    ..TargetCounts::default()
                },
                scene.materials.len(),
                placement.min_radius,
            )?,
            points,
            placement,
        })
    }

    pub(super) fn count(&self) -> u32 {
        self.points.len() as u32
    }

    /// The warning if the budget does not cover the surface.
    pub(super) fn warning(&self, scene: &Scene) -> Option<String> {
        (!self.placement.is_covering).then(|| uncovered(scene.quality.cache_points))
    }
}

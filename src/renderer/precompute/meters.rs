//! Measuring points of light meters. Each has gather rays as a cache point has.

use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::cache_points::SizeField;
use crate::scene::{Meter, Scene};
use crate::types::CachePoint;
use bytemuck::Zeroable;

/// The points of all meters, in order, each as many times as it has cache points. Their random
/// streams are consecutive from `first_stream`. The radius is `radius`, or zero in a solid, where
/// nothing is measured.
pub(super) fn points(
    scene: &Scene,
    buffers: &SceneBuffers,
    size_field: &SizeField<'_>,
    (radius, first_stream): (f32, u32),
) -> Result<Vec<CachePoint>> {
    let of_meter = |meter: &Meter| {
        let point = |(position, normal)| CachePoint {
            position,
            normal,
            facet: normal,
            radius,
            ..CachePoint::zeroed()
        };
        meter.points().into_iter().map(point)
    };
    let mut points: Vec<CachePoint> = scene.meters.iter().flat_map(of_meter).collect();
    let in_solids = size_field.in_solids(buffers, &points)?;
    for (point, is_in_solid) in points.iter_mut().zip(in_solids) {
        if is_in_solid {
            point.radius = 0.0;
        }
    }
    let [_, times] = scene.measuring_points();
    let repeated = points.into_iter().flat_map(|point| std::iter::repeat_n(point, times));
    Ok((first_stream..).zip(repeated).map(|(stream, point)| CachePoint { stream, ..point }).collect())
}

//! Twin of the views of clusters: what a view shows, and what there is to see.

use crate::cpu::rays::Geometry;
use crate::scene::hvds::Hvds;
use glam::{DVec3, UVec3, Vec3};

/// Irradiance of a view, W/m²: of each part the cluster's irradiance and the weight.
pub fn view(parts: impl IntoIterator<Item = (Vec3, f32)>) -> DVec3 {
    parts.into_iter().map(|(irradiance, weight)| f64::from(weight) * irradiance.as_dvec3()).sum()
}

/// Area of a cluster, projected along a unit direction, that leaves a cell of some level in that direction unblocked, and all of it
/// that faces the direction, m². Looks at `per_piece`² points of each piece of the base clusters below it.
pub fn projected_area(
    geometry: Geometry<'_>,
    hvds: &Hvds,
    cluster: u32,
    (level, cell): (u32, UVec3),
    direction: DVec3,
    per_piece: u32,
) -> [f64; 2] {
    let mut areas = [0.0; 2];
    let [low, high] = [cell, cell + UVec3::ONE].map(|corner| hvds.grid.corner(corner << level));
    for piece in &hvds.pieces {
        let mut around = piece.cluster;
        while around < cluster {
            around = hvds.parents[around as usize];
        }
        let normal = geometry.normal(piece.side);
        let facing = normal.as_dvec3().dot(direction);
        if around != cluster || facing <= 0.0 {
            continue;
        }
        let points = spread(&piece.corners, per_piece);
        let is_open = |point: &&Vec3| {
            let origin = geometry.offset_origin(**point, normal);
            geometry.closest(origin, direction).is_none_or(|hit| {
                let inside = hit.position.cmpge(low).all() && hit.position.cmple(high).all();
                !inside
            })
        };
        let open = points.iter().filter(is_open).count() as f64 / points.len() as f64;
        areas[0] += piece.area_m2 * facing * open;
        areas[1] += piece.area_m2 * facing;
    }
    areas
}

/// Points of a fan of triangles, `count`² in each.
fn spread(corners: &[Vec3], count: u32) -> Vec<Vec3> {
    let middle = |i: u32| (i as f32 + 0.5) / count as f32;
    let fan = corners[1..].windows(2).flat_map(|pair| {
        (0..count * count).map(|i| {
            let (along, v) = (middle(i % count).sqrt(), middle(i / count));
            corners[0].lerp(pair[0].lerp(pair[1], v), along)
        })
    });
    fan.collect()
}

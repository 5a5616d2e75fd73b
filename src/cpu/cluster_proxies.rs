//! Reference of the directional proxies, and of the visible area that they represent.

use crate::cpu::rays::Geometry;
use crate::scene::hvds::Hvds;
use glam::{DVec3, Vec3};

/// Irradiance of a proxy, W/m²: the sum of its clusters' irradiances times their weights.
pub fn proxy(terms: impl IntoIterator<Item = (Vec3, f32)>) -> DVec3 {
    terms.into_iter().map(|(irradiance, weight)| f64::from(weight) * irradiance.as_dvec3()).sum()
}

/// Area of a cluster that a point sees, and the area that faces the point, m². Samples
/// `per_fragment`² points of each triangle of the fragments in the base clusters below it.
pub fn seen_area(
    geometry: Geometry<'_>,
    hvds: &Hvds,
    cluster: u32,
    reader: DVec3,
    per_fragment: u32,
) -> [f64; 2] {
    let mut areas = [0.0; 2];
    for fragment in &hvds.fragments {
        let mut around = fragment.cluster;
        while around < cluster {
            around = hvds.parents[around as usize];
        }
        if around != cluster {
            continue;
        }
        let normal = geometry.normal(fragment.side);
        let points = spread(&fragment.corners, per_fragment);
        let area_m2 = fragment.area_m2 / points.len() as f64;
        for point in points {
            let origin = geometry.offset_origin(point, normal);
            let direction = reader - origin.as_dvec3();
            if direction.dot(normal.as_dvec3()) > 0.0 {
                areas[1] += area_m2;
                let is_seen = geometry.closest(origin, direction).is_none_or(|hit| hit.t >= 1.0);
                areas[0] += if is_seen { area_m2 } else { 0.0 };
            }
        }
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

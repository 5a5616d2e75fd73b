//! Finds the regions of a scene that need small cells: what cameras and lights see nearby, or where
//! most of the triangles are.

use super::bvh::Bvh;
use super::cell_sizes::{CellSizes, Region};
use super::fit::sphere;
use super::host_bvh::HostBvh;
use super::{Camera, Light, LightKind, Triangle};
use glam::Vec3;

/// Some camera's region needs at least this number of halvings.
const LEAST_HALVINGS: u32 = 3;
const MOST_HALVINGS: u32 = 16;
/// Smallest side of a region over its largest coordinate.
const LEAST_SIDE: f32 = 1e-5;
/// Fraction of the triangles that a crowd may lack at either end of an axis.
const OUTSIDE: f64 = 0.1;
/// A viewpoint traces rays if some surface is within the longest side of the scene over this.
const NEARBY: f32 = 64.0;
/// Rays of a camera along the axes of its picture, and rays of a light.
const PICTURE: [usize; 2] = [32, 24];
const AROUND: usize = 256;
/// Cameras and lights that trace rays, the first ones, and regions of a scene: light paths aim at
/// each of them.
const CAMERAS: usize = 8;
const LIGHTS: usize = 64;
const REGIONS: usize = 16;
/// Distance of a hit, over that of the farthest, up to which it is the surface of the viewpoint.
const NO_DISTANCE: f32 = 1e-5;
/// A viewpoint's region holds what is nearer than the median of its hits times this.
const NEARER: f32 = 2.0;

/// The regions of a scene, the smallest cells first; none in a scene that is as right without.
pub(super) fn find(triangles: &[Triangle], cameras: &[Camera], lights: &[Light]) -> Vec<Region> {
    let (low, high) = bounds(triangles.iter().flat_map(|triangle| triangle.positions));
    let side_m = (high - low).max_element();
    let is_close = |camera: &Camera| nearest(triangles, camera.position) * NEARBY < side_m;
    if !cameras.iter().any(is_close) {
        return Vec::new();
    }
    let Ok(bvh) = Bvh::build(triangles) else { return Vec::new() };
    let ordered: Vec<Triangle> = bvh.order.iter().map(|&index| triangles[index as usize]).collect();
    let tree = HostBvh::without_holes(&bvh, &ordered);
    let region = |places: Vec<Vec3>| {
        let (low, high) = bounds(places.into_iter());
        // A smaller region is a mistake, such as a light in a wall.
        let least = LEAST_SIDE * low.abs().max(high.abs()).max_element();
        let halvings = (side_m / (high - low).max_element().max(f32::MIN_POSITIVE)).log2().round();
        let halvings = (halvings.max(0.0) as u32).min(MOST_HALVINGS);
        ((high - low).max_element() > least).then_some(Region { low, high, halvings })
    };
    let of_cameras = cameras.iter().map(|camera| seen(&tree, camera.position, picture(camera)));
    let seen_by_cameras: Vec<Vec<Vec3>> = of_cameras.take(CAMERAS).collect();
    let mut all: Vec<Region> = match seen_by_cameras.iter().all(Vec::is_empty) {
        true => region(crowd(triangles)).into_iter().collect(),
        false => seen_by_cameras.into_iter().filter_map(region).collect(),
    };
    let finest = all.iter().map(|region| region.halvings).max().unwrap_or(0);
    if finest < LEAST_HALVINGS {
        return Vec::new();
    }
    let places = lights.iter().filter_map(place).take(LIGHTS);
    let of_lights = places.filter_map(|place| region(seen(&tree, place, sphere(AROUND))));
    // What no camera sees from nearby needs no cells that are much smaller.
    all.extend(of_lights.map(|found| Region { halvings: found.halvings.min(finest + 1), ..found }));
    let mut found: Vec<Region> = Vec::new();
    for region in all {
        // The region of one that is at least as fine holds it.
        let holds = |other: &Region| {
            other.halvings >= region.halvings
                && other.low.cmple(region.low).all()
                && other.high.cmpge(region.high).all()
        };
        if region.halvings > 0 && found.len() < REGIONS && !found.iter().any(holds) {
            found.push(region);
        }
    }
    found.sort_by_key(|region| std::cmp::Reverse(region.halvings));
    found
}

fn bounds(places: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    places.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// Where the rays of a light start. Those of an area light start before it, as far as it is wide:
/// it may lie on a surface.
fn place(light: &Light) -> Option<Vec3> {
    match light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
        LightKind::Area { corner, edge_u, edge_v, .. } => {
            let width = edge_u.length().min(edge_v.length());
            let before = width * edge_u.cross(edge_v).normalize_or_zero();
            Some(corner + 0.5 * (edge_u + edge_v) + before)
        }
        LightKind::Directional { .. } | LightKind::Surface { .. } | LightKind::Sky { .. } => None,
    }
}

/// Corners of the triangles in the middle of the crowd.
fn crowd(triangles: &[Triangle]) -> Vec<Vec3> {
    let middle = |triangle: &Triangle| triangle.positions.iter().sum::<Vec3>() / 3.0;
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    for axis in 0..3 {
        let mut places: Vec<f32> = triangles.iter().map(|triangle| middle(triangle)[axis]).collect();
        let count = places.len();
        let mut at = |place: usize| *places.select_nth_unstable_by(place.min(count - 1), f32::total_cmp).1;
        let outside = (OUTSIDE * count as f64).ceil() as usize;
        (low[axis], high[axis]) = (at(outside), at(count - outside.min(count)));
    }
    let side = (high - low).max_element();
    let is_in = |triangle: &&Triangle| {
        let (least, most) = bounds(triangle.positions.into_iter());
        (most - least).max_element() <= 2.0 * side
            && middle(triangle).cmpge(low - 0.5 * side).all()
            && middle(triangle).cmple(high + 0.5 * side).all()
    };
    triangles.iter().filter(is_in).flat_map(|triangle| triangle.positions).collect()
}

/// Distance of a point from the nearest bounds of a triangle, metres.
fn nearest(triangles: &[Triangle], place: Vec3) -> f32 {
    let distance = |triangle: &Triangle| {
        let (low, high) = bounds(triangle.positions.into_iter());
        place.distance(place.clamp(low, high))
    };
    triangles.iter().map(distance).fold(f32::INFINITY, f32::min)
}

fn picture(camera: &Camera) -> impl Iterator<Item = Vec3> {
    let [right, up, forward] = camera.frame();
    let tan = (0.5 * camera.fov_y_degrees).to_radians().tan();
    let aspect = camera.size[0] as f32 / camera.size[1] as f32;
    let place = |index: usize, count: usize| 2.0 * (index as f32 + 0.5) / count as f32 - 1.0;
    (0..PICTURE[0] * PICTURE[1]).map(move |index| {
        let (x, y) = (place(index % PICTURE[0], PICTURE[0]), place(index / PICTURE[0], PICTURE[1]));
        (forward + tan * (aspect * x * right - y * up)).normalize()
    })
}

/// What rays from a point meet nearby.
fn seen(tree: &HostBvh, origin: Vec3, directions: impl Iterator<Item = Vec3>) -> Vec<Vec3> {
    let hit = |direction| tree.closest(origin, direction).map(|(t, _)| (t, origin + t * direction));
    let mut hits: Vec<(f32, Vec3)> = directions.filter_map(hit).collect();
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A lamp may stand on a surface.
    let least = hits.last().map_or(0.0, |farthest| NO_DISTANCE * farthest.0);
    hits.retain(|hit| hit.0 > least);
    let Some(&(median, _)) = hits.get(hits.len() / 2) else { return Vec::new() };
    hits.retain(|hit| hit.0 <= NEARER * median);
    hits.into_iter().map(|hit| hit.1).collect()
}

/// Distance from the regions at which cells have their full width: the longest with which the
/// number of cells stays in bounds, metres.
pub(super) fn reach(triangles: &[Triangle], regions: Vec<Region>) -> CellSizes {
    /// Full widths in the longest side of a scene: any number, since all counts follow it alike.
    const ACROSS: f64 = 128.0;
    /// Tried reaches, in halvings of the longest side.
    const REACHES: u32 = 8;
    /// Maximum number of cells, relative to those in the regions or to equal cells.
    const CELLS: f64 = 1.5;
    /// Cells of a scene as crowded as a furnished room.
    const OF_ROOM: f64 = 24.0 * ACROSS * ACROSS;
    if regions.is_empty() {
        return CellSizes::default();
    }
    let (low, high) = bounds(triangles.iter().flat_map(|triangle| triangle.positions));
    let side_m = f64::from((high - low).max_element());
    let cells = |sizes: &CellSizes| -> f64 {
        let of_m2 = |place: Vec3| (side_m / ACROSS * sizes.fraction_at(place)).powi(-2);
        triangles.iter().map(|triangle| integral(triangle.positions, &regions, &of_m2, DEPTH)).sum()
    };
    let with = |reach_m: f64| CellSizes { regions: regions.clone(), reach_m };
    let most = CELLS * cells(&CellSizes::default()).max(cells(&with(1e-6 * side_m))).max(OF_ROOM);
    let mut tried = (0..REACHES).map(|halvings| with(side_m / f64::from(1 << halvings)));
    let last = with(side_m / f64::from(1 << REACHES));
    tried.find(|sizes| cells(sizes) <= most).unwrap_or(last)
}

/// Maximum number of times that [`integral`] divides a triangle.
const DEPTH: u32 = 16;

/// Integral over a triangle of a function that varies with the distance from the regions.
fn integral(corners: [Vec3; 3], regions: &[Region], of_point: &dyn Fn(Vec3) -> f64, depth: u32) -> f64 {
    let [a, b, c] = corners;
    let middle = (a + b + c) / 3.0;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let is_inside = |region: &Region| corners.iter().all(|&p| p == p.clamp(region.low, region.high));
    let is_small = |region: &Region| {
        let distance = middle.distance(middle.clamp(region.low, region.high));
        longest < 0.5 * (distance + 0.1 * region.side())
    };
    if depth == 0 || regions.iter().any(is_inside) || regions.iter().all(is_small) {
        return 0.5 * f64::from((b - a).cross(c - a).length()) * of_point(middle);
    }
    let [d, e, f] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    let parts = [[a, d, f], [d, b, e], [f, e, c], [d, e, f]];
    parts.into_iter().map(|part| integral(part, regions, of_point, depth - 1)).sum()
}

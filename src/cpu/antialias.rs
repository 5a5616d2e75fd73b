//! Reference of the antialiasing: edge pixels, the surfaces at their samples, and fragments.

use crate::cpu::primary::{Seen, direction_through, seen_through};
use crate::cpu::rays::{Geometry, intersect};
use crate::cpu::records::FACETS_ALIKE;
use crate::cpu::sampling::{hash, hash_pair, sample_3d, sobol};
use crate::types::{EVERY_VIEW, MeshEdge, NO_SIDE, PixelSurface, Surface, View};
use glam::{DVec2, DVec3, Vec3};

/// Samples of a pixel for each sample of a light in a fragment; `glsl/include/antialias.glsl` has
/// the same constants.
const COVERAGE: u32 = 4;
/// Sides whose fragment the device keeps in mind.
const KNOWN: usize = 8;
/// Maximum number of samples of an edge pixel.
const MAX_SAMPLES: u32 = 256;
/// Maximum number of fragments of an edge pixel.
const MAX_FRAGMENTS: u32 = 4;

/// Thresholds of an edge between two pixels.
#[derive(Clone, Copy)]
pub struct Thresholds {
    /// Cosine of two normals below which they make an edge.
    pub crease: f64,
    /// Distance from the other's plane that makes an edge, in pixel widths.
    pub step: f64,
}

/// Geometric normal of a side.
fn facet(surfaces: &[Surface], side: u32) -> Vec3 {
    surfaces[side as usize / 2].normal_of(side % 2 == 1)
}

/// Whether two neighbouring pixels show an edge of geometry or of a material between them.
pub fn is_edge(thresholds: Thresholds, surfaces: &[Surface], [a, b]: [&PixelSurface; 2]) -> bool {
    if a.side == NO_SIDE || b.side == NO_SIDE {
        return a.side != b.side;
    }
    let material = |pixel: &PixelSurface| surfaces[pixel.side as usize / 2].material;
    let [normal_a, normal_b] = [a, b].map(|pixel| pixel.normal.as_dvec3());
    let apart = b.position.as_dvec3() - a.position.as_dvec3();
    let off_plane = apart.dot(normal_a).abs().min(apart.dot(normal_b).abs());
    let width = f64::from(a.footprint.max(b.footprint)).sqrt();
    let [facet_a, facet_b] = [a, b].map(|pixel| facet(surfaces, pixel.side));
    material(a) != material(b)
        || facet_a.dot(facet_b) < FACETS_ALIKE
        || normal_a.dot(normal_b) < thresholds.crease
        || off_plane > thresholds.step * width
}

/// Marks the pixels of an image, row by row, at an edge of geometry or of a material towards a
/// pixel beside them.
pub fn edges(
    thresholds: Thresholds,
    surfaces: &[Surface],
    [width, height]: [u32; 2],
    pixels: &[PixelSurface],
) -> Vec<bool> {
    let is_edge = |index: usize, other| is_edge(thresholds, surfaces, [&pixels[index], &pixels[other]]);
    (0..pixels.len()).map(|index| beside(index, [width, height]).any(|other| is_edge(index, other))).collect()
}

/// How far behind the plane of a pixel's surface an edge of that surface may be, in pixel widths.
const BEHIND: f64 = 0.1;

/// Marks the pixels of an image, row by row, that an edge of the mesh crosses and that show it: it
/// is not behind the surface in their middle.
pub fn crossed(
    geometry: Geometry<'_>,
    view: &View,
    edges: &[MeshEdge],
    pixels: &[PixelSurface],
) -> Vec<bool> {
    let mut marks = vec![false; pixels.len()];
    let eye = view.position.as_dvec3();
    let corner = |name: u32, after: u32| {
        let triangle = &geometry.triangles[name as usize / 4];
        triangle.positions[((name % 4 + after) % 3) as usize].as_dvec3()
    };
    for edge in edges {
        let [opposite, from, to] = [0, 1, 2].map(|after| corner(edge.own, after));
        let side = |third: DVec3| (to - from).cross(third - from).dot(from - eye);
        if edge.other != EVERY_VIEW && (side(opposite) > 0.0) != (side(corner(edge.other, 0)) > 0.0) {
            continue;
        }
        let Some(ends) = line(view, [from, to]) else { continue };
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])].map(|end| end.truncate());
        let size = DVec2::new(f64::from(view.width), f64::from(view.height)) - 1.0;
        let [low, high] = [low, high].map(|end| end.floor().clamp(DVec2::ZERO, size));
        let is_steep = (ends[1].y - ends[0].y).abs() > (ends[1].x - ends[0].x).abs();
        for (y, x) in
            (low.y as u32..=high.y as u32).flat_map(|y| (low.x as u32..=high.x as u32).map(move |x| (y, x)))
        {
            let cell = DVec2::new(f64::from(x), f64::from(y));
            let Some(_) = within(ends, cell, [true; 2]) else { continue };
            let Some(middle) = within(ends, cell, [!is_steep, is_steep]) else { continue };
            let index = (y * view.width + x) as usize;
            marks[index] |= is_seen(geometry.surfaces, view, &pixels[index], middle);
        }
    }
    marks
}

/// The ends of the part of a line that is in front of the camera: in pixels, and 1 / depth.
fn line(view: &View, ends: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let [right, up] = [view.right, view.up].map(|axis| axis.as_dvec3() / axis.as_dvec3().length_squared());
    let seen = |point: DVec3| {
        let d = point - view.position.as_dvec3();
        DVec3::new(d.dot(right), -d.dot(up), d.dot(view.forward.as_dvec3()))
    };
    let [mut a, mut b] = ends.map(seen);
    // The part within the image: each of five planes cuts off what is behind it.
    for plane in [
        DVec3::Z,
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(-1.0, 0.0, 1.0),
        DVec3::new(0.0, 1.0, 1.0),
        DVec3::new(0.0, -1.0, 1.0),
    ] {
        let [before, after] = [a, b].map(|end| plane.dot(end) - 1e-12);
        if before < 0.0 && after < 0.0 {
            return None;
        }
        let crossing = a.lerp(b, before / (before - after));
        (a, b) = (if before < 0.0 { crossing } else { a }, if after < 0.0 { crossing } else { b });
    }
    let half = 0.5 * DVec2::new(f64::from(view.width), f64::from(view.height));
    let in_image = |end: DVec3| ((1.0 + end.truncate() / end.z) * half).extend(1.0 / end.z);
    Some([a, b].map(in_image))
}

/// The middle of the part of a line whose coordinates are within a pixel, of the axes that count.
fn within([from, to]: [DVec3; 2], pixel: DVec2, axes: [bool; 2]) -> Option<DVec3> {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for axis in (0..2).filter(|&axis| axes[axis]) {
        let (start, along) = (from[axis] - pixel[axis], to[axis] - from[axis]);
        let at = [0.0, 1.0].map(|side| (side - start) / along);
        if along == 0.0 && !(0.0..=1.0).contains(&start) {
            return None;
        }
        if along != 0.0 {
            (enters, leaves) = (enters.max(at[0].min(at[1])), leaves.min(at[0].max(at[1])));
        }
    }
    (enters <= leaves).then(|| from.lerp(to, 0.5 * (enters + leaves)))
}

/// Maximum number of points of a pixel at which holes are looked for, along each side.
const MAX_POINTS: f64 = 8.0;

/// Marks the pixels of an image, row by row, that may show both holes and surface at a triangle.
/// The ray through their middle meets it, in a hole or not, up to what they show there.
pub fn show_holes(geometry: Geometry<'_>, view: &View, pixels: &[PixelSurface]) -> Vec<bool> {
    let eye = view.position.as_dvec3();
    let shows = |(index, shown): (usize, &PixelSurface)| {
        let corner = DVec2::new(f64::from(index as u32 % view.width), f64::from(index as u32 / view.width));
        let middle = direction_through(view, corner + 0.5);
        let end = match shown.side {
            NO_SIDE => f64::INFINITY,
            _ => (f64::from(shown.footprint) / f64::from(view.pixel_area)).sqrt() * (1.0 + 1e-4),
        };
        let is_partly_hole = |triangle: u32| {
            let corners = geometry.triangles[triangle as usize].positions;
            intersect(corners, eye, middle).is_some_and(|(t, _)| t < end)
                && is_partly_hole(geometry, view, triangle, corner)
        };
        (0..geometry.triangles.len() as u32)
            .any(|triangle| geometry.opacity.has_holes(triangle) && is_partly_hole(triangle))
    };
    pixels.iter().enumerate().map(shows).collect()
}

/// Whether a pixel may show both holes and surface: of a triangle, or of those beside it. The
/// points are as close as its micro-triangles, or as their number allows.
fn is_partly_hole(geometry: Geometry<'_>, view: &View, triangle: u32, corner: DVec2) -> bool {
    let corners = geometry.triangles[triangle as usize].positions;
    let weights_at =
        |x: f64, y: f64| plane_weights(view, corners, corner + DVec2::new(x, y)).unwrap_or(DVec3::NAN);
    let middle = weights_at(0.5, 0.5);
    let extent = (weights_at(1.0, 0.5) - middle).abs() + (weights_at(0.5, 1.0) - middle).abs();
    let parts = 2.0 * extent.max_element() * geometry.opacity.parts(triangle);
    let points = (parts.ceil() + 1.0).clamp(2.0, MAX_POINTS) as u32;
    let place = |index: u32| (f64::from(index) + 0.5) / f64::from(points);
    let found: Vec<Option<bool>> = (0..points * points)
        .map(|i| weights_at(place(i % points), place(i / points)))
        .map(|weights| (weights.min_element() >= 0.0).then(|| geometry.opacity.is_hole(triangle, weights)))
        .collect();
    found.iter().any(|&is_hole| is_hole.is_none() || is_hole != found[0])
}

/// Corner weights of a triangle's plane behind an image point. `None` if it is seen edge-on.
fn plane_weights(view: &View, corners: [Vec3; 3], point: DVec2) -> Option<DVec3> {
    let direction = direction_through(view, point);
    let [a, b, c] = corners.map(|corner| corner.as_dvec3() - view.position.as_dvec3());
    let volumes = DVec3::from([c.cross(b), a.cross(c), b.cross(a)].map(|across| direction.dot(across)));
    let sum = volumes.element_sum();
    (sum != 0.0).then(|| volumes / sum)
}

/// Whether a point of an edge is not behind what a pixel's middle shows.
fn is_seen(surfaces: &[Surface], view: &View, shown: &PixelSurface, point: DVec3) -> bool {
    if shown.side == NO_SIDE {
        return true;
    }
    let position = view.position.as_dvec3() + direction_through(view, point.truncate()) / point.z;
    let plane = facet(surfaces, shown.side).as_dvec3();
    (position - shown.position.as_dvec3()).dot(plane) > -BEHIND * f64::from(shown.footprint).sqrt()
}

/// The pixels of an image in tile order: tiles of 8×8 pixels, row by row, with a Morton
/// curve in each.
pub fn tile_order([width, height]: [u32; 2]) -> impl Iterator<Item = u32> {
    let tiles = width.div_ceil(8);
    let pixel = move |place: u32| {
        let (tile, within) = (place / 64, place % 64);
        let within =
            [0, 1].map(|axis| (0..3).map(|bit| (within >> (2 * bit + axis) & 1) << bit).sum::<u32>());
        [8 * (tile % tiles) + within[0], 8 * (tile / tiles) + within[1]]
    };
    let places = 0..64 * tiles * height.div_ceil(8);
    places.map(pixel).filter(move |[x, y]| *x < width && *y < height).map(move |[x, y]| y * width + x)
}

/// Marks the pixels at a shadow edge of a light that are no edge pixels already: the light differs
/// by the fraction `contrast` or more from that at a pixel beside them.
pub fn shadow_edges(contrast: f64, size: [u32; 2], edges: &[bool], layer: &[f32]) -> Vec<bool> {
    let differ = |index: usize, other: usize| {
        let [here, there] = [layer[index], layer[other]].map(f64::from);
        here.max(there) > 0.0 && (here - there).abs() >= contrast * here.max(there)
    };
    let is_edge = |index: usize| !edges[index] && beside(index, size).any(|other| differ(index, other));
    (0..layer.len()).map(is_edge).collect()
}

/// The pixels above, left, right and below.
fn beside(index: usize, [width, height]: [u32; 2]) -> impl Iterator<Item = usize> {
    let (x, y) = (index as u32 % width, index as u32 / width);
    let beside = [
        (y > 0).then(|| index - width as usize),
        (x > 0).then(|| index - 1),
        (x + 1 < width).then_some(index + 1),
        (y + 1 < height).then_some(index + width as usize),
    ];
    beside.into_iter().flatten()
}

/// Fragments of each of `edge_count` edge pixels, with a capacity of `fragments` in total.
pub fn fragments_per_edge(edge_count: u32, fragments: u32) -> u32 {
    MAX_FRAGMENTS.min(fragments / edge_count.max(1))
}

/// Samples of each of `edge_count` edge pixels with `light_samples` of a light in a fragment, or
/// what the capacity allows; a multiple of eight. Zero if all would be one fragment.
pub fn samples_per_edge(edge_count: u32, light_samples: u32, [samples, fragments]: [u32; 2]) -> u32 {
    let most = (COVERAGE * light_samples).next_multiple_of(8).min(MAX_SAMPLES);
    let count = most.min((samples / edge_count.max(1)) & !7);
    if fragments_per_edge(edge_count, fragments) < 2 { 0 } else { count }
}

/// Returns the fragment of each sample of an edge pixel; `None` if the sample sees nothing. A
/// sample joins the fragment whose first sample it resembles most if that has the same material and
/// is no more than `alike` dissimilar, or if `most` fragments are in use. Samples on one side of a
/// triangle stay together. The second result are the first samples of the fragments.
pub fn fragments(
    surfaces: &[Surface],
    samples: &[Option<PixelSurface>],
    most: u32,
    alike: f64,
) -> (Vec<Option<usize>>, Vec<PixelSurface>) {
    let mut shown: Vec<PixelSurface> = Vec::new();
    let mut known: Vec<(u32, usize)> = Vec::new();
    let material = |surface: &PixelSurface| surfaces[surface.side as usize / 2].material;
    let mut fragment_of = |sample: &PixelSurface| {
        if let Some(&(_, own)) = known.iter().rev().take(KNOWN).find(|(side, _)| *side == sample.side) {
            return own;
        }
        let cost = |other: &PixelSurface| {
            let other_material = if material(other) == material(sample) { 0.0 } else { 1e3 };
            dissimilarity(surfaces, sample, other) + other_material
        };
        let costs = shown.iter().map(cost).enumerate();
        let best = costs.min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((own, _)) = best.filter(|(_, least)| *least <= alike || shown.len() == most as usize) {
            known.push((sample.side, own));
            return own;
        }
        shown.push(*sample);
        known.push((sample.side, shown.len() - 1));
        shown.len() - 1
    };
    let own = samples.iter().map(|sample| sample.as_ref().map(&mut fragment_of)).collect();
    (own, shown)
}

/// Whether the light `here` of a fragment may be mixed by the light `there` elsewhere on its
/// surface, negative in a penumbra: by a relative difference of `contrast`.
pub fn differs(here: f32, there: f32, contrast: f64) -> bool {
    let [low, high] = [here.abs().min(there.abs()), here.abs().max(there.abs())].map(f64::from);
    there.is_sign_negative() || (high > 0.0 && high - low >= contrast * high)
}

/// Place of a sample in an edge pixel, from its corner: Sobol points whose bits the pixel flips.
pub fn place_in_pixel(sample: u32, pixel: u32) -> DVec2 {
    let [x, y, _] = sobol(sample);
    let flipped = [x ^ hash(pixel), y ^ hash_pair(pixel, 1)];
    DVec2::from(flipped.map(|fraction| f64::from(fraction >> 8) / f64::from(1 << 24)))
}

/// Surface at a sample of an edge pixel.
pub fn edge_sample(geometry: Geometry<'_>, view: &View, pixel: u32, number: u32) -> Option<Seen> {
    let corner = DVec2::new(f64::from(pixel % view.width), f64::from(pixel / view.width));
    seen_through(geometry, view, corner + place_in_pixel(number, pixel))
}

/// Surface at sample number `sample` of a pixel.
pub fn sample(geometry: Geometry<'_>, view: &View, pixel: u32, sample: u32) -> Option<Seen> {
    let corner = Vec3::new((pixel % view.width) as f32, (pixel / view.width) as f32, 0.0);
    seen_through(geometry, view, (corner + sample_3d(sample, pixel)).as_dvec3().truncate())
}

/// What a camera ray saw, as the device stores it.
pub fn surface_of(seen: &Seen) -> PixelSurface {
    PixelSurface {
        position: seen.hit.position.as_vec3(),
        side: seen.side,
        normal: seen.normal.as_vec3(),
        footprint: seen.footprint as f32,
    }
}

/// Surface at a sample of an edge pixel, on the plane of a side, without a ray.
pub fn surface_on(geometry: Geometry<'_>, view: &View, pixel: u32, number: u32, side: u32) -> PixelSurface {
    let corner = DVec2::new(f64::from(pixel % view.width), f64::from(pixel / view.width));
    seen_on(geometry, view, corner + place_in_pixel(number, pixel), side)
}

/// Surface behind an image point, on the plane of a side, without a ray.
pub fn seen_on(geometry: Geometry<'_>, view: &View, point: DVec2, side: u32) -> PixelSurface {
    let [p0, p1, p2] = geometry.triangles[side as usize / 2].positions.map(Vec3::as_dvec3);
    let across = (p1 - p0).cross(p2 - p0);
    let eye = view.position.as_dvec3();
    let direction = direction_through(view, point);
    let t = across.dot(p0 - eye) / across.dot(direction);
    let from_p0 = eye - p0 + t * direction;
    let [b1, b2] = [from_p0.cross(p2 - p0), (p1 - p0).cross(from_p0)]
        .map(|part| part.dot(across) / across.length_squared());
    let [n0, n1, n2] = geometry.triangles[side as usize / 2].normals.map(Vec3::as_dvec3);
    let normal = ((1.0 - b1 - b2) * n0 + b1 * n1 + b2 * n2).normalize();
    PixelSurface {
        position: (eye + t * direction).as_vec3(),
        side,
        normal: if side % 2 == 1 { -normal } else { normal }.as_vec3(),
        footprint: (f64::from(view.pixel_area) * t * t) as f32,
    }
}

/// A pixel and the eight around it, starting with the pixel itself, clamped to the image.
fn around(view: &View, pixel: u32) -> impl Iterator<Item = u32> {
    let [x, y] = [pixel % view.width, pixel / view.width].map(i64::from);
    let (width, height) = (i64::from(view.width), i64::from(view.height));
    [4, 5, 6, 7, 8, 0, 1, 2, 3].into_iter().map(move |step| {
        let across = (x + step % 3 - 1).clamp(0, width - 1);
        let down = (y + step / 3 - 1).clamp(0, height - 1);
        (down * width + across) as u32
    })
}

/// Cost of taking a pixel's surface for that of a sample; infinite if the pixel sees no surface.
pub fn dissimilarity(surfaces: &[Surface], found: &PixelSurface, pixel: &PixelSurface) -> f64 {
    if pixel.side == NO_SIDE {
        return f64::INFINITY;
    }
    let apart: DVec3 = pixel.position.as_dvec3() - found.position.as_dvec3();
    let (normal, footprint) = (found.normal.as_dvec3(), f64::from(found.footprint));
    let turned = 1.0 - normal.dot(pixel.normal.as_dvec3());
    let is_alike = facet(surfaces, found.side).dot(facet(surfaces, pixel.side)) >= FACETS_ALIKE;
    turned
        + apart.dot(normal).abs() / footprint.sqrt()
        + 1e-3 * apart.length_squared() / footprint
        + if is_alike { 0.0 } else { 1.0 }
}

/// The dissimilarity and the pixel whose indirect light a fragment takes: the first pixel that
/// is similar enough, of the pixel itself and the eight around it from the right one on, else
/// the least dissimilar.
pub fn source(
    surfaces: &[Surface],
    view: &View,
    pixels: &[PixelSurface],
    pixel: u32,
    found: &PixelSurface,
) -> (f64, u32) {
    let mut best = (f64::INFINITY, pixel);
    for other in around(view, pixel) {
        let cost = dissimilarity(surfaces, found, &pixels[other as usize]);
        if cost < best.0 {
            best = (cost, other);
        }
        if best.0 <= 0.01 {
            break;
        }
    }
    best
}

/// Cosine between shading and geometric normal below which a surface is curved.
const FLAT: f64 = 0.99999;

/// Whether all rays through a pixel meet the triangle of a side, by the pixel's corners.
fn fills_pixel(geometry: Geometry<'_>, view: &View, pixel: u32, side: u32) -> bool {
    let [p0, p1, p2] = geometry.triangles[side as usize / 2].positions.map(Vec3::as_dvec3);
    let across = (p1 - p0).cross(p2 - p0);
    let eye = view.position.as_dvec3();
    (0..4).all(|i| {
        let point = [pixel % view.width + (i & 1), pixel / view.width + (i >> 1)].map(f64::from);
        let direction = direction_through(view, point.into());
        let t = across.dot(p0 - eye) / across.dot(direction);
        let from_p0 = eye - p0 + t * direction;
        let weights = [from_p0.cross(p2 - p0), (p1 - p0).cross(from_p0)]
            .map(|part| part.dot(across) / across.length_squared());
        t > 0.0 && weights[0] >= 0.0 && weights[1] >= 0.0 && weights[0] + weights[1] <= 1.0
    })
}

/// Surface of a sample of a pixel at a shadow edge: the intersection of its ray with the plane of
/// the pixel's surface, or the centre if the ray grazes that plane. If the surface is curved or the
/// pixel shows several triangles, the sample traces its ray.
pub fn shadow_sample(
    geometry: Geometry<'_>,
    view: &View,
    pixel: u32,
    centre: &PixelSurface,
    number: u32,
) -> Option<PixelSurface> {
    let normal = geometry.normal(centre.side).as_dvec3();
    if centre.normal.as_dvec3().dot(normal) < FLAT || !fills_pixel(geometry, view, pixel, centre.side) {
        return sample(geometry, view, pixel, number).as_ref().map(surface_of);
    }
    let corner = Vec3::new((pixel % view.width) as f32, (pixel / view.width) as f32, 0.0);
    let direction = direction_through(view, (corner + sample_3d(number, pixel)).as_dvec3().truncate());
    let forward = view.forward.as_dvec3();
    let eye = view.position.as_dvec3();
    let to_centre = centre.position.as_dvec3() - eye;
    let depth = to_centre.dot(forward);
    let t = to_centre.dot(normal) / direction.dot(normal);
    let position =
        if (t - depth).abs() < 0.25 * depth { (eye + t * direction).as_vec3() } else { centre.position };
    Some(PixelSurface { position, ..*centre })
}

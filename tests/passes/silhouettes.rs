//! The map of silhouettes holds every edge at which a shadow may end, at least as near to the light
//! as it is.

use crate::common::{assert_silent, context};
use crate::world::{Random, World};
use glam::{DVec3, Vec3};
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::silhouettes::Silhouettes;
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::mesh_edges::Mesh;
use lightpaths::scene::{Light, LightKind, bvh::Bvh, silhouettes};
use lightpaths::types::{Node, SilhouetteEdge};

/// Texels of a face, and half of its width at distance 1; as in `glsl/include/silhouettes.glsl`.
const SIDE: f64 = 512.0;
const REACH: f64 = 1.0625;
/// The same of the face of a directional light.
const PARALLEL_SIDE: f64 = 1024.0;

/// The side of a light on which the triangle of an edge is. Zero if rounding decides.
fn side(edge: &SilhouetteEdge, corner: Vec3, to_edge: DVec3) -> f64 {
    let [along, across] = [edge.to, corner].map(|point| point.as_dvec3() - edge.from.as_dvec3());
    let normal = along.cross(across);
    let side = normal.dot(to_edge);
    if side.abs() <= 1e-4 * normal.length() * to_edge.length() { 0.0 } else { side }
}

/// Whether the edge is a silhouette beyond doubt.
fn is_silhouette(edge: &SilhouetteEdge, to_edge: DVec3) -> bool {
    side(edge, edge.first, to_edge) * side(edge, edge.second, to_edge) > 0.0
}

/// The texels of a point light's map that hold a point, and how near to the light it is.
fn of_point(position: DVec3, point: DVec3) -> Vec<(usize, f64)> {
    let apart = point - position;
    let seen = (0..6).filter_map(|face| {
        let axis = face / 2;
        let depth = apart[axis] * if face % 2 == 1 { -1.0 } else { 1.0 };
        let place = [1, 2].map(|k| (0.5 + 0.5 / REACH * apart[(axis + k) % 3] / depth) * SIDE);
        let is_inside = depth > 0.0 && place.iter().all(|x| (0.0..SIDE).contains(x));
        let texel = ((face as f64 * SIDE + place[1].floor()) * SIDE + place[0].floor()) as usize;
        is_inside.then_some((texel, 1.0 / depth))
    });
    seen.collect()
}

/// The same for a directional light; the root of the tree bounds the scene.
fn of_direction(axis: DVec3, root: &Node, point: DVec3) -> Vec<(usize, f64)> {
    let [x, y, z, _] = root.frame.w.to_le_bytes();
    let extent = 256.0 * DVec3::from([x, y, z].map(|byte| f64::from(f32::from_bits(u32::from(byte) << 23))));
    let radius = 1.01 * 0.5 * extent.length();
    let apart = point - (root.origin().as_dvec3() + 0.5 * extent);
    let across = axis.cross(if axis.x.abs() < 0.5 { DVec3::X } else { DVec3::Y }).normalize();
    let place =
        [across, axis.cross(across)].map(|side| (0.5 + 0.5 * side.dot(apart) / radius) * PARALLEL_SIDE);
    let texel = place[1].floor() * PARALLEL_SIDE + place[0].floor();
    vec![(texel as usize, 2.0 - (axis.dot(apart) + radius) / radius)]
}

#[test]
fn maps_hold_every_silhouette() {
    let mut world = World::room();
    let triangles = world.triangles.clone();
    let bvh = Bvh::build(&triangles).unwrap();
    let edges = silhouettes::edges(&bvh, &triangles, &Mesh::of(&triangles));
    world.buffers.silhouette_edges = Some(Buffer::from_slice(&context(), "edges", &edges).unwrap());
    let map = Silhouettes::maps(&context(), 6 << 20).unwrap();
    let pass = Silhouettes::new(&context()).unwrap();
    let root = world.buffers.nodes.read::<Node>().unwrap()[0];
    let mut random = Random::new(7);
    let mut checked = 0;
    for turn in 0..12 {
        let place = 0.8 * (Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5);
        let axis = place.normalize();
        let kind = match turn % 3 {
            0 => LightKind::Point { position: place, intensity: Vec3::ONE },
            1 => LightKind::Spot {
                position: place,
                direction: axis,
                intensity: Vec3::ONE,
                angle: 0.7,
                penumbra: 0.0,
            },
            _ => LightKind::Directional { direction: axis, irradiance: Vec3::ONE },
        };
        let sources = light_sources(&[Light::new("lamp", kind)]);
        let table = Buffer::from_slice(&context(), "lights", &sources).unwrap();
        let light = OneLight { silhouettes: Some(&map), ..OneLight::new(&table, 0, &sources[0]) };
        context().run(|rec| pass.record(&mut rec.pass("silhouettes"), &world.buffers, light)).unwrap();
        let found: Vec<f32> = map.read().unwrap();
        for edge in &edges {
            let is_parallel = turn % 3 == 2;
            let to_edge = if is_parallel { axis.as_dvec3() } else { (edge.from - place).as_dvec3() };
            if !is_silhouette(edge, to_edge) {
                continue;
            }
            for step in 0..=16 {
                let point = edge.from.as_dvec3().lerp(edge.to.as_dvec3(), f64::from(step) / 16.0);
                let texels = match is_parallel {
                    true => of_direction(axis.as_dvec3(), &root, point),
                    false => of_point(place.as_dvec3(), point),
                };
                assert!(!texels.is_empty());
                for (texel, near) in texels {
                    let drawn = f64::from(found[texel]);
                    assert!(drawn >= near * (1.0 - 1e-5), "turn {turn}, {edge:?}: {drawn} and {near}");
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 10_000, "{checked} points");
    assert_silent(&context());
}

//! Which clusters the cameras see.

use crate::common::{assert_silent, context};
use glam::Vec3;
use lightpaths::passes::SceneBuffers;
use lightpaths::passes::precompute::{concession::seen_from, rays::Rays};
use lightpaths::scene::{bvh::Bvh, grid, hvds::Hvds, shapes, surfaces};
use lightpaths::types::Surface;

#[test]
fn a_camera_sees_its_half_of_a_parted_room_and_nothing_else() {
    let context = context();
    let mut scene = shapes::thin_wall();
    let bvh = Bvh::build(&scene.triangles).unwrap();
    scene.reorder(&bvh.order);
    let surfaces: Vec<Surface> =
        scene.triangles.iter().map(|triangle| surfaces::surface(triangle, [true, false])).collect();
    let coordinates = &scene.texture_coordinates;
    let buffers =
        SceneBuffers::new(&context, &bvh, &scene.triangles, &surfaces, coordinates, &scene.materials)
            .unwrap();
    let (low, high) = scene.bounds();
    let hvds = Hvds::build(&scene.triangles, &surfaces, grid::grid(low, high, 16), 16);
    let places: Vec<Vec3> = scene.cameras.iter().map(|camera| camera.position).collect();
    let seen = seen_from(&places, (&Rays::new(&context).unwrap(), &buffers), &hvds, &surfaces).unwrap();
    let mut counts = [0; 2];
    for piece in &hvds.pieces {
        let middle = piece.corners.iter().sum::<Vec3>() / piece.corners.len() as f32;
        // The wall reaches beyond the room.
        let is_inside = middle.y.abs() < 0.45 && middle.z.abs() < 0.45 || middle.x.abs() > 0.1;
        if middle.x.abs() < 0.3 && middle.x.abs() > 0.001 || !is_inside {
            continue;
        }
        let is_right = middle.x > 0.0;
        assert_eq!(seen[piece.cluster as usize], is_right, "{middle}");
        counts[usize::from(is_right)] += 1;
    }
    assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    assert_silent(&context);
}

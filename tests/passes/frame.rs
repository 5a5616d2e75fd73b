//! The frame's recipe: its barriers are enough and none is too many.

use crate::common::{assert_silent, context};
use crate::world::textured;
use glam::Vec3;
use lightpaths::renderer::{Edit, Renderer, Silent};
use lightpaths::scene::{Quality, Scene, shapes};

#[test]
fn every_barrier_of_a_frame_is_needed() {
    let plain = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.6);
    for scene in [textured(plain.clone()), plain] {
        every_barrier_is_needed_in(scene);
    }
}

fn every_barrier_is_needed_in(mut scene: Scene) {
    let context = context();
    scene.quality =
        Quality { entry_points: 3_000, cache_points: 300, gather_rays: 64, cells: 8, ..Quality::DRAFT };
    scene.cameras[0].size = [33, 17];
    let mut renderer = Renderer::new(&context, scene, &mut Silent).unwrap();
    context.take_redundant_barriers();
    for edit in [Edit::Everything, Edit::Light, Edit::View, Edit::Material, Edit::Nothing] {
        let report = renderer.frame(edit).unwrap();
        assert_eq!(report.passes.is_empty(), edit == Edit::Nothing);
        assert_eq!(context.take_redundant_barriers(), [""; 0], "{edit:?}");
        assert!(report.passes.iter().all(|pass| !pass.overlapped), "{edit:?}");
    }
    assert_silent(&context);
}

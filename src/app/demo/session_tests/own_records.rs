//! Own records come while the session rests.

use std::sync::Arc;

use glam::Vec3;

use super::{context, folder, open, settle};
use crate::app::demo::session::Session;
use crate::gpu::Context;
use crate::renderer::{Renderer, Silent};
use crate::scene::Scene;

/// Does idle work, `most` parts of it at most, and returns their number.
fn rest(session: &mut Session, most: usize) -> usize {
    let mut parts = 0;
    while parts < most && session.is_behind() {
        parts += 1;
        if let Some(commands) = session.idle_work().unwrap() {
            session.check(&commands.submit().unwrap()).unwrap();
        }
        session.end_frames(0).unwrap();
    }
    parts
}

/// The picture of the session's document and camera, from a new renderer.
fn cold_start(context: &Arc<Context>, session: &Session, is_refined: bool) -> Vec<[u8; 4]> {
    let lights = session.document.lights.iter().map(|entry| entry.light.clone()).collect();
    let scene = Scene { lights, cameras: vec![session.camera.clone()], ..session.scene.clone() };
    let mut renderer = Renderer::new(context, scene, &mut Silent).unwrap();
    renderer.frame().unwrap();
    if is_refined {
        assert!(renderer.refine().unwrap() > 0);
        renderer.frame().unwrap();
    }
    renderer.display().unwrap()
}

fn shown(session: &Session) -> Vec<[u8; 4]> {
    session.renderer().unwrap().display().unwrap()
}

#[test]
fn at_rest_the_view_gets_its_own_records() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |scene| {
        scene.cameras[0].size = [96, 96];
        (scene.quality.cache_points, scene.quality.gather_rays) = (2500, 576);
        scene.quality.record_error = 0.01;
        scene.draft = scene.quality.clone();
    });
    settle(&mut session);
    let (plain, version) = (shown(&session), session.version);
    assert!(plain == cold_start(&context, &session, false));
    // The frame that the last one left, test light, places, rays in parts, the picture, and the
    // frame that it leaves.
    let parts = rest(&mut session, usize::MAX);
    assert!(parts > 6, "{parts}");
    assert_eq!(session.version, version + 1);
    let refined = shown(&session);
    assert!(refined != plain && refined == cold_start(&context, &session, true));

    // They stay while lights change.
    let lamp = &mut session.document.lights[0].light;
    lamp.kind = lamp.kind.moved_to(Vec3::new(-0.4, 0.3, 0.2));
    settle(&mut session);
    let lit = cold_start(&context, &session, true);
    assert!(shown(&session) == lit);
    let version = session.version;
    rest(&mut session, usize::MAX);
    assert!(session.version == version && shown(&session) == lit);

    // A view that changes before all are traced begins again, and so does one after that.
    for parts in [3, usize::MAX] {
        session.camera.position.x += 0.1;
        settle(&mut session);
        assert!(shown(&session) == cold_start(&context, &session, false), "moved");
        rest(&mut session, parts);
    }
    assert!(shown(&session) == cold_start(&context, &session, true), "moved and at rest");

    // A light that moves while they are traced.
    session.camera.position.x -= 0.05;
    settle(&mut session);
    rest(&mut session, 4);
    let lamp = &mut session.document.lights[0].light;
    lamp.kind = lamp.kind.moved_to(Vec3::new(0.3, 0.2, -0.1));
    settle(&mut session);
    assert!(shown(&session) == cold_start(&context, &session, false), "lit in between");
    rest(&mut session, usize::MAX);
    assert!(shown(&session) == cold_start(&context, &session, true), "lit in between and at rest");
}

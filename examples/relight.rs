//! The library: loads a scene, moves a light in the coordinates of the scene file, renders, and
//! reads pixels and what a light meter shows.
//!
//!     cargo run --release --example relight

use glam::{DVec3, Vec3};
use lightpaths::gpu::{Context, ContextOptions};
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::meter::{Meter, MeterShape};
use lightpaths::scene::photometry::lux;
use lightpaths::scene::{LoadOptions, Scene};

fn main() -> lightpaths::Result<()> {
    let options = LoadOptions {
        preset: Some("draft".to_owned()),
        size: Some([128, 128]),
        set: vec!["camera.fov_y=45".to_owned()],
        ..LoadOptions::default()
    };
    let mut scene = Scene::load("box", &options)?;
    // A scene is recentred when it is loaded. `origin` leads from the file's coordinates to it.
    let origin = scene.origin;
    let place = move |file: DVec3| (file - origin).as_vec3();
    scene.meters.push(Meter {
        name: "floor".to_owned(),
        shape: MeterShape::Point { position: place(DVec3::new(0.5, 0.01, 0.5)), normal: Vec3::Y },
    });

    let context = Context::new(&ContextOptions::default())?;
    // Light paths are traced here, before any light is known.
    let mut renderer = Renderer::new(&context, scene, &mut Silent)?;
    for step in 0..4 {
        let to = DVec3::new(-0.6 + 0.4 * f64::from(step), 1.7, 0.2);
        renderer.move_light(0, place(to))?;
        // Each frame is the converged picture.
        let frame = renderer.frame()?;
        let pixels: Vec<[f32; 3]> = renderer.layer(Layer::Beauty)?;
        let mean = pixels.iter().map(|[_, green, _]| f64::from(*green)).sum::<f64>() / pixels.len() as f64;
        let meter = renderer.measured()?[0];
        println!(
            "lamp at {to:.2}: {:.0} ms, mean radiance {mean:.4} W/m²/sr, floor {:.0} lx",
            frame.frame_ms,
            lux(meter.irradiance())
        );
    }
    Ok(())
}

#[test]
fn the_example_runs() {
    main().unwrap();
}

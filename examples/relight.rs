//! The library: loads a scene, moves a light in the coordinates of the scene file, renders, and
//! reads pixels and what a light meter shows.
//!
//!     cargo run --release --example relight

use lightpaths::glam::{DVec3, Vec3};
use lightpaths::{
    Context, ContextOptions, Layer, LoadOptions, Meter, MeterShape, Renderer, Scene, Silent, lux,
};

fn main() -> lightpaths::Result<()> {
    let options = LoadOptions {
        preset: Some("draft".to_owned()),
        size: Some([128, 128]),
        set: vec!["camera.fov_y=45".to_owned()],
        ..LoadOptions::default()
    };
    let mut scene = Scene::load("box", &options)?;
    let lamp = scene.light_named("lamp")?;
    // A scene is recentred when it is loaded.
    let position = scene.recentred(DVec3::new(0.5, 0.01, 0.5));
    scene
        .meters
        .push(Meter { name: "floor".to_owned(), shape: MeterShape::Point { position, normal: Vec3::Y } });

    let context = Context::new(&ContextOptions::default())?;
    // Light paths are traced here, before any light is known.
    let mut renderer = Renderer::new(&context, scene, &mut Silent)?;
    for step in 0..4 {
        let to = DVec3::new(-0.6 + 0.4 * f64::from(step), 1.7, 0.2);
        renderer.move_light(lamp, renderer.scene().recentred(to))?;
        // Each frame is the converged picture.
        let frame = renderer.frame()?;
        let pixels: Vec<[f32; 3]> = renderer.layer(Layer::Beauty)?;
        let mean = pixels.iter().map(|[_, green, _]| f64::from(*green)).sum::<f64>() / pixels.len() as f64;
        let positions = renderer.positions_in_file()?;
        let meter = renderer.measured()?[0];
        println!(
            "lamp at {to:.2}: {:.0} ms, mean radiance {mean:.4} W/m²/sr, floor {:.0} lx, middle at {:.2?} m",
            frame.frame_ms,
            lux(meter.irradiance()),
            positions[positions.len() / 2 + 64],
        );
    }
    Ok(())
}

#[test]
fn the_example_runs() {
    main().unwrap();
}

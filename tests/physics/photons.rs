//! The photon mapper against closed forms.

use crate::common::{assert_silent, context};
use glam::Vec3;
use lightpaths::reference::{PhotonMapper, Picture};
use lightpaths::renderer::Silent;
use lightpaths::scene::{Scene, shapes};

fn mapper(mut scene: Scene, size: [u32; 2]) -> PhotonMapper {
    scene.cameras[0].size = size;
    PhotonMapper::new(&context(), scene, &mut Silent).unwrap()
}

/// Mean and RMS over all pixels and channels of the relative error against one expected radiance.
fn errors(layer: &[[f32; 3]], expected: f64) -> [f64; 2] {
    let errors: Vec<f64> = layer.iter().flatten().map(|value| f64::from(*value) / expected - 1.0).collect();
    let mean = |of: &dyn Fn(f64) -> f64| errors.iter().map(|e| of(*e)).sum::<f64>() / errors.len() as f64;
    [mean(&|e| e), mean(&|e| e * e).sqrt()]
}

#[test]
fn sphere() {
    for albedo in [0.5_f32, 0.9, 0.99] {
        let scene = shapes::integrating_sphere(1.5, 4, albedo, Vec3::new(0.3, 0.2, 0.1), 10.0);
        let area = scene.area_m2();
        let mut mapper = mapper(scene, [32, 32]);
        mapper.add_samples(32).unwrap();
        let rho = f64::from(albedo);
        let expected = 10.0 / area * rho / (1.0 - rho) * rho / std::f64::consts::PI;
        let picture: Picture = mapper.picture().unwrap();
        let [mean, rms] = errors(&picture.indirect, expected);
        println!(
            "albedo {albedo}: mean {:+.3} %, rms {:.3} %, {} paths, {} maps, r {}, {} ms",
            100.0 * mean,
            100.0 * rms,
            mapper.paths_a_map(),
            mapper.maps(),
            mapper.radius(),
            mapper.device_ms()
        );
    }
    assert_silent(&context());
}

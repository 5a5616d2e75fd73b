//! The path tracer, sample by sample.

use crate::common::assert_silent;
use crate::world::{World, textured};
use glam::{DVec3, Vec3};
use lightpaths::cpu::lit_scene::LitScene;
use lightpaths::cpu::path_trace::{Paths, Sample};
use lightpaths::gpu::Buffer;
use lightpaths::passes::reference::path_trace::{
    Accumulators, Job, PathTrace, ROULETTE_THRESHOLD, RadianceSum, SampleMoments,
};
use lightpaths::passes::{self, light_sources, reflectances};
use lightpaths::scene::{Camera, Light, LightKind, Scene};
use lightpaths::types::View;

const SIZE: [u32; 2] = [11, 9];
const SEED: u32 = 77;

/// One light of each kind.
pub(crate) fn lights() -> Vec<Light> {
    let position = Vec3::new(0.1, 0.6, -0.2);
    let direction = Vec3::new(0.6, -0.8, 0.0);
    let kinds = [
        LightKind::Point { position, intensity: Vec3::new(1.0, 2.0, 3.0) },
        LightKind::Spot { position, direction, intensity: Vec3::splat(4.0), angle: 0.7, penumbra: 0.4 },
        LightKind::Area {
            corner: Vec3::new(-0.3, 0.7, -0.3),
            edge_u: Vec3::new(0.5, 0.0, 0.1),
            edge_v: Vec3::new(0.0, 0.05, 0.4),
            radiance: Vec3::new(3.0, 2.0, 1.0),
            samples: 10,
        },
        LightKind::Directional { direction, irradiance: Vec3::ONE },
    ];
    kinds.map(|kind| Light::new(kind.word(), kind)).to_vec()
}

/// The room with glossy walls and without its ceiling, so that directional light comes in.
fn scene() -> Scene {
    let mut scene = crate::world::room();
    scene.triangles.retain(|triangle| triangle.positions.iter().any(|p| p.y < 0.7));
    for (material, exponent) in scene.materials.iter_mut().zip([1.0, 30.0, 2000.0]) {
        (material.diffuse, material.specular, material.exponent) =
            (0.5 * material.diffuse, Vec3::splat(0.4), exponent);
    }
    scene
}

pub(crate) fn world() -> World {
    World::new(&scene(), 8)
}

/// Without images and with them.
pub(crate) fn worlds() -> [World; 2] {
    [world(), World::new(&textured(scene()), 8)]
}

pub(crate) fn view() -> View {
    let position = Vec3::new(0.1, 0.05, 0.48);
    let name = "camera".to_owned();
    let target = Vec3::new(-0.1, -0.2, 0.0);
    View::from(&Camera { name, position, target, up: Vec3::Y, fov_y_degrees: 95.0, size: SIZE })
}

#[test]
fn samples_equal_the_reference() {
    for world in worlds() {
        samples_equal_the_reference_in(&world);
    }
}

fn samples_equal_the_reference_in(world: &World) {
    let (view, lights) = (view(), light_sources(&lights()));
    let materials = reflectances(&world.materials);
    let paths = Paths {
        scene: LitScene { geometry: world.geometry(), materials: &materials, lights: &lights },
        view,
        seed: SEED,
        roulette_threshold: f64::from(ROULETTE_THRESHOLD),
    };
    let buffer = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let pass = PathTrace::new(&world.context, &world.buffers, &view).unwrap();
    let pixels = SIZE[0] * SIZE[1];
    for light_count in [4, 0, 1] {
        let scene = LitScene { lights: &lights[..light_count as usize], ..paths.scene };
        let paths = Paths { scene, ..paths };
        let sums = Accumulators::new(&world.context, pixels).unwrap();
        // In several runs, and tile by tile.
        for samples in [0..1, 1..3, 3..11] {
            for tile in 0..PathTrace::tiles(&view) {
                let job = Job {
                    scene: passes::LitScene { buffers: &world.buffers, lights: &buffer, light_count },
                    view: &view,
                    seed: SEED,
                    sums: &sums,
                };
                pass.run(job, tile..tile + 1, samples.clone(), None).unwrap();
            }
        }
        let direct: Vec<RadianceSum> = sums.direct.read().unwrap();
        let indirect: Vec<RadianceSum> = sums.indirect.read().unwrap();
        let moments: Vec<SampleMoments> = sums.moments.read().unwrap();
        let (mut differ, mut bright) = (0, 0);
        for index in 0..pixels {
            let reference: Vec<Sample> =
                (0..11).map(|n| paths.sample(index % SIZE[0], index / SIZE[0], n)).collect();
            let total = |samples: &[Sample]| samples.iter().map(|s| s.direct + s.indirect).sum::<DVec3>();
            let mean = total(&reference) / 11.0;
            let apart = reference.iter().map(|sample| sample.direct + sample.indirect - mean);
            let squares: DVec3 = apart.map(|apart| apart * apart).sum();
            let place = index as usize;
            let found = [direct[place].value(), indirect[place].value()];
            let expected = [
                reference.iter().map(|s| s.direct).sum(),
                reference.iter().map(|s| s.indirect).sum::<DVec3>(),
            ];
            let scale = total(&reference).max_element().max(1e-3);
            let error =
                found.iter().zip(expected).map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f64::max);
            let error_of_squares = (moments[place].squares.as_dvec3() - squares).abs().max_element();
            let rays: u32 = reference.iter().map(|sample| sample.rays).sum();
            let is_same = error <= 1e-3 * scale
                && error_of_squares <= 1e-3 * scale * scale
                && moments[place].rays == rays;
            differ += u32::from(!is_same);
            bright += u32::from(scale > 0.1);
        }
        // A path that grazes an edge may take another way, and a pixel depends on eleven paths of
        // some ten rays each.
        println!("{differ} of {pixels} pixels differ, {bright} are bright");
        assert!(differ * 50 <= pixels, "{light_count} lights: {differ} of {pixels} pixels differ");
        assert!(light_count == 0 || bright * 2 > pixels, "{bright}");
    }
    assert_silent(&world.context);
}

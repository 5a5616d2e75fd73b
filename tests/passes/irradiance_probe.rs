//! Path-traced irradiance at cache points.

use crate::common::assert_silent;
use crate::path_trace;
use crate::world::{Random, World};
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::cpu::irradiance_probe::Probe;
use lightpaths::cpu::lit_scene::LitScene;
use lightpaths::cpu::path_trace::Paths;
use lightpaths::gpu::Buffer;
use lightpaths::passes::precompute::gather_rays::Hemisphere;
use lightpaths::passes::reference::irradiance_probe::{self, Job};
use lightpaths::passes::reference::path_trace::ROULETTE_THRESHOLD;
use lightpaths::passes::{self, light_sources, reflectances};

const SEED: u32 = 78;

#[test]
fn irradiance_equals_the_reference() {
    for world in path_trace::worlds() {
        irradiance_equals_the_reference_in(&world);
    }
}

fn irradiance_equals_the_reference_in(world: &World) {
    let lights = light_sources(&path_trace::lights());
    let materials = reflectances(&world.materials);
    let lights_buffer = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let mut random = Random::new(43);
    let (mut differ, mut bright, mut all) = (0, 0, 0);
    for (rings, count, samples, gather_seed, light_count) in [
        (1, 1, 1, None, 4),
        (1, 131, 3, Some(9), 4),
        (4, 3, 2, None, 1),
        (4, 3, 2, Some(9), 1),
        (2, 17, 5, None, 4),
        (2, 5, 1, None, 0),
    ] {
        let points = world.cache_points(&mut random, count, 0.1);
        let cache_points = Buffer::from_slice(&world.context, "cache points", &points).unwrap();
        let sectors = 4 * rings;
        let job = Job {
            scene: passes::LitScene { buffers: &world.buffers, lights: &lights_buffer, light_count },
            sky: None,
            cache_points: &cache_points,
            point_count: count as u32,
            hemisphere: Hemisphere { rings, sectors },
            gather_seed,
            seed: SEED,
            samples,
        };
        let found = irradiance_probe::trace(&world.context, job).unwrap();
        assert_eq!(found.len(), count);
        let paths = Paths {
            scene: LitScene {
                geometry: world.geometry(),
                materials: &materials,
                lights: &lights[..light_count as usize],
            },
            view: path_trace::view(),
            seed: SEED,
            roulette_threshold: f64::from(ROULETTE_THRESHOLD),
        };
        let probe = Probe { paths, strata: Strata { rings, sectors }, gather_seed };
        for ((index, point), found) in (0..).zip(&points).zip(found) {
            let reference = probe.irradiance(point, index, samples);
            let scale = reference.max_element().max(1e-3);
            differ += u32::from((found.as_dvec3() - reference).abs().max_element() > 1e-3 * scale);
            bright += u32::from(scale > 0.1);
            all += u32::from(light_count > 0);
        }
    }
    // A path that grazes an edge may take another way, and a point depends on up to thirty-two
    // paths of some ten rays each.
    println!("{differ} of {all} points differ, {bright} are bright");
    assert!(differ * 30 <= all, "{differ} of {all} points differ");
    assert!(bright * 2 > all, "{bright} of {all} are bright");
    assert_silent(&world.context);
}

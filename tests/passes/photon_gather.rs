//! Final gathering at the pixels.

use crate::common::assert_silent;
use crate::path_trace::{lights, view, worlds};
use crate::photons::{cells, grid, map_of, points_of};
use crate::world::{Random, World};
use glam::{DVec3, Vec3};
use lightpaths::cpu::lit_scene::LitScene;
use lightpaths::cpu::photon_gather::{Gather, IrradiancePoint};
use lightpaths::gpu::Buffer;
use lightpaths::passes::reference::photon_gather::{GatherSums, Irradiance, PhotonGather, Sequence};
use lightpaths::passes::reference::photon_map::Photon;
use lightpaths::passes::{self, light_sources, reflectances};

const SEED: u32 = 33;

#[test]
fn samples_equal_the_reference() {
    for world in worlds() {
        samples_equal_the_reference_in(&world);
    }
}

fn samples_equal_the_reference_in(world: &World) {
    let (view, sources) = (view(), light_sources(&lights()));
    let materials = reflectances(&world.materials);
    let buffer = Buffer::from_slice(&world.context, "lights", &sources).unwrap();
    let mut random = Random::new(95);
    // Many points, few, and none.
    for point_count in [2_000, 60, 0] {
        let photons: Vec<Photon> = (0..point_count)
            .map(|_| {
                let (position, _, side) = world.surface_point(&mut random);
                Photon { position, side, flux: Vec3::ONE }
            })
            .collect();
        let map = map_of(world, &photons);
        let (points, reaches) = points_of(world, &map, photons.len());
        let irradiances: Vec<Vec3> = points.iter().map(|_| Vec3::ONE + random.cube()).collect();
        let listed: Vec<IrradiancePoint> = points
            .iter()
            .zip(reaches.read::<[u8; 16]>().unwrap())
            .zip(&irradiances)
            .map(|((&surface, reach), irradiance)| IrradiancePoint {
                surface,
                reach,
                irradiance: irradiance.as_dvec3(),
            })
            .collect();
        let radius = grid().inverse_cell.recip();
        let gather = Gather {
            scene: LitScene { geometry: world.geometry(), materials: &materials, lights: &sources },
            points: &listed,
            cells: cells(),
            radius: f64::from(radius),
            view,
            seed: SEED,
        };
        let irradiances = Buffer::from_slice(&world.context, "irradiances", &irradiances).unwrap();
        let irradiance = Irradiance {
            points: &map.entries,
            entry_offsets: &map.entry_offsets,
            reaches: &reaches,
            irradiances: &irradiances,
            grid: grid(),
            radius,
        };
        let pixels = view.width * view.height;
        let mut pass = PhotonGather::new(&world.context, &world.buffers).unwrap();
        let sequence = Sequence::new(&world.context, pixels, SEED).unwrap();
        for samples in [0..1, 1..5] {
            let light_count = sources.len() as u32;
            let scene = passes::LitScene { buffers: &world.buffers, lights: &buffer, light_count };
            pass.gather(scene, &view, irradiance, &sequence, samples, &mut 0.0).unwrap();
        }
        let sums: Vec<GatherSums> = sequence.sums.read().unwrap();
        let (mut differ, mut bright) = (0, 0);
        for (pixel, sums) in (0..pixels).zip(sums) {
            let samples: Vec<[DVec3; 2]> = (0..5).map(|ray| gather.sample(pixel, ray)).collect();
            let reference = [0, 1].map(|layer| samples.iter().map(|sample| sample[layer]).sum::<DVec3>());
            let scale = (reference[0] + reference[1]).max_element().max(1e-3);
            let errors = sums.values().into_iter().zip(reference).map(|(a, b)| (a - b).abs().max_element());
            differ += u32::from(errors.fold(0.0, f64::max) > 1e-3 * scale);
            bright += u32::from(reference[1].max_element() > 0.05);
        }
        println!("{point_count} points: {differ} of {pixels} pixels differ, {bright} are bright");
        // Rays near an edge, and equally near points.
        assert!(differ * 20 <= pixels, "{point_count} points: {differ} of {pixels} pixels differ");
        assert!(bright * 2 > pixels, "{bright}");
    }
    assert_silent(&world.context);
}

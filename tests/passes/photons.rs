//! Photon tracing, the photon map, and the density estimate.

use crate::common::assert_silent;
use crate::path_trace::{lights, world, worlds};
use crate::world::{Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::lit_scene::LitScene;
use lightpaths::cpu::photon_trace::Photons;
use lightpaths::cpu::photons::{Cells, SurfacePoint, kernel, sector, sector_direction};
use lightpaths::gpu::Buffer;
use lightpaths::passes::reference::photon_irradiance::{MAX_PHOTONS, PhotonIrradiance, Points};
use lightpaths::passes::reference::photon_map::{Photon, PhotonGrid, PhotonMap};
use lightpaths::passes::reference::photon_reach;
use lightpaths::passes::reference::photon_trace::{self, BoundingSphere, MAX_SURVIVAL, PhotonTrace, STEPS};
use lightpaths::passes::{self, light_sources, reflectances};
use lightpaths::types::NO_SIDE;

const SEED: u32 = 91;
const SPHERE: BoundingSphere = BoundingSphere { centre: Vec3::new(0.0, -0.05, 0.0), radius: 1.4 };
const RADIUS: f32 = 0.11;

pub(crate) fn grid() -> PhotonGrid {
    PhotonGrid { low: Vec3::new(-1.11, -0.86, -0.61), inverse_cell: RADIUS.recip() }
}

pub(crate) fn cells() -> Cells {
    Cells { low: grid().low, inverse_cell: grid().inverse_cell }
}

/// Photons on random sides with flux; every fifth slot is empty.
fn slots(world: &World, random: &mut Random, count: u32) -> Vec<Photon> {
    let slot = |index| {
        let (position, _, side) = world.surface_point(random);
        let flux = Vec3::ONE + random.cube();
        Photon { position, side: if index % 5 == 4 { NO_SIDE } else { side }, flux }
    };
    (0..count).map(slot).collect()
}

pub(crate) fn map_of(world: &World, photons: &[Photon]) -> PhotonMap {
    let map = PhotonMap::new(&world.context, photons.len() as u32).unwrap();
    map.slots.write(photons).unwrap();
    map.build(&world.context, &world.buffers, grid(), photons.len() as u32).unwrap();
    map
}

/// Points of a map in its order, and their reaches.
pub(crate) fn points_of(world: &World, map: &PhotonMap, count: usize) -> (Vec<SurfacePoint>, Buffer) {
    let entries: Vec<[Vec3; 3]> = map.entries.read_range(0, count).unwrap();
    let mut ms = 0.0;
    let reaches =
        photon_reach::trace(&world.context, &world.buffers, &map.entries, count as u32, RADIUS, &mut ms)
            .unwrap();
    (entries.iter().map(|&[position, normal, _]| SurfacePoint { position, normal }).collect(), reaches)
}

#[test]
fn photons_equal_the_reference() {
    for world in worlds() {
        photons_equal_the_reference_in(&world);
    }
}

fn photons_equal_the_reference_in(world: &World) {
    let sources = light_sources(&lights());
    let materials = reflectances(&world.materials);
    let photons = Photons {
        scene: LitScene { geometry: world.geometry(), materials: &materials, lights: &sources },
        scene_centre: SPHERE.centre,
        scene_radius: SPHERE.radius,
        seed: SEED,
        max_survival: f64::from(MAX_SURVIVAL),
    };
    let buffer = Buffer::from_slice(&world.context, "lights", &sources).unwrap();
    let scene = passes::LitScene { buffers: &world.buffers, lights: &buffer, light_count: 4 };
    for rays in [[0, 0, 0, 0], [1, 0, 0, 0], [63, 1, 0, 0], [500, 301, 199, 300]] {
        let first_rays = [5, 0, u32::MAX - 3, 70];
        let count: u32 = rays.iter().sum();
        let map = PhotonMap::new(&world.context, (count * 40).max(STEPS)).unwrap();
        let mut trace = PhotonTrace::new(&world.context, &world.buffers, count, SPHERE).unwrap();
        let paths = photon_trace::start(&rays, &first_rays);
        let mut ms = 0.0;
        let used = trace.trace(scene, paths.clone(), SEED, &map, &mut ms).unwrap().unwrap();
        let slots: Vec<Photon> = map.slots.read_range(0, used as usize).unwrap();

        // Round by round, in the order of live paths in the list.
        let mut live: Vec<_> = paths
            .iter()
            .map(|path| (photons.start(path.light, path.ray, f64::from(rays[path.light as usize])), true))
            .collect();
        let (mut first, mut parted, mut stored) = (0, 0, 0);
        while first < slots.len() {
            let mut survivors = Vec::new();
            for (row, (mut path, mut is_same)) in slots[first..].chunks(STEPS as usize).zip(live.clone()) {
                let mut goes_on = true;
                for slot in row {
                    let arrival = if goes_on {
                        let (arrival, on) = photons.step(&mut path);
                        goes_on = on;
                        arrival
                    } else {
                        None
                    };
                    stored += u32::from(slot.side != NO_SIDE);
                    let side = arrival.map_or(NO_SIDE, |arrival| arrival.side);
                    is_same &= side == slot.side;
                    if let Some(arrival) = arrival.filter(|_| is_same && side != NO_SIDE) {
                        is_same &= (arrival.position - slot.position).length() < 2e-4
                            && (arrival.flux - slot.flux.as_dvec3()).abs().max_element()
                                <= 1e-4 * arrival.flux.max_element();
                    }
                }
                parted += u32::from(!is_same);
                if goes_on {
                    survivors.push((path, true));
                }
            }
            first += live.len() * STEPS as usize;
            live = survivors;
            // If a path continues only on the device or only in the reference, all others are
            // out of step.
            if parted > 0 {
                break;
            }
        }
        println!("{parted} of {count} paths part, {stored} photons");
        assert!(parted * 50 <= count, "{parted} of {count} paths part from the reference");
        assert!(count < 1_000 || stored > count, "{stored} photons");
    }
    assert_silent(&world.context);
}

#[test]
fn a_full_map_is_told() {
    let world = world();
    let sources = light_sources(&lights());
    let buffer = Buffer::from_slice(&world.context, "lights", &sources).unwrap();
    let map = PhotonMap::new(&world.context, 100 * STEPS).unwrap();
    let mut trace = PhotonTrace::new(&world.context, &world.buffers, 101, SPHERE).unwrap();
    let scene = passes::LitScene { buffers: &world.buffers, lights: &buffer, light_count: 4 };
    let mut slots = |rays| {
        let paths = photon_trace::start(&[rays, 0, 0, 0], &[0; 4]);
        trace.trace(scene, paths, SEED, &map, &mut 0.0).unwrap()
    };
    assert_eq!([slots(101), slots(100)], [None; 2]);
    assert!(slots(10).is_some_and(|slots| (10 * STEPS..100 * STEPS).contains(&slots)));
}

#[test]
fn maps_equal_the_reference() {
    let world = world();
    let mut random = Random::new(92);
    for count in [0, 1, 63, 64, 65, 255, 256, 257, 4_999] {
        let slots = slots(&world, &mut random, count);
        let map = map_of(&world, &slots);
        let filled: Vec<Option<Vec3>> =
            slots.iter().map(|slot| (slot.side != NO_SIDE).then_some(slot.position)).collect();
        let (order, entry_offsets) = cpu::photon_map::photon_map(cells(), &filled);
        let found: Vec<u32> = map.entry_offsets.read().unwrap();
        assert!(found == entry_offsets, "{count} slots");
        let entries: Vec<[Vec3; 3]> = map.entries.read_range(0, order.len()).unwrap();
        for ([position, normal, flux], slot) in entries.into_iter().zip(order) {
            let photon = slots[slot as usize];
            assert_eq!([position, flux], [photon.position, photon.flux]);
            assert_eq!(normal, world.geometry().normal(photon.side));
        }
    }
    assert_silent(&world.context);
}

#[test]
fn reaches_equal_the_reference() {
    let world = world();
    let mut random = Random::new(93);
    let count = 499;
    let mut photons = slots(&world, &mut random, count);
    photons.retain(|photon| photon.side != NO_SIDE);
    let map = map_of(&world, &photons);
    let (points, reaches) = points_of(&world, &map, photons.len());
    let reaches: Vec<[u8; 16]> = reaches.read().unwrap();
    let (mut differ, mut walls) = (0, 0);
    for (point, reach) in points.iter().zip(reaches) {
        let reference = cpu::photon_reach::photon_reach(world.geometry(), *point, RADIUS);
        for (steps, exact) in reach.into_iter().zip(reference) {
            let is_same = match exact {
                None => steps == u8::MAX,
                Some(exact) => {
                    steps < u8::MAX && f64::from(steps) - 0.05 <= exact && exact < f64::from(steps) + 1.05
                }
            };
            differ += usize::from(!is_same);
            walls += usize::from(exact.is_some());
        }
    }
    // Rays near an edge.
    assert!(differ * 200 <= 16 * points.len(), "{differ} of {} sectors differ", 16 * points.len());
    assert!(walls > 100, "{walls} walls");
    for number in 0..16 {
        assert_eq!(sector(sector_direction(number)), number);
    }
    assert_silent(&world.context);
}

#[test]
fn irradiances_equal_the_reference() {
    let world = world();
    let mut random = Random::new(94);
    for (point_count, photon_count) in [(0, 5), (1, 0), (63, 4_999), (65, 9_001)] {
        let mut photons = slots(&world, &mut random, point_count);
        photons.iter_mut().for_each(|photon| photon.side %= 100);
        let points_map = map_of(&world, &photons);
        let (points, reaches) = points_of(&world, &points_map, photons.len());
        let photons = slots(&world, &mut random, photon_count);
        let map = map_of(&world, &photons);
        let masses: Vec<Vec3> = (0..point_count)
            .map(|index| Vec3::splat((index % 7) as f32) * (1.0 + 0.1 * random.cube()))
            .collect();
        let upload = |values: &[Vec3]| Buffer::from_slice(&world.context, "masses", values).unwrap();
        let irradiances = upload(&masses);
        PhotonIrradiance::new(&world.context)
            .unwrap()
            .estimate(
                Points { entries: &points_map.entries, reaches: &reaches, count: point_count },
                &map,
                grid(),
                RADIUS,
                &upload(&masses),
                &irradiances,
                &mut 0.0,
            )
            .unwrap();
        let listed: Vec<(SurfacePoint, DVec3)> = photons
            .iter()
            .filter(|photon| photon.side != NO_SIDE)
            .map(|photon| {
                let normal = world.geometry().normal(photon.side);
                (SurfacePoint { position: photon.position, normal }, photon.flux.as_dvec3())
            })
            .collect();
        let (reaches, irradiances): (Vec<[u8; 16]>, Vec<Vec3>) =
            (reaches.read().unwrap(), irradiances.read().unwrap());
        let radius = f64::from(RADIUS);
        let mut bright = 0;
        for (index, point) in points.iter().enumerate() {
            let mass = masses[index].as_dvec3();
            let reference =
                cpu::photon_irradiance::photon_irradiance(*point, reaches[index], &listed, mass, radius);
            // Photons on a border of the kernel's support may count or not: the kernel is
            // continuous at its rim, and random photons are not on the rims of sectors and planes.
            assert_near(irradiances[index], reference, SUM, 1.0, "irradiance");
            bright += usize::from(reference.max_element() > 0.0);
        }
        assert!(photon_count < 1_000 || bright * 3 > points.len(), "{bright} of {} points", points.len());
    }
    crowded_buckets_are_thinned(&world);
    let point = SurfacePoint { position: Vec3::ZERO, normal: Vec3::Z };
    let at = |position, normal| kernel(point, SurfacePoint { position, normal }, 2.0);
    assert_eq!(at(Vec3::X, Vec3::Z), 0.75);
    assert_eq!(
        [at(Vec3::X, Vec3::NEG_Z), at(Vec3::new(1.0, 0.0, 0.3), Vec3::Z), at(2.0 * Vec3::Y, Vec3::Z)],
        [0.0; 3]
    );
    assert_silent(&world.context);
}

/// More photons in a spot than an estimate reads: it reads a fraction of them, which
/// stands for all.
fn crowded_buckets_are_thinned(world: &World) {
    let mut random = Random::new(96);
    let (position, _, side) = world.surface_point(&mut random);
    let map_at = |count: u32| {
        let photons: Vec<Photon> = (0..count)
            .map(|index| Photon { position, side, flux: Vec3::splat((index % 7) as f32) })
            .collect();
        map_of(world, &photons)
    };
    let points_map = map_at(100);
    let (_, reaches) = points_of(world, &points_map, 100);
    let points = Points { entries: &points_map.entries, reaches: &reaches, count: 100 };
    for count in [1_000, 1_024, 1_025, 9_990] {
        let map = map_at(count);
        let masses = Buffer::from_slice(&world.context, "masses", &[Vec3::ONE; 100]).unwrap();
        let irradiances = Buffer::from_slice(&world.context, "irradiances", &[Vec3::ZERO; 100]).unwrap();
        PhotonIrradiance::new(&world.context)
            .unwrap()
            .estimate(points, &map, grid(), RADIUS, &masses, &irradiances, &mut 0.0)
            .unwrap();
        let sums: Vec<Vec3> = irradiances.read().unwrap();
        let exact: f32 = (0..count).map(|index| (index % 7) as f32).sum();
        let mean = sums.iter().map(|sum| sum.x).sum::<f32>() / 100.0;
        let tolerance = if count <= MAX_PHOTONS { 1e-5 } else { 0.05 };
        assert!((mean / exact - 1.0).abs() <= tolerance, "{count} photons: {mean} of {exact}");
    }
}

//! Surfaces that shine: the tables, the light that clusters send towards directions, and the rays of pixels.

use crate::common::assert_silent;
use crate::world::{FLOAT, Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu::direct::lit_samples;
use lightpaths::cpu::gather_rays::Tracing;
use lightpaths::cpu::gloss::{Beam, reflected_flux, shine};
use lightpaths::cpu::gloss_pixels;
use lightpaths::cpu::hemisphere::{Strata, frame};
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::gloss::{Gloss, GlossBeam, GlossLight};
use lightpaths::passes::frame::gloss_pixels::{GlossPixels, GlossRay, GlossShine, LOBE_RAYS, Surroundings};
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::gather_rays::{self, GatherCode, Hemisphere};
use lightpaths::passes::precompute::gloss::{self, GlossTables};
use lightpaths::passes::precompute::light_paths::{self, LightPaths};
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::directions::Directions;
use lightpaths::scene::{Camera, Light, LightKind, Material};
use lightpaths::types::{
    CachePoint, Deposit, GatherRay, LightSource, NO_CLUSTER, NO_SIDE, NO_TARGET, PathVertex, PixelSurface,
    View,
};
use std::f64::consts::PI;

const SEED: u32 = 3;
const DIRECTIONS: Directions = Directions { side: 12 };
const HEMISPHERE: Hemisphere = Hemisphere { rings: 4, sectors: 16 };

/// A shining room, precomputed as far as the passes of gloss need it.
struct Shining {
    world: World,
    entry_points: Vec<PathVertex>,
    paths: LightPaths,
    points: Vec<CachePoint>,
    traced: Vec<GatherRay>,
    code: GatherCode,
    packed: Vec<GatherRay>,
    packed_code: GatherCode,
    tables: GlossTables,
}

impl Shining {
    fn new() -> Self {
        let world = World::shining_room();
        let mut random = Random::new(61);
        let mut entry_points = Vec::new();
        while entry_points.len() < 20_000 {
            let (position, _, side) = world.surface_point(&mut random);
            let cluster = world.geometry().cluster(&world.hvds, position, side);
            if cluster != NO_CLUSTER {
                let weight = 0.5 + random.unit();
                entry_points.push(PathVertex {
                    position,
                    side,
                    incoming: Vec3::ZERO,
                    weight,
                    cluster,
                    lobe: 0.0,
                });
            }
        }
        let base = world.hvds.levels[0].len() as u32;
        let paths = light_paths::trace(
            &world.context,
            &world.buffers,
            &world.clusters,
            &world.surfaces,
            &world.materials,
            base,
            &mut entry_points,
            SEED,
            &mut Silent,
        )
        .unwrap();
        let points = world.cache_points(&mut random, 300, 0.1);
        let code = GatherCode::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
        let rays = gather_rays::trace(
            &world.context,
            &world.buffers,
            &world.clusters,
            &Buffer::from_slice(&world.context, "cache points", &points).unwrap(),
            points.len() as u32,
            HEMISPHERE,
            code,
            SEED,
            &mut Silent,
        )
        .unwrap();
        let traced = rays.read().unwrap();
        let sources = gloss::Sources {
            hvds: &world.hvds,
            view_count: 0,
            surfaces: &world.surfaces,
            materials: &world.materials,
            paths: &paths,
            entry_points: &entry_points,
            cache_points: &points,
            hemisphere: HEMISPHERE,
            seed: SEED,
            directions: DIRECTIONS,
        };
        let (tables, packed_code) = gloss::build(sources, &rays, code).unwrap().unwrap();
        let packed = rays.read().unwrap();
        Self { world, entry_points, paths, points, traced, code, packed, packed_code, tables }
    }

    fn material_of(&self, side: u32) -> usize {
        self.world.surfaces[side as usize / 2].material as usize
    }

    /// Base clusters below a cluster, itself included where it is one.
    fn base_below(&self, cluster: u32) -> Vec<u32> {
        let hvds = &self.world.hvds;
        if hvds.levels[0].contains(&cluster) {
            return vec![cluster];
        }
        let children = hvds.first_children[cluster as usize]..hvds.first_children[cluster as usize + 1];
        children.flat_map(|child| self.base_below(child)).collect()
    }
}

#[test]
fn rays_that_meet_what_shines_read_the_direction_that_they_come_from() {
    let shining = Shining::new();
    let strata = Strata { rings: HEMISPHERE.rings, sectors: HEMISPHERE.sectors };
    let clusters = shining.world.hvds.cluster_count();
    let (mut shiny, mut matt) = (0, 0);
    for (index, (before, after)) in shining.traced.iter().zip(&shining.packed).enumerate() {
        assert_eq!(before.gradient, after.gradient);
        if before.target == NO_TARGET {
            assert_eq!(after.target, NO_TARGET);
            continue;
        }
        let unpack = |target: u32, code: GatherCode| {
            (target & ((1 << code.cluster_bits) - 1), target >> code.cluster_bits)
        };
        let (cluster, material) = unpack(before.target, shining.code);
        let (read, same) = unpack(after.target, shining.packed_code);
        assert_eq!(material, same);
        if !shining.world.materials[material as usize].may_shine() {
            matt += 1;
            assert_eq!(read, cluster);
            continue;
        }
        shiny += 1;
        let slot = &shining.tables.slots[(read - clusters) as usize];
        let (point, ray) = (index as u32 / strata.rays(), index as u32 % strata.rays());
        let direction = frame(shining.points[point as usize].normal) * strata.direction(ray, point, SEED);
        assert_eq!((slot.cluster, slot.direction), (cluster, DIRECTIONS.bin(-direction)));
    }
    assert!(shiny > 3_000 && matt > 1_000, "{shiny} of {matt}");
    // A scene where nothing shines has no tables.
    let world = World::room();
    assert!(!world.materials.iter().any(Material::may_shine));
    assert_silent(&shining.world.context);
}

/// A point light, and an area light of more samples than one.
fn lights() -> Vec<LightSource> {
    let point = LightKind::Point { position: Vec3::new(0.1, 0.5, -0.2), intensity: Vec3::new(1.0, 2.0, 3.0) };
    let area = LightKind::Area {
        corner: Vec3::new(-0.9, 0.7, -0.3),
        edge_u: Vec3::new(0.5, 0.0, 0.0),
        edge_v: Vec3::new(0.0, 0.0, 0.4),
        radiance: Vec3::new(5.0, 0.5, 0.0),
        samples: 6,
    };
    light_sources(&[point, area].map(|kind| Light { name: String::new(), kind }))
}

#[test]
fn light_on_what_shines_equals_the_twin() {
    let shining = Shining::new();
    let world = &shining.world;
    let mut random = Random::new(62);
    let lights = lights();
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let path_count = shining.entry_points.len();
    let area_m2 = 0.017;
    let gloss = Gloss::new(&world.context, &shining.tables, DIRECTIONS, path_count as u32, area_m2).unwrap();
    let flux: Vec<Vec3> = (0..path_count).map(|_| 1.0 + random.cube()).collect();
    gloss.reflected_flux.write(&flux).unwrap();
    let mut deposits = shining.paths.deposits.clone();
    for deposit in &mut deposits {
        deposit.throughput = 0.5 * (1.0 + random.cube());
    }
    let first = &shining.paths.first_deposits;
    let deposits_buffer = Buffer::from_slice(&world.context, "deposits", &deposits).unwrap();
    let first_buffer = Buffer::from_slice(&world.context, "first deposits", first).unwrap();
    let beams: Vec<Buffer> = lights
        .iter()
        .map(|light| Buffer::storage(&world.context, "beams", gloss.beam_bytes(light.samples)).unwrap())
        .collect();
    let gloss_lights: Vec<_> = lights
        .iter()
        .zip(&beams)
        .map(|(light, beams)| GlossLight { emission: light.emission, samples: light.samples, beams })
        .collect();
    world
        .context
        .run(|rec| {
            let mut pass = rec.pass(Gloss::BEAMS_STEM);
            for (index, (light, beams)) in (0..).zip(lights.iter().zip(&beams)) {
                let light = OneLight { table: &table, index, samples: light.samples, traces_all: false };
                gloss.record_beams(&mut pass, &world.buffers, light, beams);
            }
            drop(pass);
            rec.barrier(COMPUTE_TO_COMPUTE);
            gloss.record_entries(rec, &world.buffers.materials, &gloss_lights);
            rec.barrier(COMPUTE_TO_COMPUTE);
            let materials = &world.buffers.materials;
            gloss.record(rec, materials, &first_buffer, &deposits_buffer, &gloss_lights);
        })
        .unwrap();

    // Beams, against their twin; from there on with the device's own, where rays graze edges.
    let mut of_paths: Vec<Vec<Beam>> = vec![Vec::new(); path_count];
    let (mut differ, mut lit) = (0, 0);
    for (light, beams) in lights.iter().zip(&beams) {
        let device: Vec<GlossBeam> = beams.read().unwrap();
        let rows = device.chunks_exact(light.samples as usize);
        for (entry, row) in shining.tables.entries.iter().zip(rows) {
            let geometry = world.geometry();
            let twin = lit_samples(geometry, light, entry.position, entry.normal, entry.normal, area_m2);
            for (number, beam) in (0..).zip(row) {
                let twin = twin.iter().find(|sample| sample.0 == number);
                let agrees = match twin {
                    Some((_, direction, factor)) => {
                        let mirror = (-direction).reflect(entry.normal.as_dvec3());
                        (mirror - beam.mirror.as_dvec3()).length() < 1e-5
                            && (factor - f64::from(beam.factor)).abs() < 1e-4 * (factor + 0.01)
                    }
                    None => beam.factor == 0.0,
                };
                differ += usize::from(!agrees);
                lit += usize::from(beam.factor > 0.0);
                let flux = f64::from(area_m2 * beam.factor) * light.emission.as_dvec3();
                of_paths[entry.path as usize].push(Beam { mirror: beam.mirror.as_dvec3(), flux });
            }
        }
    }
    assert!(lit > 10_000 && differ * 250 < lit, "{differ} of {lit} beams differ");

    // From the paths themselves, not from the tables.
    let materials = world.reflectances();
    let reflected: Vec<Vec3> = gloss.reflected_flux.read().unwrap();
    for (path, (device, entry)) in reflected.iter().zip(&shining.entry_points).enumerate() {
        let material = shining.material_of(entry.side);
        let twin = match world.materials[material].may_shine() {
            true => {
                let departure = shining.paths.arrivals.departures[path];
                reflected_flux(&materials[material], &of_paths[path], departure)
            }
            false => flux[path].as_dvec3(),
        };
        assert_near(*device, twin, SUM, 1e-9, "reflected flux");
    }

    let fluxes: Vec<Vec3> = gloss.fluxes.read().unwrap();
    let brightest = fluxes.iter().map(|flux| flux.max_element()).fold(0.0, f32::max);
    assert!(fluxes.len() > 5_000 && brightest > 0.0);
    let arrivals = &shining.paths.arrivals;
    let (mut coarse, mut lit) = (0, 0);
    for (slot, device) in shining.tables.slots.iter().zip(&fluxes).step_by(7) {
        coarse += usize::from(slot.cluster >= world.hvds.levels[0].end);
        let mut vertices = Vec::new();
        for cluster in shining.base_below(slot.cluster) {
            let lists = &first[2 * cluster as usize..2 * cluster as usize + 3];
            for deposit in lists[0]..lists[2] {
                let side = arrivals.sides[deposit as usize];
                let material = &materials[shining.material_of(side)];
                let Deposit { throughput, path } = deposits[deposit as usize];
                if deposit < lists[1] {
                    let beams = of_paths[path as usize].iter();
                    vertices.extend(
                        beams.map(|beam| {
                            (material, Beam { flux: beam.flux * throughput.as_dvec3(), ..*beam })
                        }),
                    );
                } else {
                    let normal = world.geometry().normal(side).as_dvec3();
                    let mirror = arrivals.incoming[deposit as usize].as_dvec3().reflect(normal);
                    let flux = throughput.as_dvec3() * reflected[path as usize].as_dvec3();
                    vertices.push((material, Beam { mirror, flux }));
                }
            }
        }
        let twin = shine(vertices, DIRECTIONS.middle(slot.direction));
        lit += usize::from(twin.x > 0.0);
        assert_near(*device, twin, SUM, 1e-3 * f64::from(brightest), "slot");
    }
    assert!(coarse > 100 && lit > 500, "{coarse} coarse slots, {lit} with light");
    assert_silent(&world.context);
}

#[test]
fn shining_pixels_equal_the_twin() {
    let shining = Shining::new();
    let world = &shining.world;
    let mut random = Random::new(63);
    let path_count = shining.entry_points.len();
    let gloss = Gloss::new(&world.context, &shining.tables, DIRECTIONS, path_count as u32, 1.0).unwrap();
    // Nothing shines back: what does is the test above, and the physics.
    gloss.reflected_flux.write(&vec![Vec3::ZERO; path_count]).unwrap();
    let lights = lights();
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let clusters = world.hvds.cluster_count() as usize;
    let irradiance: Vec<Vec3> = (0..clusters).map(|_| 1.0 + random.cube()).collect();
    let irradiance_buffer = Buffer::from_slice(&world.context, "irradiance", &irradiance).unwrap();
    let inverse_areas =
        Buffer::from_slice(&world.context, "inverse areas", &vec![1.0_f32; clusters]).unwrap();
    let first = Buffer::from_slice(&world.context, "first deposits", &shining.paths.first_deposits).unwrap();
    let deposits = Buffer::from_slice(&world.context, "deposits", &shining.paths.deposits).unwrap();
    let bits = shining.code.cluster_bits;
    let tracing = Tracing {
        geometry: world.geometry(),
        hvds: &world.hvds,
        strata: Strata { rings: HEMISPHERE.rings, sectors: HEMISPHERE.sectors },
        seed: SEED,
        entry_points: &world.in_clusters,
        least_entry_points: gather_rays::LEAST_ENTRY_POINTS,
    };
    for (size, most) in [([1, 1], 4), ([9, 7], 3), ([31, 33], 16)] {
        let camera = Camera {
            name: String::new(),
            position: Vec3::new(0.1, 0.05, 0.45),
            target: Vec3::new(-0.1, 0.0, -0.4),
            up: Vec3::Y,
            fov_y_degrees: 80.0,
            size,
        };
        let view = View::from(&camera);
        let count = (size[0] * size[1]) as usize;
        let primary = Primary::new(&world.context, count as u32).unwrap();
        world.context.run(|rec| primary.record(rec, &world.buffers, &view)).unwrap();
        let pixels: Vec<PixelSurface> = primary.pixels.read().unwrap();
        let pass = GlossPixels::new(&world.context, count as u32, most, bits).unwrap();
        let samples = most.div_ceil(LOBE_RAYS);
        let layers: Vec<Buffer> = lights
            .iter()
            .map(|_| Buffer::storage(&world.context, "layer", 4 * u64::from(pass.capacity)).unwrap())
            .collect();
        let around = Surroundings {
            scene: &world.buffers,
            pixels: &primary.pixels,
            irradiance: &irradiance_buffer,
            inverse_areas: &inverse_areas,
            gloss: &gloss,
            first_deposits: &first,
            deposits: &deposits,
        };
        let highlights: Vec<_> = lights.iter().map(|light| light.emission).zip(&layers).collect();
        world
            .context
            .run(|rec| {
                let scene = &world.buffers;
                pass.record_rays(rec, scene, &world.clusters, &primary.pixels, &view, SEED);
                rec.barrier(COMPUTE_TO_COMPUTE);
                let mut open = rec.pass(GlossPixels::HIGHLIGHTS_STEM);
                for (index, (light, layer)) in (0..).zip(lights.iter().zip(&layers)) {
                    let light = OneLight { table: &table, index, samples: light.samples, traces_all: false };
                    pass.record_highlights(&mut open, scene, light, view.position, layer);
                }
                drop(open);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record(rec, around, &[], &highlights);
            })
            .unwrap();
        let found: Vec<GlossShine> = pass.radiance.read().unwrap();
        let points: Vec<PixelSurface> = pass.samples.read().unwrap();
        let rays: Vec<GlossRay> = pass.rays.read().unwrap();
        let shines = |side: u32| side != NO_SIDE && shining.material_of(side) < 2;
        let listed: Vec<usize> = (0..count).filter(|&index| shines(pixels[index].side)).collect();
        assert_eq!(pass.count().unwrap() as usize, listed.len());
        assert!(count < 1_000 || listed.len() > 200);
        let reflectances = world.reflectances();
        let (mut differ, mut bright) = (0, 0);
        for (place, &index) in listed.iter().enumerate() {
            let material = &reflectances[shining.material_of(pixels[index].side)];
            let [mut indirect, mut direct] = [DVec3::ZERO; 2];
            for number in 0..samples {
                let at = place * samples as usize + number as usize;
                let point = &points[at];
                let twin = gloss_pixels::sample(&tracing, &view, &pixels[index], index as u32, number);
                let is_near = (twin.position - point.position).length() < 1e-4;
                differ += usize::from(twin.side != point.side || !is_near);
                for light in &lights {
                    let factor = gloss_pixels::highlight(&tracing, point, view.position, material, light);
                    direct += factor * light.emission.as_dvec3();
                }
                for lobe in 0..LOBE_RAYS {
                    let ray = &rays[at * LOBE_RAYS as usize + lobe as usize];
                    let which = [number * LOBE_RAYS + lobe, samples * LOBE_RAYS];
                    let exponent = f64::from(material.exponent);
                    let eye = view.position;
                    let twin = gloss_pixels::trace(&tracing, point, index as u32, eye, exponent, which);
                    let target =
                        twin.target.map_or(NO_TARGET, |(cluster, material)| cluster | material << bits);
                    let is_same = (twin.weight - f64::from(ray.weight)).abs() < 1e-4;
                    differ += usize::from(target != ray.target || !is_same);
                    if ray.target != NO_TARGET {
                        let albedo = world.materials[(ray.target >> bits) as usize].diffuse;
                        let light = albedo * irradiance[(ray.target & ((1 << bits) - 1)) as usize];
                        indirect += f64::from(ray.weight) * light.as_dvec3();
                    }
                }
            }
            indirect *= material.specular.as_dvec3() / (f64::from(samples * LOBE_RAYS) * PI);
            direct /= f64::from(samples);
            assert_near(found[index].indirect, indirect, 10.0 * FLOAT, 1e-9, "indirect");
            let off = (found[index].direct.as_dvec3() - direct).abs().max_element();
            differ += usize::from(off > 1e-3 * direct.max_element() + 1e-5);
            bright += usize::from(found[index].direct.max_element() > 0.05);
        }
        assert!(count < 1_000 || bright > 50, "{bright} pixels show a highlight");
        // Rays by an edge, of the camera, a lobe or a light.
        assert!(differ * 100 <= listed.len() * most as usize, "{differ} differ of {}", listed.len());
        for index in (0..count).filter(|&index| !shines(pixels[index].side)) {
            assert_eq!((found[index].direct, found[index].indirect), (Vec3::ZERO, Vec3::ZERO));
        }
    }
    assert_silent(&world.context);
}

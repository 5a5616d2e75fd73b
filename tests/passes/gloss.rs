//! Surfaces that shine: the tables, the light that clusters send towards directions, and the rays of pixels.

use crate::common::assert_silent;
use crate::world::{FLOAT, Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu::gather_rays::Tracing;
use lightpaths::cpu::gloss::{Beam, beam, reflected_flux, shine};
use lightpaths::cpu::gloss_pixels;
use lightpaths::cpu::hemisphere::{Strata, frame};
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::form_factors::FormFactors;
use lightpaths::passes::frame::gather::GatherSources;
use lightpaths::passes::frame::gloss::Gloss;
use lightpaths::passes::frame::gloss_pixels::{GlossPixels, GlossRay};
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::gather_rays::{self, GatherCode, Hemisphere};
use lightpaths::passes::precompute::gloss::{self, GlossTables};
use lightpaths::passes::precompute::light_paths::{self, LightPaths};
use lightpaths::scene::Material;
use lightpaths::scene::directions::Directions;
use lightpaths::types::{
    CachePoint, Deposit, GatherRay, LightSource, NO_CLUSTER, NO_SIDE, NO_TARGET, PathVertex,
};

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

#[test]
fn light_on_what_shines_equals_the_twin() {
    let shining = Shining::new();
    let world = &shining.world;
    let mut random = Random::new(62);
    let lights = [
        LightSource::point(Vec3::new(0.1, 0.5, -0.2), Vec3::new(1.0, 2.0, 3.0)),
        LightSource::point(Vec3::new(-0.7, -0.4, 0.3), Vec3::new(5.0, 0.5, 0.0)),
    ];
    let path_count = shining.entry_points.len();
    let area_m2 = 0.017;
    let factors: Vec<f32> = (0..2 * path_count).map(|_| random.unit()).collect();
    let lights_buffer = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let form_factors = FormFactors::new(&world.context, &shining.entry_points, area_m2, 2, true).unwrap();
    form_factors.factors.write(&factors).unwrap();
    let mut deposits = shining.paths.deposits.clone();
    for deposit in &mut deposits {
        deposit.throughput = 0.5 * (1.0 + random.cube());
    }
    let first = &shining.paths.first_deposits;
    // Entry points deposit what their area weighs.
    for deposit in first.chunks_exact(2).flat_map(|lists| lists[0]..lists[1]) {
        let deposit = &mut deposits[deposit as usize];
        deposit.throughput = Vec3::splat(shining.entry_points[deposit.path as usize].weight);
    }
    let upload = |name: &str, values: &[Deposit]| Buffer::from_slice(&world.context, name, values).unwrap();
    let deposits_buffer = upload("deposits", &deposits);
    let first_buffer = Buffer::from_slice(&world.context, "first deposits", first).unwrap();
    let gloss = Gloss::new(&world.context, &shining.tables, DIRECTIONS, path_count as u32, 2).unwrap();
    world
        .context
        .run(|rec| {
            form_factors.record_flux(rec, &lights_buffer, 2, Some(&gloss.reflected_flux));
            rec.barrier(COMPUTE_TO_COMPUTE);
            gloss.record_entries(rec, &form_factors, &world.buffers.materials, &lights_buffer);
            rec.barrier(COMPUTE_TO_COMPUTE);
            gloss.record(rec, &world.buffers.materials, &first_buffer, &deposits_buffer);
        })
        .unwrap();

    // From the paths themselves, not from the tables.
    let materials = world.reflectances();
    let beams = |path: usize| -> Vec<Beam> {
        let entry = &shining.entry_points[path];
        let beam_of = |light: usize| {
            let flux = f64::from(area_m2 * factors[light * path_count + path]);
            let flux = flux * lights[light].emission.as_dvec3();
            beam(entry.position, world.geometry().normal(entry.side), lights[light].position, flux)
        };
        (0..2).map(beam_of).collect()
    };
    let reflected: Vec<Vec3> = gloss.reflected_flux.read().unwrap();
    for (path, (device, entry)) in reflected.iter().zip(&shining.entry_points).enumerate() {
        let material = shining.material_of(entry.side);
        let beams = beams(path);
        let twin = match world.materials[material].may_shine() {
            true => reflected_flux(&materials[material], &beams, shining.paths.arrivals.departures[path]),
            false => beams.iter().map(|beam| beam.flux).sum(),
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
                    let weight = throughput.as_dvec3();
                    vertices.extend(
                        beams(path as usize)
                            .into_iter()
                            .map(|beam| (material, Beam { flux: beam.flux * weight, ..beam })),
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
    let eye = Vec3::new(0.1, 0.05, 0.0);
    let path_count = shining.entry_points.len();
    let gloss = Gloss::new(&world.context, &shining.tables, DIRECTIONS, path_count as u32, 1).unwrap();
    let zeros = vec![Vec3::ZERO; path_count];
    gloss.reflected_flux.write(&zeros).unwrap();
    gloss.beams.write(&vec![0.0_f32; gloss.beams.bytes() as usize / 4]).unwrap();
    let clusters = world.hvds.cluster_count() as usize;
    let irradiance: Vec<Vec3> = (0..clusters).map(|_| 1.0 + random.cube()).collect();
    let irradiance_buffer = Buffer::from_slice(&world.context, "irradiance", &irradiance).unwrap();
    let inverse_areas =
        Buffer::from_slice(&world.context, "inverse areas", &vec![1.0_f32; clusters]).unwrap();
    let first = Buffer::from_slice(&world.context, "first deposits", &shining.paths.first_deposits).unwrap();
    let deposits = Buffer::from_slice(&world.context, "deposits", &shining.paths.deposits).unwrap();
    let bits = shining.code.cluster_bits;
    let strata = Strata { rings: HEMISPHERE.rings, sectors: HEMISPHERE.sectors };
    let tracing = Tracing {
        geometry: world.geometry(),
        hvds: &world.hvds,
        strata,
        seed: SEED,
        entry_points: &world.in_clusters,
        least_entry_points: gather_rays::LEAST_ENTRY_POINTS,
    };
    for (count, most) in [(0, 4), (1, 16), (65, 3), (997, 16)] {
        let mut pixels = world.pixels(&mut random, count);
        for pixel in pixels.iter_mut().step_by(7).skip(1) {
            pixel.side = NO_SIDE;
        }
        let pixels_buffer = Buffer::from_slice(&world.context, "pixels", &pixels).unwrap();
        let pass = GlossPixels::new(&world.context, count as u32, most).unwrap();
        let sources = GatherSources {
            materials: &world.buffers.materials,
            irradiance: &irradiance_buffer,
            inverse_areas: &inverse_areas,
            gloss: None,
        };
        world
            .context
            .run(|rec| {
                pass.record_rays(rec, &world.buffers, &world.clusters, &pixels_buffer, eye, bits, SEED);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record(rec, &world.buffers, sources, &gloss, &first, &deposits, &pixels_buffer, bits);
            })
            .unwrap();
        let radiance: Vec<Vec3> = pass.radiance.read().unwrap();
        let rays: Vec<GlossRay> = pass.rays.read().unwrap();
        let shines = |side: u32| side != NO_SIDE && shining.material_of(side) < 2;
        let listed: Vec<usize> = (0..count).filter(|&index| shines(pixels[index].side)).collect();
        assert_eq!(pass.count().unwrap() as usize, listed.len());
        let mut differ = 0;
        for (row, &index) in rays.chunks_exact(most as usize).zip(&listed) {
            let pixel = &pixels[index];
            let material = &world.materials[shining.material_of(pixel.side)];
            let mut sum = DVec3::ZERO;
            for (number, ray) in (0..).zip(row) {
                let exponent = f64::from(material.exponent);
                let twin = gloss_pixels::trace(&tracing, pixel, index as u32, eye, exponent, [number, most]);
                let target = twin.target.map_or(NO_TARGET, |(cluster, material)| cluster | material << bits);
                differ +=
                    usize::from(target != ray.target || (twin.weight - f64::from(ray.weight)).abs() > 1e-4);
                if ray.target != NO_TARGET {
                    let albedo = world.materials[(ray.target >> bits) as usize].diffuse;
                    let light = albedo * irradiance[(ray.target & ((1 << bits) - 1)) as usize];
                    sum += f64::from(ray.weight) * light.as_dvec3();
                }
            }
            let twin = material.specular.as_dvec3() * sum / (f64::from(most) * std::f64::consts::PI);
            assert_near(radiance[index], twin, 10.0 * FLOAT, 1e-9, "radiance");
        }
        assert!(differ * 200 <= listed.len() * most as usize, "{differ} rays differ");
        for index in (0..count).filter(|&index| !shines(pixels[index].side)) {
            assert_eq!(radiance[index], Vec3::ZERO);
        }
    }
    assert_silent(&world.context);
}

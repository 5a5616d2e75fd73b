//! Glossy surfaces: the tables, and the flux that clusters emit into direction bins.

use crate::common::assert_silent;
use crate::gloss_readers::{
    gathered_bins_equal_the_reference, pixels_of_glossy_surfaces_equal_the_reference,
    pixels_read_the_bins_of_broad_lobes,
};
use crate::world::{Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu::direct::lit_samples;
use lightpaths::cpu::gloss::{Beam, lobe_sum, reflected_flux};
use lightpaths::cpu::hemisphere::{Strata, frame};
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::gloss::{Gloss, GlossBeam, GlossLight};
use lightpaths::passes::frame::hvds::contribution_ranges;
use lightpaths::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets, TargetCounts};
use lightpaths::passes::gloss_tables::GlossTables;
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::gather_rays::{self, Hemisphere};
use lightpaths::passes::precompute::gloss;
use lightpaths::passes::precompute::path_orders::LightPaths;
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::directions::Directions;
use lightpaths::scene::{Camera, Light, LightKind, Material};
use lightpaths::types::{CachePoint, GatherRay, LightSource, NO_CLUSTER, NO_TARGET, PathVertex};
use std::collections::HashMap;

pub(crate) const SEED: u32 = 3;
pub(crate) const DIRECTIONS: Directions = Directions { side: 12 };
pub(crate) const HEMISPHERE: Hemisphere = Hemisphere { rings: 4, sectors: 16 };

/// A glossy room with the precomputed tables of the glossy passes.
pub(crate) struct Glossy {
    pub(crate) world: World,
    pub(crate) entry_points: Vec<PathVertex>,
    pub(crate) paths: LightPaths,
    pub(crate) points: Vec<CachePoint>,
    pub(crate) traced: Vec<GatherRay>,
    pub(crate) packing: GatherTargetPacking,
    pub(crate) packed: Vec<GatherRay>,
    pub(crate) target_packing: GatherTargetPacking,
    pub(crate) tables: GlossTables,
}

impl Glossy {
    pub(crate) fn new(world: World) -> Self {
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
        let (entry_points, paths) = world.light_paths(entry_points, SEED).unwrap();
        let points = world.cache_points(&mut random, 300, 0.1);
        let packing =
            GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
        let rays = gather_rays::trace(
            &world.context,
            &world.buffers,
            &world.clusters,
            &Buffer::from_slice(&world.context, "cache points", &points).unwrap(),
            points.len() as u32,
            HEMISPHERE,
            packing,
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
        let targets = GatherTargets::of_hits(packing);
        let (tables, readers) = gloss::build(sources, &rays, &targets).unwrap().unwrap();
        let counts = TargetCounts {
            clusters: world.hvds.cluster_count(),
            gloss_bins: tables.bins.len() as u32,
            ..TargetCounts::default()
        };
        let target_packing = GatherTargetPacking::of_counts(counts, world.materials.len(), 0.05).unwrap();
        let targets = targets.with(GatherTarget::GlossBin, readers);
        let packed = targets.packed(&target_packing, 0, &traced).into_owned();
        Self { world, entry_points, paths, points, traced, packing, packed, target_packing, tables }
    }

    pub(crate) fn material_of(&self, side: u32) -> usize {
        self.world.surfaces[side as usize / 2].material as usize
    }

    /// Base clusters below a cluster, or the cluster itself if it is one.
    fn base_below(&self, cluster: u32) -> Vec<u32> {
        let hvds = &self.world.hvds;
        if hvds.levels[0].contains(&cluster) {
            return vec![cluster];
        }
        hvds.children_of(cluster).iter().flat_map(|&child| self.base_below(child)).collect()
    }
}

/// A view into the glossy room.
pub(crate) fn camera(size: [u32; 2]) -> Camera {
    Camera {
        name: String::new(),
        position: Vec3::new(0.1, 0.05, 0.45),
        target: Vec3::new(-0.1, 0.0, -0.4),
        up: Vec3::Y,
        fov_y_degrees: 80.0,
        size,
    }
}

#[test]
fn rays_that_meet_glossy_surfaces_read_the_direction_that_they_come_from() {
    let glossy = Glossy::new(World::glossy_room());
    let strata = Strata { rings: HEMISPHERE.rings, sectors: HEMISPHERE.sectors };
    let (mut shiny, mut diffuse, mut inside) = (0, 0, 0);
    let mut bins = HashMap::new();
    for (index, (before, after)) in glossy.traced.iter().zip(&glossy.packed).enumerate() {
        assert_eq!(before.gradient, after.gradient);
        let Some((hit, met)) = glossy.packing.unpack(before.target) else {
            assert_eq!(after.target, NO_TARGET);
            continue;
        };
        let GatherTarget::Cluster(cluster) = hit else { panic!("a ray meets {hit:?}") };
        let (read, same) = glossy.target_packing.unpack(after.target).unwrap();
        assert_eq!(met, same);
        if !glossy.world.materials[met.material as usize].may_be_glossy() {
            diffuse += 1;
            assert_eq!(read, hit);
            continue;
        }
        shiny += 1;
        let GatherTarget::GlossBin(read) = read else { panic!("a glossy hit reads {read:?}") };
        let gloss_bin = &glossy.tables.bins[read as usize];
        let (point, ray) = (index as u32 / strata.rays(), index as u32 % strata.rays());
        let from = &glossy.points[point as usize];
        let direction = frame(from.normal) * strata.direction(ray, from.stream, SEED);
        let bin = DIRECTIONS.bin(-direction);
        assert_eq!(gloss_bin.cluster, cluster);
        // The mean of directions in a bin is at most in a neighbouring bin.
        assert!(gloss_bin.direction.as_dvec3().dot(-direction) > 0.8, "{} {direction}", gloss_bin.direction);
        assert_eq!(*bins.entry(read).or_insert(bin), bin);
        if DIRECTIONS.bin(gloss_bin.direction.as_dvec3()) == bin {
            inside += 1;
        }
    }
    assert!(shiny > 3_000 && diffuse > 1_000, "{shiny} of {diffuse}");
    assert!(100 * inside > 97 * shiny, "{inside} of {shiny}");
    // A scene without glossy materials has no tables.
    let world = World::room();
    assert!(!world.materials.iter().any(Material::may_be_glossy));
    assert_silent(&glossy.world.context);
}

/// A point light, and an area light with several samples.
pub(crate) fn lights() -> Vec<LightSource> {
    let point = LightKind::Point { position: Vec3::new(0.1, 0.5, -0.2), intensity: Vec3::new(1.0, 2.0, 3.0) };
    let area = LightKind::Area {
        corner: Vec3::new(-0.9, 0.7, -0.3),
        // Large beside the sharper lobe, small beside the broader one.
        edge_u: Vec3::new(0.9, 0.0, 0.0),
        edge_v: Vec3::new(0.0, 0.0, 0.6),
        radiance: Vec3::new(5.0, 0.5, 0.0),
        samples: 6,
    };
    light_sources(&[point, area].map(|kind| Light::new(String::new(), kind)))
}

#[test]
fn light_on_glossy_surfaces_equals_the_reference() {
    for world in [World::glossy_room(), World::textured_glossy_room()] {
        light_on_glossy_surfaces_equals_the_reference_in(world);
    }
}

fn light_on_glossy_surfaces_equals_the_reference_in(world: World) {
    let glossy = Glossy::new(world);
    let world = &glossy.world;
    let mut random = Random::new(62);
    // Five lights.
    let mut lights = lights();
    for index in [0, 0, 1] {
        let moved = lights[index].position - 0.1 * (1.0 + random.cube());
        lights.push(LightSource { position: moved, emission: 1.0 + random.cube(), ..lights[index] });
    }
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let path_count = glossy.entry_points.len();
    let area_m2 = 0.017;
    let gloss =
        Gloss::new(&world.context, &world.buffers, &glossy.tables, path_count as u32, area_m2).unwrap();
    let mut random_factors = |_: &LightSource| (0..path_count).map(|_| random.unit()).collect();
    let mut factors: Vec<Vec<f32>> = lights.iter().map(&mut random_factors).collect();
    // A light of one point sample takes its beams from its form factors.
    for (light, factors) in lights.iter().zip(&mut factors).filter(|(light, _)| light.samples == 1) {
        for entry in &glossy.tables.entries {
            let (geometry, normal) = (world.geometry(), entry.normal);
            let lit = lit_samples(geometry, light, entry.position, normal, normal, area_m2);
            factors[entry.path as usize] = lit.iter().map(|sample| sample.2 as f32).sum();
        }
    }
    let mut contributions = glossy.paths.contributions.clone();
    for contribution in &mut contributions {
        contribution.throughput = 0.5 * (1.0 + random.cube());
    }
    let first = &glossy.paths.contribution_offsets;
    let contributions_buffer = Buffer::from_slice(&world.context, "contributions", &contributions).unwrap();
    let runs = contribution_ranges(&world.hvds, first);
    let beams: Vec<Buffer> = lights
        .iter()
        .map(|light| Buffer::storage(&world.context, "beams", gloss.beam_bytes(light.samples)).unwrap())
        .collect();
    let upload = |row: &Vec<f32>| Buffer::from_slice(&world.context, "factors", row).unwrap();
    let factor_buffers: Vec<Buffer> = factors.iter().map(upload).collect();
    let rows = |name, values: u64| -> Vec<Buffer> {
        lights.iter().map(|_| Buffer::storage(&world.context, name, 12 * values).unwrap()).collect()
    };
    let first_bounce = rows("first bounce flux", path_count as u64);
    let bins = rows("light gloss bins", u64::from(gloss.leaf_count));
    let hits = rows("light hits", 1 << 16);
    let gloss_lights: Vec<_> = (0..lights.len())
        .map(|light| GlossLight {
            beam_count: lights[light].samples,
            beams: &beams[light],
            first_bounce: &first_bounce[light],
            bins: &bins[light],
            hits: &hits[light],
        })
        .collect();
    let emitting = |of: &'static str| -> Vec<(Vec3, &Buffer)> {
        let buffers = if of == "bins" { &bins } else { &hits };
        lights.iter().map(|light| light.emission).zip(buffers).collect()
    };
    world
        .context
        .run(|rec| {
            let mut pass = rec.pass(Gloss::BEAMS_STEM);
            for (index, (found, factors)) in (0..).zip(gloss_lights.iter().zip(&factor_buffers)) {
                if index > 0 {
                    pass.barrier(COMPUTE_TO_COMPUTE);
                }
                let light = OneLight::new(&table, index, &lights[index as usize]);
                gloss.record_beams(&mut pass, &world.buffers, light, factors, found);
            }
            drop(pass);
            rec.barrier(COMPUTE_TO_COMPUTE);
            gloss.record_entries(rec, &world.buffers.materials, &gloss_lights);
            rec.barrier(COMPUTE_TO_COMPUTE);
            let materials = &world.buffers.materials;
            gloss.record(rec, materials, &contributions_buffer, &gloss_lights, &emitting("bins"));
        })
        .unwrap();

    // Beams are compared with their reference. Later stages use the device's beams, because
    // rays graze edges.
    let mut of_paths: Vec<Vec<Beam>> = vec![Vec::new(); path_count];
    let (mut differ, mut lit) = (0, 0);
    for (light, beams) in lights.iter().zip(&beams) {
        let device: Vec<GlossBeam> = beams.read().unwrap();
        let rows = device.chunks_exact(light.samples as usize);
        for (entry, row) in glossy.tables.entries.iter().zip(rows) {
            let geometry = world.geometry();
            let reference = lit_samples(geometry, light, entry.position, entry.normal, entry.normal, area_m2);
            for (number, beam) in (0..).zip(row) {
                let reference = reference.iter().find(|sample| sample.0 == number);
                let agrees = match reference {
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

    // Computed from the paths, not from the tables.
    let materials = world.reflectances();
    let flux_of = |light: usize, first_bounce: Vec3| area_m2 * lights[light].emission * first_bounce;
    let first_bounce: Vec<Vec<Vec3>> = first_bounce.iter().map(|row| row.read().unwrap()).collect();
    let all = 0..lights.len();
    let reflected: Vec<Vec3> = (0..path_count)
        .map(|path| all.clone().map(|light| flux_of(light, first_bounce[light][path])).sum())
        .collect();
    for (path, (device, entry)) in reflected.iter().zip(&glossy.entry_points).enumerate() {
        let material = glossy.material_of(entry.side);
        let reference = match world.materials[material].may_be_glossy() {
            true => {
                let departure = glossy.paths.arrivals.departures[path];
                let colour = unpack_colour(glossy.paths.arrivals.entry_colours[path]);
                reflected_flux(&materials[material], colour, &of_paths[path], departure)
            }
            false => all.clone().map(|l| flux_of(l, Vec3::splat(factors[l][path])).as_dvec3()).sum(),
        };
        assert_near(*device, reference, SUM, 1e-9, "reflected flux");
    }

    let fluxes: Vec<Vec3> = gloss.fluxes.read().unwrap();
    let brightest = fluxes.iter().map(|flux| flux.max_element()).fold(0.0, f32::max);
    assert!(fluxes.len() > 5_000 && brightest > 0.0);
    let arrivals = &glossy.paths.arrivals;
    let (mut coarse, mut lit) = (0, 0);
    let sent =
        |cluster: u32, toward: DVec3| {
            let mut vertices = Vec::new();
            for cluster in glossy.base_below(cluster) {
                let run = runs[cluster as usize];
                for contribution in run.first..run.end {
                    let side = arrivals.sides[contribution as usize];
                    let material = &materials[glossy.material_of(side)];
                    let (throughput, path) = (
                        contributions[contribution as usize].throughput,
                        contributions[contribution as usize].path(),
                    );
                    if contribution < run.first_other {
                        let beams = of_paths[path as usize].iter();
                        vertices.extend(beams.map(|beam| {
                            (material, Beam { flux: beam.flux * throughput.as_dvec3(), ..*beam })
                        }));
                    } else {
                        let normal = world.geometry().normal(side).as_dvec3();
                        let mirror = arrivals.incoming[contribution as usize].as_dvec3().reflect(normal);
                        let flux = throughput.as_dvec3() * reflected[path as usize].as_dvec3();
                        vertices.push((material, Beam { mirror, flux }));
                    }
                }
            }
            lobe_sum(vertices, toward)
        };
    for (index, (gloss_bin, device)) in glossy.tables.bins.iter().zip(&fluxes).enumerate().step_by(7) {
        coarse += usize::from(gloss_bin.cluster >= world.hvds.levels[0].end);
        let reference = match index.checked_sub(glossy.tables.leaf_count as usize) {
            None => sent(gloss_bin.cluster, gloss_bin.direction.as_dvec3()),
            // Its children, each in its direction.
            Some(sum) => {
                let run = &glossy.tables.child_offsets[sum..sum + 2];
                let children = &glossy.tables.children[run[0] as usize..run[1] as usize];
                let part = |&child: &u32| {
                    let child = &glossy.tables.bins[child as usize];
                    assert_eq!(world.hvds.parents[child.cluster as usize], gloss_bin.cluster);
                    assert!(child.direction.dot(gloss_bin.direction) > 0.8);
                    sent(child.cluster, child.direction.as_dvec3())
                };
                match children.iter().all(|&child| child < glossy.tables.leaf_count) {
                    true => children.iter().map(part).sum(),
                    false => children.iter().map(|&child| fluxes[child as usize].as_dvec3()).sum(),
                }
            }
        };
        lit += usize::from(reference.x > 0.0);
        assert_near(*device, reference, SUM, 1e-3 * f64::from(brightest), "gloss_bin");
    }
    assert!(coarse > 100 && lit > 500, "{coarse} coarse bins, {lit} with light");
    let sums: usize = glossy.tables.sums.iter().map(ExactSizeIterator::len).sum();
    assert!(sums > 50, "{sums} bins are sums");

    // A light that is not stale is only summed, and no bit changes.
    let materials = &world.buffers.materials;
    let paths = &contributions_buffer;
    world.context.run(|rec| gloss.record(rec, materials, paths, &[], &emitting("bins"))).unwrap();
    assert!(gloss.fluxes.read::<Vec3>().unwrap() == fluxes);
    // A light's bits are the same alone and among others.
    let bits = || bins.iter().map(|row| row.read::<u32>().unwrap()).collect::<Vec<_>>();
    let among_others = bits();
    for light in gloss_lights.chunks(1) {
        world.context.run(|rec| gloss.record(rec, materials, paths, light, &emitting("bins"))).unwrap();
    }
    assert!(bits() == among_others);
    gathered_bins_equal_the_reference(&glossy, &gloss, &fluxes);
    pixels_read_the_bins_of_broad_lobes(&glossy, &gloss, &contributions_buffer);
    let around = (&contributions_buffer, &gloss_lights[..]);
    pixels_of_glossy_surfaces_equal_the_reference(&glossy, &gloss, around, &emitting("hits"), sent);
    assert_silent(&world.context);
}

/// A light with many point samples: several dispatches take a cluster's vertices, and later ones
/// add to the result of the first.
#[test]
fn a_light_of_many_samples_adds_up_over_dispatches() {
    let glossy = Glossy::new(World::glossy_room());
    let context = &glossy.world.context;
    let gloss =
        Gloss::new(context, &glossy.world.buffers, &glossy.tables, glossy.entry_points.len() as u32, 0.017)
            .unwrap();
    let mut random = Random::new(63);
    let beams: Vec<GlossBeam> = (0..glossy.tables.entries.len())
        .map(|_| GlossBeam { mirror: random.cube().normalize(), factor: random.unit() })
        .collect();
    let mut contributions = glossy.paths.contributions.clone();
    contributions.iter_mut().for_each(|contribution| contribution.throughput = 0.5 * (1.0 + random.cube()));
    let contributions = Buffer::from_slice(context, "contributions", &contributions).unwrap();
    let nothing = vec![Vec3::ZERO; glossy.entry_points.len()];
    let dark_paths = Buffer::from_slice(context, "first bounce flux", &nothing).unwrap();
    // The same light: all samples are equal to the first.
    let [one, many] = [1, 256].map(|samples| {
        let dark = GlossBeam { mirror: Vec3::X, factor: 0.0 };
        let mut rows = vec![dark; beams.len() * samples];
        rows.iter_mut().step_by(samples).zip(&beams).for_each(|(row, beam)| *row = *beam);
        let beams = Buffer::from_slice(context, "beams", &rows).unwrap();
        let bins = Buffer::storage(context, "light gloss bins", 12 * u64::from(gloss.leaf_count)).unwrap();
        let hits = Buffer::storage(context, "light hits", 12).unwrap();
        let light = GlossLight {
            beam_count: samples as u32,
            beams: &beams,
            first_bounce: &dark_paths,
            bins: &bins,
            hits: &hits,
        };
        context
            .run(|rec| {
                gloss.record(rec, &glossy.world.buffers.materials, &contributions, &[light], &[]);
            })
            .unwrap();
        bins.read::<Vec3>().unwrap()
    });
    // A dispatch has 4 096 iterations: 16 entry points of 256 samples.
    assert!(glossy.tables.max_vertices > 32, "{}", glossy.tables.max_vertices);
    // Coarse clusters are included: their loops have more iterations in all than lavapipe's limit.
    let bins = &glossy.tables.bins[..one.len()];
    assert!(bins.iter().any(|gloss_bin| gloss_bin.cluster >= glossy.world.hvds.levels[0].end));
    let lit = one.iter().filter(|flux| flux.max_element() > 0.0).count();
    assert!(lit > 500, "{lit} of {} bins have light", one.len());
    for (one, &many) in one.iter().zip(&many) {
        assert_near(many, one.as_dvec3(), SUM, 1e-9, "gloss_bin");
    }
    assert_silent(context);
}

//! Bright clusters: what is selected, what gather rays leave out, and what rays bring instead.

use crate::common::assert_silent;
use crate::gather::{random_rays, targets};
use crate::world::{Random, World, room, textured};
use bytemuck::Zeroable;
use glam::{DMat3, DVec3, Vec3, Vec4};
use lightpaths::cpu::bright::{Source, threshold};
use lightpaths::cpu::hemisphere::frame;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use lightpaths::passes::bright_tables::BrightTables;
use lightpaths::passes::frame::bright::{BRIGHT, Bright, CONTRAST};
use lightpaths::passes::frame::gather::{BrightSources, Gather, GatherSources};
use lightpaths::passes::frame::hvds::{ClusterFlux, Pyramid};
use lightpaths::passes::frame::needed_records::RecordList;
use lightpaths::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets};
use lightpaths::passes::precompute::gather_rays::{Hemisphere, RayTable};
use lightpaths::passes::precompute::merged_rays::{MergedRayPacking, MergedRays};
use lightpaths::types::{CachePoint, NO_CLUSTER, PathVertex, Record};

/// Four gather rays: all but the nearest clusters are far away.
const HEMISPHERE: Hemisphere = Hemisphere { rings: 1, sectors: 4 };
/// Seeds of the mean over random rays.
const SEEDS: u32 = 400;

/// A world whose clusters reflect light, some of them much.
struct Lit {
    world: World,
    tables: BrightTables,
    pyramid: Pyramid,
    flux: Vec<ClusterFlux>,
    /// Direct flux of each cluster that comes from bright ones, W.
    bright: Vec<DVec3>,
    sources: Vec<Source>,
}

impl Lit {
    /// Every 29th watched cluster has `glow` times the light of the others.
    fn new(world: World, glow: f32) -> Self {
        let hvds = &world.hvds;
        let base_count = hvds.levels[0].len();
        let entry = |fragment: &lightpaths::scene::fragment::Fragment| PathVertex {
            position: fragment.middle(),
            side: fragment.side,
            cluster: fragment.cluster,
            ..PathVertex::zeroed()
        };
        let entry_points: Vec<PathVertex> = hvds.fragments.iter().map(entry).collect();
        let all = vec![true; hvds.cluster_count() as usize];
        let tables = BrightTables::new(hvds, (&entry_points, &world.surfaces), &all, HEMISPHERE);
        let mut random = Random::new(77);
        let mut flux = vec![ClusterFlux { direct: Vec3::ZERO, indirect: Vec3::ZERO }; all.len()];
        let mut has_entry = vec![false; base_count];
        entry_points.iter().for_each(|point| has_entry[point.cluster as usize] = true);
        for base in (0..base_count).filter(|&base| has_entry[base]) {
            let lit = if tables.ranges[base][0].is_multiple_of(29) { glow } else { 1.0 };
            let direct = lit * hvds.areas_m2[base] * (1.5 + random.cube());
            let indirect = hvds.areas_m2[base] * (1.5 + random.cube());
            let mut cluster = base;
            while let Some(sum) = flux.get_mut(cluster) {
                sum.direct += direct;
                sum.indirect += indirect;
                cluster = hvds.parents[cluster] as usize;
            }
        }
        let pyramid =
            Pyramid::new(&world.context, (hvds, &hvds.areas_m2), &vec![0; 2 * base_count + 1], 1e-9, false);
        let pyramid = pyramid.unwrap();
        pyramid.flux.write(&flux).unwrap();
        let irradiance: Vec<Vec3> = flux
            .iter()
            .zip(&hvds.areas_m2)
            .map(|(flux, area)| (flux.direct + flux.indirect) / area.max(f32::MIN_POSITIVE))
            .collect();
        pyramid.irradiance.write(&irradiance).unwrap();

        let albedos: Vec<DVec3> = world.reflectances().iter().map(|m| m.diffuse.as_dvec3()).collect();
        let mean = |colour: DVec3| colour.element_sum() / 3.0;
        let exitance = |watched: &lightpaths::passes::bright_tables::Watched| {
            let direct = flux[watched.cluster as usize].direct.as_dvec3();
            let area = f64::from(hvds.areas_m2[watched.cluster as usize]);
            (mean(albedos[watched.material as usize] * direct), area)
        };
        let light: Vec<(f64, f64)> = tables.watched.iter().map(exitance).collect();
        let least = threshold(&light, f64::from(BRIGHT), f64::from(CONTRAST));
        let is_bright: Vec<bool> = light.iter().map(|(light, area)| light / area > least).collect();
        let mut bright = vec![DVec3::ZERO; all.len()];
        let mut sources = Vec::new();
        let geometry = world.geometry();
        for (base, (own, &[watched, _])) in flux.iter().zip(&tables.ranges).enumerate().take(base_count) {
            if !has_entry[base] || !is_bright[watched as usize] {
                continue;
            }
            let direct = own.direct.as_dvec3();
            let mut cluster = base;
            while let Some(sum) = bright.get_mut(cluster) {
                *sum += direct;
                cluster = hvds.parents[cluster] as usize;
            }
            let site = tables.sites[base];
            let material = world.surfaces[site.side as usize / 2].material;
            let colour = geometry.colour_at(site.side, site.position);
            sources.push(Source {
                position: site.position,
                side: site.side,
                reach: f64::from(site.reach),
                light: albedos[material as usize] * colour * direct,
            });
        }
        Self { tables, pyramid, flux, bright, sources, world }
    }

    fn pass(&self, seed: u32) -> Bright {
        Bright::new(&self.world.context, &self.world.buffers, &self.tables, HEMISPHERE, seed).unwrap()
    }

    /// A gather at these points with random rays, and its targets.
    fn gather(&self, points: &[CachePoint], random: &mut Random) -> (Gather, Vec<u32>) {
        let (world, context, count) = (&self.world, &self.world.context, points.len() as u32);
        let clusters = world.hvds.cluster_count();
        let packing = GatherTargetPacking::new(clusters, world.materials.len(), 0.05).unwrap();
        let rays = random_rays(random, packing, clusters, count * HEMISPHERE.rays());
        let listed = MergedRayPacking::new(targets(&rays), HEMISPHERE).targets;
        let table = RayTable {
            rows_per_buffer: count,
            buffers: vec![Buffer::from_slice(context, "gather rays", &rays).unwrap()],
            colours: vec![Buffer::from_slice(context, "ray colours", &[0_u32]).unwrap()],
            has_colours: false,
        };
        let targets = (&GatherTargets::of_hits(packing), &packing);
        let merged = MergedRays::new(context, table, targets, HEMISPHERE, None).unwrap();
        let points = Buffer::from_slice(context, "cache points", points).unwrap();
        let gather = Gather::new(context, points, count, merged, HEMISPHERE, packing, false);
        (gather.unwrap(), listed)
    }

    fn sources_with<'a>(&'a self, pass: &'a Bright) -> GatherSources<'a> {
        GatherSources {
            materials: &self.world.buffers.materials,
            irradiance: &self.pyramid.irradiance,
            inverse_areas: &self.pyramid.inverse_areas,
            gloss: None,
            sky: None,
            bright: Some(BrightSources { bright: pass, scene: &self.world.buffers, pyramid: &self.pyramid }),
        }
    }

    /// Adds the light that rays of a seed bring to the records of all points of a gather.
    fn add_rays(&self, gather: &Gather, seed: u32, records: &Buffer) {
        let (context, pass) = (&self.world.context, self.pass(seed));
        let list = RecordList::all(context, gather.point_count(), gather.point_count()).unwrap();
        let run = context.run(|rec| {
            pass.record(rec, &self.world.buffers.materials, &self.pyramid);
            rec.barrier(COMPUTE_TO_COMPUTE);
            let mut scope = rec.pass(Gather::STEM);
            gather.record_radiances(&mut scope, self.sources_with(&pass), &list);
            scope.barrier(COMPUTE_TO_INDIRECT);
            let points = (&gather.cache_points, records);
            pass.record_rays(&mut scope, (&self.world.buffers, &self.pyramid), points, &list);
        });
        run.unwrap();
    }
}

/// Watched clusters hold all base clusters with entry points, none twice, and those in one cluster
/// are adjacent in their list.
#[test]
fn every_entry_point_is_watched_once() {
    let Lit { world, tables, .. } = Lit::new(World::room(), 1.0);
    let hvds = &world.hvds;
    let unweighted: Vec<u32> = hvds.unweighted.iter().copied().filter(|&c| c != NO_CLUSTER).collect();
    assert!(!unweighted.is_empty() && tables.watched.len() * 4 < hvds.levels[0].len());
    let around = |cluster: usize| {
        let mut above = vec![cluster];
        while let Some(&parent) = hvds.parents.get(above[above.len() - 1]).filter(|&&p| p != NO_CLUSTER) {
            above.push(parent as usize);
        }
        above
    };
    let mut inside = vec![Vec::new(); hvds.parents.len()];
    for (number, watched) in (0..).zip(&tables.watched) {
        around(watched.cluster as usize).into_iter().for_each(|above| inside[above].push(number));
    }
    for (cluster, inside) in (0..).zip(&inside) {
        let is_around = |number: &u32| {
            around(cluster as usize).contains(&(tables.watched[*number as usize].cluster as usize))
        };
        let own: Vec<u32> = (0..tables.watched.len() as u32).filter(is_around).collect();
        let is_base = hvds.levels[0].contains(&cluster);
        assert!(!is_base || own.is_empty() == unweighted.contains(&cluster));
        let [first, end] = tables.ranges[cluster as usize];
        let expected = if own.is_empty() { inside } else { &own };
        assert!(own.len() <= 1 && (first..end).eq(expected.iter().copied()), "cluster {cluster}");
    }
}

/// The mean over seeds is the sum over all sites of bright clusters, with its derivatives.
#[test]
fn rays_bring_the_light_of_bright_clusters() {
    for world in [World::room(), World::new(&textured(room()), 16)] {
        rays_bring_the_light_of_bright_clusters_in(Lit::new(world, 400.0));
    }
}

/// Irradiance and gradients of a record, in one vector.
fn values(record: &Record) -> [f64; 21] {
    let columns = [record.translation, record.rotation].map(|m| m.as_dmat3().to_cols_array());
    let mut all = [0.0; 21];
    all[..3].copy_from_slice(&record.irradiance.as_dvec3().to_array());
    all[3..12].copy_from_slice(&columns[0]);
    all[12..].copy_from_slice(&columns[1]);
    all
}

fn rays_bring_the_light_of_bright_clusters_in(lit: Lit) {
    let (world, context) = (&lit.world, &lit.world.context);
    assert!(lit.sources.len() > 30);
    let count = 60;
    let mut random = Random::new(5);
    let points = world.cache_points(&mut random, count, 0.1);
    let (gather, _) = lit.gather(&points, &mut random);
    let mut sums = vec![[[0.0; 21]; 2]; count];
    let dark = vec![Record::zeroed(); count];
    let records = Buffer::from_slice(context, "records", &dark).unwrap();
    for seed in 0..SEEDS {
        records.write(&dark).unwrap();
        lit.add_rays(&gather, seed, &records);
        for (sum, record) in sums.iter_mut().zip(records.read::<Record>().unwrap()) {
            for (k, value) in values(&record).into_iter().enumerate() {
                sum[0][k] += value;
                sum[1][k] += value * value;
            }
        }
    }
    let geometry = world.geometry();
    let (mut far_off, mut lit_points, mut whole) = (0, 0, [[0.0; 2]; 2]);
    for (point, [sum, squares]) in points.iter().zip(&sums) {
        let seen: Vec<&Source> =
            lit.sources.iter().filter(|source| source.is_seen_from(point, &geometry)).collect();
        let at = |offset: DVec3, turn: DVec3| -> DVec3 {
            let origin = geometry.offset_origin(point.position, point.facet).as_dvec3() + offset;
            let normal = point.normal.as_dvec3() + turn;
            seen.iter().map(|source| source.irradiance((origin, normal), &geometry)).sum()
        };
        let [tangent, bitangent] = [frame(point.normal).x_axis, frame(point.normal).y_axis];
        let mut gradients = [DMat3::ZERO; 2];
        for axis in [tangent, bitangent] {
            let step = 1e-5 * axis;
            let moved = (at(step, DVec3::ZERO) - at(-step, DVec3::ZERO)) / 2e-5;
            let turned = (at(DVec3::ZERO, step) - at(DVec3::ZERO, -step)) / 2e-5;
            for (gradient, change) in gradients.iter_mut().zip([moved, turned]) {
                *gradient += DMat3::from_cols(change.x * axis, change.y * axis, change.z * axis);
            }
        }
        let irradiance = at(DVec3::ZERO, DVec3::ZERO);
        lit_points += usize::from(irradiance != DVec3::ZERO);
        let expected: Vec<f64> = irradiance
            .to_array()
            .into_iter()
            .chain(gradients.iter().flat_map(|gradient| gradient.to_cols_array()))
            .collect();
        let size = expected.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for (k, expected) in expected.into_iter().enumerate() {
            let mean = sum[k] / f64::from(SEEDS);
            let variance = (squares[k] / f64::from(SEEDS) - mean * mean).max(0.0) / f64::from(SEEDS);
            far_off += usize::from((mean - expected).abs() > 5.0 * variance.sqrt() + 1e-3 * size);
            whole[usize::from(k >= 3)][0] += mean.abs();
            whole[usize::from(k >= 3)][1] += expected.abs();
        }
    }
    // A ray may pass an edge in f32 that it meets in f64.
    println!("{far_off} values are far off, {lit_points} points are lit, {whole:?}");
    assert!(lit_points * 2 > count, "{lit_points} of {count} points are lit");
    assert!(far_off * 100 < count * 21, "{far_off} values are far off");
    assert!((whole[0][0] / whole[0][1] - 1.0).abs() < 0.02, "{whole:?}");
    assert!((whole[1][0] / whole[1][1] - 1.0).abs() < 0.04, "{whole:?}");
    assert_silent(context);
}

/// Where nothing is much brighter than the mean, no ray is cast and gather rays leave nothing out.
#[test]
fn even_light_is_left_to_gather_rays() {
    let lit = Lit::new(World::room(), 4.0);
    assert!(lit.sources.is_empty());
    gather_targets_leave_out_the_light_of_bright_clusters_in(&lit);
    let mut random = Random::new(5);
    let points = lit.world.cache_points(&mut random, 20, 0.1);
    let (gather, _) = lit.gather(&points, &mut random);
    let records = Buffer::from_slice(&lit.world.context, "records", &[Record::zeroed(); 20]).unwrap();
    lit.add_rays(&gather, 1, &records);
    assert!(records.read::<Record>().unwrap().iter().all(|record| values(record) == [0.0; 21]));
}

#[test]
fn gather_targets_leave_out_the_light_of_bright_clusters() {
    gather_targets_leave_out_the_light_of_bright_clusters_in(&Lit::new(World::room(), 400.0));
}

fn gather_targets_leave_out_the_light_of_bright_clusters_in(lit: &Lit) {
    let (world, context) = (&lit.world, &lit.world.context);
    let mut random = Random::new(9);
    let points = world.cache_points(&mut random, 2000, 0.1);
    let (gather, listed) = lit.gather(&points, &mut random);
    lit.add_rays(&gather, 1, &gather.records);
    let radiances: Vec<Vec4> = gather.radiances()[0].read_range(0, listed.len()).unwrap();
    let materials = world.reflectances();
    let (mut less, mut near) = (0, 0);
    for (word, radiance) in listed.iter().zip(radiances) {
        let (GatherTarget::Cluster(cluster), met) = gather.packing.unpack(*word).unwrap() else { panic!() };
        let cluster = cluster as usize;
        let flux = &lit.flux[cluster];
        let left_out = if met.is_far { lit.bright[cluster] } else { DVec3::ZERO };
        let area = f64::from(world.hvds.areas_m2[cluster]);
        let whole = (flux.direct + flux.indirect).as_dvec3();
        let albedo = materials[met.material as usize].diffuse.as_dvec3();
        let expected = albedo * (whole - left_out) / (std::f64::consts::PI * area);
        let scale = (albedo * whole).max_element() / area;
        let difference = (radiance.truncate().as_dvec3() - expected).abs().max_element();
        assert!(difference <= 1e-5 * scale, "cluster {cluster}: {radiance}, not {expected}");
        less += usize::from(left_out != DVec3::ZERO);
        near += usize::from(!met.is_far && lit.bright[cluster] != DVec3::ZERO);
    }
    assert_eq!(less > 30 && near > 30, !lit.sources.is_empty(), "{less} far and {near} near ones");
    assert_silent(context);
}

//! Broad lobes at records, and the pixels that read them.

use crate::antialias::Frame;
use crate::common::assert_silent;
use crate::gloss::{Glossy, HEMISPHERE, SEED, camera, lights};
use crate::gloss_readers::unpack_direction;
use crate::world::{Random, SUM, World, assert_near, room};
use glam::{DVec3, Vec3, Vec4};
use lightpaths::cpu::gloss::{LobeRay, LobeRecord, lobe_albedo, lobe_at_record, lobe_from_records};
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::antialias::{NO_EDGE, SeenFragments};
use lightpaths::passes::frame::bin_reads::BinReads;
use lightpaths::passes::frame::gather::{Gather, GatherSources};
use lightpaths::passes::frame::gloss::Gloss;
use lightpaths::passes::frame::gloss_pixels::{GlossPixels, LOBE_RAYS, PixelGloss, Surroundings};
use lightpaths::passes::frame::gloss_records::{
    BroadLobes, GlossRecord, GlossRecords, LobeExponents, RecordLobes, lobe_albedo as table_albedo,
};
use lightpaths::passes::frame::needed_records::RecordList;
use lightpaths::passes::frame::record_tree::RecordTree;
use lightpaths::passes::frame::splat::{SeenSurfaces, Splat, SplatWeight, WeightRange};
use lightpaths::passes::gather_targets::GatherTargets;
use lightpaths::passes::precompute::gather_rays::{RayDirections, RayTable};
use lightpaths::passes::precompute::merged_rays::{MergedRayLists, MergedRays};
use lightpaths::scene::Material;
use lightpaths::types::{NO_SIDE, NO_TARGET, PixelSurface};

/// The albedo of a lobe is the cosine of its mirror direction unless the surface cuts it off.
#[test]
fn albedos_of_lobes_equal_their_integrals() {
    for exponent in [1.0, 2.0, 7.5, 20.0, 100.0] {
        for cosine in [0.0, 0.1, 0.35, 0.6, 0.9, 1.0] {
            let (found, reference) = (table_albedo(exponent, cosine), lobe_albedo(exponent, cosine));
            assert!((found - reference).abs() < 1e-3, "{exponent}, {cosine}: {found}, {reference}");
        }
    }
    assert!((table_albedo(100.0, 0.8) - 0.8).abs() < 1e-3);
}

#[test]
fn exponents_are_exact_up_to_four() {
    let plain = &room().materials[0];
    let material =
        |exponent, specular| Material { specular: Vec3::splat(specular), exponent, ..plain.clone() };
    let of = |exponents: &[f32]| {
        let materials: Vec<_> = exponents.iter().map(|&exponent| material(exponent, 0.2)).collect();
        LobeExponents::new(&materials, BroadLobes { little: 128, strong: 0 })
    };
    assert_eq!(of(&[]).count, 0);
    let lobes = BroadLobes { little: 128, strong: 128 };
    assert_eq!(LobeExponents::new(&[material(5.0, 0.0)], lobes).count, 0);
    assert_eq!((of(&[20.0, 20.0]).count, of(&[20.0, 20.0]).values.x), (1, 20.0));
    assert_eq!(
        (of(&[40.0, 3.0, 7.0]).count, of(&[40.0, 3.0, 7.0]).values.truncate()),
        (3, Vec3::new(3.0, 7.0, 40.0))
    );
    assert_eq!(of(&[40.0, 3.0, 7.0, 5.0]).values, Vec4::new(3.0, 5.0, 7.0, 40.0));
    // Of more, the ends are kept and the others stand between.
    let many = of(&[2.0, 3.0, 5.0, 8.0, 128.0]);
    assert!(many.values.abs_diff_eq(Vec4::new(2.0, 8.0, 32.0, 128.0), 1e-3), "{many:?}");
    // A lobe of fewer than four rays is no broad one.
    assert_eq!(of(&[2.0, 129.0]).count, 1);
}

/// A strong lobe needs eight times the rays unless it covers much of the scene.
#[test]
fn strong_lobes_take_records_where_rays_are_many() {
    let plain = Material { diffuse: Vec3::splat(0.3), ..room().materials[0].clone() };
    let material =
        |specular, exponent| Material { specular: Vec3::splat(specular), exponent, ..plain.clone() };
    let materials = |strong: f32| [material(0.2, 5.0), material(strong, 5.0), material(0.0, 5.0)];
    let of = |strong: f32, parts: [f64; 3]| BroadLobes::new(&materials(strong), &parts, 256);
    assert_eq!(of(0.21, [0.1, 0.3, 0.6]), BroadLobes { little: 128, strong: 16 });
    assert_eq!(of(0.21, [0.1, 0.4, 0.5]), BroadLobes { little: 128, strong: 128 });
    // Exactly four tenths of the reflected light is little.
    assert_eq!(of(0.2, [0.1, 0.4, 0.5]), BroadLobes { little: 128, strong: 16 });
    let lobes = of(0.21, [0.1, 0.3, 0.6]);
    let is_held = |specular, exponent| lobes.hold(&material(specular, exponent));
    assert!(is_held(0.2, 128.0) && !is_held(0.2, 129.0));
    assert!(is_held(0.21, 16.0) && !is_held(0.21, 17.0));
    assert!(!is_held(0.0, 5.0));
    assert_eq!(lobes.packed(), 16 << 16 | 128);
}

#[test]
fn broad_lobes_of_pixels_come_from_records() {
    broad_lobes_come_from_records_in(&Glossy::new(World::glossy_room()), false);
    broad_lobes_come_from_records_in(&Glossy::new(World::textured_glossy_room()), true);
}

fn broad_lobes_come_from_records_in(glossy: &Glossy, has_colours: bool) {
    let (world, context) = (&glossy.world, &glossy.world.context);
    let mut random = Random::new(71);
    let point_count = glossy.points.len() as u32;
    let clusters = world.hvds.cluster_count();
    let irradiance: Vec<Vec3> = (0..clusters).map(|_| 1.0 + random.cube()).collect();
    let irradiance = Buffer::from_slice(context, "irradiance", &irradiance).unwrap();
    let inverse_areas =
        Buffer::from_slice(context, "inverse areas", &vec![1.0_f32; clusters as usize]).unwrap();
    let gloss = Gloss::new(context, &world.buffers, &glossy.tables, 1, 1.0).unwrap();
    let fluxes: Vec<Vec3> = glossy.tables.bins.iter().map(|_| 0.2 * (1.0 + random.cube())).collect();
    gloss.fluxes.write(&fluxes).unwrap();

    // A hundredth of the rays meets nothing.
    let mut packed = glossy.packed.clone();
    packed.iter_mut().filter(|_| random.below(100) == 0).for_each(|ray| ray.target = NO_TARGET);
    let colours: Vec<u32> = packed.iter().map(|_| random.word()).collect();
    let table = RayTable {
        rows_per_buffer: point_count,
        buffers: vec![Buffer::from_slice(context, "gather rays", &packed).unwrap()],
        colours: vec![Buffer::from_slice(context, "ray colours", &colours).unwrap()],
        has_colours,
    };
    let directions = RayDirections::new(&glossy.points, HEMISPHERE, SEED);
    let packing = glossy.target_packing;
    let targets = GatherTargets::of_hits(packing);
    let merged_rays =
        MergedRays::new(context, table, (&targets, &packing), HEMISPHERE, Some(&directions)).unwrap();
    let lists = merged_rays.lists().unwrap();
    let points = Buffer::from_slice(context, "cache points", &glossy.points).unwrap();
    let gather = Gather::new(context, points, point_count, merged_rays, HEMISPHERE, packing, true).unwrap();

    // The second material's exponent is one of the lobes'; the first's stands between two.
    let [sharp, broad] = [0, 1].map(|material| world.materials[material].exponent);
    let values = Vec4::new(broad, 0.75 * sharp, 1.5 * sharp, 0.0);
    assert!(broad < values.y);
    let most = (2.0 * sharp) as u32;
    let exponents = LobeExponents { values, count: 3, broad: BroadLobes { little: most, strong: most } };
    let records = GlossRecords::new(context, &gather, exponents).unwrap();

    let camera = camera([29, 23]);
    let frame = Frame::new(world, &lights()[..1], &camera, 4);
    let (view, count) = (frame.view, camera.size[0] * camera.size[1]);
    let tree = RecordTree::new(context, &glossy.points, &world.triangles).unwrap();
    let (pixels, fragments) = (&frame.buffers[0], &frame.antialias.fragments);
    let (edge_points, point_groups) = (&fragments.edge_points, &fragments.point_groups);
    let seen_surfaces = SeenSurfaces { pixels, edge_points, point_groups };
    let seen = SeenFragments { pixels, antialias: &frame.antialias };
    let splat = Splat::new(context, tree.into(), camera.size, frame.antialias.capacity.points).unwrap();
    let mut pixels_pass =
        GlossPixels::new(context, &world.buffers, count, LOBE_RAYS, packing.cluster_bits, [true; 2]).unwrap();
    (pixels_pass.broad, pixels_pass.takes_samples) = (exponents.broad, false);
    let bins = BinReads::none(context).unwrap();
    let contributions = Buffer::from_slice(context, "contributions", &glossy.paths.contributions).unwrap();
    let sources = GatherSources {
        materials: &world.buffers.materials,
        irradiance: &irradiance,
        inverse_areas: &inverse_areas,
        gloss: Some(&gloss),
        sky: None,
        bright: None,
    };
    let list = RecordList::all(context, point_count, gather.merged_rays.records_per_chunk).unwrap();
    context
        .run(|rec| {
            pixels_pass.record_rays(rec, &world.buffers, (&world.clusters, &bins), seen, &view, SEED);
            rec.barrier(COMPUTE_TO_COMPUTE);
            splat.record(rec, &world.buffers.surfaces, &gather.cache_points, seen_surfaces);
            rec.barrier(COMPUTE_TO_COMPUTE);
            gather.record(rec, sources, &list);
            rec.barrier(COMPUTE_TO_COMPUTE);
            records.record(rec, &world.buffers, (seen, &splat), &gather, view.position);
            rec.barrier(COMPUTE_TO_COMPUTE);
            let around = Surroundings {
                scene: &world.buffers,
                seen,
                irradiance: &irradiance,
                inverse_areas: &inverse_areas,
                gloss: &gloss,
                contributions: &contributions,
                lobes: Some(RecordLobes { lobes: &records, splat: &splat, eye: view.position }),
            };
            pixels_pass.record(rec, around, &[], [&[], &[]]);
        })
        .unwrap();

    // What each pixel shows of glossy surfaces: weight, surface, and the records that it reads.
    let pixels = &frame.pixels;
    let [ranges, weights] = splat.lists();
    let ranges: Vec<WeightRange> = ranges.read().unwrap();
    let weights: Vec<SplatWeight> = weights.read().unwrap();
    let material_of = |pixel: &PixelSurface| &world.materials[glossy.material_of(pixel.side)];
    let is_glossy = |pixel: &PixelSurface| pixel.side != NO_SIDE && material_of(pixel).specular != Vec3::ZERO;
    let weights_in = |range: WeightRange| &weights[range.first as usize..range.end as usize];
    let (firsts, fragments, surfaces) = (frame.firsts(), frame.fragments(), frame.fragment_surfaces());
    let edge_ranges: Vec<WeightRange> = splat.edge_ranges().read().unwrap();
    let (mut beside, mut apart) = (0, 0);
    let mut shown_by = |pixel: usize| -> Vec<(f64, PixelSurface, &[SplatWeight])> {
        let number = frame.numbers[pixel];
        if number == NO_EDGE {
            let centre = (1.0, pixels[pixel], weights_in(ranges[pixel]));
            return if is_glossy(&centre.1) { vec![centre] } else { Vec::new() };
        }
        let mut of_fragment = |index: usize| {
            let (fragment, surface) = (&fragments[index], surfaces[index]);
            let source = frame.pixel_at(pixel as u32, fragment.what & 15) as usize;
            let is_apart = fragment.point != u32::MAX;
            (beside, apart) = (beside + u32::from(source != pixel), apart + u32::from(is_apart));
            let range = if is_apart { edge_ranges[fragment.point as usize] } else { ranges[source] };
            (f64::from(fragment.what >> 14), surface, weights_in(range))
        };
        let shown = firsts[number as usize]..firsts[number as usize + 1];
        shown.filter(|&index| is_glossy(&surfaces[index])).map(&mut of_fragment).collect()
    };
    let shown: Vec<_> = (0..pixels.len()).map(&mut shown_by).collect();
    assert!(beside > 10 && apart > 10, "{beside} fragments take another pixel's records, {apart} their own");
    let mut read: Vec<u32> =
        shown.iter().flatten().flat_map(|part| part.2.iter().map(|weight| weight.record)).collect();
    read.sort_unstable();
    read.dedup();
    assert!(read.len() > 15, "{} records", read.len());
    let lobes: Vec<GlossRecord> = records.records.read().unwrap();
    let of_record = lobe_rays(&lists, &gather);
    let mut whole = 0;
    for &record in &read {
        let point = &glossy.points[record as usize];
        let (position, normal) = (point.position.as_dvec3(), point.normal.as_dvec3());
        let mirror = (position - view.position.as_dvec3()).normalize().reflect(normal);
        let rays = &of_record[record as usize];
        whole += usize::from(rays.iter().map(|ray| ray.0).sum::<f64>() == f64::from(HEMISPHERE.rays()));
        for (place, exponent) in exponents.values.to_array().into_iter().take(3).enumerate() {
            let found = &lobes[place * glossy.points.len() + record as usize];
            assert!((found.mirror.as_dvec3() - mirror).length() < 1e-5);
            if mirror.dot(normal) < 0.02 {
                continue;
            }
            let at =
                |mirror: DVec3| lobe_at_record(rays, HEMISPHERE.rays(), mirror, normal, f64::from(exponent));
            let reference = at(mirror);
            // The table of albedos is linear between its entries, and directions have 16 bits.
            assert_near(found.radiance, reference, 5e-3, 1e-2, "lobe at a record");
            let turn = 1e-4 * mirror.any_orthonormal_vector();
            let slope = (at((mirror + turn).normalize()) - at((mirror - turn).normalize())) / 2e-4;
            let change = found.change.as_dmat3().transpose() * (turn * 1e4);
            // Lobes that bring next to nothing are zero in f32.
            let scale = (2.0 * reference.max_element()).max(1e-30);
            assert_near(change.as_vec3(), slope, 0.05, scale, "turned lobe");
        }
    }
    assert!(whole > 5 && whole < read.len(), "{whole} of {} records have all rays", read.len());

    let found: Vec<PixelGloss> = pixels_pass.radiance.read().unwrap();
    let mut lit = 0;
    for (index, shown) in shown.iter().enumerate() {
        let all: f64 = shown.iter().map(|part| part.0).sum();
        let mut reference = DVec3::ZERO;
        for (weight, surface, read) in shown {
            let mirror = (surface.position - view.position).as_dvec3().normalize();
            let mirror = mirror.reflect(surface.normal.as_dvec3());
            let of = |place: usize| {
                let read = read.iter().map(|splat| {
                    let lobe = &lobes[place * glossy.points.len() + splat.record as usize];
                    LobeRecord {
                        weight: f64::from(splat.weight.abs()),
                        radiance: lobe.radiance.as_dvec3(),
                        mirror: lobe.mirror.as_dvec3(),
                        change: lobe.change.as_dmat3(),
                    }
                });
                lobe_from_records(&read.collect::<Vec<_>>(), mirror, f64::from(exponents.values[place]))
            };
            let material = material_of(surface);
            let radiance = if material.exponent == broad {
                of(0)
            } else {
                let fraction = f64::from(values.z / sharp).ln() / f64::from(values.z / values.y).ln();
                of(2).lerp(of(1), fraction)
            };
            reference += weight / all * material.specular.as_dvec3() * radiance;
        }
        lit += usize::from(reference.max_element() > 0.0);
        assert_near(found[index].indirect, reference, SUM, 1e-3, "pixel");
    }
    assert!(lit > 50, "{lit} pixels");
    assert_silent(context);
}

/// The merged rays of each record with the radiance that the device has found for their targets.
fn lobe_rays(lists: &MergedRayLists, gather: &Gather) -> Vec<Vec<LobeRay>> {
    let [radiances, lobes] = gather.radiances();
    let radiances: Vec<Vec4> = radiances.read().unwrap();
    let lobes: Vec<Vec3> = lobes.read().unwrap();
    let bits = gather.merged_rays.target_bits;
    let mut next = 0;
    let mut rays_of = |&count: &u32| {
        let own = next..next + count as usize;
        next = own.end;
        own.map(|index| {
            let word = lists.merged_rays[index].target_index;
            let target = (word & ((1 << bits) - 1)) as usize;
            let mut radiance = radiances[target].truncate().as_dvec3();
            if let Some(&colour) = lists.colours.get(index) {
                radiance = radiance * unpack_colour(colour) + lobes[target].as_dvec3();
            }
            (f64::from(word >> bits) + 1.0, unpack_direction(lists.directions[index]), radiance)
        })
        .collect()
    };
    lists.counts.iter().map(&mut rays_of).collect()
}

//! Readers of glossy radiance: gather rays, through gloss bins, and rays of glossy pixels.

use crate::gloss::{DIRECTIONS, Glossy, HEMISPHERE, SEED, camera};
use crate::world::{Random, SUM, assert_near};
use glam::{DVec2, DVec3, Vec3};
use lightpaths::cpu::gather;
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::antialias::{Antialias, SeenFragments};
use lightpaths::passes::frame::bin_reads::BinReads;
use lightpaths::passes::frame::gather::{Gather, GatherSources};
use lightpaths::passes::frame::gloss::{Gloss, GlossLight};
use lightpaths::passes::frame::gloss_pixels::{
    GlossPixels, GlossRay, LOBE_RAYS, NO_GLOSS_BIN, PixelGloss, Surroundings,
};
use lightpaths::passes::frame::needed_records::RecordList;
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::gather_targets::GatherTargets;
use lightpaths::passes::precompute::gather_rays::RayTable;
use lightpaths::passes::precompute::merged_rays::{MergedRayPacking, MergedRays};
use lightpaths::types::{MergedRay, NO_CLUSTER, NO_TARGET, PixelSurface, Record, View};
use std::f64::consts::PI;

/// Records of rays that read gloss bins: the gloss bin's flux over area is added to albedo times
/// irradiance of its cluster.
pub(crate) fn gathered_bins_equal_the_reference(glossy: &Glossy, gloss: &Gloss, fluxes: &[Vec3]) {
    let (world, context) = (&glossy.world, &glossy.world.context);
    let mut random = Random::new(64);
    let clusters = world.hvds.cluster_count();
    let irradiance: Vec<Vec3> = (0..clusters).map(|_| 1.0 + random.cube()).collect();
    let inverse_areas: Vec<f32> = (0..clusters).map(|_| 10.0 * random.unit()).collect();
    let colours: Vec<u32> = glossy.packed.iter().map(|_| random.word()).collect();
    let point_count = glossy.points.len() as u32;
    let table = |has_colours| RayTable {
        rows_per_buffer: point_count,
        buffers: vec![Buffer::from_slice(context, "gather rays", &glossy.packed).unwrap()],
        colours: vec![Buffer::from_slice(context, "ray colours", &colours).unwrap()],
        has_colours,
    };
    let irradiance_buffer = Buffer::from_slice(context, "irradiance", &irradiance).unwrap();
    let areas_buffer = Buffer::from_slice(context, "inverse areas", &inverse_areas).unwrap();
    let albedos: Vec<Vec3> = world.materials.iter().map(|material| material.diffuse).collect();
    let bin_pairs = glossy.tables.bins.iter().zip(fluxes);
    let bins: Vec<(u32, DVec3)> = bin_pairs
        .map(|(gloss_bin, flux)| {
            (gloss_bin.cluster, flux.as_dvec3() * f64::from(inverse_areas[gloss_bin.cluster as usize]))
        })
        .collect();
    for has_colours in [false, true] {
        let points = Buffer::from_slice(context, "cache points", &glossy.points).unwrap();
        let (packing, rays) = (glossy.target_packing, table(has_colours));
        let list = RecordList::all(context, point_count, rays.rows_per_buffer).unwrap();
        let merged_rays =
            MergedRays::new(context, rays, (&GatherTargets::of_hits(packing), &packing), HEMISPHERE, None)
                .unwrap();
        let pass = Gather::new(context, points, point_count, merged_rays, HEMISPHERE, packing, true).unwrap();
        let sources = GatherSources {
            materials: &world.buffers.materials,
            irradiance: &irradiance_buffer,
            inverse_areas: &areas_buffer,
            gloss: Some(gloss),
            sky: None,
            bright: None,
        };
        context.run(|rec| pass.record(rec, sources, &list)).unwrap();
        let records: Vec<Record> = pass.records.read().unwrap();
        let targets = glossy.packed.iter().map(|ray| ray.target).filter(|&target| target != NO_TARGET);
        let merging = MergedRayPacking::new(targets.collect(), HEMISPHERE);
        let sources = gather::Sources {
            albedos: &albedos,
            irradiance: &irradiance,
            targets: &merging.targets,
            target_bits: merging.target_bits,
            cluster_bits: packing.cluster_bits,
            min_distance: packing.min_distance,
            rotation_unit: merging.rotation_unit(),
            bins: &bins,
        };
        let strata = Strata { rings: HEMISPHERE.rings, sectors: HEMISPHERE.sectors };
        let rows = glossy.packed.chunks_exact(strata.rays() as usize);
        let colour_rows = colours.chunks_exact(strata.rays() as usize);
        for ((record, point), (row, colours)) in records.iter().zip(&glossy.points).zip(rows.zip(colour_rows))
        {
            let colours = if has_colours { colours } else { &[] };
            let (merged_rays, colours): (Vec<MergedRay>, Vec<u32>) =
                merging.merged_rays(row, colours, None).into_iter().map(|m| (m.ray, m.colour)).unzip();
            let colours = if has_colours { &colours[..] } else { &[] };
            let reference = gather::gather(sources, strata, point.normal, &merged_rays, colours);
            assert_near(record.irradiance, reference.irradiance, SUM, 0.0, "gathered bins");
        }
    }
}

/// Glossy pixels whose rays meet glossy surfaces, with no other light: the sum over the vertices
/// there, one by one.
pub(crate) fn pixels_of_glossy_surfaces_equal_the_reference(
    glossy: &Glossy,
    gloss: &Gloss,
    (contributions, lights): (&Buffer, &[GlossLight<'_>]),
    hits: &[(Vec3, &Buffer)],
    sent: impl Fn(u32, DVec3) -> DVec3,
) {
    let (world, context) = (&glossy.world, &glossy.world.context);
    let mut random = Random::new(65);
    let camera = camera([13, 11]);
    let view = View::from(&camera);
    let count = camera.size[0] * camera.size[1];
    let primary = Primary::new(context, count).unwrap();
    let antialias = Antialias::new(context, camera.size, 0).unwrap();
    let seen = SeenFragments { pixels: &primary.pixels, antialias: &antialias };
    let clusters = world.hvds.cluster_count() as usize;
    let inverse_areas: Vec<f32> = (0..clusters).map(|_| 1.0 + random.unit()).collect();
    let bits = glossy.packing.cluster_bits;
    let pass = GlossPixels::new(context, &world.buffers, count, LOBE_RAYS, bits, [true; 2]).unwrap();
    let bins = BinReads::none(context).unwrap();
    let around = Surroundings {
        scene: &world.buffers,
        seen,
        irradiance: &Buffer::from_slice(context, "irradiance", &vec![Vec3::ZERO; clusters]).unwrap(),
        inverse_areas: &Buffer::from_slice(context, "inverse areas", &inverse_areas).unwrap(),
        gloss,
        contributions,
        lobes: None,
    };
    context
        .run(|rec| {
            primary.record(rec, &world.buffers, &view);
            rec.barrier(COMPUTE_TO_COMPUTE);
            pass.record_rays(rec, &world.buffers, (&world.clusters, &bins), seen, &view, SEED);
            rec.barrier(COMPUTE_TO_COMPUTE);
            pass.record(rec, around, lights, [hits, &[]]);
        })
        .unwrap();
    let pixels: Vec<PixelSurface> = primary.pixels.read().unwrap();
    let rays: Vec<GlossRay> = pass.rays.read().unwrap();
    let found: Vec<PixelGloss> = pass.radiance.read().unwrap();
    let materials = world.reflectances();
    let is_glossy = |material: u32| materials[material as usize].specular != Vec3::ZERO;
    let listed = (0..count as usize)
        .filter(|&pixel| is_glossy(glossy.material_of(pixels[pixel].side) as u32))
        .zip(rays.chunks_exact(LOBE_RAYS as usize));
    let mut lit = 0;
    for (pixel, rays) in listed {
        let mut sum = DVec3::ZERO;
        for ray in rays.iter().filter(|ray| ray.target != NO_TARGET && is_glossy(ray.target >> bits)) {
            let cluster = ray.target & ((1 << bits) - 1);
            let area = f64::from(inverse_areas[cluster as usize]);
            sum += f64::from(ray.weight) * area * sent(cluster, unpack_direction(ray.direction));
        }
        let specular = materials[glossy.material_of(pixels[pixel].side)].specular.as_dvec3();
        let reference = specular * sum / (f64::from(LOBE_RAYS) * PI);
        lit += usize::from(reference.max_element() > 0.0);
        assert_near(found[pixel].indirect, reference, SUM, 1e-3 * reference.max_element(), "pixel");
    }
    assert!(lit > 20, "{lit} pixels see glossy surfaces");
}

/// Rays of glossy pixels that meet broad lobes read the gloss bins of gather rays: of the cluster
/// that they meet, or of an ancestor, in the direction of the pixel. The pixels show the
/// radiance of these gloss bins.
pub(crate) fn pixels_read_the_bins_of_broad_lobes(glossy: &Glossy, gloss: &Gloss, contributions: &Buffer) {
    let (world, context) = (&glossy.world, &glossy.world.context);
    let camera = camera([29, 23]);
    let (view, count) = (View::from(&camera), camera.size[0] * camera.size[1]);
    let primary = Primary::new(context, count).unwrap();
    let antialias = Antialias::new(context, camera.size, 0).unwrap();
    let seen = SeenFragments { pixels: &primary.pixels, antialias: &antialias };
    let clusters = world.hvds.cluster_count() as usize;
    let bits = glossy.packing.cluster_bits;
    let materials = world.reflectances();
    let exponents: Vec<f32> = materials[..2].iter().map(|material| material.exponent).collect();
    let between = 0.5 * (exponents[0] + exponents[1]);
    assert!(exponents.iter().any(|&n| n < between) && exponents.iter().any(|&n| n > between));
    let mut bins = BinReads::new(context, &glossy.tables, DIRECTIONS).unwrap();
    bins.max_exponent = between;
    let fluxes: Vec<Vec3> = gloss.fluxes.read().unwrap();
    let irradiance = Buffer::from_slice(context, "irradiance", &vec![Vec3::ZERO; clusters]).unwrap();
    let inverse_areas = Buffer::from_slice(context, "inverse areas", &vec![1.0_f32; clusters]).unwrap();
    let pass = GlossPixels::new(context, &world.buffers, count, LOBE_RAYS, bits, [true; 2]).unwrap();
    let around = Surroundings {
        scene: &world.buffers,
        seen,
        irradiance: &irradiance,
        inverse_areas: &inverse_areas,
        gloss,
        contributions,
        lobes: None,
    };
    context
        .run(|rec| {
            primary.record(rec, &world.buffers, &view);
            rec.barrier(COMPUTE_TO_COMPUTE);
            pass.record_rays(rec, &world.buffers, (&world.clusters, &bins), seen, &view, SEED);
            rec.barrier(COMPUTE_TO_COMPUTE);
            pass.record(rec, around, &[], [&[], &[]]);
        })
        .unwrap();
    let pixels: Vec<PixelSurface> = primary.pixels.read().unwrap();
    let rays: Vec<GlossRay> = pass.rays.read().unwrap();
    let found: Vec<PixelGloss> = pass.radiance.read().unwrap();
    let is_glossy = |material: u32| materials[material as usize].specular != Vec3::ZERO;
    let listed = (0..count as usize)
        .filter(|&pixel| is_glossy(glossy.material_of(pixels[pixel].side) as u32))
        .zip(rays.chunks_exact(LOBE_RAYS as usize));
    let (mut broad, mut read, mut off) = (0, 0, 0);
    for (pixel, rays) in listed {
        let mut sum = DVec3::ZERO;
        for ray in rays.iter().filter(|ray| ray.target != NO_TARGET) {
            let (cluster, material) = (ray.target & ((1 << bits) - 1), ray.target >> bits);
            if !is_glossy(material) || materials[material as usize].exponent > between {
                assert_eq!(ray.gloss_bin, NO_GLOSS_BIN);
                continue;
            }
            broad += 1;
            if ray.gloss_bin == NO_GLOSS_BIN {
                continue;
            }
            read += 1;
            let gloss_bin = &glossy.tables.bins[ray.gloss_bin as usize];
            // Of the cluster, a descendant or an ancestor.
            let holds = |mut cluster: u32, within: u32| {
                while cluster != NO_CLUSTER && cluster != within {
                    cluster = world.hvds.parents[cluster as usize];
                }
                cluster != NO_CLUSTER
            };
            assert!(holds(cluster, gloss_bin.cluster) || holds(gloss_bin.cluster, cluster));
            let bins =
                [unpack_direction(ray.direction), gloss_bin.direction.as_dvec3()].map(|d| DIRECTIONS.bin(d));
            // A direction near the border of two bins.
            off += usize::from(bins[0] != bins[1]);
            sum += f64::from(ray.weight) * fluxes[ray.gloss_bin as usize].as_dvec3();
        }
        let specular = materials[glossy.material_of(pixels[pixel].side)].specular.as_dvec3();
        let reference = specular * sum / (f64::from(LOBE_RAYS) * PI);
        assert_near(found[pixel].indirect, reference, SUM, 1e-3 * reference.max_element(), "pixel");
    }
    assert!(broad > 100 && 2 * read > broad, "{read} of {broad} rays read bins");
    assert!(50 * off <= read, "{off} of {read} in another bin");
}

/// A unit direction in two 16-bit integers of the octahedral map.
pub(crate) fn unpack_direction(word: u32) -> DVec3 {
    let half = |bits: u32| (f64::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let p = DVec2::new(half(word & 0xffff), half(word >> 16));
    let z = 1.0 - p.abs().element_sum();
    let flat = if z >= 0.0 { p } else { (1.0 - DVec2::new(p.y, p.x).abs()) * DVec2::ONE.copysign(p) };
    flat.extend(z).normalize()
}

//! Glossy pixels: their samples, their rays, and the light along these rays.

use crate::antialias::Frame;
use crate::common::assert_silent;
use crate::gloss::{Glossy, HEMISPHERE, SEED, camera, lights};
use crate::world::{FLOAT, Random, World, assert_near};
use glam::{DVec2, DVec3, Vec3};
use lightpaths::cpu::antialias::{place_in_pixel, seen_on};
use lightpaths::cpu::gather_rays::Tracing;
use lightpaths::cpu::gloss_pixels::{self, Sample};
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::antialias::{NO_EDGE, SeenFragments};
use lightpaths::passes::frame::bin_reads::BinReads;
use lightpaths::passes::frame::gloss::Gloss;
use lightpaths::passes::frame::gloss_pixels::{GlossPixels, GlossRay, LOBE_RAYS, PixelGloss, Surroundings};
use lightpaths::passes::frame::gloss_records::BroadLobes;
use lightpaths::passes::frame::gloss_samples::GlossPart;
use lightpaths::passes::precompute::gather_rays;
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::{Light, LightKind, Naming};
use lightpaths::types::{NO_SIDE, NO_TARGET, PixelSurface, View};
use std::f64::consts::PI;
use std::ops::Range;

/// For each edge pixel, its samples on each fragment, if that is glossy.
fn glossy_members(frame: &Frame, is_glossy: &impl Fn(u32) -> bool) -> Vec<Option<Vec<Vec<u32>>>> {
    let count = frame.samples_per_edge(frame.edge_count()) as usize;
    let (samples, firsts, surfaces) = (frame.samples(), frame.firsts(), frame.fragment_surfaces());
    let members = |edge: usize| {
        let fragments = firsts[edge]..firsts[edge + 1];
        let of_fragment = |fragment: usize| {
            let own = fragment - firsts[edge];
            let on_it = |&number: &u32| samples[edge * count + number as usize].1 == own;
            let all = if is_glossy(surfaces[fragment].side) { 0..count as u32 } else { 0..0 };
            all.filter(on_it).collect()
        };
        fragments.map(of_fragment).collect()
    };
    let of_pixel = |&number: &u32| (number != NO_EDGE && count > 0).then(|| members(number as usize));
    frame.numbers[..frame.pixels.len()].iter().map(of_pixel).collect()
}

/// A member of an edge pixel, on a side.
fn on_member(tracing: &Tracing<'_>, view: &View, pixel: u32, (member, side): (u32, u32)) -> Sample {
    let corner = DVec2::new(f64::from(pixel % view.width), f64::from(pixel / view.width));
    let point = corner + place_in_pixel(member, pixel);
    Sample { surface: seen_on(tracing.geometry, view, point, side), point }
}

#[test]
fn glossy_pixels_equal_the_reference() {
    for world in [World::glossy_room(), World::textured_glossy_room()] {
        glossy_pixels_equal_the_reference_in(world);
    }
}

fn glossy_pixels_equal_the_reference_in(world: World) {
    let glossy = Glossy::new(world);
    let world = &glossy.world;
    let mut random = Random::new(63);
    let path_count = glossy.entry_points.len();
    let gloss = Gloss::new(&world.context, &world.buffers, &glossy.tables, path_count as u32, 1.0).unwrap();
    let has_images = world.buffers.textures.are_used;
    // No cluster is glossy here; the tests in `gloss` cover that.
    let mut lights = lights();
    // Through the middle of the room, so that pixels see fronts and backs of both, with
    // blocks before them.
    let panel = |edges: [Vec3; 2]| LightKind::Area {
        corner: Vec3::new(-0.8, -0.15, -0.8),
        edge_u: 1.6 * edges[0],
        edge_v: 1.6 * edges[1],
        radiance: Vec3::ONE,
        samples: 4,
    };
    let panels = [[Vec3::X, Vec3::Z], [Vec3::Z, Vec3::X]].map(panel);
    lights.extend(light_sources(&panels.map(|kind| Light::new(String::new(), kind))));
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let clusters = world.hvds.cluster_count() as usize;
    let irradiance: Vec<Vec3> = (0..clusters).map(|_| 1.0 + random.cube()).collect();
    let irradiance_buffer = Buffer::from_slice(&world.context, "irradiance", &irradiance).unwrap();
    let inverse_areas =
        Buffer::from_slice(&world.context, "inverse areas", &vec![1.0_f32; clusters]).unwrap();
    let contributions =
        Buffer::from_slice(&world.context, "contributions", &glossy.paths.contributions).unwrap();
    let bits = glossy.packing.cluster_bits;
    let tracing = Tracing {
        geometry: world.geometry(),
        hvds: &world.hvds,
        strata: Strata { rings: HEMISPHERE.rings, sectors: HEMISPHERE.sectors },
        seed: SEED,
        naming: Naming::Number,
        entry_points: &world.in_clusters,
        min_entry_points: gather_rays::MIN_ENTRY_POINTS,
    };
    let is_glossy = |side: u32| side != NO_SIDE && glossy.material_of(side) < 2;
    let mut turning = 0;
    // Without samples of edges, and with. In the smallest pictures, mirrors turn within a pixel by
    // more than the lobe is wide.
    for (size, most, of_edge) in
        [([1, 1], 4, 0), ([9, 7], 3, 4), ([12, 9], 4, 4), ([31, 33], 16, 0), ([31, 33], 32, 4)]
    {
        let frame = Frame::new(world, &lights[..1], &camera(size), of_edge);
        let seen = SeenFragments { pixels: &frame.buffers[0], antialias: &frame.antialias };
        let (view, pixels, count) = (frame.view, &frame.pixels, (size[0] * size[1]) as usize);
        let pass =
            GlossPixels::new(&world.context, &world.buffers, count as u32, most, bits, [true; 2]).unwrap();
        let samples = most.div_ceil(LOBE_RAYS);
        let highlight_buffers: Vec<Buffer> = lights
            .iter()
            .map(|_| Buffer::storage(&world.context, "buffer", 4 * u64::from(pass.capacity)).unwrap())
            .collect();
        let around = Surroundings {
            scene: &world.buffers,
            seen,
            irradiance: &irradiance_buffer,
            inverse_areas: &inverse_areas,
            gloss: &gloss,
            contributions: &contributions,
            lobes: None,
        };
        let bins = BinReads::none(&world.context).unwrap();
        let highlights: Vec<_> = lights.iter().map(|light| light.emission).zip(&highlight_buffers).collect();
        world
            .context
            .run(|rec| {
                let scene = &world.buffers;
                pass.record_rays(rec, scene, (&world.clusters, &bins), seen, &view, SEED);
                rec.barrier(COMPUTE_TO_COMPUTE);
                let mut open = rec.pass(GlossPixels::HIGHLIGHTS_STEM);
                for (index, (light, buffer)) in (0..).zip(lights.iter().zip(&highlight_buffers)) {
                    if index > 0 {
                        open.barrier(COMPUTE_TO_COMPUTE);
                    }
                    let light = OneLight::new(&table, index, light);
                    pass.record_highlights(&mut open, scene, light, (view.position, SEED), buffer);
                }
                drop(open);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record(rec, around, &[], [&[], &highlights]);
            })
            .unwrap();
        let found: Vec<PixelGloss> = pass.radiance.read().unwrap();
        let points: Vec<PixelSurface> = pass.samples.surfaces.read().unwrap();
        let rays: Vec<GlossRay> = pass.rays.read().unwrap();
        let colours: Vec<u32> =
            if has_images { pass.colours.read().unwrap() } else { vec![u32::MAX; rays.len()] };
        let parts: Vec<GlossPart> = pass.samples.parts.read().unwrap();
        let members = glossy_members(&frame, &is_glossy);
        let is_listed = |index: usize| match &members[index] {
            Some(members) => members.iter().any(|samples| !samples.is_empty()),
            None => is_glossy(pixels[index].side),
        };
        let listed: Vec<usize> = (0..count).filter(|&index| is_listed(index)).collect();
        assert_eq!(pass.samples.count().unwrap() as usize, listed.len());
        assert!(count < 1_000 || listed.len() > 200);
        // Edge pixels with a glossy fragment that their centre does not show.
        let beside = listed.iter().filter(|&&index| !is_glossy(pixels[index].side)).count();
        assert!(count < 1_000 || (beside > 20) == (of_edge > 0), "{beside} pixels");
        let (edge_sides, per_edge) = (frame.samples(), frame.samples_per_edge(frame.edge_count()) as usize);
        let reflectances = world.reflectances();
        let (mut differ, mut bright, mut off_direct) = (0, 0, 0);
        for (place, &index) in listed.iter().enumerate() {
            let [mut indirect, mut direct] = [DVec3::ZERO; 2];
            for number in 0..samples {
                let at = place * samples as usize + number as usize;
                let point = &points[at];
                let material = &reflectances[glossy.material_of(point.side)];
                let (sample, weight) = match &members[index] {
                    None => {
                        let centre = &pixels[index];
                        let sample = gloss_pixels::sample(&tracing, &view, centre, index as u32, number);
                        (sample, 1.0 / f64::from(samples))
                    }
                    Some(members) => {
                        let (member, weight) = gloss_pixels::edge_member(members, number, samples);
                        let edge = frame.numbers[index] as usize;
                        let side = edge_sides[edge * per_edge + member as usize].0;
                        (on_member(&tracing, &view, index as u32, (member, side)), weight)
                    }
                };
                let reference = &sample.surface;
                let is_near = (reference.position - point.position).length() < 1e-4;
                differ += usize::from(reference.side != point.side || !is_near);
                let turn = [parts[at].across, parts[at].down].map(Vec3::as_dvec3);
                assert!((f64::from(parts[at].weight) - weight).abs() < 1e-6, "{} {weight}", parts[at].weight);
                let exact = gloss_pixels::mirror_turn(tracing.geometry, &view, &sample, samples);
                let apart = (turn[0] - exact[0]).length().max((turn[1] - exact[1]).length());
                // A camera that looks along a plane.
                differ += usize::from(apart > 1e-3 * (1.0 + exact[0].length() + exact[1].length()));
                let spread = (exact[0].length_squared() + exact[1].length_squared()) / 3.0;
                turning += usize::from(0.5 * f64::from(material.exponent) * spread > 0.1);
                for light in &lights {
                    let eye = view.position;
                    let which = [index as u32, number];
                    let factor =
                        gloss_pixels::highlight(&tracing, (point, turn), eye, material, light, which);
                    direct += weight * factor * light.emission.as_dvec3();
                }
                let mut of_sample = DVec3::ZERO;
                for lobe in 0..LOBE_RAYS {
                    let ray = &rays[at * LOBE_RAYS as usize + lobe as usize];
                    let which = [number * LOBE_RAYS + lobe, samples * LOBE_RAYS];
                    let exponent = f64::from(material.exponent);
                    let eye = view.position;
                    let reference = gloss_pixels::trace(&tracing, point, index as u32, eye, exponent, which);
                    let target =
                        reference.target.map_or(NO_TARGET, |(cluster, material)| cluster | material << bits);
                    let colour = unpack_colour(colours[at * LOBE_RAYS as usize + lobe as usize]);
                    let is_same = (reference.weight - f64::from(ray.weight)).abs() < 1e-4
                        && (reference.weight == 0.0
                            || (reference.colour - colour).abs().max_element() < 2e-3);
                    differ += usize::from(target != ray.target || !is_same);
                    if ray.target != NO_TARGET {
                        let albedo = world.materials[(ray.target >> bits) as usize].diffuse;
                        let light = albedo * irradiance[(ray.target & ((1 << bits) - 1)) as usize];
                        of_sample += f64::from(ray.weight) * colour * light.as_dvec3();
                    }
                }
                indirect += weight * material.specular.as_dvec3() * of_sample;
            }
            indirect /= f64::from(LOBE_RAYS) * PI;
            assert_near(found[index].indirect, indirect, 10.0 * FLOAT, 1e-9, "indirect");
            let off = (found[index].direct.as_dvec3() - direct).abs().max_element();
            off_direct += usize::from(off > 1e-3 * direct.max_element() + 1e-5);
            bright += usize::from(found[index].direct.max_element() > 0.05);
        }
        assert!(count < 1_000 || bright > 50, "{bright} pixels show a highlight");
        // Rays of the camera, a lobe or a light near an edge.
        assert!(differ * 100 <= listed.len() * most as usize, "{differ} differ of {}", listed.len());
        // Directions of a lobe near the border of a light.
        assert!(off_direct * 20 <= bright, "{off_direct} highlights of {bright} differ");
        for index in (0..count).filter(|&index| !is_listed(index)) {
            assert_eq!((found[index].direct, found[index].indirect), (Vec3::ZERO, Vec3::ZERO));
        }
    }
    assert!(turning > 10, "mirrors turn at {turning} samples");
    assert_silent(&world.context);
}

/// Where samples are short, pixels without rays have one each, and those with rays have the others.
#[test]
fn pixels_with_rays_take_the_samples_that_others_leave() {
    let glossy = Glossy::new(World::glossy_room());
    let world = &glossy.world;
    let exponents = [0, 1].map(|material| world.materials[material].exponent);
    let (size, rays) = ([160, 120], 128);
    let count = (size[0] * size[1]) as usize;
    let frame = Frame::new(world, &lights()[..1], &camera(size), 4);
    let seen = SeenFragments { pixels: &frame.buffers[0], antialias: &frame.antialias };
    let members = [0, 1].map(|material| {
        glossy_members(&frame, &|side| side != NO_SIDE && glossy.material_of(side) == material)
    });
    let shows = |material: usize, index: usize| match &members[material][index] {
        Some(members) => members.iter().any(|samples| !samples.is_empty()),
        None => {
            frame.pixels[index].side != NO_SIDE && glossy.material_of(frame.pixels[index].side) == material
        }
    };
    let bits = glossy.packing.cluster_bits;
    let bins = BinReads::none(&world.context).unwrap();
    // The broader lobe comes from records.
    let sharp = usize::from(exponents[1] > exponents[0]);
    let most = exponents[1 - sharp] as u32;
    for broad in [BroadLobes::default(), BroadLobes { little: most, strong: most }] {
        let mut pass =
            GlossPixels::new(&world.context, &world.buffers, count as u32, rays, bits, [true; 2]).unwrap();
        pass.broad = broad;
        world
            .context
            .run(|rec| {
                pass.record_rays(rec, &world.buffers, (&world.clusters, &bins), seen, &frame.view, SEED);
            })
            .unwrap();
        let takes_rays =
            |index: usize| shows(sharp, index) || (most > broad.little && shows(1 - sharp, index));
        let is_glossy = |index: usize| shows(0, index) || shows(1, index);
        let mut expected: Vec<u32> =
            (0..count).filter(|&index| takes_rays(index)).map(|index| index as u32).collect();
        let traced = expected.len();
        expected.extend(
            (0..count).filter(|&index| is_glossy(index) && !takes_rays(index)).map(|index| index as u32),
        );
        let listed = pass.samples.listed().unwrap();
        assert!(listed == expected, "{} pixels instead of {}", listed.len(), expected.len());
        let others = expected.len() - traced;
        assert_eq!(others > 200, broad != BroadLobes::default(), "{others} pixels without rays");
        let capacity = pass.capacity as usize;
        assert!(32 * traced > capacity, "samples are short");
        let of_traced = (capacity - others) / traced;
        let samples = [of_traced, (capacity - of_traced * traced).checked_div(others).unwrap_or(0)];
        assert!(others == 0 || samples[0] > 2 * samples[1], "{samples:?}");
        let parts: Vec<GlossPart> = pass.samples.parts.read().unwrap();
        let mut first = 0;
        for place in 0..expected.len() {
            let own = samples[usize::from(place >= traced)];
            let sum: f32 = parts[first..first + own].iter().map(|part| part.weight).sum();
            assert!((sum - 1.0).abs() < 1e-5, "the weights of a pixel sum to {sum}");
            first += own;
        }
        let rays: Vec<GlossRay> = pass.rays.read().unwrap();
        let hits = |range: Range<usize>| {
            let rays = &rays[range.start * LOBE_RAYS as usize..range.end * LOBE_RAYS as usize];
            rays.iter().filter(|ray| ray.target != NO_TARGET).count()
        };
        assert!(hits(0..of_traced * traced) * 2 > of_traced * traced * LOBE_RAYS as usize);
    }
    assert_silent(&world.context);
}

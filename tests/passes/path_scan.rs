//! The segmented product over light paths.

use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::path_scan::{FROM_ENTRY, HEAD, PathScan, PathStep};
use lightpaths::types::{Contribution, OPEN, Reflectance};

/// Steps of paths of these lengths. Slots are a permutation, by a stride that has no common factor
/// with any length here.
fn steps(lengths: &[usize], mut step: impl FnMut() -> (u32, f32)) -> Vec<PathStep> {
    let count: usize = lengths.iter().sum();
    let mut steps = Vec::new();
    for &length in lengths {
        for vertex in 0..length {
            let (material, weight) = step();
            let contribution = (steps.len() as u64 * 7_919 % count as u64) as u32;
            let material = if vertex == 0 { HEAD } else { material };
            steps.push(PathStep { material, weight, contribution });
        }
    }
    steps
}

/// Scans paths among diffuse materials.
fn scan(albedos: &[Vec3], steps: &[PathStep], colours: &[u32]) -> Vec<Vec3> {
    let reflectance =
        |&diffuse: &Vec3| Reflectance { diffuse, exponent: 1.0, specular: Vec3::ZERO, flags: 0 };
    let materials: Vec<_> = albedos.iter().map(reflectance).collect();
    scan_among(&materials, steps, colours, &[])
}

/// Scans on the device and returns throughputs in path order. It scans twice, because the result
/// must not depend on the old content.
fn scan_among(materials: &[Reflectance], steps: &[PathStep], colours: &[u32], lobes: &[f32]) -> Vec<Vec3> {
    const UNTOUCHED: Vec3 = Vec3::splat(-7.0);
    let context = context();
    let materials = Buffer::from_slice(&context, "materials", materials).unwrap();
    let contribution =
        |path: usize| Contribution { throughput: UNTOUCHED, ..Contribution::new(path as u32, OPEN) };
    let contributions: Vec<_> = (0..=steps.len()).map(contribution).collect();
    let scan = PathScan::new(&context, steps, colours, lobes, &contributions).unwrap();
    // Two or three parts of each list.
    let most = [1 + steps.len() as u32 / 3_000, 1 + contributions.len() as u32 * 2 / 5];
    let cut = PathScan::in_chunks(&context, steps, colours, lobes, &contributions, most).unwrap();
    for _ in 0..2 {
        context.run(|rec| scan.record(rec, &materials, None)).unwrap();
        context.run(|rec| cut.record(rec, &materials, None)).unwrap();
    }
    let found: Vec<Contribution> = scan.contributions.read().unwrap();
    let bits =
        |contributions: &[Contribution]| bytemuck::cast_slice::<Contribution, u8>(contributions).to_vec();
    assert!(bits(&cut.contributions.read().unwrap()) == bits(&found), "in parts as in one");
    assert!(
        (0..).zip(&found).all(|(path, contribution)| contribution.path() == path),
        "paths stay as they are"
    );
    assert_eq!(found.last().unwrap().throughput, UNTOUCHED, "nothing is written past the last vertex");
    steps.iter().map(|step| found[step.contribution as usize].throughput).collect()
}

fn reference(albedos: &[Vec3], steps: &[PathStep], colours: &[u32]) -> Vec<DVec3> {
    let colour = |index: usize| colours.get(index).map_or(DVec3::ONE, |&packed| unpack_colour(packed));
    let albedo = |(index, step): (usize, &PathStep)| {
        let albedo =
            (step.material != HEAD).then(|| albedos[step.material as usize].as_dvec3() * colour(index));
        (albedo, step.weight)
    };
    cpu::path_scan::path_scan(steps.iter().enumerate().map(albedo))
}

/// Lengths of paths with `count` vertices in all; the longest is about `longest`.
fn lengths(random: &mut Random, count: usize, longest: u32) -> Vec<usize> {
    let mut lengths = Vec::new();
    let mut left = count;
    while left > 0 {
        let length = left.min(1 + random.below(longest) as usize);
        lengths.push(length);
        left -= length;
    }
    lengths
}

/// Around an invocation's 4 or 128 vertices, a block's 1024, two blocks, and the 256 blocks that
/// one round carries over on a GPU.
const COUNTS: [usize; 17] =
    [0, 1, 3, 4, 5, 127, 128, 129, 1023, 1024, 1025, 2048, 2053, 9_973, 262_144, 262_145, 300_007];

#[test]
fn short_paths_equal_the_reference() {
    let albedos =
        [Vec3::new(0.9, 0.5, 0.1), Vec3::new(0.75, 0.25, 0.0), Vec3::ZERO, Vec3::new(0.33, 0.99, 0.66)];
    let mut random = Random::new(1);
    for count in COUNTS {
        let lengths = lengths(&mut random, count, 12);
        // Mostly materials other than the black one; survival weights are at least one.
        let steps =
            steps(&lengths, || ([0, 1, 3, 0, 1, 3, 2][random.below(7) as usize], 1.0 + random.unit()));
        // Colours only if there are images; the colour at the start of a path has no effect.
        let colour = |step: &PathStep| if step.material == HEAD { u32::MAX } else { random.word() };
        let colours: Vec<u32> = steps.iter().map(colour).collect();
        for colours in [&[][..], &colours] {
            let found = scan(&albedos, &steps, colours);
            for (index, (device, reference)) in
                found.iter().zip(reference(&albedos, &steps, colours)).enumerate()
            {
                assert_near(*device, reference, FLOAT, 0.0, &format!("vertex {index} of {count}"));
            }
        }
    }
    assert_silent(&context());
}

#[test]
fn paths_among_glossy_surfaces_equal_the_reference() {
    let mut random = Random::new(3);
    let material = |exponent| Reflectance {
        diffuse: Vec3::new(0.4, 0.2, 0.0),
        exponent,
        specular: Vec3::new(0.1, 0.5, 0.6),
        flags: 0,
    };
    let materials = [1.0, 7.5, 40.0, 1000.0].map(material);
    for count in [0, 1, 1023, 1025, 9_973] {
        let lengths = lengths(&mut random, count, 8);
        let steps = steps(&lengths, || {
            let material = random.below(5);
            (if material == 4 { FROM_ENTRY } else { material }, 0.5 + random.unit())
        });
        // From the mirror direction, through the falloff of a sharp lobe, to
        // the opposite direction.
        let lobes: Vec<f32> =
            (0..count).map(|_| 2.0 * random.unit().powi(1 + random.below(12) as i32)).collect();
        let found = scan_among(&materials, &steps, &[], &lobes);
        let reflected = |step: &PathStep, lobe: f32| match step.material {
            HEAD => None,
            FROM_ENTRY => Some(DVec3::ONE),
            material => Some(cpu::brdf::reflected_fraction(&materials[material as usize], f64::from(lobe))),
        };
        let pairs = steps.iter().zip(&lobes);
        let reference =
            cpu::path_scan::path_scan(pairs.map(|(step, &lobe)| (reflected(step, lobe), step.weight)));
        for (index, (device, reference)) in found.iter().zip(reference).enumerate() {
            // An exponent of 1000 costs two digits.
            assert_near(*device, reference, 10.0 * FLOAT, 1e-9, &format!("vertex {index} of {count}"));
        }
    }
    assert_silent(&context());
}

#[test]
fn long_paths_equal_the_reference_exactly() {
    // All factors are powers of two, so products are exact in any order. In every channel they rise
    // as often as they fall.
    let albedos = [
        Vec3::ONE,
        Vec3::new(1.0, 0.5, 0.25),
        Vec3::new(0.25, 0.5, 1.0),
        Vec3::new(0.5, 1.0, 0.5),
        Vec3::new(1.0, 0.5, 1.0),
    ];
    let mut random = Random::new(2);
    let mut step = || match random.below(64) {
        material @ 1..=3 => (material, 2.0),
        4 => (4, 1.0),
        _ => (0, 1.0),
    };
    for count in COUNTS {
        let all_heads = vec![1; count];
        let one_path = vec![count; count.min(1)];
        // One path over several blocks, between short ones.
        let long = [vec![3, 1, 5], vec![count.saturating_sub(16)], vec![2, 5]].concat();
        for lengths in [all_heads, one_path, long] {
            if lengths.iter().max().is_some_and(|&longest| longest > 10_000) && count > 10_000 {
                // The product would exceed the range of f32.
                continue;
            }
            let steps = steps(&lengths, &mut step);
            let found = scan(&albedos, &steps, &[]);
            let reference = reference(&albedos, &steps, &[]);
            assert!(reference.iter().all(|t| t.max_element() < 1e30 && t.min_element() > 1e-30));
            let differs = (0..found.len()).find(|&i| found[i].as_dvec3() != reference[i]);
            assert_eq!(differs, None, "first vertex that differs, of {count} in {} paths", lengths.len());
        }
    }
    assert_silent(&context());
}

#[test]
fn a_path_of_many_blocks_carries_its_throughput_through_all() {
    // More blocks than two rounds of the carry step hold, in one path, with a factor in the
    // first block only.
    let count = 2 * 256 * 1024 + 2_500;
    let albedos = [Vec3::ONE, Vec3::new(0.5, 0.0, 0.25)];
    let mut index = 0;
    let steps = steps(&[count], || {
        index += 1;
        (u32::from(index == 3), 1.0)
    });
    let found = scan(&albedos, &steps, &[]);
    assert!(found[..2].iter().all(|&throughput| throughput == Vec3::ONE));
    assert!(found[2..].iter().all(|&throughput| throughput == albedos[1]));
    assert_silent(&context());
}

/// A scan of the edited ranges gives the same bits as a scan of all paths.
#[test]
fn a_part_scanned_again_equals_a_whole_scan() {
    let context = context();
    let mut random = Random::new(4);
    let lengths = lengths(&mut random, 30_011, 12);
    // Material 2 reflects only the paths of two ranges of the array.
    let ends: Vec<u32> = lengths
        .iter()
        .scan(0, |end, &length| {
            *end += length as u32;
            Some(*end)
        })
        .collect();
    let bounds = [ends[900], ends[1_000], ends[2_500], ends[2_600]];
    let parts = [bounds[0]..bounds[1], bounds[2]..bounds[3]];
    let mut place = 0;
    let steps = steps(&lengths, || {
        let is_inside = parts.iter().any(|part| part.contains(&place));
        place += 1;
        (random.below(if is_inside { 3 } else { 2 }), 1.0 + random.unit())
    });
    let material = |diffuse| Reflectance { diffuse, exponent: 1.0, specular: Vec3::ZERO, flags: 0 };
    let mut table = [Vec3::splat(0.7), Vec3::new(0.3, 0.5, 0.9), Vec3::splat(0.1)].map(material);
    let contributions: Vec<_> = (0..=steps.len()).map(|path| Contribution::new(path as u32, OPEN)).collect();
    let whole = PathScan::new(&context, &steps, &[], &[], &contributions).unwrap();
    let part = PathScan::new(&context, &steps, &[], &[], &contributions).unwrap();
    let materials = Buffer::from_slice(&context, "materials", &table).unwrap();
    context.run(|rec| part.record(rec, &materials, None)).unwrap();
    let before: Vec<Contribution> = part.contributions.read().unwrap();
    table[2].diffuse = Vec3::new(0.8, 0.6, 0.4);
    materials.write(&table).unwrap();
    context.run(|rec| part.record(rec, &materials, Some(&parts))).unwrap();
    context.run(|rec| whole.record(rec, &materials, None)).unwrap();
    let [part, whole] = [part, whole].map(|scan| scan.contributions.read::<Contribution>().unwrap());
    let same =
        |a: &[Contribution], b: &[Contribution]| a.iter().zip(b).all(|(a, b)| a.throughput == b.throughput);
    assert!(same(&part, &whole) && !same(&part, &before));
    assert_silent(&context);
}

//! The segmented product over light paths.

use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::path_scan::{HEAD, PathScan, PathStep};
use lightpaths::types::{Deposit, Reflectance};

/// Steps of paths of those lengths; slots are a permutation. A stride that no length here shares a factor with.
fn steps(lengths: &[usize], mut step: impl FnMut() -> (u32, f32)) -> Vec<PathStep> {
    let count: usize = lengths.iter().sum();
    let mut steps = Vec::new();
    for &length in lengths {
        for vertex in 0..length {
            let (material, weight) = step();
            let slot = (steps.len() as u64 * 7_919 % count as u64) as u32;
            let material = if vertex == 0 { HEAD } else { material };
            steps.push(PathStep { material, weight, slot });
        }
    }
    steps
}

/// Scans on the device, twice because the result must not depend on what was there: throughputs in path order.
fn scan(albedos: &[Vec3], steps: &[PathStep], colours: &[u32]) -> Vec<Vec3> {
    const UNTOUCHED: Vec3 = Vec3::splat(-7.0);
    let context = context();
    let reflectance =
        |&diffuse: &Vec3| Reflectance { diffuse, exponent: 1.0, specular: Vec3::ZERO, flags: 0 };
    let materials: Vec<_> = albedos.iter().map(reflectance).collect();
    let materials = Buffer::from_slice(&context, "materials", &materials).unwrap();
    let deposit = |path: usize| Deposit { throughput: UNTOUCHED, path: path as u32 };
    let deposits: Vec<_> = (0..=steps.len()).map(deposit).collect();
    let scan = PathScan::new(&context, steps, colours, &deposits).unwrap();
    for _ in 0..2 {
        context.run(|rec| scan.record(rec, &materials)).unwrap();
    }
    let found: Vec<Deposit> = scan.deposits.read().unwrap();
    assert!((0..).zip(&found).all(|(path, deposit)| deposit.path == path), "paths stay as they are");
    assert_eq!(found.last().unwrap().throughput, UNTOUCHED, "nothing is written past the last vertex");
    steps.iter().map(|step| found[step.slot as usize].throughput).collect()
}

fn twin(albedos: &[Vec3], steps: &[PathStep], colours: &[u32]) -> Vec<DVec3> {
    let colour = |index: usize| colours.get(index).map_or(DVec3::ONE, |&packed| unpack_colour(packed));
    let albedo = |(index, step): (usize, &PathStep)| {
        let albedo =
            (step.material != HEAD).then(|| albedos[step.material as usize].as_dvec3() * colour(index));
        (albedo, step.weight)
    };
    cpu::path_scan::path_scan(steps.iter().enumerate().map(albedo))
}

/// Lengths of paths that make `count` vertices, the longest about `longest`.
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

/// Around an invocation's four vertices, a block's 1024, two blocks, and the 256 blocks that one round carries over.
const COUNTS: [usize; 14] = [0, 1, 3, 4, 5, 1023, 1024, 1025, 2048, 2053, 9_973, 262_144, 262_145, 300_007];

#[test]
fn short_paths_equal_the_twin() {
    let albedos =
        [Vec3::new(0.9, 0.5, 0.1), Vec3::new(0.75, 0.25, 0.0), Vec3::ZERO, Vec3::new(0.33, 0.99, 0.66)];
    let mut random = Random::new(1);
    for count in COUNTS {
        let lengths = lengths(&mut random, count, 12);
        // Every material but the black one mostly; survival weights are at least one.
        let steps =
            steps(&lengths, || ([0, 1, 3, 0, 1, 3, 2][random.below(7) as usize], 1.0 + random.unit()));
        // Colours only where there are images; none at the start of a path changes anything.
        let colour = |step: &PathStep| if step.material == HEAD { u32::MAX } else { random.word() };
        let colours: Vec<u32> = steps.iter().map(colour).collect();
        for colours in [&[][..], &colours] {
            let found = scan(&albedos, &steps, colours);
            for (index, (device, twin)) in found.iter().zip(twin(&albedos, &steps, colours)).enumerate() {
                assert_near(*device, twin, FLOAT, 0.0, &format!("vertex {index} of {count}"));
            }
        }
    }
    assert_silent(&context());
}

#[test]
fn long_paths_equal_the_twin_exactly() {
    // All factors are powers of two: no product is ever rounded, whatever its order.
    // In every channel they rise as often as they fall.
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
                // Exponents would leave the range of an f32.
                continue;
            }
            let steps = steps(&lengths, &mut step);
            let found = scan(&albedos, &steps, &[]);
            let twin = twin(&albedos, &steps, &[]);
            assert!(twin.iter().all(|t| t.max_element() < 1e30 && t.min_element() > 1e-30));
            let differs = (0..found.len()).find(|&i| found[i].as_dvec3() != twin[i]);
            assert_eq!(differs, None, "first vertex that differs, of {count} in {} paths", lengths.len());
        }
    }
    assert_silent(&context());
}

#[test]
fn a_path_of_many_blocks_carries_its_throughput_through_all() {
    // More blocks than two rounds of the carry step hold, in a single path: one factor in the first block only.
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

//! Mirrors `glsl/include/sampling.glsl`: scrambled Sobol points, integer for integer.

use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::TAU;

/// Integer hash with low bias.
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ x >> 15
}

/// Hash of two words.
pub fn hash_pair(a: u32, b: u32) -> u32 {
    hash(a ^ hash(b.wrapping_add(0x9e37_79b9)))
}

/// Nested uniform scramble: the bits above a bit decide whether it is flipped.
pub fn owen_scramble(x: u32, seed: u32) -> u32 {
    // [Burley]
    let mut bits = x.reverse_bits().wrapping_add(seed);
    for factor in [0x6c50_b47c_u32, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6] {
        bits ^= bits.wrapping_mul(factor);
    }
    bits.reverse_bits()
}

/// Direction numbers of a Sobol dimension by the recurrence of its primitive polynomial over
/// GF(2): the coefficients between the leading and the last one, and as many odd initial numbers
/// as its degree.
const fn directions(coefficients: &[u64], initial: &[u64]) -> [u32; 32] {
    let (mut m, mut numbers, degree) = ([0; 32], [0; 32], initial.len());
    let mut k = 0;
    while k < 32 {
        if k < degree {
            m[k] = initial[k];
        } else {
            m[k] = m[k - degree] ^ m[k - degree] << degree;
            let mut i = 1;
            while i <= coefficients.len() {
                m[k] ^= coefficients[i - 1] * (m[k - i] << i);
                i += 1;
            }
        }
        numbers[k] = (m[k] << (31 - k)) as u32;
        k += 1;
    }
    numbers
}

/// Direction numbers of the first three dimensions. The initial numbers of the first are all 1.
const DIRECTIONS: [[u32; 32]; 3] =
    [directions(&[], &[1; 32]), directions(&[], &[1]), directions(&[1], &[1, 3])];

/// Point `index` of the first three Sobol dimensions, unscrambled, as 32-bit fractions.
pub fn sobol(index: u32) -> [u32; 3] {
    let (mut point, mut rest) = ([0; 3], index);
    while rest != 0 {
        let bit = rest.trailing_zeros() as usize;
        for (point, directions) in point.iter_mut().zip(&DIRECTIONS) {
            *point ^= directions[bit];
        }
        rest &= rest - 1;
    }
    point
}

/// Point `index` of the sequence scrambled by `seed`, in [0,1)³.
pub fn sample_3d(index: u32, seed: u32) -> Vec3 {
    let point = sobol(owen_scramble(index, hash(seed)));
    let coordinate = |k: usize| {
        let fraction = owen_scramble(point[k], hash_pair(seed, k as u32 + 1));
        // The upper 24 bits, which an f32 holds exactly.
        (fraction >> 8) as f32 / 16_777_216.0
    };
    Vec3::new(coordinate(0), coordinate(1), coordinate(2))
}

/// Cosine-distributed direction around +z; pdf cosθ/π.
pub fn sample_cosine(u: DVec2) -> DVec3 {
    let (sin, cos) = (TAU * u.y).sin_cos();
    DVec3::new(u.x.sqrt() * cos, u.x.sqrt() * sin, (1.0 - u.x).sqrt())
}

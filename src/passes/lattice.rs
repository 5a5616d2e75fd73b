//! Lattices of the point samples of a light.

/// Step and modulus of a lattice of `samples` points, with one in every row and every column. The
/// step is close to the golden section, which separates neighbours, and coprime to the modulus,
/// which separates rows. The modulus is the number of points, or one more without the point at the
/// origin, whichever is closer.
pub(super) fn lattice(samples: u32) -> [u32; 2] {
    let distance = |[stride, modulus]: [u32; 2]| (f64::from(stride) / f64::from(modulus) - GOLDEN).abs();
    let lattices = [samples, samples + 1].into_iter().flat_map(|modulus| {
        (1..modulus).filter(move |&stride| is_coprime(stride, modulus)).map(move |stride| [stride, modulus])
    });
    lattices.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or([1, 1])
}

/// Sets of point samples, one for each image point of a pixel; as in `glsl/include/lights.glsl`.
const SAMPLE_SETS: u32 = 16;

/// Whether the image points of a pixel have different samples of a light. A light of fewer samples
/// may stand for a curved surface, which its corners leave.
pub(super) fn has_sets(samples: u32) -> bool {
    samples >= 4
}

/// Point samples of a light, of `samples`, that one image point of a pixel has.
pub(super) fn samples_of_point(samples: u32) -> u32 {
    samples.min(8).max(samples.div_ceil(4))
}

/// Step of the lattice of the samples of all image points of a pixel, `samples` each, with one in
/// every row and every column. Every sixteenth point makes a set, and each set is a lattice with
/// rows and columns of its own. Of the steps around the golden section, the one whose closest
/// neighbours are farthest apart.
pub(super) fn pixel_lattice(samples: u32) -> u32 {
    let all = samples * if has_sets(samples) { SAMPLE_SETS } else { 1 };
    let quality =
        |step: u32| [all, samples].map(|count| closest(step, count) / f64::from(count)).iter().sum();
    let middle = (GOLDEN * f64::from(all)) as u32;
    let steps =
        (middle.saturating_sub(CANDIDATES)..middle + CANDIDATES).filter(|&step| is_coprime(step, all));
    let rated = steps.map(|step| -> (u32, f64) { (step, quality(step)) });
    rated.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(1, |(step, _)| step)
}

/// Squared distance of the closest points of a lattice, in units of its rows.
fn closest(step: u32, modulus: u32) -> f64 {
    let offset = |columns: u32| {
        let rows = columns * step % modulus;
        let rows = rows.min(modulus - rows);
        f64::from(columns).powi(2) + f64::from(rows).powi(2)
    };
    // Closer ones are at most as many columns apart as a square lattice has in a row.
    let columns = (1.1 * f64::from(modulus).sqrt()) as u32;
    (1..=columns.min(modulus.saturating_sub(1))).map(offset).fold(f64::from(modulus), f64::min)
}

/// Steps on either side of the golden section that are tried.
const CANDIDATES: u32 = 32;

/// The golden section, which separates the neighbours of a lattice best.
const GOLDEN: f64 = 0.618_033_988_75;

fn is_coprime(a: u32, b: u32) -> bool {
    let (mut a, mut b) = (a, b);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

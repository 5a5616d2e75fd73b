//! Built-in models of lightpaths, generated at the requested fineness.
#![forbid(unsafe_code)]

mod atrium;
mod cushion;
mod drapery;
mod joinery;
mod model;
mod moulding;
mod outline;
mod panel;
mod plants;
mod rng;
mod room;
mod sheet;
mod solid;
mod turning;

pub use model::{Mesh, Model};
use outline::Detail;

/// A generator of a model.
struct Generator {
    name: &'static str,
    /// Default number of triangles: the size class of the paper's scene. [Yue, table 1]
    triangles: u32,
    /// The detail that gives this number.
    detail: f64,
    build: fn(&mut Model, Detail),
}

const GENERATORS: [Generator; 2] = [
    Generator { name: "atrium", triangles: 76_154, detail: 0.555, build: atrium::build },
    Generator { name: "room", triangles: 141_287, detail: 1.135, build: room::build },
];

/// Names of the generated models.
pub const NAMES: [&str; 2] = [GENERATORS[0].name, GENERATORS[1].name];
/// Range of triangle counts that can be requested.
pub const TRIANGLES: std::ops::RangeInclusive<u32> = 10_000..=20_000_000;
/// Relative tolerance of the number of triangles.
const CLOSE: f64 = 0.015;
/// Largest number of attempts to meet the number of triangles.
const ATTEMPTS: usize = 10;

/// Generates the model of that name with about `triangles` triangles, or its default number. `None`
/// if there is no such model.
///
/// Parts have whole numbers of segments, so that triangle counts come in steps; the
/// nearest is taken.
pub fn generate(name: &str, triangles: Option<u32>) -> Option<Model> {
    let generator = GENERATORS.iter().find(|generator| generator.name == name)?;
    let wanted = f64::from(triangles.unwrap_or(generator.triangles));
    // The triangle count grows with a power of the detail between 1.5 and 2. `low` has too few,
    // `high` too many.
    let mut detail = generator.detail * (wanted / f64::from(generator.triangles)).powf(0.6);
    let [mut low, mut high] = [0.0, f64::INFINITY];
    let mut best: Option<(f64, Model)> = None;
    for _ in 0..ATTEMPTS {
        let mut model = Model::default();
        (generator.build)(&mut model, Detail(detail));
        let ratio = model.triangles() as f64 / wanted;
        let off = ratio.ln().abs();
        if best.as_ref().is_none_or(|(least, _)| off < *least) {
            best = Some((off, model));
        }
        if off < CLOSE {
            break;
        }
        if ratio > 1.0 {
            high = detail;
        } else {
            low = detail;
        }
        let guess = detail * ratio.powf(-0.6);
        let is_between = guess > low && guess < high;
        detail = if is_between { guess } else { 0.5 * (low + high.min(4.0 * detail)) };
    }
    best.map(|(_, model)| model)
}

//! Ratios between the times of two versions, from alternating rounds. `scripts/bench.sh` writes
//! `old-1.json`, `new-1.json`, `old-2.json` and so on with `lightpaths time --json`, and passes
//! their folder to this program.
//!
//! For each scene, column and pass it prints the geometric mean of new over old, with its 99 %
//! confidence interval by Student's distribution of the ratios' logarithms. It exits with 1 if the
//! lower end of a column's interval is above [`TOLERATED`]. Passes do not count, because among many
//! of them one seems slower now and then.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use serde_json::Value;

/// Tolerated slowdown of a column.
const TOLERATED: f64 = 1.02;

/// 99.5 % quantiles of Student's distribution with 1, 2, ... degrees of freedom; [`NORMAL`] beyond.
const STUDENT: [f64; 30] = [
    63.657, 9.925, 5.841, 4.604, 4.032, 3.707, 3.499, 3.355, 3.250, 3.169, 3.106, 3.055, 3.012, 2.977, 2.947,
    2.921, 2.898, 2.878, 2.861, 2.845, 2.831, 2.819, 2.807, 2.797, 2.787, 2.779, 2.771, 2.763, 2.756, 2.750,
];
const NORMAL: f64 = 2.576;

/// The compared quantity: scene, whether it is a column, name.
type Name = (String, bool, String);

/// Times of a run, milliseconds. A pass that runs several times per frame has as many entries.
type Times = BTreeMap<Name, f64>;

/// A ratio and its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ratio {
    mean: f64,
    low: f64,
    high: f64,
}

impl Ratio {
    /// The ratio of at least two pairs of positive times, old and new.
    fn of(pairs: &[[f64; 2]]) -> Self {
        let logs: Vec<f64> = pairs.iter().map(|[old, new]| (new / old).ln()).collect();
        let count = logs.len() as f64;
        let mean = logs.iter().sum::<f64>() / count;
        let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let quantile = STUDENT.get(logs.len() - 2).copied().unwrap_or(NORMAL);
        let spread = quantile * (variance / count).sqrt();
        Self { mean: mean.exp(), low: (mean - spread).exp(), high: (mean + spread).exp() }
    }

    fn is_slower(self) -> bool {
        self.low > TOLERATED
    }

    fn say(self) -> String {
        let verdict = match self {
            Self { low, .. } if low > 1.0 => "slower",
            Self { high, .. } if high < 1.0 => "faster",
            _ => "",
        };
        format!("{:>7.3}  {:>6.3} to {:<7.3} {verdict}", self.mean, self.low, self.high)
    }
}

/// Times of all columns and passes of a document.
fn times(document: &Value) -> Times {
    let mut times = Times::new();
    for scene in document["scenes"].as_array().into_iter().flatten() {
        let name = scene["name"].as_str().unwrap_or_default();
        let mut add = |is_column, what: &str, ms: &Value| {
            *times.entry((name.to_owned(), is_column, what.to_owned())).or_default() +=
                ms.as_f64().unwrap_or(0.0);
        };
        for (column, ms) in scene["ms"].as_object().into_iter().flatten() {
            add(true, column, ms);
        }
        for pass in scene["passes"].as_array().into_iter().flatten() {
            add(false, pass["name"].as_str().unwrap_or_default(), &pass["ms"]);
        }
    }
    times
}

/// Ratios of the positive times that both versions have in all rounds.
fn ratios(rounds: &[[Times; 2]]) -> BTreeMap<Name, Ratio> {
    let Some([first, _]) = rounds.first() else { return BTreeMap::new() };
    let of_name = |name: &Name| {
        let pair = |[old, new]: &[Times; 2]| {
            let pair = [*old.get(name)?, *new.get(name)?];
            pair.iter().all(|ms| *ms > 0.0).then_some(pair)
        };
        let pairs = rounds.iter().map(pair).collect::<Option<Vec<_>>>()?;
        Some((name.clone(), Ratio::of(&pairs)))
    };
    first.keys().filter_map(of_name).collect()
}

fn read(path: &Path) -> Result<Value, String> {
    let text = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_slice(&text).map_err(|error| format!("{}: {error}", path.display()))
}

fn run(folder: &Path) -> Result<bool, String> {
    let mut rounds = Vec::new();
    for round in 1.. {
        let paths = ["old", "new"].map(|which| folder.join(format!("{which}-{round}.json")));
        if !paths[0].exists() {
            break;
        }
        rounds.push([times(&read(&paths[0])?), times(&read(&paths[1])?)]);
    }
    if rounds.len() < 2 {
        return Err(format!(
            "{}: two rounds or more are needed, there are {}",
            folder.display(),
            rounds.len()
        ));
    }
    println!("new / old, {} rounds, 99 % confidence", rounds.len());
    let (mut scene, mut is_slower) = (String::new(), false);
    let ratios = ratios(&rounds);
    // Columns before passes.
    for is_column in [true, false] {
        for ((of, _, name), ratio) in ratios.iter().filter(|(name, _)| name.1 == is_column) {
            if *of != scene {
                println!("\n{of}, {}", if is_column { "columns" } else { "passes" });
                scene.clone_from(of);
            }
            println!("  {name:<16}{}", ratio.say());
            is_slower |= is_column && ratio.is_slower();
        }
        scene.clear();
    }
    Ok(is_slower)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder] = &arguments[..] else {
        eprintln!("usage: time_ratios FOLDER");
        return ExitCode::from(2);
    };
    match run(Path::new(folder)) {
        Ok(false) => ExitCode::SUCCESS,
        Ok(true) => {
            eprintln!(
                "time_ratios: a column has become slower by more than {:.0} %, for certain",
                100.0 * (TOLERATED - 1.0)
            );
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("time_ratios: {error}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_students() {
        // Logarithms 0, 0.1 and 0.2: mean 0.1, standard error 0.1/sqrt(3), 9.925 of them.
        let pairs = [0.0f64, 0.1, 0.2].map(|log| [5.0, 5.0 * log.exp()]);
        let Ratio { mean, low, high } = Ratio::of(&pairs);
        let spread = 9.925 * 0.1 / 3.0f64.sqrt();
        for (value, log) in [(mean, 0.1), (low, 0.1 - spread), (high, 0.1 + spread)] {
            assert!((value.ln() - log).abs() < 1e-12, "{value}");
        }
        assert!(!Ratio::of(&pairs).is_slower());
        assert!(Ratio::of(&[[1.0, 1.1]; 5]).is_slower());
        assert!(!Ratio::of(&[[1.0, 1.01]; 5]).is_slower(), "tolerated");
        assert!(!Ratio::of(&[[1.0, 0.5]; 40]).is_slower());
    }

    #[test]
    fn what_one_version_lacks_is_left_out() {
        let document = |ms: f64| {
            serde_json::json!({"scenes": [{"name": "box", "ms": {"Tdi": ms}, "passes": [
                {"name": "gather", "ms": 1.0}, {"name": "gather", "ms": 2.0 * ms}, {"name": "empty", "ms": 0.0}]}]})
        };
        let mut old = times(&document(2.0));
        old.insert(("box".to_owned(), false, "gone".to_owned()), 3.0);
        let new = times(&document(4.0));
        let ratios = ratios(&[[old.clone(), new.clone()], [old, new]]);
        let found: Vec<_> =
            ratios.iter().map(|((_, is_column, name), r)| (*is_column, &**name, r.mean)).collect();
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((ratios[&("box".to_owned(), false, "gather".to_owned())].mean - 9.0 / 5.0).abs() < 1e-12);
        assert!((ratios[&("box".to_owned(), true, "Tdi".to_owned())].mean - 2.0).abs() < 1e-12);
    }
}

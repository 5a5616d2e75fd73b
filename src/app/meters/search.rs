//! The search for powers and places of lights that give wanted illuminances.

use super::{active, least_squares, measure_with};
use crate::error::Result;
use crate::renderer::{Measured, Reading, Renderer};
use crate::scene::LightKind;
use glam::Vec3;

/// Weight of a light's change beside the relative errors. It only chooses among powers that fit the
/// goals equally well.
const KEEP: f64 = 1e-4;
/// Sum of squared relative errors at which no light moves any further: half a percent.
const ENOUGH: f64 = 2.5e-5;
/// Steps of lights that may move, and attempts at a step.
const STEPS: usize = 12;
const ATTEMPTS: usize = 6;
/// Distance of two measurements that give a slope, as a fraction of the reach.
const SLOPE: f32 = 0.05;
/// Damping of the first step, as a fraction of the greatest slope; its factors after a step that
/// helps and after one that does not.
const DAMPING: f64 = 0.1;
const RELAXED: f64 = 0.3;
const DAMPED: f64 = 4.0;

/// Relative error up to which a goal is reached.
const REACHED: f64 = 0.02;

/// A wanted mean illuminance.
#[derive(Clone, Copy, Debug)]
pub(in crate::app) struct Goal {
    /// Index of the meter.
    pub(in crate::app) meter: usize,
    /// Its illuminance, lx.
    pub(in crate::app) lux: f64,
}

/// What is wanted, and which lights may change.
pub(in crate::app) struct Wish<'a> {
    pub(in crate::app) goals: &'a [Goal],
    /// Lights whose power may change.
    pub(in crate::app) lights: &'a [usize],
    /// Bound of the factors of their powers.
    pub(in crate::app) max_factor: f64,
}

/// What was found.
pub(in crate::app) struct Found {
    /// Light, as it was found, and factor of its power.
    pub(in crate::app) lights: Vec<(usize, LightKind, f64)>,
    /// Illuminance of each goal before and after, lx, as rendered.
    pub(in crate::app) rendered: Vec<[f64; 2]>,
}

/// Whether an illuminance is the wanted one.
pub(super) fn is_reached(after: f64, wanted: f64) -> bool {
    (after / wanted - 1.0).abs() <= REACHED
}

#[cfg(feature = "window")]
impl Goal {
    /// A line about its illuminance before and after, lx.
    pub(in crate::app) fn said(&self, meters: &[crate::scene::Meter], [before, after]: [f64; 2]) -> String {
        let missed = if is_reached(after, self.lux) { "" } else { ", which is not reachable" };
        format!("{}: {before:.0} to {after:.0} lx of {:.0}{missed}", meters[self.meter].name, self.lux)
    }
}

impl Wish<'_> {
    /// Searches for powers, and for places of lights that are `moved`, each at most `reach` metres.
    /// The renderer's lights are then as found, and on as the last measurement had them.
    pub(in crate::app) fn find(
        &self,
        renderer: &mut Renderer,
        (moved, reach): (&[usize], f32),
    ) -> Result<Found> {
        let Self { goals, lights, max_factor } = *self;
        let all = active(renderer.scene());
        let before = means(renderer, goals, &all)?;
        let mut on: Vec<usize> = all.into_iter().filter(|light| !lights.contains(light)).collect();
        let mut search = Search::new(renderer, goals, (lights, &on), max_factor)?;
        search.descend(renderer, moved, reach)?;

        let (factors, _) = search.powers();
        let mut found = Vec::new();
        for (&light, factor) in lights.iter().zip(factors) {
            let mut kind = renderer.scene().lights[light].kind;
            if factor > 0.0 {
                kind = kind.with_emission(kind.emission() * factor as f32);
                renderer.set_light(light, kind)?;
                on.push(light);
            }
            found.push((light, kind, factor));
        }
        let after = means(renderer, goals, &on)?;
        Ok(Found { lights: found, rendered: before.into_iter().zip(after).map(|(a, b)| [a, b]).collect() })
    }
}

/// Lights that may change, and what is known about them.
struct Search<'a> {
    goals: &'a [Goal],
    /// Lights whose power may change.
    lights: &'a [usize],
    /// Bound of the factors of their powers.
    max_factor: f64,
    /// Illuminance of each goal from the lights that stay as they are, lx.
    fixed: Vec<f64>,
    /// Illuminance of each goal from each light alone, lx.
    alone: Vec<Vec<f64>>,
}

/// Mean illuminance of each goal with these lights on, lx.
fn means(renderer: &mut Renderer, goals: &[Goal], on: &[usize]) -> Result<Vec<f64>> {
    let points = measure_with(renderer, |light| on.contains(&light))?;
    let points = Measured::by_meter(renderer.scene(), &points);
    Ok(goals.iter().map(|goal| Reading::new(points[goal.meter]).mean).collect())
}

fn place_of(renderer: &Renderer, light: usize) -> Vec3 {
    renderer.scene().lights[light].kind.position().unwrap_or_default()
}

impl<'a> Search<'a> {
    /// Measures each light that may change alone, and `others` together.
    fn new(
        renderer: &mut Renderer,
        goals: &'a [Goal],
        (lights, others): (&'a [usize], &[usize]),
        max_factor: f64,
    ) -> Result<Self> {
        let fixed = match others.is_empty() {
            true => vec![0.0; goals.len()],
            false => means(renderer, goals, others)?,
        };
        let alone = lights.iter().map(|&light| means(renderer, goals, &[light])).collect::<Result<_>>()?;
        Ok(Self { goals, lights, max_factor, fixed, alone })
    }

    /// Factors of the powers, and the relative errors of the goals that they leave.
    fn powers(&self) -> (Vec<f64>, Vec<f64>) {
        let row = |(number, goal): (usize, &Goal)| -> Vec<f64> {
            self.alone.iter().map(|means| means[number] / goal.lux).collect()
        };
        let mut rows: Vec<Vec<f64>> = self.goals.iter().enumerate().map(row).collect();
        let mut wanted: Vec<f64> =
            self.goals.iter().zip(&self.fixed).map(|(goal, fixed)| 1.0 - fixed / goal.lux).collect();
        add_ridge(&mut rows, self.lights.len(), KEEP);
        wanted.resize(rows.len(), KEEP);
        let factors = least_squares::solve(&rows, &wanted, 0.0, &vec![self.max_factor; self.lights.len()]);
        let error = |(row, wanted): (&Vec<f64>, &f64)| -> f64 {
            row.iter().zip(&factors).map(|(a, x)| a * x).sum::<f64>() - wanted
        };
        let errors = rows.iter().zip(&wanted).take(self.goals.len()).map(error).collect();
        (factors, errors)
    }

    /// Moves lights, each at most `reach` metres, until the powers reach all goals or no step
    /// helps. `moved` are places in the list of lights. The steps are damped Gauss-Newton steps of
    /// the errors that the best powers leave. [Golub 1973]
    fn descend(&mut self, renderer: &mut Renderer, moved: &[usize], reach: f32) -> Result<()> {
        let places = |renderer: &Renderer| -> Vec<Vec3> {
            moved.iter().map(|&own| place_of(renderer, self.lights[own])).collect()
        };
        let starts = places(renderer);
        let (_, mut errors) = self.powers();
        let mut damping = DAMPING;
        for _ in 0..STEPS {
            if moved.is_empty() || squares(&errors) <= ENOUGH {
                break;
            }
            let (from, alone) = (places(renderer), self.alone.clone());
            let slopes = self.slopes(renderer, moved, (&errors, SLOPE * reach))?;
            let mut is_better = false;
            for _ in 0..ATTEMPTS {
                let step = damped_step(&slopes, &errors, damping);
                for (number, &own) in moved.iter().enumerate() {
                    let way = from[number] + step[number] - starts[number];
                    self.move_to(renderer, own, starts[number] + way.clamp_length_max(reach))?;
                }
                let (_, next) = self.powers();
                is_better = squares(&next) < squares(&errors);
                damping *= if is_better { RELAXED } else { DAMPED };
                if is_better {
                    errors = next;
                    break;
                }
            }
            if !is_better {
                self.alone = alone;
                for (&own, &from) in moved.iter().zip(&from) {
                    renderer.move_light(self.lights[own], from)?;
                }
                break;
            }
        }
        Ok(())
    }

    /// Moves a light and measures it alone.
    fn move_to(&mut self, renderer: &mut Renderer, own: usize, to: Vec3) -> Result<()> {
        let light = self.lights[own];
        renderer.move_light(light, to)?;
        self.alone[own] = means(renderer, self.goals, &[light])?;
        Ok(())
    }

    /// Slopes of the errors, 1/m, along each axis for each light that may move. Each is the
    /// difference of two measurements.
    fn slopes(
        &mut self,
        renderer: &mut Renderer,
        moved: &[usize],
        (errors, step_m): (&[f64], f32),
    ) -> Result<Vec<Vec<f64>>> {
        let mut slopes = Vec::with_capacity(3 * moved.len());
        for &own in moved {
            let (from, alone) = (place_of(renderer, self.lights[own]), self.alone[own].clone());
            for axis in Vec3::AXES {
                self.move_to(renderer, own, from + step_m * axis)?;
                let (_, beside) = self.powers();
                let slope = |(beside, here): (&f64, &f64)| (beside - here) / f64::from(step_m);
                slopes.push(beside.iter().zip(errors).map(slope).collect());
            }
            renderer.move_light(self.lights[own], from)?;
            self.alone[own] = alone;
        }
        Ok(slopes)
    }
}

fn squares(errors: &[f64]) -> f64 {
    errors.iter().map(|error| error * error).sum()
}

/// Adds rows of a multiple of the identity.
fn add_ridge(rows: &mut Vec<Vec<f64>>, count: usize, weight: f64) {
    rows.extend((0..count).map(|own| (0..count).map(|i| if i == own { weight } else { 0.0 }).collect()));
}

/// The step, metres, of each light that reduces the errors, with these slopes of each axis.
fn damped_step(slopes: &[Vec<f64>], errors: &[f64], damping: f64) -> Vec<Vec3> {
    let steepest = slopes.iter().map(|slope| squares(slope).sqrt()).fold(f64::MIN_POSITIVE, f64::max);
    let row = |goal: usize| slopes.iter().map(|slope| slope[goal]).collect();
    let mut rows: Vec<Vec<f64>> = (0..errors.len()).map(row).collect();
    add_ridge(&mut rows, slopes.len(), damping * steepest);
    let mut wanted: Vec<f64> = errors.iter().map(|error| -error).collect();
    wanted.resize(rows.len(), 0.0);
    let step = least_squares::solve(&rows, &wanted, f64::NEG_INFINITY, &vec![f64::INFINITY; slopes.len()]);
    step.chunks(3).map(|axes| Vec3::from_array([0, 1, 2].map(|axis| axes[axis] as f32))).collect()
}

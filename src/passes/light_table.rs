//! The device's tables of lights: one for frames, in which each light is one or more parts with
//! point samples, and one for path and photon tracing, which choose a point at random.

use crate::scene::emission::Sky;
use crate::scene::emitters::Part;
use crate::scene::environment::{Beam, Cell};
use crate::scene::{Emission, Light, LightKind, octahedral};
use crate::types::{LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_GROUP, LIGHT_SKY, LIGHT_SPOT, LightSource};
use glam::{DVec2, DVec3, Vec3};
use std::ops::Range;

/// Point samples of an emitting surface, over all of its parts.
const SURFACE_SAMPLES: u32 = 32;
/// Point samples of a part: one dispatch handles all of them.
const MAX_PART_SAMPLES: u32 = super::one_light::SAMPLES_A_DISPATCH;
/// Width of the octahedral map of a sky's irradiances, odd so that the axes are nodes. Mirrors
/// `SKY_TABLE` in `glsl/include/direct.glsl`.
const SKY_TABLE: u32 = 65;

/// A table of lights.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    /// The rows; frames read one at a time.
    pub rows: Vec<LightSource>,
    /// Irradiances from skies, which follow the rows.
    pub sky_irradiances: Vec<f32>,
    /// Rows of each light.
    pub lights: Vec<Range<u32>>,
}

impl LightTable {
    /// The table for frames. Without emitting surfaces and sky, each light is one row.
    pub fn new(lights: &[Light], emission: &Emission) -> Self {
        let mut table = Self::default();
        for light in lights {
            let first = table.rows.len();
            table.rows.extend(parts(&light.kind, emission));
            table.lights.push(first as u32..table.rows.len() as u32);
        }
        // The irradiances start where the rows end.
        let mut place = table.rows.len() * size_of::<LightSource>() / 4;
        for (light, rows) in lights.iter().zip(&table.lights) {
            if let (LightKind::Sky { turn, channel, .. }, Some(sky)) = (light.kind, &emission.sky) {
                table.sky_irradiances.extend(sky_irradiances(sky, turn, channel));
                // Whole numbers below 2^24, which a float holds. Their bits as integers would be
                // denormal floats, which devices may replace by zero.
                let last = &mut table.rows[rows.end as usize - 1];
                (last.inner_angle, last.outer_angle) = (place as f32, rows.len() as f32);
                place += (SKY_TABLE * SKY_TABLE) as usize;
            }
        }
        table
    }

    /// The table for path and photon tracing. The first rows are the lights; a light of several
    /// parts names the rows of these.
    pub fn for_paths(lights: &[Light], emission: &Emission) -> Vec<LightSource> {
        let mut rows: Vec<LightSource> = Vec::new();
        let mut parts: Vec<LightSource> = Vec::new();
        for light in lights {
            let of_light = path_parts(&light.kind, emission);
            let head = match of_light {
                Some(of_light) => {
                    let head = LightSource {
                        kind: LIGHT_GROUP,
                        stride: (lights.len() + parts.len()) as u32,
                        modulus: of_light.len() as u32,
                        ..LightSource::point(Vec3::ZERO, light.kind.emission())
                    };
                    parts.extend(of_light);
                    head
                }
                None => plain(&light.kind),
            };
            rows.push(head);
        }
        rows.extend(parts);
        rows
    }
}

/// The device's table of lights that have one part each.
pub fn light_sources(lights: &[Light]) -> Vec<LightSource> {
    lights.iter().map(|light| plain(&light.kind)).collect()
}

/// A light of one part. Black for other lights.
fn plain(kind: &LightKind) -> LightSource {
    match *kind {
        LightKind::Point { position, intensity } => LightSource::point(position, intensity),
        LightKind::Spot { position, direction, intensity, angle, penumbra } => LightSource {
            kind: LIGHT_SPOT,
            axis: direction,
            inner_angle: angle * (1.0 - penumbra),
            outer_angle: angle,
            ..LightSource::point(position, intensity)
        },
        LightKind::Area { corner, edge_u, edge_v, radiance, samples } => {
            area_light(&Part { corner, edge_u, edge_v, shape: 0 }, radiance, samples)
        }
        LightKind::Directional { direction, irradiance } => LightSource {
            kind: LIGHT_DIRECTIONAL,
            axis: direction,
            ..LightSource::point(Vec3::ZERO, irradiance)
        },
        LightKind::Surface { .. } | LightKind::Sky { .. } => LightSource::point(Vec3::ZERO, Vec3::ZERO),
    }
}

fn area_light(part: &Part, radiance: Vec3, samples: u32) -> LightSource {
    let [stride, modulus] = lattice(samples);
    LightSource {
        kind: LIGHT_AREA,
        axis: part.cross().normalize().as_vec3(),
        area: part.area_m2() as f32,
        edge_u: part.edge_u,
        edge_v: part.edge_v,
        samples,
        stride,
        modulus,
        shape: part.shape,
        ..LightSource::point(part.corner, radiance)
    }
}

/// The parts of a light in frames; at least one.
fn parts(kind: &LightKind, emission: &Emission) -> Vec<LightSource> {
    let found: Vec<LightSource> = match (*kind, &emission.sky) {
        (LightKind::Surface { material, radiance }, _) => {
            let parts = emission.surfaces.get(&material).map_or(&[][..], |emitter| &emitter.parts);
            let samples = match parts.len() as u32 {
                0 | 1 => SURFACE_SAMPLES,
                count => (SURFACE_SAMPLES / count).clamp(1, MAX_PART_SAMPLES),
            };
            parts.iter().map(|part| area_light(part, radiance, samples)).collect()
        }
        (LightKind::Sky { radiance, turn, channel }, Some(sky)) => {
            let part = |beam: &Beam| LightSource {
                kind: LIGHT_DIRECTIONAL,
                axis: -turned(beam.direction, turn).as_vec3(),
                relative: of_channel(beam.irradiance, channel) as f32,
                // Highlights look up this channel of the sky.
                area: f32::from(channel.unwrap_or(0)),
                ..LightSource::point(Vec3::ZERO, radiance)
            };
            sky.beams.iter().map(part).collect()
        }
        _ => Vec::new(),
    };
    if found.is_empty() { vec![plain(kind)] } else { found }
}

/// The parts of a light for path and photon tracing, with their cumulative probabilities. `None`
/// if the light has one.
fn path_parts(kind: &LightKind, emission: &Emission) -> Option<Vec<LightSource>> {
    let (mut parts, powers): (Vec<LightSource>, Vec<f64>) = match (*kind, &emission.sky) {
        (LightKind::Surface { material, radiance }, _) => {
            let surface = &emission.surfaces.get(&material)?.surface;
            (
                surface.iter().map(|part| area_light(part, radiance, 1)).collect(),
                surface.iter().map(Part::area_m2).collect(),
            )
        }
        (LightKind::Sky { radiance, turn, channel }, Some(sky)) => {
            let part = |cell: &Cell| LightSource {
                kind: LIGHT_SKY,
                edge_u: DVec3::new(cell.azimuth - f64::from(turn), cell.width, cell.height).as_vec3(),
                outer_angle: cell.depth as f32,
                area: cell.solid_angle() as f32,
                relative: of_channel(cell.radiance, channel) as f32,
                ..LightSource::point(Vec3::ZERO, radiance)
            };
            let power = |cell: &Cell| of_channel(cell.radiance, channel) * cell.solid_angle();
            let lit = sky.cells.iter().filter(|cell| power(cell) > 0.0);
            lit.map(|cell| (part(cell), power(cell))).unzip()
        }
        _ => return None,
    };
    let total: f64 = powers.iter().sum();
    let mut end = 0.0;
    for (part, power) in parts.iter_mut().zip(&powers) {
        end += power / total;
        part.inner_angle = end as f32;
    }
    parts.last_mut()?.inner_angle = 1.0;
    Some(parts)
}

/// Rotates a direction about +Y.
fn turned(direction: DVec3, turn: f32) -> DVec3 {
    let [x, z] = DVec2::from_angle(-f64::from(turn)).rotate(DVec2::new(direction.x, direction.z)).to_array();
    DVec3::new(x, direction.y, z)
}

fn of_channel(colour: DVec3, channel: Option<u8>) -> f64 {
    match channel {
        Some(channel) => colour[usize::from(channel)],
        None => colour.max_element(),
    }
}

/// Irradiance from all of a sky, for normals of an octahedral map. A receiver that sees all of its
/// sky gets exactly that, whatever the parts.
fn sky_irradiances(sky: &Sky, turn: f32, channel: Option<u8>) -> impl Iterator<Item = f32> {
    let normals = octahedral::directions(SKY_TABLE).into_iter();
    normals.map(move |normal| of_channel(sky.irradiance.at(turned(normal, -turn)), channel) as f32)
}

/// Step and modulus of a lattice of `samples` points, with one in every row and every column. The
/// step is close to the golden section, which separates neighbours, and coprime to the modulus,
/// which separates rows. The modulus is the number of points, or one more without the point at the
/// origin, whichever is closer.
fn lattice(samples: u32) -> [u32; 2] {
    let is_coprime = |stride: u32, modulus: u32| {
        let (mut a, mut b) = (modulus, stride);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    let distance =
        |[stride, modulus]: [u32; 2]| (f64::from(stride) / f64::from(modulus) - 0.618_033_988_75).abs();
    let lattices = [samples, samples + 1].into_iter().flat_map(|modulus| {
        (1..modulus).filter(move |&stride| is_coprime(stride, modulus)).map(move |stride| [stride, modulus])
    });
    lattices.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or([1, 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::environment::Environment;

    fn sky(turn: f32) -> (Vec<Light>, Emission) {
        let emission = Emission { sky: Some(Sky::new(Environment::constant(), 64)), ..Emission::default() };
        let kind = LightKind::Sky { radiance: Vec3::ONE, turn, channel: None };
        (vec![Light { name: "sky".to_owned(), kind, is_on: true }], emission)
    }

    #[test]
    fn a_sky_is_directional_parts_and_its_irradiances() {
        let (lights, emission) = sky(0.7);
        let table = LightTable::new(&lights, &emission);
        assert_eq!((table.lights.len(), &table.lights[0]), (1, &(0..64)));
        assert!(table.rows.iter().all(|row| row.kind == LIGHT_DIRECTIONAL && row.relative > 0.0));
        assert_eq!((table.rows[63].inner_angle, table.rows[63].outer_angle), ((64 * 24) as f32, 64.0));
        assert_eq!(table.sky_irradiances.len(), (SKY_TABLE * SKY_TABLE) as usize);
        let error = |irradiance: &f32| (irradiance / std::f32::consts::PI - 1.0).abs();
        assert!(table.sky_irradiances.iter().map(error).fold(0.0, f32::max) < 1e-3);
    }

    #[test]
    fn parts_for_paths_are_chosen_by_power() {
        let (lights, emission) = sky(0.0);
        let rows = LightTable::for_paths(&lights, &emission);
        assert_eq!((rows[0].kind, rows[0].stride, rows[0].modulus), (LIGHT_GROUP, 1, rows.len() as u32 - 1));
        let ends: Vec<f32> = rows[1..].iter().map(|row| row.inner_angle).collect();
        assert!(ends.is_sorted() && ends.last() == Some(&1.0));
        // Equal radiance: a cell's probability is its solid angle over 4π.
        let share = f64::from(rows[900].inner_angle - rows[899].inner_angle);
        assert!(
            (share * 4.0 * std::f64::consts::PI / f64::from(rows[900].area) - 1.0).abs() < 1e-2,
            "{share}"
        );
    }

    #[test]
    fn turns_are_about_y() {
        let quarter = turned(DVec3::NEG_Z, std::f32::consts::FRAC_PI_2);
        assert!((quarter - DVec3::NEG_X).length() < 1e-6, "{quarter}");
    }
}

//! The device's tables of lights: one for frames, in which each light is one or more parts with
//! point samples, and one for path and photon tracing, which choose a point at random.

use super::lattice::lattice;
use super::one_light::SkyTable;
use crate::cpu::hemisphere::frame;
use crate::cpu::lights::Intensities;
use crate::scene::emission::Sky;
use crate::scene::emitters::Part;
use crate::scene::environment::{Beam, Cell};
use crate::scene::luminaire::Profile;
use crate::scene::{Emission, Light, LightKind};
use crate::types::{LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_GROUP, LIGHT_SKY, LIGHT_SPOT, LightSource};
use glam::{DVec2, DVec3, Vec3};
use std::ops::Range;
use std::sync::Arc;

/// Point samples of an emitting surface, over all of its parts.
const SURFACE_SAMPLES: u32 = 32;
/// Point samples of a part: one dispatch handles all of them.
const MAX_PART_SAMPLES: u32 = super::one_light::SAMPLES_A_DISPATCH;

/// A table of lights.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    /// The rows; frames read one at a time.
    pub rows: Vec<LightSource>,
    /// Values that follow the rows: radiances of skies per unit emission, measured intensities.
    pub values: Vec<f32>,
    /// Rows and sky of each light.
    pub lights: Vec<LightRows>,
}

/// What a table stores about one light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightRows {
    /// Rows of the parts with shadow rays. Empty for a sky without bright spots, whose only row
    /// is no part.
    pub parts: Range<u32>,
    /// The radiance that rays out of the scene find. `None` unless the light is a sky.
    pub sky: Option<SkyTable>,
}

impl LightRows {
    /// All rows of the light; at least one.
    pub fn rows(&self) -> Range<usize> {
        self.parts.start as usize..self.parts.end.max(self.parts.start + 1) as usize
    }
}

impl LightTable {
    /// The table for frames. Without emitting surfaces and sky, each light is one row.
    pub fn new(lights: &[Light], emission: &Emission) -> Self {
        let mut table = Self::default();
        for light in lights {
            let first = table.rows.len() as u32;
            let parts = parts(&light.kind, emission);
            let end = first + parts.len() as u32;
            // A light names its row even if it has no part.
            table.rows.extend(if parts.is_empty() { vec![plain(&light.kind)] } else { parts });
            table.lights.push(LightRows { parts: first..end, sky: None });
        }
        for (index, light) in lights.iter().enumerate() {
            if let (LightKind::Sky { turn, channel, .. }, Some(sky)) = (light.kind, &emission.sky) {
                let first_word = (table.first_word() + table.values.len()) as u32;
                table.lights[index].sky = Some(SkyTable { first_word, side: sky.side });
                table.values.extend(sky_radiances(sky, turn, channel));
            }
        }
        table.measure(lights);
        table
    }

    /// Word at which the values start.
    fn first_word(&self) -> usize {
        self.rows.len() * size_of::<LightSource>() / 4
    }

    /// Appends the measured intensities of lights; those of one file once.
    fn measure(&mut self, lights: &[Light]) {
        let mut known: Vec<(&Arc<Profile>, f32)> = Vec::new();
        for (index, light) in lights.iter().enumerate() {
            let Some(luminaire) = &light.luminaire else { continue };
            let profile = &luminaire.profile;
            let found = known.iter().find(|(known, _)| Arc::ptr_eq(known, profile) || *known == profile);
            let fractions = found.map(|(_, word)| *word).unwrap_or_else(|| {
                let word = self.next_word();
                self.values.extend(&profile.fractions);
                known.push((profile, word));
                word
            });
            let head = self.next_word();
            let row = &mut self.rows[self.lights[index].parts.start as usize];
            row.area = head;
            (row.inner_angle, row.outer_angle) = (profile.widest, profile.widest);
            let c0 = frame(row.axis).transpose() * luminaire.c0(row.axis);
            let azimuth = c0.y.atan2(c0.x) as f32;
            self.values.extend([profile.rows as f32, profile.columns as f32, azimuth, fractions]);
        }
    }

    /// The word behind the last value, as a number: a float holds integers up to 2^24.
    fn next_word(&self) -> f32 {
        (self.first_word() + self.values.len()) as f32
    }

    /// The measured intensities.
    pub fn intensities(&self) -> Intensities<'_> {
        Intensities { first_word: self.first_word(), values: &self.values }
    }

    /// Length of [`Self::bytes`].
    pub fn byte_count(&self) -> usize {
        (4 * (self.first_word() + self.values.len())).next_multiple_of(16)
    }

    /// The device's copy: rows, then values, in whole texels.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = bytemuck::cast_slice(&self.rows).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&self.values));
        bytes.resize(self.byte_count(), 0);
        bytes
    }

    /// Radiance of the sky in each cell of its octahedral table, W/m²/sr, if the lights have these
    /// emissions. Empty without a sky.
    pub fn sky_radiance(&self, emissions: impl Iterator<Item = Vec3>) -> Vec<Vec3> {
        let skies =
            self.lights.iter().zip(emissions).filter_map(|(rows, emission)| Some((rows.sky?, emission)));
        let first_of_all = self.first_word();
        let mut sum = Vec::new();
        for (sky, emission) in skies {
            let first = sky.first_word as usize - first_of_all;
            sum.resize(sky.cells() as usize, Vec3::ZERO);
            let own = &self.values[first..first + sum.len()];
            sum.iter_mut().zip(own).for_each(|(sum, radiance)| *sum += *radiance * emission);
        }
        sum
    }

    /// The table for path and photon tracing. The first rows are the lights; a light of several
    /// parts names the rows of these.
    pub fn for_paths(lights: &[Light], emission: &Emission) -> Self {
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
        let own = |index| LightRows { parts: index..index + 1, sky: None };
        let mut table =
            Self { rows, values: Vec::new(), lights: (0..lights.len() as u32).map(own).collect() };
        table.measure(lights);
        table
    }
}

/// The device's table of lights that have one part each.
pub fn light_sources(lights: &[Light]) -> Vec<LightSource> {
    lights.iter().map(|light| plain(&light.kind)).collect()
}

/// A light of one part. Without direction for a sky, black for a surface.
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
        LightKind::Sky { radiance, channel, .. } => LightSource {
            kind: LIGHT_DIRECTIONAL,
            // Highlights look up this channel of the sky.
            area: f32::from(channel.unwrap_or(0)),
            ..LightSource::point(Vec3::ZERO, radiance)
        },
        LightKind::Surface { .. } => LightSource::point(Vec3::ZERO, Vec3::ZERO),
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

/// The parts of a light in frames. Only a sky may have none.
fn parts(kind: &LightKind, emission: &Emission) -> Vec<LightSource> {
    match (*kind, &emission.sky) {
        (LightKind::Surface { material, radiance }, _) => {
            let Some(parts) = emission.surfaces.get(&material).map(|emitter| &emitter.parts) else {
                return vec![plain(kind)];
            };
            let samples = match parts.len() as u32 {
                0 | 1 => SURFACE_SAMPLES,
                count => (SURFACE_SAMPLES / count).clamp(1, MAX_PART_SAMPLES),
            };
            parts.iter().map(|part| area_light(part, radiance, samples)).collect()
        }
        (LightKind::Sky { turn, channel, .. }, Some(sky)) => {
            let part = |beam: &Beam| LightSource {
                axis: -turned(beam.direction, turn).as_vec3(),
                relative: of_channel(beam.irradiance, channel) as f32,
                ..plain(kind)
            };
            sky.beams.iter().map(part).collect()
        }
        _ => vec![plain(kind)],
    }
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
            let part = |(cell, smooth): (&Cell, &Cell)| LightSource {
                kind: LIGHT_SKY,
                edge_u: DVec3::new(cell.azimuth - f64::from(turn), cell.width, cell.height).as_vec3(),
                // The fraction that frames gather.
                edge_v: Vec3::X
                    * (of_channel(smooth.radiance, channel) / of_channel(cell.radiance, channel)) as f32,
                outer_angle: cell.depth as f32,
                area: cell.solid_angle() as f32,
                relative: of_channel(cell.radiance, channel) as f32,
                ..LightSource::point(Vec3::ZERO, radiance)
            };
            let power = |cell: &Cell| of_channel(cell.radiance, channel) * cell.solid_angle();
            let lit = sky.cells.iter().zip(&sky.smooth_cells).filter(|(cell, _)| power(cell) > 0.0);
            lit.map(|both| (part(both), power(both.0))).unzip()
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

/// Radiance per unit emission in each cell of a sky's table.
fn sky_radiances(sky: &Sky, turn: f32, channel: Option<u8>) -> impl Iterator<Item = f32> {
    let table = sky.table(turn);
    (0..table.len()).map(move |cell| of_channel(table[cell], channel) as f32)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::scene::environment::Environment;
    use crate::scene::luminaire::Luminaire;

    fn sky(turn: f32) -> (Vec<Light>, Emission) {
        let emission = Emission { sky: Some(Sky::new(Environment::constant(), 64)), ..Emission::default() };
        let kind = LightKind::Sky { radiance: Vec3::ONE, turn, channel: None };
        (vec![Light::new("sky", kind)], emission)
    }

    #[test]
    fn a_constant_sky_is_one_radiance_without_parts() {
        let (lights, emission) = sky(0.7);
        let table = LightTable::new(&lights, &emission);
        let first_word = (size_of::<LightSource>() / 4) as u32;
        let expected = LightRows { parts: 0..0, sky: Some(SkyTable { first_word, side: 1 }) };
        assert_eq!((table.rows.len(), &table.lights[..]), (1, &[expected][..]));
        assert!((table.values[0] - 1.0).abs() < 1e-6 && table.values.len() == 1);
        let tint = Vec3::new(0.5, 2.0, 3.0);
        assert_eq!(table.sky_radiance(std::iter::once(tint)), [tint * table.values[0]]);
    }

    #[test]
    fn bright_spots_are_parts_with_the_light_that_the_table_lacks() {
        let mut texels = vec![Vec3::ONE; 64 * 32];
        texels[10 * 64 + 40] = Vec3::splat(5000.0);
        let environment = Arc::new(Environment { size: [64, 32], texels });
        let emission = Emission { sky: Some(Sky::new(environment.clone(), 64)), ..Emission::default() };
        let table = LightTable::new(&sky(0.0).0, &emission);
        assert_eq!((table.lights[0].parts.clone(), table.lights[0].sky.unwrap().side), (0..1, 64));
        let sun = &table.rows[0];
        assert_eq!(sun.kind, LIGHT_DIRECTIONAL);
        // Irradiance of a surface that faces the spot, which is almost flat.
        let cell = environment.cells().0[10 * 64 + 40];
        let bright = (5000.0 - f64::from(sky_peak(&emission))) * cell.solid_angle();
        assert!((f64::from(sun.relative) / bright - 1.0).abs() < 2e-3, "{} {bright}", sun.relative);
    }

    fn sky_peak(emission: &Emission) -> f32 {
        let texels = &emission.sky.as_ref().unwrap().smooth.texels;
        texels.iter().map(|texel| texel.x).fold(0.0, f32::max)
    }

    #[test]
    fn parts_for_paths_are_chosen_by_power() {
        let (lights, emission) = sky(0.0);
        let rows = LightTable::for_paths(&lights, &emission).rows;
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

    /// Two turned lights of one file have a head each, and its fractions once.
    #[test]
    fn lights_of_one_file_have_its_intensities_in_common() {
        let text = "TILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n500 300 100\n";
        let profile = Arc::new(Profile::from_ies(text.as_bytes()).unwrap());
        let lamp = |turn| Luminaire { profile: profile.clone(), file: "lamp.ies".into(), turn };
        let lights = [0.0, 0.5].map(|turn| Light::measured("lamp", lamp(turn), Vec3::ZERO));
        let table = LightTable::new(&lights, &Emission::default());
        assert_eq!((table.values.len(), table.byte_count()), (3 + 2 * 4, table.bytes().len()));
        let [first, second] = [0, 1].map(|row| table.rows[row]);
        assert!(first.area != second.area);
        for light in [first, second] {
            let away = DVec3::new(1.0, -1.0, 0.0).normalize();
            assert!((table.intensities().fraction(&light, away) - 0.6).abs() < 1e-6);
        }
    }

    #[test]
    fn turns_are_about_y() {
        let quarter = turned(DVec3::NEG_Z, std::f32::consts::FRAC_PI_2);
        assert!((quarter - DVec3::NEG_X).length() < 1e-6, "{quarter}");
    }
}

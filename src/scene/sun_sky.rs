//! The sun and a clear sky as an environment, from the sun's place and the turbidity of the air.
//! The sky is the model of [Hosek 2012], in W/m²/sr; 683 lm/W gives its luminance.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use rayon::prelude::*;

use super::environment::Environment;

/// Size of the image: a texel is somewhat smaller than the sun.
const SIZE: [u32; 2] = [1024, 512];
/// Angular radius of the sun, radians.
const SUN_RADIUS: f64 = 0.004_65;
/// Irradiance of the sun outside of the atmosphere: 128 klx, as warm as a black body of 5 778 K.
const SOLAR: DVec3 = DVec3::new(203.0, 185.0, 172.0);
/// Wavelengths of the channels, µm.
const WAVELENGTHS: [f64; 3] = [0.610, 0.550, 0.465];
/// Absorption by 0.35 cm of ozone at these wavelengths. [Preetham, table 2]
const OZONE: [f64; 3] = [0.042, 0.030, 0.003];
/// Samples of a texel along each side, for the edge of the sun.
const SAMPLES: usize = 8;

/// What the environment depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SunSky {
    /// Height of the sun over the horizon, degrees, 0..=90.
    pub(super) elevation: f64,
    /// Direction of the sun from −Z towards +X, degrees.
    pub(super) azimuth: f64,
    /// 2 is clear air, 10 haze.
    pub(super) turbidity: f64,
    /// Albedo of the ground, which is seen below the horizon.
    pub(super) ground: Vec3,
}

impl SunSky {
    /// Unit direction towards the sun.
    fn direction(&self) -> DVec3 {
        let [elevation, azimuth] = [self.elevation, self.azimuth].map(f64::to_radians);
        let across = elevation.cos();
        DVec3::new(across * azimuth.sin(), elevation.sin(), -across * azimuth.cos())
    }

    /// Irradiance of a surface that faces the sun, W/m². [Preetham, appendix]
    fn sunlight(&self) -> DVec3 {
        let sine = self.elevation.to_radians().sin();
        // [Kasten 1989]
        let air_mass = 1.0 / (sine + 0.505_72 * (self.elevation + 6.079_95).powf(-1.636_4));
        let haze = 0.046_08 * self.turbidity - 0.045_86;
        let depth = |channel: usize| {
            let wavelength = WAVELENGTHS[channel];
            0.008_735 * wavelength.powf(-4.08) + haze * wavelength.powf(-1.3) + OZONE[channel]
        };
        SOLAR * DVec3::from([0, 1, 2].map(|channel| (-air_mass * depth(channel)).exp()))
    }

    /// The image of the sky, of the ground below the horizon, and of the sun.
    ///
    /// Panics if a number is out of range: the reader refuses it.
    pub(super) fn environment(&self) -> Arc<Environment> {
        let params = SkyParams {
            elevation: self.elevation.to_radians() as f32,
            turbidity: self.turbidity as f32,
            albedo: self.ground.to_array(),
        };
        let state = SkyState::new(&params).expect("the reader has checked the ranges");
        let sun = self.direction();
        let half = SIZE[1] as usize / 2;
        let sky = |index: usize| {
            let direction = direction(index % SIZE[0] as usize, index / SIZE[0] as usize, [0.5; 2]);
            let (theta, gamma) =
                (direction.y.acos() as f32, direction.dot(sun).clamp(-1.0, 1.0).acos() as f32);
            let radiance = |channel| f64::from(state.radiance(theta, gamma, channel)).max(0.0);
            DVec3::new(radiance(Channel::R), radiance(Channel::G), radiance(Channel::B))
        };
        let mut texels: Vec<DVec3> = (0..half * SIZE[0] as usize).into_par_iter().map(sky).collect();
        let falls = |(index, radiance): (usize, &DVec3)| {
            let row = index / SIZE[0] as usize;
            let height = direction(0, row, [0.5; 2]).y;
            *radiance * height * solid_angle(row)
        };
        let light: DVec3 = texels.iter().enumerate().map(falls).sum();
        let sunlight = self.sunlight();
        let ground = self.ground.as_dvec3() / PI * (light + sunlight * sun.y.max(0.0));
        texels.resize(SIZE[0] as usize * SIZE[1] as usize, ground);
        let discs = discs(sun);
        let seen: f64 = discs.iter().map(|&(index, part)| part * solid_angle(index / SIZE[0] as usize)).sum();
        for (index, part) in discs {
            texels[index] += part / seen * sunlight;
        }
        Arc::new(Environment {
            size: SIZE,
            texels: texels.into_iter().map(|texel| texel.as_vec3()).collect(),
        })
    }
}

/// Unit direction of a place in a texel.
fn direction(column: usize, row: usize, place: [f64; 2]) -> DVec3 {
    let azimuth = 2.0 * PI * (column as f64 + place[0]) / f64::from(SIZE[0]) - PI;
    let polar = PI * (row as f64 + place[1]) / f64::from(SIZE[1]);
    DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos())
}

fn solid_angle(row: usize) -> f64 {
    let height = |row: usize| (PI * row as f64 / f64::from(SIZE[1])).cos();
    2.0 * PI / f64::from(SIZE[0]) * (height(row) - height(row + 1))
}

/// Texels that show the sun, each with the part of it that does.
fn discs(sun: DVec3) -> Vec<(usize, f64)> {
    let reach = 2.0 * PI / f64::from(SIZE[0]) + SUN_RADIUS;
    let part = |index: usize| {
        let (column, row) = (index % SIZE[0] as usize, index / SIZE[0] as usize);
        // Near the zenith a texel is wide and thin.
        if direction(column, row, [0.5; 2]).dot(sun) < (2.0 * reach).cos() {
            return None;
        }
        let place = |sample: usize| (sample as f64 + 0.5) / SAMPLES as f64;
        let shows = |sample: &usize| {
            let inside = [place(sample % SAMPLES), place(sample / SAMPLES)];
            direction(column, row, inside).dot(sun) > SUN_RADIUS.cos()
        };
        let count = (0..SAMPLES * SAMPLES).filter(shows).count();
        (count > 0).then_some((index, count as f64 / (SAMPLES * SAMPLES) as f64))
    };
    (0..SIZE[0] as usize * SIZE[1] as usize).into_par_iter().filter_map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::emission::Sky;

    fn luminance(colour: DVec3) -> f64 {
        683.0 * colour.dot(DVec3::new(0.2126, 0.7152, 0.0722))
    }

    /// On clear days the sun brings 70 to 100 klx, and the sky 10 to 20 klx.
    #[test]
    fn a_clear_day_is_as_bright_as_measured() {
        for elevation in [35.0, 60.0, 80.0] {
            let day = SunSky { elevation, azimuth: 30.0, turbidity: 3.0, ground: Vec3::splat(0.2) };
            let sun = luminance(day.sunlight());
            assert!((70e3..105e3).contains(&sun), "{sun} lx at {elevation}°");
            let environment = day.environment();
            let (cells, _) = environment.divided().0.cells();
            let sky: f64 = cells
                .iter()
                .filter(|cell| cell.height > -1e-9)
                .map(|cell| luminance(cell.radiance) * cell.solid_angle() * (cell.height + 0.5 * cell.depth))
                .sum();
            assert!((10e3..24e3).contains(&sky), "{sky} lx at {elevation}°");
        }
        let low = SunSky { elevation: 3.0, azimuth: 0.0, turbidity: 3.0, ground: Vec3::ZERO };
        let [red, _, blue] = low.sunlight().to_array();
        assert!(red > 4.0 * blue, "a low sun is red");
    }

    #[test]
    fn the_sun_is_one_light_with_its_irradiance() {
        for (elevation, azimuth) in [(50.0, 0.0), (20.0, 100.0), (89.5, 0.0), (12.0, 180.0), (70.0, -75.3)] {
            let day = SunSky { elevation, azimuth, turbidity: 2.5, ground: Vec3::splat(0.3) };
            let sky = Sky::new(day.environment(), 64);
            let beams = &sky.beams;
            let sum: DVec3 = beams.iter().map(|beam| beam.irradiance).sum();
            let whole = day.sunlight();
            assert!((sum / whole - 1.0).abs().max_element() < 0.01, "{sum} instead of {whole}");
            let sum: DVec3 = beams.iter().map(|beam| beam.irradiance.x * beam.direction).sum();
            let off = sum.normalize().dot(day.direction()).min(1.0).acos().to_degrees();
            assert!(off < 0.1 && beams.len() <= 2, "{off}° off, {} lights", beams.len());
        }
    }
}

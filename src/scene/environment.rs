//! The sky: radiance from each direction, as an equirectangular image. Its middle shows −Z, its
//! upper edge +Y.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Largest width of the grid of cells that path and photon tracing sample.
const MAX_CELLS: usize = 256;
/// Size of the grid of cells for sums of unoccluded irradiance. A horizon divides few cells.
const IRRADIANCE_CELLS: [usize; 2] = [192, 96];

/// A sky without its brightness: radiance per unit of the lights that show it.
#[derive(Clone, PartialEq)]
pub struct Environment {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Linear red, green, blue, row by row from the top.
    pub texels: Vec<Vec3>,
}

/// Prints the size, since all texels would be too long.
impl std::fmt::Debug for Environment {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(formatter, "Environment({}×{})", self.size[0], self.size[1])
    }
}

/// A range of directions with uniform radiance.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// First azimuth, radians; 0 is −Z, π/2 is +X.
    pub azimuth: f64,
    /// Difference of azimuths.
    pub width: f64,
    /// Sine of the lowest elevation.
    pub height: f64,
    /// Difference of these sines.
    pub depth: f64,
    /// Mean radiance of the cell.
    pub radiance: DVec3,
}

impl Cell {
    /// Solid angle, sr.
    pub fn solid_angle(&self) -> f64 {
        self.width * self.depth
    }

    /// ∫ω dω over the cell.
    fn moment(&self) -> DVec3 {
        // ∫√(1−h²) dh
        let across = |height: f64| {
            let height = height.clamp(-1.0, 1.0);
            0.5 * (height * (1.0 - height * height).sqrt() + height.asin())
        };
        let top = self.height + self.depth;
        let radius = across(top) - across(self.height);
        let [from, to] = [self.azimuth, self.azimuth + self.width];
        let upwards = 0.5 * (top * top - self.height * self.height);
        DVec3::new(radius * (from.cos() - to.cos()), upwards * self.width, -radius * (to.sin() - from.sin()))
    }
}

/// A part of the sky as a directional light.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Unit direction towards the sky.
    pub direction: DVec3,
    /// Irradiance of a facing surface.
    pub irradiance: DVec3,
}

impl Environment {
    /// A sky of one colour.
    pub fn constant() -> Arc<Self> {
        // Enough texels to divide it into parts.
        let size = [64, 32];
        Arc::new(Self { size, texels: vec![Vec3::ONE; (size[0] * size[1]) as usize] })
    }

    /// Whether all texels have the colour of the brightest, but for their brightness.
    pub fn is_grey(&self) -> bool {
        self.texels
            .iter()
            .all(|texel| texel.max_element() - texel.min_element() <= 1e-3 * texel.max_element())
    }

    /// Cells of a grid of at most 256×128, row by row from the top, and its columns.
    pub fn cells(&self) -> (Vec<Cell>, usize) {
        let [width, height] = self.size.map(|size| size as usize);
        let columns = width.min(MAX_CELLS);
        (self.grid([columns, height.min(MAX_CELLS / 2)]), columns)
    }

    /// Cells of a grid, row by row from the top.
    fn grid(&self, [columns, rows]: [usize; 2]) -> Vec<Cell> {
        let [width, height] = self.size.map(|size| size as usize);
        let height_at = |row: usize, rows: usize| (PI * row as f64 / rows as f64).cos();
        let cells = (0..rows * columns).map(|index| {
            let (row, column) = (index / columns, index % columns);
            let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
            for y in row * height / rows..((row + 1) * height / rows).max(row * height / rows + 1) {
                let solid = height_at(y, height) - height_at(y + 1, height);
                for x in column * width / columns
                    ..((column + 1) * width / columns).max(column * width / columns + 1)
                {
                    sum += solid * self.texels[y * width + x].as_dvec3();
                    weight += solid;
                }
            }
            let (top, bottom) = (height_at(row, rows), height_at(row + 1, rows));
            Cell {
                azimuth: TAU * column as f64 / columns as f64 - PI,
                width: TAU / columns as f64,
                height: bottom,
                depth: top - bottom,
                radiance: sum / weight,
            }
        });
        cells.collect()
    }

    /// Divides the sky into `count` directional lights of about equal brightness, neighbours
    /// together: the brightest region is halved until there are enough. [Debevec 2005]
    pub fn beams(&self, count: usize) -> Vec<Beam> {
        let (cells, columns) = self.cells();
        let brightness: Vec<f64> =
            cells.iter().map(|cell| cell.radiance.element_sum() * cell.solid_angle()).collect();
        let mut regions = vec![Region { x: 0, y: 0, width: columns, height: cells.len() / columns }];
        let sum = |region: &Region| region.cells(columns).map(|cell| brightness[cell]).sum::<f64>();
        let mut sums = vec![sum(&regions[0])];
        while regions.len() < count {
            let divisible =
                (0..regions.len()).filter(|&index| regions[index].width * regions[index].height > 1);
            let Some(index) = divisible.max_by(|&a, &b| sums[a].total_cmp(&sums[b])) else { break };
            let halves = regions[index].halved(&cells, &brightness, columns);
            sums.splice(index..=index, halves.iter().map(sum));
            regions.splice(index..=index, halves);
        }
        regions.iter().filter_map(|region| beam(region.cells(columns).map(|cell| &cells[cell]))).collect()
    }

    /// Irradiance of receivers that see all of their sky, by their unit normals.
    pub fn irradiances(&self, normals: &[DVec3]) -> Vec<DVec3> {
        let cells = self.grid(IRRADIANCE_CELLS);
        let moments: Vec<(DVec3, DVec3)> = cells.iter().map(|cell| (cell.radiance, cell.moment())).collect();
        let facing = |normal: &DVec3| {
            moments.iter().map(|&(radiance, moment)| radiance * moment.dot(*normal).max(0.0)).sum()
        };
        normals.par_iter().map(facing).collect()
    }
}

/// A directional light that replaces some cells.
fn beam<'a>(cells: impl Iterator<Item = &'a Cell> + Clone) -> Option<Beam> {
    let moment: DVec3 = cells.clone().map(|cell| cell.radiance.element_sum() * cell.moment()).sum();
    let direction = moment.try_normalize()?;
    let irradiance = cells.map(|cell| cell.radiance * cell.moment().dot(direction)).sum();
    Some(Beam { direction, irradiance })
}

/// A rectangle of cells.
#[derive(Clone, Copy)]
struct Region {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl Region {
    fn cells(&self, columns: usize) -> impl Iterator<Item = usize> + Clone + use<> {
        let Self { x, y, width, height } = *self;
        (y..y + height).flat_map(move |row| (x..x + width).map(move |column| row * columns + column))
    }

    /// Both halves by brightness, cut across the longer side.
    fn halved(&self, cells: &[Cell], brightness: &[f64], columns: usize) -> [Self; 2] {
        let middle = &cells[(self.y + self.height / 2) * columns + self.x];
        let elevation = (middle.height + 0.5 * middle.depth).asin();
        let across = self.width as f64 * middle.width * elevation.cos();
        let upwards = self.height as f64 * PI * columns as f64 / cells.len() as f64;
        let is_wide = self.height == 1 || (self.width > 1 && across > upwards);
        let length = if is_wide { self.width } else { self.height };
        let part = |first: usize, end: usize| match is_wide {
            true => Self { x: self.x + first, width: end - first, ..*self },
            false => Self { y: self.y + first, height: end - first, ..*self },
        };
        let sum = |region: Self| region.cells(columns).map(|cell| brightness[cell]).sum::<f64>();
        let half = 0.5 * sum(*self);
        // The cut after which the first part is closest to a half.
        let cut = (1..length).min_by(|&a, &b| {
            let off = |cut| (sum(part(0, cut)) - half).abs();
            off(a).total_cmp(&off(b))
        });
        let cut = cut.unwrap_or(1);
        [part(0, cut), part(cut, length)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_sky_lights_every_normal_by_pi() {
        let sky = Environment::constant();
        let (cells, columns) = sky.cells();
        assert_eq!((cells.len(), columns), (64 * 32, 64));
        let whole: f64 = cells.iter().map(Cell::solid_angle).sum();
        assert!((whole - 2.0 * TAU).abs() < 1e-9);
        let beams = sky.beams(64);
        assert_eq!(beams.len(), 64);
        for normal in [DVec3::X, DVec3::NEG_Y, DVec3::new(0.48, 0.6, -0.64)] {
            let exact = sky.irradiances(&[normal])[0].x;
            assert!((exact / PI - 1.0).abs() < 3e-4, "{exact}");
            let found: f64 =
                beams.iter().map(|beam| beam.irradiance.x * beam.direction.dot(normal).max(0.0)).sum();
            assert!((found / PI - 1.0).abs() < 0.02, "{found} from beams");
        }
    }

    #[test]
    fn a_bright_spot_gets_its_own_beam() {
        let mut sky = Environment { size: [32, 16], texels: vec![Vec3::splat(0.01); 512] };
        // Right of the middle, above the horizon: towards +X and up.
        sky.texels[4 * 32 + 24] = Vec3::new(100.0, 50.0, 25.0);
        let beams = sky.beams(16);
        let brightest = beams.iter().max_by(|a, b| a.irradiance.x.total_cmp(&b.irradiance.x)).unwrap();
        let (azimuth, elevation) = (TAU * 24.5 / 32.0 - PI, PI * (0.5 - 4.5 / 16.0));
        let expected =
            DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), -azimuth.cos() * elevation.cos());
        assert!(brightest.direction.dot(expected) > 0.999, "{} {expected}", brightest.direction);
        assert!((brightest.irradiance.x / brightest.irradiance.z - 4.0).abs() < 0.01);
        assert!(!sky.is_grey() && Environment::constant().is_grey());
    }
}

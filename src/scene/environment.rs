//! The sky: radiance from each direction, as an equirectangular image. Its middle shows −Z, its
//! upper edge +Y.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::octahedral;

/// Largest width of the grid of cells that path and photon tracing sample.
const MAX_CELLS: usize = 256;
/// Largest width of the grid of cells that become directional lights.
const MAX_BEAM_CELLS: usize = 1024;
/// Width of a region that one directional light represents, radians: shadows of the sun, of half a
/// degree, look sharp.
const MIN_REGION: f64 = 0.02;
/// Radiance over the mean of the sky above which light is left to directional lights. Gather rays
/// resolve the rest.
const BRIGHT: f64 = 32.0;
/// Fraction of the sky's light below which bright parts get no directional lights.
const MIN_BRIGHT: f64 = 1e-2;
/// Steps towards the radiance that divides the sky.
const BOUND_ROUNDS: usize = 8;
/// Samples of a cell of a table: as many on each side of both diagonals.
const CELL_SAMPLES: u32 = 66;

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
        self.cells_within(MAX_CELLS)
    }

    fn cells_within(&self, most: usize) -> (Vec<Cell>, usize) {
        let [width, height] = self.size.map(|size| size as usize);
        let columns = width.min(most);
        (self.grid([columns, height.min(most / 2)]), columns)
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
        let (cells, columns) = self.cells_within(MAX_BEAM_CELLS);
        let brightness: Vec<f64> =
            cells.iter().map(|cell| cell.radiance.element_sum() * cell.solid_angle()).collect();
        let all = Region { x: 0, y: 0, width: columns, height: cells.len() / columns };
        let Some(all) = all.trimmed(&brightness, columns) else { return Vec::new() };
        let mut regions = vec![all];
        let sum = |region: &Region| region.cells(columns).map(|cell| brightness[cell]).sum::<f64>();
        let mut sums = vec![sum(&regions[0])];
        while regions.len() < count {
            let divisible = (0..regions.len()).filter(|&index| regions[index].is_divisible(&cells, columns));
            let Some(index) = divisible.max_by(|&a, &b| sums[a].total_cmp(&sums[b])) else { break };
            let halves = regions[index].halved(&cells, &brightness, columns);
            sums.splice(index..=index, halves.iter().map(sum));
            regions.splice(index..=index, halves);
        }
        regions.iter().filter_map(|region| beam(region.cells(columns).map(|cell| &cells[cell]))).collect()
    }

    /// Divides the radiance into a part that gather rays resolve, and bright spots. The spots are
    /// `None` if the sky has none.
    pub fn divided(&self) -> (Self, Option<Self>) {
        let rows = self.size[1] as usize;
        let solid_angle = |index: usize| {
            let height = |row: usize| (PI * row as f64 / rows as f64).cos();
            let row = index / self.size[0] as usize;
            height(row) - height(row + 1)
        };
        let weights: Vec<f64> = (0..self.texels.len()).map(solid_angle).collect();
        let sum = |bound: f64| -> f64 {
            let light = |(texel, weight): (&Vec3, &f64)| f64::from(texel.max_element()).min(bound) * weight;
            self.texels.iter().zip(&weights).map(light).sum()
        };
        // Relative to the mean of the part below the bound itself.
        let mut bound = f64::INFINITY;
        for _ in 0..BOUND_ROUNDS {
            bound = BRIGHT * sum(bound) / weights.iter().sum::<f64>();
        }
        if sum(bound) > (1.0 - MIN_BRIGHT) * sum(f64::INFINITY) {
            return (self.clone(), None);
        }
        let fraction = |texel: &Vec3| (bound / f64::from(texel.max_element())).min(1.0) as f32;
        let smooth: Vec<Vec3> = self.texels.iter().map(|texel| *texel * fraction(texel)).collect();
        let bright = self.texels.iter().zip(&smooth).map(|(all, smooth)| *all - *smooth).collect();
        (Self { size: self.size, texels: smooth }, Some(Self { size: self.size, texels: bright }))
    }

    /// Whether all directions have the same radiance.
    pub fn is_constant(&self) -> bool {
        self.texels.iter().all(|texel| *texel == self.texels[0])
    }

    /// Mean radiance of each cell of an octahedral table of `side`², from its own [`Self::cells`],
    /// with the sky rotated by `turn` radians about +Y.
    pub fn table(&self, cells: &[Cell], side: u32, turn: f64) -> Vec<DVec3> {
        let columns = (self.size[0] as usize).min(MAX_CELLS);
        let rows = cells.len() / columns;
        let radiance = |direction: DVec3| {
            let azimuth = direction.x.atan2(-direction.z) + turn;
            let column = (azimuth / TAU + 0.5).rem_euclid(1.0) * columns as f64;
            let row = direction.y.clamp(-1.0, 1.0).acos() / PI * rows as f64;
            let row = (row as usize).min(rows - 1);
            cells[row * columns + (column as usize).min(columns - 1)].radiance
        };
        let cell = |cell: u32| -> DVec3 {
            let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
            for direction in octahedral::directions_in(cell, side, CELL_SAMPLES) {
                let solid_angle = octahedral::relative_solid_angle(direction);
                sum += solid_angle * radiance(direction);
                weight += solid_angle;
            }
            sum / weight
        };
        (0..side * side).into_par_iter().map(cell).collect()
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

    /// The smallest region around its cells that are not black. `None` if all are.
    fn trimmed(&self, brightness: &[f64], columns: usize) -> Option<Self> {
        let lit = || self.cells(columns).filter(|&cell| brightness[cell] > 0.0);
        let (x, right) = (lit().map(|cell| cell % columns).min()?, lit().map(|cell| cell % columns).max()?);
        let (y, bottom) = (lit().next()? / columns, lit().last()? / columns);
        Some(Self { x, y, width: right + 1 - x, height: bottom + 1 - y })
    }

    /// Width and height, radians.
    fn extents(&self, cells: &[Cell], columns: usize) -> [f64; 2] {
        let middle = &cells[(self.y + self.height / 2) * columns + self.x];
        let elevation = (middle.height + 0.5 * middle.depth).asin();
        let across = self.width as f64 * middle.width * elevation.cos();
        [across, self.height as f64 * PI * columns as f64 / cells.len() as f64]
    }

    fn is_divisible(&self, cells: &[Cell], columns: usize) -> bool {
        let [across, upwards] = self.extents(cells, columns);
        self.width * self.height > 1 && across.max(upwards) > MIN_REGION
    }

    /// Both halves by brightness, cut across the longer side.
    fn halved(&self, cells: &[Cell], brightness: &[f64], columns: usize) -> [Self; 2] {
        let [across, upwards] = self.extents(cells, columns);
        let is_wide = self.height == 1 || (self.width > 1 && across > upwards);
        let length = if is_wide { self.width } else { self.height };
        let piece = |first: usize, end: usize| match is_wide {
            true => Self { x: self.x + first, width: end - first, ..*self },
            false => Self { y: self.y + first, height: end - first, ..*self },
        };
        let sum = |region: Self| region.cells(columns).map(|cell| brightness[cell]).sum::<f64>();
        let half = 0.5 * sum(*self);
        // The cut after which the first part is closest to a half.
        let cut = (1..length).min_by(|&a, &b| {
            let off = |cut| (sum(piece(0, cut)) - half).abs();
            off(a).total_cmp(&off(b))
        });
        let cut = cut.unwrap_or(1);
        [piece(0, cut), piece(cut, length)].map(|piece| piece.trimmed(brightness, columns).unwrap_or(piece))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_sky_has_one_radiance_and_no_bright_spots() {
        let sky = Environment::constant();
        let (cells, columns) = sky.cells();
        assert_eq!((cells.len(), columns), (64 * 32, 64));
        let whole: f64 = cells.iter().map(Cell::solid_angle).sum();
        assert!((whole - 2.0 * TAU).abs() < 1e-9);
        assert!(sky.is_constant() && sky.divided().1.is_none());
        assert!(
            sky.table(&sky.cells().0, 4, 0.3)
                .iter()
                .all(|radiance| (*radiance - DVec3::ONE).length() < 1e-12)
        );
    }

    #[test]
    fn bright_spots_and_the_rest_are_the_sky() {
        let mut sky = Environment { size: [64, 32], texels: vec![Vec3::new(0.5, 1.0, 2.0); 64 * 32] };
        sky.texels[700] = Vec3::new(4000.0, 2000.0, 1000.0);
        let (smooth, bright) = sky.divided();
        let bright = bright.unwrap();
        for (index, all) in sky.texels.iter().enumerate() {
            let sum = smooth.texels[index] + bright.texels[index];
            assert!((sum - *all).abs().max_element() <= 1e-6 * all.max_element());
            assert_eq!(bright.texels[index] == Vec3::ZERO, index != 700);
        }
        let brightest = smooth.texels.iter().map(|texel| texel.max_element()).fold(0.0, f32::max);
        assert!((brightest / 64.0 - 1.0).abs() < 0.1, "{brightest}: 32 means");
    }

    #[test]
    fn a_table_shows_the_sky_where_it_is_turned_to() {
        let mut sky = Environment { size: [64, 32], texels: vec![Vec3::ZERO; 64 * 32] };
        // The middle of the image is -Z. A turn by a quarter shows it at -X.
        (0..32)
            .flat_map(|y| (24..40).map(move |x| 64 * y + x))
            .for_each(|texel| sky.texels[texel] = Vec3::ONE);
        let table = sky.table(&sky.cells().0, 32, std::f64::consts::FRAC_PI_2);
        for (cell, radiance) in table.iter().enumerate() {
            let towards = octahedral::directions_in(cell as u32, 32, 1).next().unwrap();
            let across = towards.z.abs() - towards.x.abs();
            if across.abs() > 0.1 {
                let expected = f64::from(u8::from(across < 0.0 && towards.x < 0.0));
                assert!((radiance.x - expected).abs() < 1e-9, "{towards} {radiance}");
            }
        }
    }

    /// The horizon divides cells of the table along their diagonals.
    #[test]
    fn a_table_halves_the_cells_at_the_horizon() {
        let texel = |index: usize| Vec3::splat(if index < 256 * 64 { 1.0 } else { 0.0 });
        let sky = Environment { size: [256, 128], texels: (0..256 * 128).map(texel).collect() };
        let table = sky.table(&sky.cells().0, 64, 0.0);
        let divided: Vec<f64> = table.iter().map(|radiance| radiance.x).filter(|x| x.fract() > 0.0).collect();
        let mean = divided.iter().sum::<f64>() / divided.len() as f64;
        assert!(divided.len() == 128 && (mean - 0.5).abs() < 0.002, "{} of {mean}", divided.len());
    }

    /// Cells of the table differ in solid angle, and radiance varies within them.
    #[test]
    fn a_table_lights_every_normal_as_the_sky_does() {
        // A glow of exponent 40 around a direction, above a gradient.
        let size = [256, 128];
        let glow = DVec3::new(0.6, 0.64, 0.48);
        let texel = |index: usize| {
            let (x, y) = (index % 256, index / 256);
            let (azimuth, elevation) =
                (TAU * (x as f64 + 0.5) / 256.0 - PI, PI * (0.5 - (y as f64 + 0.5) / 128.0));
            let towards = DVec3::new(
                azimuth.sin() * elevation.cos(),
                elevation.sin(),
                -azimuth.cos() * elevation.cos(),
            );
            Vec3::splat((0.2 + 0.1 * towards.y + 4.0 * towards.dot(glow).max(0.0).powi(40)) as f32)
        };
        let sky = Environment { size, texels: (0..256 * 128).map(texel).collect() };
        let table = sky.table(&sky.cells().0, 64, 0.0);
        let cells = sky.cells().0;
        for normal in [DVec3::Y, DVec3::X, DVec3::NEG_Z, glow, -glow, DVec3::new(-0.48, 0.6, -0.64)] {
            let exact: f64 =
                cells.iter().map(|cell| cell.radiance.x * cell.moment().dot(normal).max(0.0)).sum();
            let (mut sum, mut weight) = (0.0, 0.0);
            for index in 0..512 * 512 {
                let towards = octahedral::directions_in(index, 512, 1).next().unwrap();
                let solid = octahedral::relative_solid_angle(towards);
                sum += solid * towards.dot(normal).max(0.0) * table[octahedral::cell(towards, 64) as usize].x;
                weight += solid;
            }
            let found = 2.0 * TAU * sum / weight;
            assert!((found / exact - 1.0).abs() < 1.5e-3, "{found} {exact}");
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

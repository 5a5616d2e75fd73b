//! Light meters: points, planes and painted regions of a scene at which illuminance is measured.

use glam::{DVec3, Vec3};

use super::models::refuse_repeated;
use super::value::{COORDINATE, Node, Section, unit, unknown};
use super::{keys, limits};
use crate::Result;
use std::path::Path;

/// Maximum number of points along an edge of a plane.
const GRID: std::ops::RangeInclusive<u32> = 1..=128;

/// Gather rays of a measuring point, and of all measuring points. A picture averages over the
/// points of a surface, a meter reads single ones.
const RAYS: [usize; 2] = [1 << 12, 1 << 24];

/// Number of cache points at each of `count` measuring points: each has its own gather rays.
pub(super) fn cache_points_at(count: usize, gather_rays: u32) -> usize {
    let of_each = RAYS[0].min(RAYS[1] / count.max(1));
    (of_each / gather_rays as usize).max(1)
}

/// A named light meter. Positions are recentred world space, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Meter {
    /// Name in the scene file; unique.
    pub name: String,
    /// Where it measures.
    pub shape: MeterShape,
}

/// Where a light meter measures, and in which direction it faces.
#[derive(Clone, Debug, PartialEq)]
pub enum MeterShape {
    /// A single point.
    Point {
        /// Where it is.
        position: Vec3,
        /// Unit normal of the side that takes light.
        normal: Vec3,
    },
    /// A grid of points on a parallelogram, which takes light from `edge_u × edge_v`.
    Plane {
        /// Corner that both edges start from.
        corner: Vec3,
        /// First edge from the corner.
        edge_u: Vec3,
        /// Second edge from the corner.
        edge_v: Vec3,
        /// Points along both edges, in the middles of equal cells.
        grid: [u32; 2],
    },
    /// Points on surfaces of any form, which count alike; at least one.
    Region {
        /// Position and unit normal of each.
        points: Vec<MeterPoint>,
    },
}

/// A measuring point: position and unit normal.
pub type MeterPoint = (Vec3, Vec3);

/// Number of points along edges of these lengths, in cells of p = 0.2 m · 5^lg(d / 1 m), where d is
/// the longer edge. [EN 12464-1, 4.4]
pub(super) fn standard_grid(lengths: [f64; 2]) -> [u32; 2] {
    let cell = 0.2 * 5f64.powf(lengths[0].max(lengths[1]).log10());
    lengths.map(|length| ((length / cell).round() as u32).clamp(*GRID.start(), *GRID.end()))
}

#[cfg(feature = "window")]
impl MeterShape {
    /// A square plane that faces along the unit `normal`, with its middle at `middle`.
    pub(crate) fn on_surface(middle: Vec3, normal: Vec3, side: f32) -> Self {
        let edge_u = side * Vec3::Y.cross(normal).try_normalize().unwrap_or(Vec3::X);
        let edge_v = normal.cross(edge_u);
        let grid = standard_grid([f64::from(side); 2]);
        Self::Plane { corner: middle - 0.5 * (edge_u + edge_v), edge_u, edge_v, grid }
    }

    /// The same elsewhere.
    pub(crate) fn moved(self, by: Vec3) -> Self {
        match self {
            Self::Point { position, normal } => Self::Point { position: position + by, normal },
            Self::Plane { corner, edge_u, edge_v, grid } => {
                Self::Plane { corner: corner + by, edge_u, edge_v, grid }
            }
            Self::Region { points } => {
                Self::Region { points: points.into_iter().map(|(at, normal)| (at + by, normal)).collect() }
            }
        }
    }
}

impl Meter {
    /// Default name of a meter, by its number in the file.
    pub(super) fn unnamed(number: usize) -> String {
        format!("meter{number}")
    }

    /// Reads a meter in world space and recentres it on `origin`. The first is number 0.
    pub(super) fn read(section: &Section, number: usize, origin: DVec3) -> Result<Self> {
        const KINDS: [&str; 3] = ["point", "plane", "region"];
        let kind = section.need(section.text("kind")?, "kind", "point, plane or region")?;
        if !KINDS.contains(&kind) {
            return Err(section.fault_at("kind", unknown("kind of meter", &KINDS, kind)));
        }
        section.only(&keys::names("meter", Some(kind)))?;
        let name = section.text("name")?.map_or_else(|| Self::unnamed(number), str::to_owned);
        let vector = |key| section.need(section.vector(key, COORDINATE)?, key, "three numbers, metres");
        let shape = if kind == "point" {
            let normal = section.need(section.direction("normal")?, "normal", "three numbers")?;
            MeterShape::Point { position: (vector("position")? - origin).as_vec3(), normal: normal.as_vec3() }
        } else if kind == "region" {
            MeterShape::Region { points: region(section, origin)? }
        } else {
            let (u, v) = (vector("edge_u")?, vector("edge_v")?);
            if u.cross(v).length() <= 1e-6 * u.length() * v.length() {
                return Err(section.fault_at("edge_v", "must be neither zero nor parallel to edge_u"));
            }
            MeterShape::Plane {
                corner: (vector("corner")? - origin).as_vec3(),
                edge_u: u.as_vec3(),
                edge_v: v.as_vec3(),
                grid: section.size("grid", GRID)?.unwrap_or_else(|| standard_grid([u.length(), v.length()])),
            }
        };
        Ok(Self { name, shape })
    }

    /// Points along both edges of a plane. Other meters have one row.
    pub fn grid(&self) -> [u32; 2] {
        match &self.shape {
            MeterShape::Point { .. } => [1, 1],
            MeterShape::Plane { grid, .. } => *grid,
            MeterShape::Region { points } => [points.len() as u32, 1],
        }
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.grid().iter().map(|&count| count as usize).product()
    }

    /// All points, along `edge_u` first.
    pub fn points(&self) -> Vec<MeterPoint> {
        match self.shape {
            MeterShape::Point { position, normal } => vec![(position, normal)],
            MeterShape::Region { ref points } => points.clone(),
            MeterShape::Plane { corner, edge_u, edge_v, grid: [columns, rows] } => {
                let normal = edge_u.cross(edge_v).normalize();
                let middle = |index: u32, count: u32| (index as f32 + 0.5) / count as f32;
                let place =
                    |row, column| corner + middle(column, columns) * edge_u + middle(row, rows) * edge_v;
                let row = |row| (0..columns).map(move |column| (place(row, column), normal));
                (0..rows).flat_map(row).collect()
            }
        }
    }
}

/// The points of a region, recentred on `origin`.
fn region(section: &Section, origin: DVec3) -> Result<Vec<MeterPoint>> {
    let list = |key| section.need(section.vectors(key, COORDINATE)?, key, "a list of points");
    let (points, normals) = (list("points")?, list("normals")?);
    if points.is_empty() || points.len() > limits::METER_POINTS {
        let most = limits::METER_POINTS;
        return Err(section.fault_at("points", format!("has {} points, 1 to {most} expected", points.len())));
    }
    if normals.len() != points.len() {
        let message = format!("has {} normals for {} points", normals.len(), points.len());
        return Err(section.fault_at("normals", message));
    }
    let unit = |normal| unit(normal).ok_or_else(|| section.fault_at("normals", "must not be zero"));
    let normals = normals.into_iter().map(unit).collect::<Result<Vec<_>>>()?;
    let point = |(at, normal): (DVec3, DVec3)| ((at - origin).as_vec3(), normal.as_vec3());
    Ok(points.into_iter().zip(normals).map(point).collect())
}

/// Reads the meters of a scene file.
pub(super) fn read_all(file: &Path, root: &Node, origin: DVec3) -> Result<Vec<Meter>> {
    let sections = Section::list(file, root, "meter", limits::METERS)?;
    let meters = sections.iter().enumerate().map(|(number, section)| Meter::read(section, number, origin));
    let meters = meters.collect::<Result<Vec<_>>>()?;
    refuse_repeated(&sections, meters.iter().map(|meter| meter.name.as_str()))?;
    let mut count = 0;
    for (section, meter) in sections.iter().zip(&meters) {
        count += meter.count();
        if count > limits::METER_POINTS {
            let most = limits::METER_POINTS;
            return Err(section.fault(format!("the meters have more than {most} points together")));
        }
    }
    Ok(meters)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of EN 12464-1, annex A.
    #[test]
    fn grids_are_those_of_the_standard() {
        for (length, count) in [(0.4, 4), (1.0, 5), (2.0, 6), (5.0, 8), (10.0, 10), (25.0, 13), (50.0, 16)] {
            assert_eq!(standard_grid([length, length]), [count; 2], "{length} m");
        }
        assert_eq!(standard_grid([5.0, 0.01]), [8, 1]);
    }

    #[test]
    fn points_are_the_middles_of_cells() {
        let shape = MeterShape::Plane {
            corner: Vec3::new(1.0, 2.0, 3.0),
            edge_u: 4.0 * Vec3::X,
            edge_v: -3.0 * Vec3::Z,
            grid: [2, 3],
        };
        let meter = Meter { name: "desk".to_owned(), shape };
        let points = meter.points();
        assert_eq!((points.len(), meter.count()), (6, 6));
        assert_eq!(points[1], (Vec3::new(4.0, 2.0, 2.5), Vec3::Y));
        assert_eq!(points[5], (Vec3::new(4.0, 2.0, 0.5), Vec3::Y));
    }
}

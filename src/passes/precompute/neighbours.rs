//! Which cache points see so much the same that their records may be blended.

use super::cache_points::Placed;
use crate::cpu::records::FACETS_ALIKE;
use crate::layout::{GpuStruct, Layout, gpu_struct};
use glam::{IVec3, Vec3};
use std::collections::HashMap;

gpu_struct! {
    /// A record that speaks for another's place.
    pub struct Neighbour {
        /// Record.
        pub record: u32,
        /// Its share; a record's shares sum to 1.
        pub weight: f32,
    }
}

/// What the lists share with the shader that reads them.
pub const LAYOUTS: &[Layout] = &[Neighbour::LAYOUT];

/// Neighbours of every record, as one list: the record itself among them.
pub struct Neighbourhoods {
    /// First neighbour of each record, and the end.
    pub first: Vec<u32>,
    /// Neighbours with weights that sum to 1.
    pub list: Vec<Neighbour>,
}

/// How far a neighbour may be, in validity radii.
const REACH: f32 = 2.0;
/// 1 / (1 - cos 10°)^½, as in the error metric.
const INVERSE_NORMAL_ERROR: f32 = 8.1131;

impl Neighbourhoods {
    /// Finds the neighbours of all points: within two of both validity radii and within both clearances, so that no surface can
    /// stand between them, and with shading normals within ten degrees and facets alike.
    pub fn new(points: &[Placed]) -> Self {
        let reach: Vec<f32> = points.iter().map(|p| (REACH * p.point.radius).min(p.clearance)).collect();
        let cell = reach.iter().fold(f32::MIN_POSITIVE, |a, &b| a.max(b));
        let cell_of = |position: Vec3| (position / cell).floor().as_ivec3();
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        for (index, placed) in points.iter().enumerate() {
            cells.entry(cell_of(placed.point.position)).or_default().push(index as u32);
        }
        let mut neighbourhoods = Self { first: vec![0], list: Vec::new() };
        for (index, Placed { point, .. }) in points.iter().enumerate() {
            let start = neighbourhoods.list.len();
            let centre = cell_of(point.position);
            for offset in 0..27 {
                let step = IVec3::new(offset % 3, offset / 3 % 3, offset / 9) - 1;
                for &other in cells.get(&(centre + step)).into_iter().flatten() {
                    let weight = if other as usize == index {
                        1.0
                    } else {
                        let neighbour = &points[other as usize].point;
                        let distance = point.position.distance(neighbour.position);
                        let position_error = distance / reach[index].min(reach[other as usize]);
                        let turn = (1.0 - point.normal.dot(neighbour.normal)).max(0.0).sqrt();
                        let is_alike = point.facet.dot(neighbour.facet) >= FACETS_ALIKE;
                        if is_alike { 1.0 - position_error.max(turn * INVERSE_NORMAL_ERROR) } else { 0.0 }
                    };
                    if weight > 0.0 {
                        neighbourhoods.list.push(Neighbour { record: other, weight });
                    }
                }
            }
            let own = &mut neighbourhoods.list[start..];
            own.sort_by_key(|neighbour| neighbour.record);
            let sum: f32 = own.iter().map(|neighbour| neighbour.weight).sum();
            own.iter_mut().for_each(|neighbour| neighbour.weight /= sum);
            neighbourhoods.first.push(neighbourhoods.list.len() as u32);
        }
        neighbourhoods
    }
}

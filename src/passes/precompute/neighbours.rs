//! Neighbourhoods: cache points with so similar a view that their records may be blended.

use super::cache_points::Placed;
use super::reaches::Reaches;
use crate::cpu::records::{FACETS_ALIKE, Tolerance};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use glam::Vec3;
use rayon::prelude::*;

gpu_struct! {
    /// A neighbour of a record, for blending.
    pub struct Neighbour {
        pub record: u32,
        /// Its weight; the weights of a record sum to 1.
        pub weight: f32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[Neighbour::LAYOUT];

/// Neighbours of every record in one list; each list includes the record itself.
pub struct Neighbourhoods {
    /// CSR offsets of the neighbours of each record.
    pub first: Vec<u32>,
    /// Neighbours with weights that sum to 1.
    pub list: Vec<Neighbour>,
}

/// Maximum distance of a neighbour, in validity radii.
const REACH: f32 = 2.0;

impl Neighbourhoods {
    /// Finds the neighbours of all points. A neighbour is within two of both validity radii, and
    /// within both clearances, so that no surface is between them. Shading normals differ by less
    /// than ten degrees, and facets are alike.
    pub fn new(points: &[Placed]) -> Self {
        let reach = |placed: &Placed| (REACH * placed.point.radius).min(placed.clearance);
        let places: Vec<(Vec3, f32)> = points.iter().map(|p| (p.point.position, reach(p))).collect();
        let map = Reaches::from_points(&places);
        let of_point = |index: usize| {
            let point = &points[index].point;
            let mut own = vec![Neighbour { record: index as u32, weight: 1.0 }];
            map.any(point.position, |other| {
                let neighbour = &points[other as usize].point;
                if other as usize != index && point.facet.dot(neighbour.facet) >= FACETS_ALIKE {
                    let distance = point.position.distance(neighbour.position);
                    let position_error = distance / places[index].1.min(places[other as usize].1);
                    let turn = (1.0 - point.normal.dot(neighbour.normal)).max(0.0).sqrt();
                    let weight = 1.0 - position_error.max(turn * Tolerance::VALID.inverse_normal_error);
                    if weight > 0.0 {
                        own.push(Neighbour { record: other, weight });
                    }
                }
                false
            });
            own.sort_unstable_by_key(|neighbour| neighbour.record);
            let sum: f32 = own.iter().map(|neighbour| neighbour.weight).sum();
            own.iter_mut().for_each(|neighbour| neighbour.weight /= sum);
            own
        };
        let lists: Vec<_> = (0..points.len()).into_par_iter().map(of_point).collect();
        let mut neighbourhoods = Self { first: vec![0], list: Vec::new() };
        for own in lists {
            neighbourhoods.list.extend(own);
            neighbourhoods.first.push(neighbourhoods.list.len() as u32);
        }
        neighbourhoods
    }

    /// Adds a record after the last, without neighbours.
    pub fn push_alone(&mut self) {
        let record = self.first.len() as u32 - 1;
        self.list.push(Neighbour { record, weight: 1.0 });
        self.first.push(self.list.len() as u32);
    }
}

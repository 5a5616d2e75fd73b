//! The two orders that light paths are stored in: by path, as the scan of their energy takes
//! them, and by cluster, as the hierarchy does. [Yue §3] Paths that the same editable materials
//! reflect stand together.

use crate::passes::frame::path_scan::{FROM_ENTRY, HEAD, PathStep};
use crate::scene::Material;
use crate::types::{Contribution, NO_CLUSTER, OPEN, PathVertex, Surface};
use glam::Vec3;
use std::ops::Range;

/// A packed colour that changes nothing.
pub(super) const WHITE: u32 = u32::MAX;

/// Where on its path a vertex was found, and what becomes of it.
#[derive(Clone, Copy)]
pub struct Vertex {
    path: u32,
    pub(super) position: Vec3,
    pub(super) side: u32,
    pub(super) weight: f32,
    pub(super) cluster: u32,
    incoming: Vec3,
    lobe: f32,
    /// What counts of it for readers from afar, 0..=[`OPEN`].
    pub(super) accessibility: u32,
    /// Packed colour of the image at the vertex before.
    colour: u32,
}

impl Vertex {
    pub(super) fn new(path: u32, vertex: &PathVertex, colour: u32) -> Self {
        let PathVertex { position, side, weight, cluster, incoming, lobe } = *vertex;
        Self { path, position, side, weight, cluster, incoming, lobe, accessibility: OPEN, colour }
    }

    /// Whether its path starts there.
    pub(super) fn is_entry(&self) -> bool {
        self.incoming == Vec3::ZERO
    }
}

/// What is known of the vertices where a material may be glossy.
#[derive(Default)]
pub struct Arrivals {
    /// Of each step: 1 − cosα off the mirror direction at the vertex before.
    pub lobes: Vec<f32>,
    /// Of each contribution: unit direction of travel when the path arrived; zero at entry points.
    pub incoming: Vec<Vec3>,
    /// Of each contribution: 2·triangle + (1 if the back side).
    pub sides: Vec<u32>,
    /// Of each path: unit direction in which it left its entry point; zero if it ended there.
    pub departures: Vec<Vec3>,
    /// Of each path: packed colour of the image at its entry point; white if it ended there.
    pub entry_colours: Vec<u32>,
}

/// Paths that stand together because the same editable materials reflect them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathGroup {
    /// A bit for each editable material, by [`editable_bits`].
    pub materials: u32,
    /// Steps of the path.
    pub steps: Range<u32>,
}

/// The bit of each material that is editable, in order; the last bit stands for all that find no
/// other. Zero for the others.
pub fn editable_bits(materials: &[Material]) -> Vec<u32> {
    let mut editable = 0;
    let bit = |material: &Material| {
        if !material.editable {
            return 0;
        }
        editable += 1;
        1 << (editable - 1).min(31)
    };
    materials.iter().map(bit).collect()
}

/// All light paths, in the two orders that a frame needs.
pub struct LightPaths {
    /// Every vertex in path order: how its energy follows from the vertex before.
    pub steps: Vec<PathStep>,
    /// Packed colour of the image at the vertex before each; none at all in scenes without images.
    pub colours: Vec<u32>,
    /// Every vertex in the order of base clusters; throughputs are the scan's to fill in. One more,
    /// which nobody reads, takes vertices that no cluster holds.
    pub contributions: Vec<Contribution>,
    /// First contribution of each base cluster by an entry point, then its first by another vertex,
    /// and the end.
    pub contribution_offsets: Vec<u32>,
    /// Where some materials are editable: the paths by which of them reflect them,
    /// entry points aside.
    pub groups: Vec<PathGroup>,
    /// Of each path the number that names its random numbers; none at all where that is its own.
    pub names: Vec<u32>,
    /// Empty if nothing is glossy.
    pub arrivals: Arrivals,
    /// Vertices that no cluster holds: those inside solids, where parts reach into each other.
    pub lost: u64,
}

/// Reorders entry points and numbers the paths anew, so that those that the same editable materials
/// reflect stand together; returns for each path which these are, and its number before. Entry
/// points do not count: their reflection is part of the path's flux.
pub(super) fn group(
    vertices: &mut [Vertex],
    entry_points: &mut [PathVertex],
    bit: impl Fn(u32) -> u32,
) -> (Vec<u32>, Vec<u32>) {
    let mut masks = vec![0; entry_points.len()];
    let mut pending: Vec<Option<u32>> = vec![None; entry_points.len()];
    for vertex in &*vertices {
        // A vertex reflects what reaches the next one, if there is one.
        let path = vertex.path as usize;
        if let Some(reflecting) = pending[path] {
            masks[path] |= reflecting;
        }
        pending[path] = Some(if vertex.is_entry() { 0 } else { bit(vertex.side) });
    }
    let mut order: Vec<u32> = (0..entry_points.len() as u32).collect();
    order.sort_by_key(|&path| masks[path as usize]);
    let mut places = vec![0; order.len()];
    for (place, &path) in (0..).zip(&order) {
        places[path as usize] = place;
    }
    vertices.iter_mut().for_each(|vertex| vertex.path = places[vertex.path as usize]);
    let sorted: Vec<PathVertex> = order.iter().map(|&path| entry_points[path as usize]).collect();
    entry_points.copy_from_slice(&sorted);
    (order.iter().map(|&path| masks[path as usize]).collect(), order)
}

impl LightPaths {
    /// Notes where the paths of each mask stand; `masks` in path order, or none.
    pub(super) fn group_steps(&mut self, masks: &[u32]) {
        let mut path = 0;
        for (index, step) in (0..).zip(&self.steps) {
            if step.material == HEAD {
                path += 1;
            }
            let Some(&materials) = masks.get(path - 1) else { return };
            match self.groups.last_mut() {
                Some(group) if group.materials == materials => group.steps.end = index + 1,
                _ => self.groups.push(PathGroup { materials, steps: index..index + 1 }),
            }
        }
    }

    /// Orders vertices by path, and by cluster. Vertices of one path come in the order of the walk.
    pub(super) fn from_vertices(
        mut vertices: Vec<Vertex>,
        surfaces: &[Surface],
        may_be_glossy: &[bool],
        paths: usize,
        base_clusters: u32,
    ) -> Self {
        let vertex_offsets = offsets(paths, vertices.iter().map(|vertex| vertex.path));
        let mut ordered = vertices.clone();
        let mut cursor = vertex_offsets.clone();
        for vertex in vertices.drain(..) {
            let place = &mut cursor[vertex.path as usize];
            ordered[*place as usize] = vertex;
            *place += 1;
        }

        let mut heads = vec![false; ordered.len()];
        vertex_offsets[..paths].iter().for_each(|&first| heads[first as usize] = true);
        let list = |(vertex, &is_head): (&Vertex, &bool)| 2 * vertex.cluster + u32::from(!is_head);
        let held = ordered.iter().zip(&heads).filter(|(vertex, _)| vertex.cluster != NO_CLUSTER);
        let contribution_offsets = offsets(2 * base_clusters as usize, held.map(list));
        let total = contribution_offsets[2 * base_clusters as usize];
        let mut cursor = contribution_offsets.clone();
        let mut contributions = vec![Contribution::new(0, OPEN); total as usize + 1];
        let mut steps = Vec::with_capacity(ordered.len());
        let colours = ordered.iter().map(|vertex| vertex.colour).collect();
        let mut arrivals = Arrivals {
            lobes: Vec::with_capacity(ordered.len()),
            incoming: vec![Vec3::ZERO; contributions.len()],
            sides: vec![0; contributions.len()],
            departures: vec![Vec3::ZERO; paths],
            entry_colours: vec![WHITE; paths],
        };
        let mut before: Option<(Vertex, bool)> = None;
        let mut lost = 0;
        for (vertex, is_head) in ordered.into_iter().zip(heads) {
            let slot = if vertex.cluster == NO_CLUSTER {
                lost += 1;
                total
            } else {
                let place = &mut cursor[2 * vertex.cluster as usize + usize::from(!is_head)];
                *place += 1;
                *place - 1
            };
            contributions[slot as usize] = Contribution::new(vertex.path, vertex.accessibility);
            arrivals.lobes.push(vertex.lobe);
            arrivals.incoming[slot as usize] = vertex.incoming;
            arrivals.sides[slot as usize] = vertex.side;
            let mut material = HEAD;
            if let Some((reflecting, is_entry)) = before.filter(|(before, _)| before.path == vertex.path) {
                material = surfaces[reflecting.side as usize / 2].material;
                if is_entry {
                    arrivals.departures[vertex.path as usize] = vertex.incoming;
                    arrivals.entry_colours[vertex.path as usize] = vertex.colour;
                    material = if may_be_glossy[material as usize] { FROM_ENTRY } else { material };
                }
            }
            steps.push(PathStep { material, weight: vertex.weight, slot });
            before = Some((vertex, is_head));
        }
        Self {
            steps,
            colours,
            contributions,
            contribution_offsets,
            groups: Vec::new(),
            names: Vec::new(),
            arrivals,
            lost,
        }
    }
}

/// Where each bin of a counting sort begins, and the end.
fn offsets(bins: usize, keys: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut first = vec![0; bins + 1];
    for key in keys {
        first[key as usize + 1] += 1;
    }
    for bin in 0..bins {
        first[bin + 1] += first[bin];
    }
    first
}

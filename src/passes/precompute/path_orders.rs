//! The two orders of light paths: by path, for the energy scan, and by cluster, for the hierarchy.
//! [Yue §3] Paths that the same editable materials reflect are consecutive.

use crate::passes::frame::path_scan::{FROM_ENTRY, HEAD, PathStep};
use crate::scene::Material;
use crate::types::{Contribution, NO_CLUSTER, OPEN, PathVertex, Surface};
use glam::Vec3;
use std::ops::Range;

/// The packed colour white.
pub(super) const WHITE: u32 = u32::MAX;

/// A path vertex with its path and cluster.
#[derive(Clone, Copy)]
pub struct Vertex {
    path: u32,
    pub(super) position: Vec3,
    pub(super) side: u32,
    pub(super) weight: f32,
    pub(super) cluster: u32,
    incoming: Vec3,
    lobe: f32,
    /// Its ambient accessibility, 0..=[`OPEN`].
    pub(super) accessibility: u32,
    /// Packed colour of the image at the vertex before.
    colour: u32,
}

impl Vertex {
    pub(super) fn new(path: u32, vertex: &PathVertex, colour: u32) -> Self {
        let PathVertex { position, side, weight, cluster, incoming, lobe } = *vertex;
        Self { path, position, side, weight, cluster, incoming, lobe, accessibility: OPEN, colour }
    }

    /// Whether its path starts here.
    pub(super) fn is_entry(&self) -> bool {
        self.incoming == Vec3::ZERO
    }
}

/// Data of vertices, steps and paths in scenes with a material that may be glossy.
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

/// Consecutive paths that the same editable materials reflect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathRange {
    /// A bit for each editable material, by [`editable_bits`].
    pub materials: u32,
    /// Range of their steps.
    pub steps: Range<u32>,
}

/// The bit of each editable material, in order; the last bit is shared by all further ones. Zero
/// for other materials.
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
    /// Every vertex in path order: the factor from the energy of the vertex before.
    pub steps: Vec<PathStep>,
    /// Packed colour of the image at the vertex before each; empty in scenes without images.
    pub colours: Vec<u32>,
    /// Every vertex in the order of base clusters; the scan fills in the throughputs. One unused
    /// element at the end takes the vertices that no cluster holds.
    pub contributions: Vec<Contribution>,
    /// For each base cluster, its first contribution of an entry point and its first one of another
    /// vertex; then the end.
    pub contribution_offsets: Vec<u32>,
    /// Paths grouped by the editable materials that reflect them, entry points aside. Empty if no
    /// material is editable.
    pub ranges: Vec<PathRange>,
    /// Random stream index of each path.
    pub streams: Vec<u32>,
    /// Empty if nothing is glossy.
    pub arrivals: Arrivals,
    /// Vertices that no cluster holds: those inside interpenetrating solids.
    pub lost: u64,
}

/// Reorders entry points and renumbers the paths, so that paths reflected by the same editable
/// materials are consecutive. Returns the materials of each path. Entry points do not count: their
/// reflection is part of the path's flux.
fn group(
    vertices: &mut [Vertex],
    (entry_points, streams): (&mut [PathVertex], &mut [u32]),
    bit: impl Fn(u32) -> u32,
) -> Vec<u32> {
    let mut masks = vec![0; entry_points.len()];
    let mut pending: Vec<Option<u32>> = vec![None; entry_points.len()];
    for vertex in &*vertices {
        // A vertex counts as reflecting only if the path has a next vertex.
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
    let sorted: Vec<u32> = order.iter().map(|&path| streams[path as usize]).collect();
    streams.copy_from_slice(&sorted);
    order.iter().map(|&path| masks[path as usize]).collect()
}

impl LightPaths {
    /// The paths of these entry points and streams from their vertices, and the entry points in
    /// the order of the paths. If materials are editable, paths reflected by the same ones are
    /// consecutive. `surfaces` in BVH order, `materials` as on the device.
    pub fn new(
        mut vertices: Vec<Vertex>,
        (mut entry_points, mut streams): (Vec<PathVertex>, Vec<u32>),
        surfaces: &[Surface],
        materials: &[Material],
        base_clusters: u32,
        has_images: bool,
    ) -> (Vec<PathVertex>, Self) {
        let bits = editable_bits(materials);
        let mut masks = Vec::new();
        if bits.iter().any(|&bit| bit != 0) {
            let bit = |side: u32| bits[surfaces[side as usize / 2].material as usize];
            masks = group(&mut vertices, (&mut entry_points, &mut streams), bit);
        }
        let may_be_glossy: Vec<bool> = materials.iter().map(Material::may_be_glossy).collect();
        let count = entry_points.len();
        let mut paths = Self::from_vertices(vertices, surfaces, &may_be_glossy, count, base_clusters);
        paths.group_steps(&masks);
        paths.streams = streams;
        if !may_be_glossy.contains(&true) {
            paths.arrivals = Arrivals::default();
        }
        if !has_images {
            paths.colours = Vec::new();
        }
        (entry_points, paths)
    }

    /// Stores the step range of the paths of each mask; `masks` in path order, or empty.
    fn group_steps(&mut self, masks: &[u32]) {
        let mut path = 0;
        for (index, step) in (0..).zip(&self.steps) {
            if step.material == HEAD {
                path += 1;
            }
            let Some(&materials) = masks.get(path - 1) else { return };
            match self.ranges.last_mut() {
                Some(group) if group.materials == materials => group.steps.end = index + 1,
                _ => self.ranges.push(PathRange { materials, steps: index..index + 1 }),
            }
        }
    }

    /// Orders vertices by path, and by cluster. Vertices of one path are in the order of the walk.
    fn from_vertices(
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
            let contribution = if vertex.cluster == NO_CLUSTER {
                lost += 1;
                total
            } else {
                let place = &mut cursor[2 * vertex.cluster as usize + usize::from(!is_head)];
                *place += 1;
                *place - 1
            };
            contributions[contribution as usize] = Contribution::new(vertex.path, vertex.accessibility);
            arrivals.lobes.push(vertex.lobe);
            arrivals.incoming[contribution as usize] = vertex.incoming;
            arrivals.sides[contribution as usize] = vertex.side;
            let mut material = HEAD;
            if let Some((reflecting, is_entry)) = before.filter(|(before, _)| before.path == vertex.path) {
                material = surfaces[reflecting.side as usize / 2].material;
                if is_entry {
                    arrivals.departures[vertex.path as usize] = vertex.incoming;
                    arrivals.entry_colours[vertex.path as usize] = vertex.colour;
                    material = if may_be_glossy[material as usize] { FROM_ENTRY } else { material };
                }
            }
            steps.push(PathStep { material, weight: vertex.weight, contribution });
            before = Some((vertex, is_head));
        }
        Self {
            steps,
            colours,
            contributions,
            contribution_offsets,
            ranges: Vec::new(),
            streams: Vec::new(),
            arrivals,
            lost,
        }
    }
}

/// Start of each bin of a counting sort, and the end.
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

//! Occlusion in cells: the fraction of a coarse cluster that its readers see. [Yue §2, Figure 1]
//! In: clusters, readers. Out: the fraction of sample points that are visible.
//!
//! Deviation: rays extend to the reader instead of ending at the cell's boundary. A ray that
//! leaves the cell sideways, below a screen as wide as the cell is high, meets the screen of
//! the next cell.

use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::gloss;
use crate::passes::precompute::rays::{RayQuery, Rays};
use crate::scene::fragment::Fragment;
use crate::scene::hvds::Hvds;
use crate::types::Surface;
use glam::{DVec3, UVec2, UVec3, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::OnceLock;

/// Rays that measure the visible fraction of a cluster.
const SAMPLES: usize = 8;

/// Height above a plane that counts as zero, in base cells.
const FLAT: f64 = 1e-3;

/// Maximum number of triangles of a cell that are tested one by one; beyond it rays decide.
const MAX_PLANES: usize = 256;

/// A point on a cluster, and the unit geometric normal of its side.
#[derive(Clone, Copy, Debug)]
struct Sample {
    position: Vec3,
    normal: Vec3,
}

/// Points spread over a cluster.
struct Samples {
    points: Vec<Sample>,
    /// Mean normal, unit, or zero.
    normal: DVec3,
}

/// Points that read a cluster from about the same direction.
pub struct Readers {
    /// A sample of the readers' positions, off their surfaces.
    pub points: Vec<Vec3>,
    /// Mean unit direction towards them.
    pub direction: DVec3,
}

/// Visibility of a cluster along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Fraction of the surface facing the readers that they see.
    pub open: f64,
    /// Cosine of its mean normal with the mean direction, at least 0.
    pub facing: f64,
}

/// A cluster to measure.
#[derive(Clone, Copy)]
pub(super) struct Ask<'a> {
    pub(super) cluster: u32,
    pub(super) readers: &'a Readers,
}

/// The surface in the cells of all levels.
pub(super) struct Cells<'a> {
    hvds: &'a Hvds,
    surfaces: &'a [Surface],
    /// Range of base clusters below each cluster.
    base_ranges: Vec<UVec2>,
    /// Base cell of each base cluster.
    base_cells: Vec<UVec3>,
    /// Fragments by base cluster, and the first of each base cluster.
    fragments: Vec<u32>,
    fragment_offsets: Vec<u32>,
    /// Clusters of each cell above the base level.
    in_cells: HashMap<(usize, UVec3), Vec<u32>>,
    /// Samples of each cluster, created on first use.
    samples: Vec<OnceLock<Samples>>,
    clear_distance: f32,
}

/// A triangle in a cell, as seen from a cluster in it.
struct Plane {
    normal: DVec3,
    /// Range of heights of the cluster's surface above the triangle's front, metres.
    heights: [f64; 2],
}

/// Possible occluders of a cluster.
pub(super) enum Hiding {
    /// No occluder in any direction.
    Nothing,
    /// Some of these planes may occlude.
    Planes(Planes),
    /// Too many triangles to decide.
    Unknown,
}

/// Planes of triangles around a cluster.
pub(super) struct Planes(Vec<Plane>, f64);

impl Hiding {
    /// Whether surface in the cell may be between the cluster and a reader in that direction.
    pub(super) fn is_possible_along(&self, direction: DVec3) -> bool {
        match self {
            Self::Nothing => false,
            Self::Unknown => true,
            // A surface in front of a plane meets it only in directions towards its back.
            Self::Planes(Planes(planes, flat)) => planes.iter().any(|plane| {
                let along = plane.normal.dot(direction);
                let leaves_front = plane.heights[0] >= -flat && along >= 0.0;
                let leaves_back = plane.heights[1] <= *flat && along <= 0.0;
                !leaves_front && !leaves_back
            }),
        }
    }
}

impl<'a> Cells<'a> {
    /// Sorts the surface by cell. Rays start `clear_distance` metres off it.
    pub(super) fn new(hvds: &'a Hvds, surfaces: &'a [Surface], clear_distance: f32) -> Self {
        let base = hvds.levels[0].len();
        let mut base_cells = vec![UVec3::ZERO; base];
        let size = hvds.grid.cells;
        for cell in 0..hvds.grid.cell_count() as u32 {
            for found in hvds.clusters_in(cell as usize) {
                for cluster in found.cluster..=found.cluster + u32::from(found.plane.is_some()) {
                    base_cells[cluster as usize] =
                        UVec3::new(cell % size.x, cell / size.x % size.y, cell / size.x / size.y);
                }
            }
        }
        let (fragments, fragment_offsets) = sorted_fragments(&hvds.fragments, base);
        let base_ranges = gloss::base_ranges(hvds);
        let mut in_cells: HashMap<_, Vec<u32>> = HashMap::new();
        for (level, clusters) in hvds.levels.iter().enumerate().skip(1) {
            for cluster in clusters.clone() {
                let cell = base_cells[base_ranges[cluster as usize].x as usize] >> level as u32;
                in_cells.entry((level, cell)).or_default().push(cluster);
            }
        }
        let count = hvds.cluster_count() as usize;
        let samples = (0..count).map(|_| OnceLock::new()).collect();
        Self {
            hvds,
            surfaces,
            base_ranges,
            base_cells,
            fragments,
            fragment_offsets,
            in_cells,
            samples,
            clear_distance,
        }
    }

    /// Level and cell of a cluster.
    fn place(&self, cluster: u32) -> (usize, UVec3) {
        let level = self.hvds.levels.partition_point(|level| level.end <= cluster);
        (level, self.base_cells[self.base_ranges[cluster as usize].x as usize] >> level as u32)
    }

    /// Clusters one level down.
    pub(super) fn children(&self, cluster: u32) -> Range<u32> {
        self.hvds.child_offsets[cluster as usize]..self.hvds.child_offsets[cluster as usize + 1]
    }

    fn fragments_of(&self, cluster: u32) -> impl Iterator<Item = &'a Fragment> + Clone {
        let hvds: &'a Hvds = self.hvds;
        let range = self.base_ranges[cluster as usize];
        let range = self.fragment_offsets[range.x as usize] as usize
            ..self.fragment_offsets[range.y as usize] as usize;
        self.fragments[range].iter().map(move |&fragment| &hvds.fragments[fragment as usize])
    }

    /// Unit geometric normal of a side.
    pub(super) fn normal(&self, side: u32) -> Vec3 {
        let normal = self.surfaces[side as usize / 2].normal;
        if side % 2 == 1 { -normal } else { normal }
    }

    /// Possible occluders of a cluster above the base level.
    pub(super) fn hiding(&self, cluster: u32) -> Hiding {
        let flat = FLAT * self.hvds.grid.cell_size();
        // Planes of the cluster's sides: surface that rises above none of them hides nothing, as on
        // a convex solid.
        let Some(sides) = last_of_each(self.fragments_of(cluster), |fragment| fragment.side) else {
            return Hiding::Unknown;
        };
        let plane =
            |fragment: &&Fragment| (self.normal(fragment.side).as_dvec3(), fragment.corners[0].as_dvec3());
        let sides: Vec<(DVec3, DVec3)> = sides.iter().map(plane).collect();
        let rises = |fragment: &&Fragment| {
            let over = |&(normal, on): &(DVec3, DVec3)| {
                fragment.corners.iter().any(|corner| normal.dot(corner.as_dvec3() - on) > flat)
            };
            sides.iter().any(over)
        };
        let around = self.in_cells[&self.place(cluster)].iter().flat_map(|&other| self.fragments_of(other));
        let Some(triangles) = last_of_each(around.filter(rises), |fragment| fragment.side / 2) else {
            return Hiding::Unknown;
        };
        let corners = || self.fragments_of(cluster).flat_map(|fragment| &fragment.corners);
        let plane = |fragment: &&Fragment| {
            let normal = self.surfaces[fragment.side as usize / 2].normal.as_dvec3();
            let on = fragment.corners[0].as_dvec3();
            let heights = corners().map(|corner| normal.dot(corner.as_dvec3() - on));
            let widen = |[low, high]: [f64; 2], height: f64| [low.min(height), high.max(height)];
            Plane { normal, heights: heights.fold([f64::INFINITY, f64::NEG_INFINITY], widen) }
        };
        let planes: Vec<Plane> = triangles.iter().map(plane).collect();
        let is_coplanar = |plane: &Plane| plane.heights[0] >= -flat && plane.heights[1] <= flat;
        if planes.iter().all(is_coplanar) {
            return Hiding::Nothing;
        }
        Hiding::Planes(Planes(planes, flat))
    }

    /// Points spread over the surface of a cluster, by area.
    fn spread(&self, cluster: u32) -> Samples {
        let fragments = self.fragments_of(cluster);
        let area_m2: f64 = fragments.clone().map(Fragment::open_area_m2).sum();
        let mut points = Vec::with_capacity(SAMPLES);
        let mut passed = 0.0;
        for fragment in fragments {
            passed += fragment.open_area_m2();
            while points.len() < SAMPLES && (points.len() as f64 + 0.5) * area_m2 <= passed * SAMPLES as f64 {
                let position = point_on(fragment, points.len() as u32).as_vec3();
                points.push(Sample { position, normal: self.normal(fragment.side) });
            }
        }
        let normal: DVec3 = points.iter().map(|sample| sample.normal.as_dvec3()).sum();
        Samples { points, normal: normal.normalize_or_zero() }
    }

    fn samples(&self, cluster: u32) -> &Samples {
        self.samples[cluster as usize].get_or_init(|| self.spread(cluster))
    }

    /// Measures the visibility of clusters for their readers. Any thread may call it.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn seen(&self, rays: &Rays, scene: &SceneBuffers, asked: &[Ask<'_>]) -> Result<Vec<Seen>> {
        let mut queries = Vec::with_capacity(SAMPLES * asked.len());
        let mut ends = Vec::with_capacity(asked.len());
        for ask in asked {
            let samples = self.samples(ask.cluster).points.iter().zip(ask.readers.points.iter().cycle());
            queries.extend(samples.filter_map(|(sample, &reader)| self.query(sample, reader)));
            ends.push(queries.len());
        }
        let answers = rays.trace(scene, &queries)?;
        let mut first = 0;
        let seen = asked.iter().zip(ends).map(|(ask, end)| {
            let answers = &answers[first..end];
            first = end;
            let opens = answers.iter().filter(|answer| answer.t < 0.0 || answer.t >= 1.0).count();
            Seen {
                open: if answers.is_empty() { 0.0 } else { opens as f64 / answers.len() as f64 },
                facing: self.samples(ask.cluster).normal.dot(ask.readers.direction).max(0.0),
            }
        });
        Ok(seen.collect())
    }

    /// The ray segment from a sample to a reader. `None` if the sample faces away.
    fn query(&self, sample: &Sample, reader: Vec3) -> Option<RayQuery> {
        let origin = sample.position + self.clear_distance * sample.normal;
        let direction = reader - origin;
        (direction.dot(sample.normal) > 0.0).then_some(RayQuery { origin, direction })
    }
}

/// Fragments by cluster of the base level, in their order, and the first of each cluster.
fn sorted_fragments(fragments: &[Fragment], base: usize) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0; base + 2];
    fragments.iter().for_each(|fragment| first[fragment.cluster as usize + 2] += 1);
    (1..first.len()).for_each(|cluster| first[cluster] += first[cluster - 1]);
    let mut sorted = vec![0; fragments.len()];
    for (index, fragment) in (0..).zip(fragments) {
        let place = &mut first[fragment.cluster as usize + 1];
        sorted[*place as usize] = index;
        *place += 1;
    }
    first.pop();
    (sorted, first)
}

/// The last fragment of each key, by key. `None` if there are more than [`MAX_PLANES`].
fn last_of_each<'a>(
    fragments: impl Iterator<Item = &'a Fragment>,
    key: fn(&Fragment) -> u32,
) -> Option<Vec<&'a Fragment>> {
    let mut last = BTreeMap::new();
    for fragment in fragments {
        last.insert(key(fragment), fragment);
        if last.len() > MAX_PLANES {
            return None;
        }
    }
    Some(last.into_values().collect())
}

/// Point of a two-dimensional additive recurrence on the plastic number, moved to a convex polygon.
fn point_on(fragment: &Fragment, index: u32) -> DVec3 {
    const G: f64 = 1.324_717_957_244_746;
    let [mut u, v] = [1.0, 2.0].map(|power| (0.5 + f64::from(index + 1) * f64::powf(G, -power)).fract());
    let corner = |i: usize| fragment.corners[i].as_dvec3();
    let fan = 1..fragment.corners.len() - 1;
    let double_area = |i: usize| (corner(i) - corner(0)).cross(corner(i + 1) - corner(0)).length();
    let total: f64 = fan.clone().map(double_area).sum();
    let mut chosen = fan.start;
    for i in fan {
        chosen = i;
        let fraction = double_area(i) / total;
        if u < fraction {
            u /= fraction;
            break;
        }
        u -= fraction;
    }
    let along = u.clamp(0.0, 1.0).sqrt();
    let far = corner(chosen).lerp(corner(chosen + 1), v);
    corner(0).lerp(far, along)
}

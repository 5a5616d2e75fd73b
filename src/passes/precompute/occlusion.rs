//! Occlusion in cells: which part of a coarse cluster those see who read it. [Yue §2, Figure 1]
//! In: clusters, readers. Out: the share of sample points that nothing hides.
//!
//! Deviation: rays go on to the reader instead of ending at the cell's boundary. What leaves a cell sideways, below a screen that is
//! as wide as the cell is high, meets the screen next door.

use super::rays::{RayQuery, Rays};
use super::shares;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::scene::hvds::{Hvds, Piece};
use crate::types::Surface;
use glam::{DVec3, UVec2, UVec3, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Rays that measure the share of a cluster within the one that is read.
const SAMPLES: usize = 8;
/// Rays that tell whether anything of a cluster that is read is hidden.
const FIRST_SAMPLES: usize = 8;

/// Heights over a plane that count as none, in base cells.
const FLAT: f64 = 1e-3;

/// More triangles than this in a cell are not looked at one by one: rays tell.
const MOST_PLANES: usize = 256;

/// A point on a cluster, and the unit geometric normal of its side.
#[derive(Clone, Copy, Debug)]
struct Sample {
    position: Vec3,
    normal: Vec3,
}

/// Points that read a cluster from about the same direction.
pub struct Readers {
    /// Some of them, off their surfaces.
    pub points: Vec<Vec3>,
    /// Unit direction towards them, in the mean.
    pub direction: DVec3,
}

/// What is seen of a cluster along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Share of its surface that the readers see, of what faces them.
    pub open: f64,
    /// Cosine of its mean normal with the mean direction, at least 0.
    pub facing: f64,
}

/// A cluster to look at.
#[derive(Clone, Copy)]
pub(super) struct Ask<'a> {
    pub(super) cluster: u32,
    /// By [`FIRST_SAMPLES`] instead of [`SAMPLES`].
    pub(super) is_first: bool,
    pub(super) readers: &'a Readers,
}

/// The surface in the cells of all levels.
pub(super) struct Cells<'a> {
    hvds: &'a Hvds,
    surfaces: &'a [Surface],
    /// First base cluster below each cluster, and the end.
    base_ranges: Vec<UVec2>,
    /// Base cell of each base cluster.
    base_cells: Vec<UVec3>,
    /// Pieces by base cluster, and the first of each base cluster.
    pieces: Vec<u32>,
    first_pieces: Vec<u32>,
    /// Clusters of each cell above the base level.
    in_cells: HashMap<(usize, UVec3), Vec<u32>>,
    /// Of each cluster, where somebody asked: few or many.
    samples: [Vec<Option<Box<[Sample]>>>; 2],
    clear_distance: f32,
}

/// A triangle in a cell, as seen from a cluster in it.
struct Plane {
    normal: DVec3,
    /// Of the cluster's surface over the triangle's front, metres.
    heights: [f64; 2],
}

/// What may hide a cluster.
pub(super) enum Hiding {
    /// Nothing, from any direction.
    Nothing,
    /// Some of these planes.
    Planes(Planes),
    /// Anything.
    Unknown,
}

/// Planes of triangles around a cluster.
pub(super) struct Planes(Vec<Plane>, f64);

impl Hiding {
    /// Whether something in the cell may stand between the cluster and what is in a direction.
    pub(super) fn is_possible_along(&self, direction: DVec3) -> bool {
        match self {
            Self::Nothing => false,
            Self::Unknown => true,
            // A surface in front of a plane meets it only where it goes back.
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
    /// Sorts the surface by cell. Rays start `clear_distance` (metres) off it.
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
        let mut pieces: Vec<u32> = (0..hvds.pieces.len() as u32).collect();
        pieces.sort_by_key(|&piece| hvds.pieces[piece as usize].cluster);
        let first = |cluster| pieces.partition_point(|&piece| hvds.pieces[piece as usize].cluster < cluster);
        let first_pieces = (0..=base as u32).map(|cluster| first(cluster) as u32).collect();
        let base_ranges = super::gloss::base_ranges(hvds);
        let mut in_cells: HashMap<_, Vec<u32>> = HashMap::new();
        for (level, clusters) in hvds.levels.iter().enumerate().skip(1) {
            for cluster in clusters.clone() {
                let cell = base_cells[base_ranges[cluster as usize].x as usize] >> level as u32;
                in_cells.entry((level, cell)).or_default().push(cluster);
            }
        }
        let count = hvds.cluster_count() as usize;
        let samples = [(); 2].map(|()| vec![None; count]);
        Self {
            hvds,
            surfaces,
            base_ranges,
            base_cells,
            pieces,
            first_pieces,
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
        self.hvds.first_children[cluster as usize]..self.hvds.first_children[cluster as usize + 1]
    }

    fn pieces_of(&self, cluster: u32) -> impl Iterator<Item = &'a Piece> + Clone {
        let hvds: &'a Hvds = self.hvds;
        let range = self.base_ranges[cluster as usize];
        let run = self.first_pieces[range.x as usize] as usize..self.first_pieces[range.y as usize] as usize;
        self.pieces[run].iter().map(move |&piece| &hvds.pieces[piece as usize])
    }

    /// Unit geometric normal of a side.
    pub(super) fn normal(&self, side: u32) -> Vec3 {
        let normal = self.surfaces[side as usize / 2].normal;
        if side % 2 == 1 { -normal } else { normal }
    }

    /// What may hide surface of a cluster that is not of the base level.
    pub(super) fn hiding(&self, cluster: u32) -> Hiding {
        let flat = FLAT * self.hvds.grid.cell_size();
        let own: Vec<&Piece> = self.pieces_of(cluster).collect();
        let corners: Vec<DVec3> =
            own.iter().flat_map(|p| &p.corners).map(|corner| corner.as_dvec3()).collect();
        let heights = |normal: DVec3, on: DVec3, points: &[DVec3]| {
            let over = points.iter().map(|&point| normal.dot(point - on));
            over.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(h), high.max(h)])
        };
        // Planes of the cluster's sides: what rises above none hides nothing, as on a solid that bulges everywhere.
        let sides: BTreeMap<u32, DVec3> = own.iter().map(|p| (p.side, p.corners[0].as_dvec3())).collect();
        if sides.len() > MOST_PLANES {
            return Hiding::Unknown;
        }
        let sides: Vec<(DVec3, DVec3)> =
            sides.into_iter().map(|(side, on)| (self.normal(side).as_dvec3(), on)).collect();

        let mut triangles: BTreeMap<u32, &Piece> = BTreeMap::new();
        for &other in &self.in_cells[&self.place(cluster)] {
            for piece in self.pieces_of(other) {
                let points: Vec<DVec3> = piece.corners.iter().map(|corner| corner.as_dvec3()).collect();
                if sides.iter().any(|&(normal, on)| heights(normal, on, &points)[1] > flat) {
                    triangles.insert(piece.side / 2, piece);
                }
            }
        }
        if triangles.is_empty() {
            return Hiding::Nothing;
        }
        if triangles.len() > MOST_PLANES {
            return Hiding::Unknown;
        }
        let plane = |(&triangle, piece): (&u32, &&Piece)| {
            let normal = self.surfaces[triangle as usize].normal.as_dvec3();
            Plane { normal, heights: heights(normal, piece.corners[0].as_dvec3(), &corners) }
        };
        let planes: Vec<Plane> = triangles.iter().map(plane).collect();
        let is_coplanar = |plane: &Plane| plane.heights[0] >= -flat && plane.heights[1] <= flat;
        if planes.iter().all(is_coplanar) {
            return Hiding::Nothing;
        }
        Hiding::Planes(Planes(planes, flat))
    }

    /// Points spread over the surface of a cluster, by area.
    fn spread(&self, cluster: u32, count: usize) -> Box<[Sample]> {
        let pieces = self.pieces_of(cluster);
        let area_m2: f64 = pieces.clone().map(Piece::open_area_m2).sum();
        let mut samples = Vec::with_capacity(count);
        let mut passed = 0.0;
        for piece in pieces {
            passed += piece.open_area_m2();
            while samples.len() < count && (samples.len() as f64 + 0.5) * area_m2 <= passed * count as f64 {
                let position = point_on(piece, samples.len() as u32).as_vec3();
                samples.push(Sample { position, normal: self.normal(piece.side) });
            }
        }
        samples.into()
    }

    fn samples(&self, ask: &Ask<'_>) -> &[Sample] {
        let samples = self.samples[usize::from(ask.is_first)][ask.cluster as usize].as_ref();
        samples.expect("samples are spread before they are looked at")
    }

    /// What readers see of clusters.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn seen(&mut self, rays: &Rays, scene: &SceneBuffers, asked: &[Ask<'_>]) -> Result<Vec<Seen>> {
        for (is_first, count) in [(false, SAMPLES), (true, FIRST_SAMPLES)] {
            let kept = &self.samples[usize::from(is_first)];
            let asked = asked.iter().filter(|ask| ask.is_first == is_first).map(|ask| ask.cluster);
            let mut new: Vec<u32> = asked.filter(|&cluster| kept[cluster as usize].is_none()).collect();
            new.sort_unstable();
            new.dedup();
            let spread = shares::each(new.len(), |index| self.spread(new[index], count));
            for (cluster, samples) in new.into_iter().zip(spread) {
                self.samples[usize::from(is_first)][cluster as usize] = Some(samples);
            }
        }
        let cells = &*self;
        let queries = shares::in_shares(asked.len(), |share| {
            asked[share].iter().flat_map(|ask| cells.queries(ask).flatten()).collect()
        });
        let answers = rays.trace(scene, &queries)?;
        let mut answers = answers.iter();
        let seen = asked.iter().map(|ask| {
            let (mut faces, mut opens) = (0, 0);
            let mut normal = DVec3::ZERO;
            for (sample, query) in cells.samples(ask).iter().zip(cells.queries(ask)) {
                normal += sample.normal.as_dvec3();
                if query.is_some() {
                    let answer = answers.next().expect("a ray each was traced");
                    faces += 1;
                    opens += u32::from(answer.t < 0.0 || answer.t >= 1.0);
                }
            }
            Seen {
                open: if faces > 0 { f64::from(opens) / f64::from(faces) } else { 0.0 },
                facing: normal.normalize_or_zero().dot(ask.readers.direction).max(0.0),
            }
        });
        Ok(seen.collect())
    }

    /// The rays that tell whether readers see samples of a cluster; none where a sample faces away.
    fn queries(&self, ask: &Ask<'_>) -> impl Iterator<Item = Option<RayQuery>> {
        let readers = ask.readers.points.iter().cycle();
        self.samples(ask).iter().zip(readers).map(|(sample, &reader)| self.query(sample, reader))
    }

    /// The ray, as long as its direction, that tells whether a reader sees a sample; none where the sample faces away.
    fn query(&self, sample: &Sample, reader: Vec3) -> Option<RayQuery> {
        let origin = sample.position + self.clear_distance * sample.normal;
        let direction = reader - origin;
        (direction.dot(sample.normal) > 0.0).then_some(RayQuery { origin, direction })
    }
}

/// Point of a two-dimensional additive recurrence on the plastic number, moved to a convex polygon.
fn point_on(piece: &Piece, index: u32) -> DVec3 {
    const G: f64 = 1.324_717_957_244_746;
    let [mut u, v] = [1.0, 2.0].map(|power| (0.5 + f64::from(index + 1) * f64::powf(G, -power)).fract());
    let corner = |i: usize| piece.corners[i].as_dvec3();
    let fan = 1..piece.corners.len() - 1;
    let double_area = |i: usize| (corner(i) - corner(0)).cross(corner(i + 1) - corner(0)).length();
    let total: f64 = fan.clone().map(double_area).sum();
    let mut chosen = fan.start;
    for i in fan {
        chosen = i;
        let share = double_area(i) / total;
        if u < share {
            u /= share;
            break;
        }
        u -= share;
    }
    let along = u.clamp(0.0, 1.0).sqrt();
    let far = corner(chosen).lerp(corner(chosen + 1), v);
    corner(0).lerp(far, along)
}

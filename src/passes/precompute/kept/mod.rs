//! What a precomputation keeps for the next one, in which models stand elsewhere.
//!
//! A result follows from a place and from what rays find around it. It is kept where nothing has
//! moved within their reach, and has the bits then that a cold start computes. Rays of unlimited
//! reach keep their hits on surface that cannot move ([`hits`]).

pub mod hits;
pub mod names;

use crate::cache_file::hash;
use crate::error::Result;
use crate::gpu::Context;
use crate::scene::{Scene, Triangle};
use crate::types::Surface;
use bytemuck::Pod;
use glam::Vec3;
use hits::KeptHits;
use names::Name;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Boxes of what has moved beyond which one box holds all.
const MAX_BOXES: usize = 64;

/// Rounding errors of reaches, relative to them and to the size of the scene.
const SLACK: [f32; 2] = [1e-4, 1e-5];

/// Words of the largest result.
const WORDS: usize = 5;

/// Results of one kind by name.
type Results = HashMap<Name, [u32; WORDS]>;

/// The scene for which results hold.
struct Of {
    /// Hash of what results follow from, beside the triangles.
    surroundings: [u64; 2],
    objects: Vec<String>,
    triangles: Vec<Triangle>,
    /// Sides of each triangle that take part in light transport, as in [`Surface`].
    sides: Vec<u32>,
    scene_size: f32,
    /// Hash of the triangles that cannot move, with the surroundings.
    fixed: [u64; 2],
}

impl Of {
    /// Triangles of each object, by its name.
    fn by_object(&self) -> HashMap<&str, Vec<u32>> {
        let mut by_object: HashMap<&str, Vec<u32>> = HashMap::new();
        for (index, triangle) in (0..).zip(&self.triangles) {
            by_object.entry(&self.objects[triangle.object as usize]).or_default().push(index);
        }
        by_object
    }
}

/// Number of results that were kept, of all.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
pub struct KeptCount {
    /// Results of the precomputation before.
    pub kept: u64,
    /// Results in all.
    pub all: u64,
}

/// Results of the last precomputation of a scene with models that can move.
///
/// A precomputation that ends early leaves it as it was.
#[derive(Default)]
pub struct Kept {
    of: Option<Of>,
    results: HashMap<&'static str, Results>,
    /// The scene of the precomputation that goes on.
    next: Option<Of>,
    found: Mutex<HashMap<&'static str, (Results, KeptCount)>>,
    /// Pairs of equal triangles of the scene before and of this one.
    equal: Vec<[u32; 2]>,
    /// Low and high corners of what has moved, before and now.
    moved: Vec<[Vec3; 2]>,
    hits: Option<KeptHits>,
}

impl Kept {
    /// Begins a precomputation of a scene, with its triangles in the order of loading. Results of
    /// the one before are kept if only objects have moved. `surroundings`: hash of what results
    /// follow from, beside the triangles. Random decisions are named by place.
    pub fn begin(&mut self, scene: &Scene, surroundings: [u64; 2]) {
        self.found().clear();
        self.equal.clear();
        self.moved.clear();
        let (low, high) = scene.bounds();
        let next = Of {
            surroundings,
            objects: scene.objects.clone(),
            triangles: scene.triangles.clone(),
            sides: Vec::new(),
            scene_size: (high - low).length(),
            fixed: hash_of_fixed(scene, surroundings),
        };
        let before = self.of.take().filter(|before| before.surroundings == surroundings);
        match &before {
            None => self.results.clear(),
            Some(before) => self.compare(before, &next),
        }
        (self.of, self.next) = (before, Some(next));
    }

    /// Finds the objects that have moved.
    fn compare(&mut self, before: &Of, next: &Of) {
        let (old, new) = (before.by_object(), next.by_object());
        let is_equal = |&[old, new]: &[u32; 2]| {
            let (old, new) = (before.triangles[old as usize], next.triangles[new as usize]);
            old == Triangle { object: old.object, ..new }
        };
        for (object, triangles) in &old {
            let others = new.get(object).map_or(&[][..], Vec::as_slice);
            let pairs: Vec<[u32; 2]> = triangles.iter().zip(others).map(|(&old, &new)| [old, new]).collect();
            if triangles.len() == others.len() && pairs.iter().all(is_equal) {
                self.equal.extend(pairs);
            } else {
                self.moved.extend(bounds_of(&before.triangles, triangles));
                self.moved.extend(bounds_of(&next.triangles, others));
            }
        }
        for triangles in new.iter().filter(|(object, _)| !old.contains_key(*object)).map(|(_, all)| all) {
            self.moved.extend(bounds_of(&next.triangles, triangles));
        }
    }

    /// Takes the sides that take part in light transport; surfaces in the order `order` of the
    /// triangles. A triangle of which another side does counts as moved: rays find something else.
    pub fn note_sides(&mut self, surfaces: &[Surface], order: &[u32]) {
        let Some(next) = &mut self.next else { return };
        next.sides = vec![0; order.len()];
        for (surface, &triangle) in surfaces.iter().zip(order) {
            next.sides[triangle as usize] = surface.sides;
        }
        let Some(before) = &self.of else { return };
        let differs = |&&[old, new]: &&[u32; 2]| before.sides[old as usize] != next.sides[new as usize];
        let others = self.equal.iter().filter(differs);
        self.moved.extend(others.flat_map(|&[_, new]| bounds_of(&next.triangles, &[new])));
        if self.moved.len() > MAX_BOXES {
            let all = self.moved.drain(..).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
            self.moved.extend(all);
        }
    }

    /// Ends the precomputation: the next one may keep its results.
    pub fn end(&mut self) {
        let results = self.found().drain().map(|(kind, (results, _))| (kind, results)).collect();
        (self.of, self.results) = (self.next.take(), results);
    }

    /// Numbers of results of each kind. Nothing before [`Self::begin`] and after [`Self::end`].
    pub fn counts(&self) -> Vec<(&'static str, KeptCount)> {
        let mut counts: Vec<_> = self.found().iter().map(|(&kind, &(_, count))| (kind, count)).collect();
        counts.sort_unstable_by_key(|count| count.0);
        counts
    }

    /// Hits of gather rays, `rays` from each of at most `points` cache points.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn hits(&mut self, context: &Arc<Context>, rays: u32, points: u32) -> Result<&mut KeptHits> {
        let of = self.next.as_ref().map_or([0; 2], |next| next.fixed);
        let hits = match self.hits.take().filter(|hits| hits.suits(context, of, [rays, points])) {
            Some(hits) => hits,
            None => KeptHits::new(context, of, [rays, points])?,
        };
        Ok(self.hits.insert(hits))
    }

    fn found(&self) -> MutexGuard<'_, HashMap<&'static str, (Results, KeptCount)>> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether nothing has moved in the neighbourhood of a box.
    pub(super) fn is_clear(&self, [low, high]: [Vec3; 2], reach: f32) -> bool {
        let size = self.next.as_ref().map_or(0.0, |next| next.scene_size);
        let reach = Vec3::splat(reach + SLACK[0] * reach + SLACK[1] * size);
        let (low, high) = (low - reach, high + reach);
        !self.moved.iter().any(|[from, to]| low.cmple(*to).all() && high.cmpge(*from).all())
    }

    /// Number of rays that may meet what has moved.
    pub(super) fn meeting(&self, origin: Vec3, directions: impl Iterator<Item = Vec3>) -> i32 {
        let size = self.next.as_ref().map_or(0.0, |next| next.scene_size);
        let meets = |direction: Vec3, [low, high]: [Vec3; 2]| {
            let slack = Vec3::splat(SLACK[1] * size);
            let ends = [low - slack - origin, high + slack - origin];
            // 0 · ∞ is no number; `max` and `min` then return the other one.
            let [a, b] = ends.map(|end| end / direction);
            a.min(b).max_element().max(0.0) <= a.max(b).min_element()
        };
        directions.filter(|&direction| self.moved.iter().any(|&moved| meets(direction, moved))).count() as i32
    }

    /// The result of each item, of one kind: that of the precomputation before if it `is_kept`,
    /// else what `find` returns for all other items, in order.
    ///
    /// # Errors
    /// Those of `find`.
    pub(super) fn all<T: Copy + Send + Sync, V: Pod + Send + Sync>(
        &self,
        kind: &'static str,
        items: &[T],
        name: impl Fn(&T) -> Name + Sync,
        is_kept: impl Fn(&T, &V) -> bool + Sync,
        find: impl FnOnce(&[T]) -> Result<Vec<V>>,
    ) -> Result<Vec<V>> {
        let before = self.results.get(kind).filter(|_| self.of.is_some());
        let recall = |item: &T| {
            let name = name(item);
            let known = before.and_then(|before| before.get(&name)).map(value);
            (name, known.filter(|value| is_kept(item, value)))
        };
        let named: Vec<(Name, Option<V>)> = items.par_iter().map(recall).collect();
        let others = items.iter().zip(&named).filter(|(_, (_, known))| known.is_none());
        let others: Vec<T> = others.map(|(&item, _)| item).collect();
        let mut found = find(&others)?.into_iter();
        let all: Vec<V> = named
            .iter()
            .map(|(_, known)| known.unwrap_or_else(|| found.next().expect("a result for each item")))
            .collect();
        let mut results = self.found();
        let (results, count) = results.entry(kind).or_default();
        results.extend(named.iter().map(|(name, _)| *name).zip(all.iter().map(words)));
        count.kept += (items.len() - others.len()) as u64;
        count.all += items.len() as u64;
        Ok(all)
    }
}

/// A result as words.
fn words<V: Pod>(value: &V) -> [u32; WORDS] {
    let mut words = [0; WORDS];
    bytemuck::bytes_of_mut(&mut words)[..size_of::<V>()].copy_from_slice(bytemuck::bytes_of(value));
    words
}

/// The result of [`words`].
fn value<V: Pod>(words: &[u32; WORDS]) -> V {
    bytemuck::pod_read_unaligned(&bytemuck::bytes_of(words)[..size_of::<V>()])
}

/// Hash of the triangles that cannot move, in the order of loading.
fn hash_of_fixed(scene: &Scene, surroundings: [u64; 2]) -> [u64; 2] {
    let is_movable = scene.movable_triangles();
    let fixed = scene.triangles.iter().zip(is_movable).filter(|(_, is_movable)| !is_movable);
    let corners = fixed.flat_map(|(triangle, _)| triangle.positions);
    let words: Vec<[u32; 3]> = corners.map(|corner| corner.to_array().map(f32::to_bits)).collect();
    let [a, b] = hash(bytemuck::cast_slice(&words));
    hash(bytemuck::cast_slice(&[[a, b], surroundings]))
}

pub(super) fn bounds(corners: impl Iterator<Item = Vec3>) -> Option<[Vec3; 2]> {
    corners.map(|corner| [corner; 2]).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
}

fn bounds_of(all: &[Triangle], triangles: &[u32]) -> Option<[Vec3; 2]> {
    bounds(triangles.iter().flat_map(|&triangle| all[triangle as usize].positions))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept() -> Kept {
        let of = Of {
            surroundings: [0; 2],
            objects: Vec::new(),
            triangles: Vec::new(),
            sides: Vec::new(),
            scene_size: 10.0,
            fixed: [0; 2],
        };
        let moved = vec![[Vec3::ZERO, Vec3::ONE], [Vec3::splat(5.0), Vec3::splat(6.0)]];
        Kept { next: Some(of), moved, ..Kept::default() }
    }

    #[test]
    fn a_neighbourhood_is_clear_of_what_has_moved() {
        let kept = kept();
        let at = |x: f32| [Vec3::new(x, 0.5, 0.5); 2];
        assert!(kept.is_clear(at(3.0), 1.9) && !kept.is_clear(at(3.0), 2.0));
        assert!(kept.is_clear(at(-2.0), 1.9) && !kept.is_clear(at(-2.0), 2.1));
        assert!(!kept.is_clear(at(0.5), 0.0));
        assert!(!kept.is_clear([Vec3::splat(-1.0), Vec3::splat(9.0)], 0.0), "a box around both");
        // A corner of the second box.
        assert!(!kept.is_clear([Vec3::splat(4.0); 2], 1.0) && kept.is_clear([Vec3::splat(4.0); 2], 0.9));
    }

    #[test]
    fn rays_that_may_meet_what_has_moved_are_counted() {
        let kept = kept();
        let meeting = |origin: Vec3, directions: &[Vec3]| kept.meeting(origin, directions.iter().copied());
        let origin = Vec3::new(3.0, 0.5, 0.5);
        assert_eq!(meeting(origin, &[Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::new(-1.0, 0.3, 0.0)]), 1);
        assert_eq!(meeting(origin, &[Vec3::new(-1.0, 0.2, 0.0), Vec3::new(-10.0, 0.2, 0.1)]), 2);
        assert_eq!(meeting(Vec3::splat(3.0), &[Vec3::ONE, Vec3::NEG_ONE, Vec3::new(1.0, 1.0, -1.0)]), 2);
        assert_eq!(meeting(Vec3::splat(0.5), &[Vec3::X, Vec3::Y, Vec3::NEG_ONE]), 3, "from within");
        // A ray in the plane of a face.
        assert_eq!(meeting(Vec3::new(-1.0, 1.0, 0.5), &[Vec3::X]), 1);
    }
}

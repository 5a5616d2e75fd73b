//! Hits of gather rays on surface that stays where it is: a row a cache point. A ray whose cache
//! point stays keeps its hit, whatever models move.

use super::names::{Name, name_of_point};
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::types::CachePoint;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Row of a cache point without one.
pub const NO_ROW: u32 = u32::MAX;
/// Flag of a row that holds the hits.
pub const ROW_IS_KEPT: u32 = 1 << 31;

/// Rows of hits on the device.
pub struct KeptHits {
    /// The triangle that each ray meets, a row after another.
    pub buffer: Buffer,
    /// Hash of what the hits follow from, beside their rays.
    of: [u64; 2],
    /// Rays of a row.
    rays: u32,
    capacity: u32,
    rows: HashMap<Name, u32>,
}

impl KeptHits {
    /// Empty rows of that many rays, for that many points or as many as one binding holds. `of`:
    /// hash of what the hits follow from, beside their rays.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new(context: &Arc<Context>, of: [u64; 2], [rays, points]: [u32; 2]) -> Result<Self> {
        let capacity = capacity(context, [rays, points]);
        let bytes = 4 * u64::from(capacity) * u64::from(rays);
        let buffer = Buffer::storage(context, GrowsWith::GatherRays.named("kept hits"), bytes.max(4))?;
        Ok(Self { buffer, of, rays, capacity, rows: HashMap::new() })
    }

    /// Whether it is what [`Self::new`] would make, with hits or without.
    pub fn suits(&self, context: &Context, of: [u64; 2], [rays, points]: [u32; 2]) -> bool {
        self.of == of && self.rays == rays && self.capacity == capacity(context, [rays, points])
    }

    /// Assigns a row to each point: that of its hits, with [`ROW_IS_KEPT`], else an empty one, else
    /// [`NO_ROW`]. Rows of other points are forgotten.
    pub fn assign(&mut self, points: &[CachePoint]) -> Assigned {
        let names: Vec<Name> = points.iter().map(name_of_point).collect();
        let wanted: HashSet<&Name> = names.iter().collect();
        self.rows.retain(|name, _| wanted.contains(name));
        let used: HashSet<u32> = self.rows.values().copied().collect();
        let mut free = (0..self.capacity).filter(|row| !used.contains(row));
        let mut new = HashMap::new();
        let row = |name: &Name| match self.rows.get(name) {
            Some(row) => row | ROW_IS_KEPT,
            // Points at one place have one row each: the last one's stays.
            None => free.next().inspect(|&row| _ = new.insert(*name, row)).unwrap_or(NO_ROW),
        };
        let rows = names.iter().map(row).collect();
        Assigned { rows, new }
    }

    /// Takes the rows of `assigned`, which now hold hits.
    pub fn fill(&mut self, assigned: Assigned) {
        self.rows.extend(assigned.new);
    }
}

/// Rows of that many rays, at most one a point, that one binding holds.
fn capacity(context: &Context, [rays, points]: [u32; 2]) -> u32 {
    let fitting = context.limits().storage_range_bytes / (4 * u64::from(rays.max(1)));
    fitting.min(u64::from(points)) as u32
}

/// Rows of cache points.
pub struct Assigned {
    /// Row of each cache point.
    pub rows: Vec<u32>,
    new: HashMap<Name, u32>,
}

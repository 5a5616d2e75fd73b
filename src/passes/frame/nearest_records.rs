//! The tree of nearest records: what a pixel that no record covers searches. A binary tree of boxes
//! around positions and normals, in depth-first order. It depends neither on the camera nor on the
//! lights. In: cache points, metres. Out: nodes, and the records in the order of the leaves.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::types::CachePoint;
use glam::Vec3;
use std::sync::Arc;

/// Maximum number of records of a leaf.
const LEAF: usize = 4;
/// Bits of [`Node::records`] that hold the number.
const COUNT_BITS: u32 = 3;

/// The tree on the device.
pub(super) struct NearestRecords {
    pub(super) nodes: Buffer,
    pub(super) node_count: u32,
    pub(super) order: Buffer,
}

/// A node as kernels read it: four texels. The left child follows its parent, and the right child
/// is at the left child's `next`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Node {
    /// Lowest position of a record, metres.
    low: Vec3,
    /// The node after this one and all below it.
    next: u32,
    high: Vec3,
    /// Number of records of a leaf, and in the bits above it the first one's place in the order.
    /// Zero if the node is no leaf.
    records: u32,
    /// Lowest components of the normals.
    normal_low: Vec3,
    unused: u32,
    normal_high: Vec3,
    unused2: u32,
}

impl NearestRecords {
    /// Builds the tree of all cache points.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn new(context: &Arc<Context>, points: &[CachePoint]) -> Result<Self> {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut nodes = Vec::new();
        add(points, &mut order, 0, &mut nodes);
        order.resize(order.len().max(1), 0);
        let named = |name| GrowsWith::GatherRays.named(name);
        Ok(Self {
            nodes: Buffer::from_slice(context, named("nearest records"), &nodes)?,
            node_count: nodes.len() as u32,
            order: Buffer::from_slice(context, named("order of nearest records"), &order)?,
        })
    }

    /// Bytes of nodes and order.
    pub(super) fn bytes(&self) -> u64 {
        self.nodes.bytes() + self.order.bytes()
    }
}

/// Adds the tree of some records and sorts them into its leaves. The first one is at a place in the
/// order of all.
fn add(points: &[CachePoint], records: &mut [u32], place: usize, nodes: &mut Vec<Node>) {
    let point = |&record: &u32| &points[record as usize];
    let bounds = |of: fn(&CachePoint) -> Vec3| {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let add = |(low, high): (Vec3, Vec3), at: Vec3| (low.min(at), high.max(at));
        records.iter().map(|record| of(point(record))).fold(empty, add)
    };
    let ((low, high), (normal_low, normal_high)) =
        (bounds(|point| point.position), bounds(|point| point.normal));
    let is_leaf = records.len() <= LEAF;
    let leaf = if is_leaf { (place as u32) << COUNT_BITS | records.len() as u32 } else { 0 };
    let own = nodes.len();
    nodes.push(Node { low, next: 0, high, records: leaf, normal_low, unused: 0, normal_high, unused2: 0 });
    if !is_leaf {
        let axis = (high - low).max_position();
        let middle = records.len() / 2;
        // The index decides between equal places, so that the tree is the same everywhere.
        records.select_nth_unstable_by(middle, |a, b| {
            let along = |record| point(record).position[axis];
            along(a).total_cmp(&along(b)).then(a.cmp(b))
        });
        let (left, right) = records.split_at_mut(middle);
        add(points, left, place, nodes);
        add(points, right, place + middle, nodes);
    }
    nodes[own].next = nodes.len() as u32;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::hash;

    #[test]
    fn nodes_bound_their_records_and_leaves_hold_each_once() {
        let random = |seed: u32| (hash(seed) >> 8) as f32 / 16_777_216.0;
        let vector = |seed: u32| Vec3::new(random(seed), random(seed + 1), random(seed + 2)) - 0.5;
        let point = |number: u32| {
            let (position, normal) = (vector(6 * number), vector(6 * number + 3).normalize());
            CachePoint {
                position,
                radius: 1.0,
                normal,
                side: 0,
                occluder: Vec3::ZERO,
                facet: normal,
                inverse_reach: 0.0,
                stream: 0,
            }
        };
        // All at one place, too.
        let together = vec![point(0); 100];
        for points in [Vec::new(), (0..1).map(point).collect(), (0..1000).map(point).collect(), together] {
            let mut order: Vec<u32> = (0..points.len() as u32).collect();
            let mut nodes = Vec::new();
            add(&points, &mut order, 0, &mut nodes);
            let held = |node: &Node| {
                let first = (node.records >> COUNT_BITS) as usize;
                order[first..first + (node.records & ((1 << COUNT_BITS) - 1)) as usize].iter()
            };
            let mut all: Vec<u32> = nodes.iter().flat_map(held).copied().collect();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..points.len() as u32));
            for (index, node) in nodes.iter().enumerate() {
                for record in nodes[index..node.next as usize].iter().flat_map(held) {
                    let CachePoint { position, normal, .. } = points[*record as usize];
                    assert!(node.low.cmple(position).all() && position.cmple(node.high).all());
                    assert!(node.normal_low.cmple(normal).all() && normal.cmple(node.normal_high).all());
                }
            }
        }
    }
}

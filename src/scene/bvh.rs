//! The acceleration structure: built by `obvhs` on the host, traversed by our own compute code. [Ylitie 2017]

use crate::error::{Error, Result};
use crate::scene::Triangle;
use crate::types;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb};
use std::time::Duration;

/// Entries of the traversal stack in `glsl/include/bvh.glsl`; a node group is pushed at most once a level.
const STACK_SIZE: usize = 32;

/// An eight-wide compressed BVH. Its triangles are the scene's in leaf order, each exactly once.
pub struct Bvh {
    /// Nodes, the root first.
    pub nodes: Vec<types::Node>,
    /// Index of the scene triangle that stands at each place of the leaf order.
    pub order: Vec<u32>,
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Builds the tree over at least one triangle.
    ///
    /// # Errors
    /// [`Error::Usage`] if the tree is deeper than the traversal stack, which only degenerate geometry brings about.
    pub fn build(triangles: &[Triangle]) -> Result<Self> {
        let bounds: Vec<Bounds> =
            triangles.iter().map(|t| Bounds(Aabb::from_points(&t.positions.map(Into::into)))).collect();
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_cwbvh(&bounds, params, &mut Duration::default());
        let nodes: Vec<types::Node> = bytemuck::cast_slice(&tree.nodes).to_vec();
        if depth(&nodes) > STACK_SIZE {
            return Err(Error::Usage(
                "the scene's triangles nest too deeply for the ray traversal; remove coincident geometry"
                    .into(),
            ));
        }
        Ok(Self { nodes, order: tree.primitive_indices })
    }
}

/// Levels of the tree: a child always stands behind its parent in the node array.
fn depth(nodes: &[types::Node]) -> usize {
    let mut levels = vec![1; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let (first, children) = node.inner_children();
        for child in first..first + children {
            levels[child as usize] = levels[index] + 1;
        }
    }
    levels.into_iter().max().unwrap_or(0)
}

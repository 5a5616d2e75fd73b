//! The acceleration structure: `obvhs` builds it on the host, and our own compute code traverses
//! it. [Ylitie 2017]

use crate::error::{Error, Result};
use crate::scene::Triangle;
use crate::types;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb};
use std::time::Duration;

/// Entries of the traversal stack in `glsl/include/bvh.glsl`. A node is pushed at most
/// once a level.
const STACK_SIZE: usize = 32;
/// Largest node index of a stack entry: some hundred million triangles need as many nodes.
const MAX_NODES: usize = 1 << 24;

/// An eight-wide compressed BVH. Its leaves hold each scene triangle exactly once.
pub struct Bvh {
    /// Nodes, the root first.
    pub nodes: Vec<types::Node>,
    /// Scene triangle at each position of the leaf order.
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
    /// [`Error::Usage`] if the tree is deeper than the traversal stack, which needs degenerate
    /// geometry, or has more nodes than a stack entry can number.
    pub fn build(triangles: &[Triangle]) -> Result<Self> {
        let bounds: Vec<Bounds> =
            triangles.iter().map(|t| Bounds(Aabb::from_points(&t.positions.map(Into::into)))).collect();
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_cwbvh(&bounds, params, &mut Duration::default());
        let nodes: Vec<types::Node> = bytemuck::cast_slice(&tree.nodes).to_vec();
        check_size(nodes.len(), depth(&nodes))?;
        Ok(Self { nodes, order: tree.primitive_indices })
    }
}

/// Refuses trees that the kernels cannot traverse.
fn check_size(nodes: usize, depth: usize) -> Result<()> {
    let too_much = if nodes > MAX_NODES {
        format!(
            "the scene's triangles make a tree of {nodes} nodes, rays walk {MAX_NODES}; use fewer triangles"
        )
    } else if depth > STACK_SIZE {
        "the scene's triangles nest too deeply for the ray traversal; remove coincident geometry".into()
    } else {
        return Ok(());
    };
    Err(Error::Usage(too_much))
}

/// Levels of the tree. A child always follows its parent in the node array.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_that_rays_cannot_walk_are_refused() {
        assert!(check_size(MAX_NODES, STACK_SIZE).is_ok());
        let message = |nodes, depth| check_size(nodes, depth).unwrap_err().to_string();
        assert!(message(MAX_NODES + 1, 1).contains("16777217 nodes, rays walk 16777216"));
        assert!(message(1, STACK_SIZE + 1).contains("nest too deeply"));
    }
}

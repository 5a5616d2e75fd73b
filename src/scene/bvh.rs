//! The acceleration structure: `obvhs` builds it on the host, and our own compute code traverses
//! it. [Ylitie 2017]

use crate::error::{Error, Result};
use crate::scene::{Scene, Triangle};
use crate::types;
use glam::{UVec4, Vec3};
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb};
use std::time::Duration;

/// Entries of the traversal stack in `glsl/include/bvh.glsl`. A node is pushed at most
/// once a level.
const STACK_SIZE: usize = 32;
/// Largest node index of a stack entry: some hundred million triangles need as many nodes.
const MAX_NODES: usize = 1 << 24;

/// Root of the tree of all surface that stays where it is, if models of the scene can move.
pub const STATIC_ROOT: u32 = 1;
/// Root of the tree of these models.
pub const MOVABLE_ROOT: u32 = 2;

/// An eight-wide compressed BVH. Its leaves hold each scene triangle exactly once.
pub struct Bvh {
    /// Nodes, the root first.
    pub nodes: Vec<types::Node>,
    /// Scene triangle at each position of the leaf order.
    pub order: Vec<u32>,
    /// `None` without models that can move, or without other surface.
    pub movable: Option<Movable>,
}

/// The part of the tree that holds models that can move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movable {
    /// Position in the leaf order of its first triangle: those of other surface come before it.
    pub first: u32,
    /// Low and high corner of these models, metres.
    pub bounds: [Vec3; 2],
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Builds the tree of a scene. Models that can move have a tree of their own in it, so that the
    /// other tree, and what rays find in it, stays as it is when they move.
    ///
    /// # Errors
    /// As for [`Self::build`].
    pub fn of_scene(scene: &Scene) -> Result<Self> {
        let is_movable = scene.movable_triangles();
        let (movable, fixed): (Vec<u32>, Vec<u32>) =
            (0..scene.triangles.len() as u32).partition(|&triangle| is_movable[triangle as usize]);
        if movable.is_empty() || fixed.is_empty() {
            return Self::build(&scene.triangles);
        }
        let part = |triangles: &[u32]| {
            let part: Vec<Triangle> =
                triangles.iter().map(|&index| scene.triangles[index as usize]).collect();
            let Self { nodes, order, .. } = Self::build(&part)?;
            let order = order.into_iter().map(|index| triangles[index as usize]).collect();
            Ok::<_, Error>((nodes, order, bounds_of(&part)))
        };
        Self::joined(part(&fixed)?, part(&movable)?)
    }

    /// One tree of two: of their nodes, orders and bounds.
    fn joined(
        (fixed, mut order, fixed_bounds): (Vec<types::Node>, Vec<u32>, [Vec3; 2]),
        (movable, others, bounds): (Vec<types::Node>, Vec<u32>, [Vec3; 2]),
    ) -> Result<Self> {
        let first = order.len() as u32;
        order.extend(others);
        let (Some((fixed_root, fixed)), Some((movable_root, movable))) =
            (fixed.split_first(), movable.split_first())
        else {
            return Err(Error::Usage("the scene has no triangle".into()));
        };
        let moved = |node: &types::Node, nodes: u32, triangles: u32| {
            let by = UVec4::new(nodes, triangles, 0, 0);
            types::Node { children: node.children.wrapping_add(by), ..*node }
        };
        // Both roots stand before the other nodes.
        let fixed_by = (MOVABLE_ROOT, 0);
        let movable_by = (MOVABLE_ROOT + fixed.len() as u32, first);
        let mut nodes = vec![
            root_of([fixed_bounds, bounds]),
            moved(fixed_root, fixed_by.0, fixed_by.1),
            moved(movable_root, movable_by.0, movable_by.1),
        ];
        nodes.extend(fixed.iter().map(|node| moved(node, fixed_by.0, fixed_by.1)));
        nodes.extend(movable.iter().map(|node| moved(node, movable_by.0, movable_by.1)));
        check_size(nodes.len(), depth(&nodes))?;
        Ok(Self { nodes, order, movable: Some(Movable { first, bounds }) })
    }

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
        Ok(Self { nodes, order: tree.primitive_indices, movable: None })
    }
}

fn bounds_of(triangles: &[Triangle]) -> [Vec3; 2] {
    let corners = triangles.iter().flat_map(|triangle| triangle.positions);
    corners
        .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], corner| [low.min(corner), high.max(corner)])
}

/// The node whose two children, at [`STATIC_ROOT`] and [`MOVABLE_ROOT`], have these bounds. Planes
/// are whole steps of a power of two from the low corner, a byte each, and no closer than the
/// bounds. [Ylitie §3.1]
fn root_of(children: [[Vec3; 2]; 2]) -> types::Node {
    /// A child in slot s that is a node: its kind, and 24 + s.
    const INNER: u32 = 1 << 5 | 24;
    let low = children[0][0].min(children[1][0]);
    let high = children[0][1].max(children[1][1]);
    let exponents = (high - low).max(Vec3::splat(1e-20)).to_array().map(|extent| {
        let step = (f64::from(extent) / 255.0).log2().ceil() as i32;
        (step + 127).clamp(1, 254) as u32
    });
    let mut planes = [[0; 2]; 3];
    for (axis, [lows, highs]) in planes.iter_mut().enumerate() {
        let step = 2f64.powi(exponents[axis] as i32 - 127);
        let steps = |plane: f32| (f64::from(plane) - f64::from(low[axis])) / step;
        for (slot, [child_low, child_high]) in children.iter().enumerate() {
            *lows |= (steps(child_low[axis]).floor().clamp(0.0, 255.0) as u32) << (8 * slot);
            *highs |= (steps(child_high[axis]).ceil().clamp(0.0, 255.0) as u32) << (8 * slot);
        }
    }
    let [x, y, z] = exponents;
    let [x_planes, y_planes, z_planes] = planes.map(|[lows, highs]| UVec4::new(lows, 0, highs, 0));
    types::Node {
        frame: UVec4::new(
            low.x.to_bits(),
            low.y.to_bits(),
            low.z.to_bits(),
            0b11 << 24 | z << 16 | y << 8 | x,
        ),
        children: UVec4::new(STATIC_ROOT, 0, INNER | (INNER + 1) << 8, 0),
        x_planes,
        y_planes,
        z_planes,
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
    use crate::scene::host_bvh::HostBvh;
    use crate::scene::shapes;

    /// A closed box with a smaller one in it that can move.
    fn scene() -> Scene {
        let mut scene = shapes::closed_box(Vec3::new(3.0, 2.0, 4.0), 0.5);
        let small = shapes::closed_box(Vec3::new(1.2, 0.9, 1.6), 0.5).triangles;
        let place = Vec3::new(0.7, -0.5, 0.2);
        scene.triangles.extend(small.into_iter().map(|triangle| Triangle {
            positions: triangle.positions.map(|corner| corner + place),
            object: 1,
            ..triangle
        }));
        scene.objects = ["large", "small"].map(str::to_owned).to_vec();
        scene.model_objects = vec![0..1, 1..2];
        scene.model_is_movable = vec![false, true];
        scene
    }

    #[test]
    fn two_trees_hold_what_one_does() {
        let trees = [Bvh::of_scene(&scene()).unwrap(), Bvh::build(&scene().triangles).unwrap()];
        let movable = trees[0].movable.unwrap();
        assert_eq!((movable.first, trees[1].movable), (12, None));
        assert!(trees[0].order[..12].iter().all(|&triangle| triangle < 12));
        let hosts = trees.each_ref().map(|bvh| {
            let mut scene = scene();
            scene.reorder(&bvh.order);
            HostBvh::new(bvh, &scene)
        });
        let mut small = 0;
        for i in 0..4000 {
            let random = |k: u32| (f64::from(i) * f64::from(1 + k).sqrt().fract()).fract() as f32 - 0.5;
            let origin = Vec3::new(2.9 * random(1), 1.9 * random(2), 3.9 * random(4));
            let direction = Vec3::new(random(5), random(6), random(9));
            let [two, one] = [0, 1].map(|tree: usize| {
                let (t, triangle) = hosts[tree].closest(origin, direction).unwrap();
                (t.to_bits(), trees[tree].order[triangle as usize])
            });
            assert_eq!(two, one, "ray {i}");
            small += u32::from(two.1 >= 12);
        }
        assert!((400..3600).contains(&small), "{small} of 4000 rays meet the small box");
    }

    #[test]
    fn the_root_encloses_both_trees() {
        let [a, b] =
            [[Vec3::new(-7.3, 0.0, 2.0), Vec3::new(-1.1, 0.0, 1e4)], [Vec3::ZERO, Vec3::new(0.3, 1e-3, 9.0)]];
        let root = root_of([a, b]);
        let exponents = root.frame.w.to_le_bytes();
        for (slot, bounds) in [a, b].iter().enumerate() {
            for (axis, planes) in [root.x_planes, root.y_planes, root.z_planes].iter().enumerate() {
                let step = f32::from_bits(u32::from(exponents[axis]) << 23);
                let plane = |word: u32| root.origin()[axis] + step * f32::from(word.to_le_bytes()[slot]);
                let [low, high] = [plane(planes.x), plane(planes.z)];
                assert!(low <= bounds[0][axis] && high >= bounds[1][axis], "{low} to {high}");
                assert!(low > bounds[0][axis] - 2.0 * step && high < bounds[1][axis] + 2.0 * step);
            }
        }
    }

    #[test]
    fn trees_that_rays_cannot_walk_are_refused() {
        assert!(check_size(MAX_NODES, STACK_SIZE).is_ok());
        let message = |nodes, depth| check_size(nodes, depth).unwrap_err().to_string();
        assert!(message(MAX_NODES + 1, 1).contains("16777217 nodes, rays walk 16777216"));
        assert!(message(1, STACK_SIZE + 1).contains("nest too deeply"));
    }
}

//! The scene on the device: the bindings of every pass that traces rays.

use crate::cpu::records::FACETS_ALIKE;
use crate::error::Result;
use crate::gpu::spirv::{HAS_CUTOUTS, HAS_PANES, HAS_REGIONS};
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::passes::{EmissionBuffers, TextureBuffers, loop_limit};
use crate::scene::bvh::Movable;
use crate::scene::{Material, Scene, bvh::Bvh, mesh_edges::Mesh, panes, silhouettes};
use crate::types::{self, EDITABLE, MAY_BE_GLOSSY, MeshEdge};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::sync::Arc;

/// Immutable geometry and the material table. Triangles and surfaces are in BVH leaf order.
/// If one of the lists of nodes, triangles and surfaces exceeds a binding, all three are
/// behind addresses ([`Buffer::address_of`]).
pub struct SceneBuffers {
    /// `Node`s, the root first; bound as texels.
    pub nodes: Buffer,
    /// Corners of each triangle, then the opacity micromaps; bound as texels.
    pub triangles: Buffer,
    /// Normals, material and sides of each triangle.
    pub surfaces: Buffer,
    /// Edges at which a pixel may show two surfaces, and their number; zero if they are not known.
    pub mesh_edges: Buffer,
    pub mesh_edge_count: u32,
    /// `SilhouetteEdge`s. `None`: they are not known.
    pub silhouette_edges: Option<Buffer>,
    /// `Reflectance` of each material.
    pub materials: Buffer,
    /// Images of the materials' diffuse albedo.
    pub textures: TextureBuffers,
    /// The part of the tree with models that can move.
    pub movable: Option<Movable>,
    /// Lights of one colour each that stand for a light: 3 if panes have colours, else 1.
    pub light_channels: u32,
    /// Light that surfaces and the sky send to a viewer.
    pub emission: EmissionBuffers,
    /// Number of shadow rays of a frame from pixels, from fragments and from entry points, a buffer
    /// each. Kernels count them if points take common rays.
    pub ray_counts: [Buffer; 3],
    /// Host-visible flag: [`LOOP_TRUNCATED`](types::LOOP_TRUNCATED) after an invocation with
    /// truncated loops, in kernels without another way to report it.
    pub truncated_loops: Buffer,
}

impl SceneBuffers {
    /// Uploads a scene, with its triangles in the tree's order.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory) if the images are larger than the device
    /// can bind; the device lacks memory.
    pub fn new(
        context: &Arc<Context>,
        bvh: &Bvh,
        scene: &Scene,
        surfaces: &[types::Surface],
    ) -> Result<Self> {
        let Scene { texture_coordinates, materials, panes, .. } = scene;
        let (nodes, corners) = trees(bvh, scene)?;
        let longest = size_of_val(&*nodes).max(size_of_val(&*corners)).max(size_of_val(surfaces));
        // Kernels bind all three lists, or use addresses for all three.
        let is_bound = longest as u64 <= context.limits().storage_range_bytes;
        let triangles = list(context, "triangles", &corners, is_bound)?;
        let nodes = list(context, "nodes", &nodes, is_bound)?;
        let nodes = match scene.cell_sizes.regions.is_empty() {
            true => nodes,
            false => nodes.with_constant(HAS_REGIONS),
        };
        let ray_count = || Buffer::storage(context, "ray count", 16);
        Ok(Self {
            nodes: if panes.is_empty() { nodes } else { nodes.with_constant(HAS_PANES) },
            triangles: match scene.opacity.is_empty() {
                true => triangles,
                false => triangles.with_constant(HAS_CUTOUTS),
            },
            surfaces: list(context, "surfaces", surfaces, is_bound)?,
            mesh_edges: Buffer::storage(context, "mesh edges", size_of::<MeshEdge>() as u64)?,
            mesh_edge_count: 0,
            silhouette_edges: None,
            materials: Buffer::from_slice(context, "materials", &reflectances(materials))?,
            textures: TextureBuffers::new(context, texture_coordinates, materials, !panes.is_empty())?,
            emission: EmissionBuffers::new(context, materials, scene.emission.clone())?,
            movable: bvh.movable,
            light_channels: panes::light_channels(panes),
            ray_counts: [ray_count()?, ray_count()?, ray_count()?],
            truncated_loops: Buffer::host_flag(context, "truncated")?,
        })
    }

    /// Adds the edges at which a pixel may show two surfaces.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn with_mesh_edges(mut self, context: &Arc<Context>, scene: &Scene, mesh: &Mesh) -> Result<Self> {
        let edges = mesh.seen_edges(&scene.triangles, f64::from(FACETS_ALIKE));
        if let Some(list) = edge_list(context, "mesh edges", &edges)? {
            self.mesh_edges = list;
            self.mesh_edge_count = edges.len() as u32;
        }
        Ok(self)
    }

    /// Adds the edges at which shadows may end, if frames use them. Not in a scene with holes: the
    /// shadow of a hole ends where there is no edge.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn with_silhouettes(
        mut self,
        context: &Arc<Context>,
        bvh: &Bvh,
        scene: &Scene,
        mesh: &Mesh,
    ) -> Result<Self> {
        if context.tuning().finds_alike && scene.opacity.is_empty() {
            let edges = silhouettes::edges(bvh, &scene.triangles, mesh);
            self.silhouette_edges = edge_list(context, "silhouette edges", &edges)?;
        }
        Ok(self)
    }

    /// Returns an error if [`Self::truncated_loops`] is set: `name` is the kernel, and each hit
    /// takes a ray to each of `lights` lights.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory) with a hint.
    pub fn refuse_truncated_loops(&self, name: &str, lights: u32) -> Result<()> {
        loop_limit::refuse(self.truncated_loops.read_flag() == types::LOOP_TRUNCATED, name, lights)
    }
}

/// The device's lists of nodes and triangles: the scene's, then those of its panes. The words of
/// opacity micromaps follow, in whole triangles.
fn trees(bvh: &Bvh, scene: &Scene) -> Result<(Vec<types::Node>, Vec<types::Triangle>)> {
    const WORDS: usize = size_of::<types::Triangle>() / 4;
    let triangle = |positions: &[Vec3; 3]| {
        let [p0, p1, p2] = positions.map(|corner| corner.extend(0.0));
        types::Triangle { p0, p1, p2 }
    };
    let mut nodes = bvh.nodes.clone();
    let mut list: Vec<types::Triangle> =
        scene.triangles.iter().map(|found| triangle(&found.positions)).collect();
    if let (Some(first), Some(side_m)) = (list.first_mut(), scene.cell_sizes.least_side_m()) {
        first.p2.w = f32::from_bits(side_m.to_bits() >> 23 << 24);
    }
    if !scene.panes.is_empty() {
        let (pane_nodes, order) = panes::tree(&scene.panes, [nodes.len(), list.len()])?;
        let first = list.len();
        let pane = |&index: &u32| &scene.panes[index as usize];
        list.extend(order.iter().map(|index| triangle(&pane(index).positions)));
        let words: &mut [u32] = bytemuck::cast_slice_mut(&mut list);
        words[11] |= nodes.len() as u32;
        for (place, pane) in (first..).zip(order.iter().map(pane)) {
            words[WORDS * place + 11] = pane.packed_colour();
        }
        nodes.extend(pane_nodes);
    }
    let (end, micromaps) = (WORDS * list.len(), scene.opacity.words());
    list.resize(list.len() + micromaps.len().div_ceil(WORDS), Zeroable::zeroed());
    let words: &mut [u32] = bytemuck::cast_slice_mut(&mut list);
    words[end..][..micromaps.len()].copy_from_slice(micromaps);
    for (triangle, [first, level]) in scene.opacity.micromaps() {
        words[WORDS * triangle + 3] = end as u32 + first;
        words[WORDS * triangle + 7] = level;
    }
    Ok((nodes, list))
}

/// A list of edges; `None` if it is empty, or longer than a binding.
fn edge_list<T: Pod>(context: &Arc<Context>, name: &str, edges: &[T]) -> Result<Option<Buffer>> {
    let fits = size_of_val(edges) as u64 <= context.limits().storage_range_bytes;
    let list = || Buffer::from_slice(context, GrowsWith::Triangles.named(name), edges);
    (fits && !edges.is_empty()).then(list).transpose()
}

fn list<T: Pod>(context: &Arc<Context>, name: &str, items: &[T], is_bound: bool) -> Result<Buffer> {
    let name = GrowsWith::Triangles.named(name);
    if is_bound { Buffer::from_slice(context, name, items) } else { Buffer::address_of(context, name, items) }
}

/// A scene and its lights: the bindings of passes that follow paths.
#[derive(Clone, Copy)]
pub struct LitScene<'a> {
    /// Geometry and materials.
    pub buffers: &'a SceneBuffers,
    /// Table of `LightSource`s.
    pub lights: &'a Buffer,
    /// Number of lights.
    pub light_count: u32,
}

impl<'a> LitScene<'a> {
    /// The bindings of such a pass, with `own` between those of the scene and those of its images.
    pub fn bindings_and<const N: usize>(
        &self,
        own: [(&'static str, &'a Buffer); N],
    ) -> Vec<(&'static str, &'a Buffer)> {
        let scene = [
            ("Nodes", &self.buffers.nodes),
            ("Triangles", &self.buffers.triangles),
            ("Surfaces", &self.buffers.surfaces),
            ("Materials", &self.buffers.materials),
            ("Lights", self.lights),
        ];
        scene.into_iter().chain(self.buffers.textures.after(own)).collect()
    }

    /// As [`Self::bindings_and`], for a pass that sees emission.
    pub fn seen_bindings_and<const N: usize>(
        &self,
        own: [(&'static str, &'a Buffer); N],
    ) -> Vec<(&'static str, &'a Buffer)> {
        let mut bindings = self.bindings_and(own);
        bindings.extend(self.buffers.emission.bindings());
        bindings
    }
}

/// The device's material table.
pub fn reflectances(materials: &[Material]) -> Vec<types::Reflectance> {
    let reflectance = |m: &Material| types::Reflectance {
        diffuse: m.diffuse,
        exponent: m.exponent,
        specular: m.specular,
        flags: if m.editable { EDITABLE } else { 0 } | if m.may_be_glossy() { MAY_BE_GLOSSY } else { 0 },
    };
    materials.iter().map(reflectance).collect()
}

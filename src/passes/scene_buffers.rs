//! The scene on the device: what every pass that traces rays binds.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::scene::{Material, Triangle, bvh::Bvh};
use crate::types;
use glam::Vec3;
use std::sync::Arc;

/// Immutable geometry and the material table. Triangles and surfaces stand in BVH leaf order.
pub struct SceneBuffers {
    /// `Node`s, the root first.
    pub nodes: Buffer,
    /// Corners of each triangle.
    pub triangles: Buffer,
    /// Normals, material and sides of each triangle.
    pub surfaces: Buffer,
    /// `Reflectance` of each material.
    pub materials: Buffer,
}

impl SceneBuffers {
    /// Uploads a scene; `triangles` in the tree's order.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new(
        context: &Arc<Context>,
        bvh: &Bvh,
        triangles: &[Triangle],
        surfaces: &[types::Surface],
        materials: &[Material],
    ) -> Result<Self> {
        let corners: Vec<types::Triangle> = triangles
            .iter()
            .map(|t| types::Triangle { p0: t.positions[0], p1: t.positions[1], p2: t.positions[2] })
            .collect();
        Ok(Self {
            nodes: Buffer::from_slice(context, "nodes", &bvh.nodes)?,
            triangles: Buffer::from_slice(context, "triangles", &corners)?,
            surfaces: Buffer::from_slice(context, "surfaces", surfaces)?,
            materials: Buffer::from_slice(context, "materials", &reflectances(materials))?,
        })
    }
}

/// The device's material table. Specular lobes are not transported in this version and are left out of it.
pub fn reflectances(materials: &[Material]) -> Vec<types::Reflectance> {
    let reflectance = |m: &Material| types::Reflectance {
        diffuse: m.diffuse,
        exponent: m.exponent,
        specular: Vec3::ZERO,
        flags: u32::from(m.editable),
    };
    materials.iter().map(reflectance).collect()
}

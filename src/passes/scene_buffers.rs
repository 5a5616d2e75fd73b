//! The scene on the device: what every pass that traces rays binds.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::scene::{Light, LightKind, Material, Triangle, bvh::Bvh};
use crate::types::{self, EDITABLE, LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_SPOT, LightSource, MAY_SHINE};
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

/// A scene and its lights: what passes bind that follow paths.
#[derive(Clone, Copy)]
pub struct LitScene<'a> {
    /// Geometry and materials.
    pub buffers: &'a SceneBuffers,
    /// `LightSource`s.
    pub lights: &'a Buffer,
    /// How many.
    pub light_count: u32,
}

impl<'a> LitScene<'a> {
    /// The first bindings of such a pass, and then its own.
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
        scene.into_iter().chain(own).collect()
    }
}

/// The device's material table.
pub fn reflectances(materials: &[Material]) -> Vec<types::Reflectance> {
    let reflectance = |m: &Material| types::Reflectance {
        diffuse: m.diffuse,
        exponent: m.exponent,
        specular: m.specular,
        flags: if m.editable { EDITABLE } else { 0 } | if m.may_shine() { MAY_SHINE } else { 0 },
    };
    materials.iter().map(reflectance).collect()
}

/// The device's table of lights.
pub fn light_sources(lights: &[Light]) -> Vec<LightSource> {
    let source = |light: &Light| match light.kind {
        LightKind::Point { position, intensity } => LightSource::point(position, intensity),
        LightKind::Spot { position, direction, intensity, angle, penumbra } => LightSource {
            kind: LIGHT_SPOT,
            axis: direction,
            inner_angle: angle * (1.0 - penumbra),
            outer_angle: angle,
            ..LightSource::point(position, intensity)
        },
        LightKind::Area { corner, edge_u, edge_v, radiance, .. } => {
            let normal = edge_u.as_dvec3().cross(edge_v.as_dvec3());
            LightSource {
                kind: LIGHT_AREA,
                axis: normal.normalize().as_vec3(),
                area: normal.length() as f32,
                edge_u,
                edge_v,
                ..LightSource::point(corner, radiance)
            }
        }
        LightKind::Directional { direction, irradiance } => LightSource {
            kind: LIGHT_DIRECTIONAL,
            axis: direction,
            ..LightSource::point(Vec3::ZERO, irradiance)
        },
    };
    lights.iter().map(source).collect()
}

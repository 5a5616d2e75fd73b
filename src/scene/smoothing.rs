//! Normals of smoothing groups: faces of one group share them at their common vertices.

use std::collections::HashMap;

use glam::DVec3;

use super::geometry::Mesh;

/// Sums of the normals of all faces at a vertex, by vertex and smoothing group.
#[derive(Default)]
pub(super) struct Smoothing {
    sums: HashMap<(usize, u32), DVec3>,
}

impl Smoothing {
    /// Adds the faces of a mesh, whose positions are these vertices. Each face counts by its angle
    /// at the vertex, so that a polygon counts the same however it is divided.
    pub(super) fn add(&mut self, group: u32, vertices: &[usize], mesh: &Mesh) {
        for corners in mesh.indices.chunks_exact(3) {
            let corners = [corners[0], corners[1], corners[2]].map(|index| index as usize);
            let [a, b, c] = corners.map(|corner| mesh.positions[corner]);
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            for (corner, [before, at, after]) in corners.into_iter().zip([[c, a, b], [a, b, c], [b, c, a]]) {
                let angle = (before - at).angle_between(after - at);
                *self.sums.entry((vertices[corner], group)).or_default() += angle * normal;
            }
        }
    }

    /// The normals at vertices of a group, not unit. Zero where all faces are without area.
    pub(super) fn normals(&self, group: u32, vertices: &[usize]) -> Vec<DVec3> {
        vertices.iter().map(|&vertex| self.sums.get(&(vertex, group)).copied().unwrap_or_default()).collect()
    }
}

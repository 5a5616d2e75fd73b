//! A model under construction: parts placed in the world, sorted by material.

use glam::{DAffine3, DMat3, DVec3};

use super::solid::{Part, Solid};

/// Corners lie on a lattice of this many points a metre. It is exact in f32 within 64 m, so that
/// shared corners stay shared, and finer than any part. It also hides differences in the last bits
/// of a sine.
const LATTICE: f64 = 262_144.0;

/// A material of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Finish(usize);

/// Indexed triangles of one diffuse material.
#[derive(Debug)]
pub struct Mesh {
    /// Name of the material.
    pub material: &'static str,
    /// Its diffuse albedo, linear Rec.709.
    pub diffuse: [f32; 3],
    /// Positions of the corners, metres.
    pub positions: Vec<DVec3>,
    /// Unit normals, one per position.
    pub normals: Vec<DVec3>,
    /// Three per triangle.
    pub indices: Vec<u32>,
}

/// A model, one mesh for each material.
#[derive(Debug, Default)]
pub struct Model {
    /// In the order in which the generator names the materials.
    pub meshes: Vec<Mesh>,
}

impl Model {
    /// A diffuse material of that albedo, linear Rec.709.
    pub(super) fn diffuse(&mut self, material: &'static str, diffuse: [f32; 3]) -> Finish {
        let (positions, normals, indices) = Default::default();
        self.meshes.push(Mesh { material, diffuse, positions, normals, indices });
        Finish(self.meshes.len() - 1)
    }

    /// Places a part of one material.
    pub(super) fn place(&mut self, part: &Part, at: &DAffine3, finish: Finish) {
        self.place_in(part, at, &[finish]);
    }

    /// Places a part whose facets choose among several materials.
    pub(super) fn place_in(&mut self, part: &Part, at: &DAffine3, finishes: &[Finish]) {
        let normal_matrix: DMat3 = at.matrix3.inverse().transpose();
        let is_mirrored = at.matrix3.determinant() < 0.0;
        for (number, &Finish(index)) in finishes.iter().enumerate() {
            let mesh = &mut self.meshes[index];
            let mut vertices = vec![u32::MAX; part.positions.len()];
            for (facet, corners) in part.facets.iter().enumerate() {
                if part.finishes.get(facet).map_or(0, |&finish| usize::from(finish)) != number {
                    continue;
                }
                let mut corners = corners.map(|corner| {
                    let corner = corner as usize;
                    if vertices[corner] == u32::MAX {
                        vertices[corner] = mesh.positions.len() as u32;
                        let position = at.transform_point3(part.positions[corner]);
                        mesh.positions.push((position * LATTICE).round() / LATTICE);
                        mesh.normals.push((normal_matrix * part.normals[corner]).normalize());
                    }
                    vertices[corner]
                });
                if is_mirrored {
                    corners.swap(1, 2);
                }
                mesh.indices.extend(corners);
            }
        }
    }

    /// Adds a solid at its own position.
    pub(super) fn add(&mut self, solid: Solid, finish: Finish) {
        self.place(&solid.smooth(), &DAffine3::IDENTITY, finish);
    }

    /// Adds a solid of several materials at its own position.
    pub(super) fn add_in(&mut self, solid: Solid, finishes: &[Finish]) {
        self.place_in(&solid.smooth(), &DAffine3::IDENTITY, finishes);
    }

    /// Triangles so far.
    pub(super) fn triangles(&self) -> usize {
        self.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum()
    }
}

/// A translation, metres.
pub(super) fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// A rotation about the vertical through the origin, counter-clockwise from above.
pub(super) fn turn(degrees: f64) -> DAffine3 {
    DAffine3::from_rotation_y(degrees.to_radians())
}

//! Keys of a `[[model]]` that apply to any file: its transform, and a material for all faces.

use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, EulerRot};

use super::cutouts::Coverage;
use super::geometry::Mesh;
use super::material::Material;
use super::value::{COORDINATE, Kind, Node, Section, printable};
use crate::Result;

/// Range of scales, either sign.
const SCALE: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// The transform of a model: `matrix`, or else scale first, then rotation about x, y and z in this
/// order, then translation.
pub(super) fn transform(section: &Section) -> Result<DAffine3> {
    if let Some(rows) = section.matrix("matrix", COORDINATE)? {
        if let Some(key) = ["translate", "rotate", "scale"].into_iter().find(|key| section.get(key).is_some())
        {
            return Err(section.fault_at("matrix", format!("replaces `{key}`: state one of them")));
        }
        return affine(rows).map_err(|message| section.fault_at("matrix", message));
    }
    let translate = section.vector("translate", COORDINATE)?.unwrap_or_default();
    let rotate = section.vector("rotate", -360.0..=360.0)?.unwrap_or_default();
    let (least, most) = (*SCALE.start(), *SCALE.end());
    let scale = match section.get("scale") {
        Some(Node { kind: Kind::Array(_), .. }) => section.vector("scale", -most..=most)?,
        _ => section.number("scale", -most..=most)?.map(DVec3::splat),
    };
    let scale = scale.unwrap_or(DVec3::ONE);
    if scale.abs().min_element() < least {
        return Err(section.fault_at("scale", "must not be smaller than 1e-9 along any axis"));
    }
    Ok(DAffine3::from_scale_rotation_translation(scale, euler(rotate), translate))
}

/// Rotation about x, then y, then z, by these angles in degrees.
pub(super) fn euler(degrees: DVec3) -> DQuat {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

/// Fails with a reason if the matrix is no invertible transform of points.
fn affine(rows: [[f64; 4]; 4]) -> std::result::Result<DAffine3, String> {
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err("its last row must be 0, 0, 0, 1: rows are listed one after another".to_owned());
    }
    let affine = DAffine3::from_mat4(DMat4::from_cols_array_2d(&rows).transpose());
    // The Frobenius norm bounds the largest scale, and that of the inverse the smallest one.
    let norm = |matrix: DMat3| matrix.to_cols_array().into_iter().map(|x| x * x).sum::<f64>().sqrt();
    let (largest, smallest) = (norm(affine.matrix3), 1.0 / norm(affine.matrix3.inverse()));
    if affine.matrix3.determinant() == 0.0 || !SCALE.contains(&smallest) || !SCALE.contains(&largest) {
        return Err("must scale by 1e-9 to 1e9 along every axis, and not make the model flat".to_owned());
    }
    Ok(affine)
}

/// Name of a model: its own, or that of its file without the ending, or of the built-in model.
/// Objects have it if the file names none.
pub(super) fn name(section: &Section) -> Result<String> {
    if let Some(name) = section.text("name")? {
        return Ok(name.to_owned());
    }
    let file = section.text("file")?.map(|file| Path::new(file).file_stem().unwrap_or_default());
    let named = file.map(|stem| printable(&stem.to_string_lossy()));
    Ok(named.or(section.text("built_in")?.map(str::to_owned)).unwrap_or_default())
}

/// Gives all meshes the material of that name: of the model, or else a neutral one for a
/// `[[material]]` of the scene file to replace. Colours of vertices belong to the other materials
/// and are dropped. Returns whether the model has it.
pub(super) fn take_material(
    meshes: &mut [Mesh],
    (materials, coverages): (&mut Vec<Material>, &mut Vec<Coverage>),
    name: &str,
) -> bool {
    let found = materials.iter().position(|material| material.name == name);
    coverages.resize(materials.len(), Coverage::Full);
    *coverages = vec![found.map_or(Coverage::Full, |index| coverages.swap_remove(index))];
    *materials = vec![found.map_or_else(|| Material::neutral(name), |index| materials.swap_remove(index))];
    for mesh in meshes {
        mesh.material = 0;
        mesh.colours.clear();
    }
    found.is_some()
}

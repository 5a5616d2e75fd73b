//! Reads models from STL files, as text or binary: facets without materials.

use std::path::Path;

use glam::DVec3;

use super::geometry::{Mesh, too_many};
use super::limits::TRIANGLES;
use super::lines::{Lines, decode};
use super::material::Material;
use super::material_names::{NO_MATERIAL, shown};
use super::reading::Reading;
use super::value::excerpt;
use crate::{Error, Result};

/// Bytes before the facets of a binary file, the last four of which count them.
const HEADER: usize = 84;
/// Bytes of a facet: its normal, three corners, two bytes for colours.
const FACET: usize = 50;

/// Reads the contents of `path`. Normals follow from the corners, as stated ones are often zero.
///
/// Fails with file and line on corners that are not finite, and without any facet.
pub(super) fn load(reading: &mut Reading, path: &Path, bytes: Vec<u8>) -> Result<(Mesh, Material)> {
    let positions = match binary_facets(&bytes) {
        Some(facets) => {
            if facets.iter().any(|facet| facet[FACET - 2..] != [0, 0]) {
                reading.notes.add("colours of facets are passed over", || shown(path));
            }
            binary(facets).map_err(|message| Error::input(path, message))?
        }
        None => text(path, &decode(bytes).0)?,
    };
    if positions.is_empty() {
        return Err(Error::input(path, "holds no facet: an STL file, text or binary, was expected"));
    }
    let indices = (0..positions.len() as u32).collect();
    Ok((Mesh { positions, indices, ..Mesh::default() }, Material::neutral(NO_MATERIAL)))
}

/// The facets of a binary file. `None` if the length is not the one that its header states: text,
/// whose first word many binary files have, too.
fn binary_facets(bytes: &[u8]) -> Option<&[[u8; FACET]]> {
    let (header, facets) = bytes.split_at_checked(HEADER)?;
    let count = u32::from_le_bytes(*header.last_chunk()?) as usize;
    let (facets, rest) = facets.as_chunks();
    // Some programs write more behind the facets.
    let is_text = header.starts_with(b"solid") && (facets.len() != count || !rest.is_empty());
    if is_text { None } else { facets.get(..count) }
}

fn binary(facets: &[[u8; FACET]]) -> std::result::Result<Vec<DVec3>, String> {
    if facets.len() > TRIANGLES {
        return Err(too_many(facets.len()));
    }
    let mut positions = Vec::with_capacity(3 * facets.len());
    for (number, facet) in facets.iter().enumerate() {
        let numbers = facet[12..FACET - 2].as_chunks().0;
        for corner in numbers.as_chunks::<3>().0 {
            let position = DVec3::from(corner.map(|number| f64::from(f32::from_le_bytes(number))));
            if !position.is_finite() {
                return Err(format!("facet {number} has a corner that is not finite"));
            }
            positions.push(position);
        }
    }
    Ok(positions)
}

/// The corners of a text: three lines `vertex x y z` for each facet, of any number of solids.
fn text(path: &Path, text: &str) -> Result<Vec<DVec3>> {
    let mut positions = Vec::new();
    for (line, content) in Lines::new(text) {
        let mut words = content.split_whitespace();
        let keyword = words.next().unwrap_or_default();
        let fault = |message: String| Error::input_at(path, line, message);
        if keyword.eq_ignore_ascii_case("vertex") {
            let numbers = words.map_while(|word| word.parse().ok()).filter(|number: &f64| number.is_finite());
            let numbers: Vec<f64> = numbers.take(3).collect();
            let &[x, y, z] = &numbers[..] else {
                let message = format!("vertex: three finite numbers were expected: {}", excerpt(&content));
                return Err(fault(message));
            };
            positions.push(DVec3::new(x, y, z));
        } else if keyword.eq_ignore_ascii_case("endloop") && positions.len() % 3 != 0 {
            return Err(fault("endloop: a facet has three lines `vertex`".to_owned()));
        }
        if positions.len() > 3 * TRIANGLES {
            return Err(fault(too_many(positions.len() / 3)));
        }
    }
    positions.truncate(positions.len() / 3 * 3);
    Ok(positions)
}

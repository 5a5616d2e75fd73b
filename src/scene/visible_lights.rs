//! Area lights that are seen: their surface is part of the scene.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::material::Sides;
use super::objects::Objects;
use super::value::{Node, Section};
use super::{Light, LightKind, Material, Triangle, limits};
use crate::Result;

/// Adds the surface of area lights that are visible. Each becomes a light of its own material.
pub(super) fn show(
    (file, root): (&Path, &Node),
    lights: &mut [Light],
    (materials, objects): (&mut Vec<Material>, &mut Objects),
    (triangles, coordinates): (&mut Vec<Triangle>, &mut Vec<[Vec2; 3]>),
) -> Result<()> {
    let sections = Section::list(file, root, "light", limits::LIGHTS)?;
    for (section, light) in sections.iter().zip(lights) {
        let LightKind::Area { corner, edge_u, edge_v, radiance, .. } = light.kind else { continue };
        if section.flag("visible")? != Some(true) {
            continue;
        }
        let (material, object) = (materials.len() as u32, objects.add(&light.name));
        materials.push(Material {
            diffuse: Vec3::ZERO,
            emission: radiance,
            emitting_sides: Some(Sides::Front),
            ..Material::neutral(&light.name)
        });
        let normals = [edge_u.cross(edge_v).normalize(); 3];
        let [p0, p1, p2, p3] = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
        let quad =
            [[p0, p1, p2], [p0, p2, p3]].map(|positions| Triangle { positions, normals, material, object });
        triangles.extend(quad);
        if !coordinates.is_empty() {
            coordinates.extend([[Vec2::ZERO; 3]; 2]);
        }
        light.kind = LightKind::Surface { material, radiance };
    }
    Ok(())
}

//! Dependencies of stored light paths. Lights are not among them: paths are traced without lights,
//! and warnings about their positions are computed again.

use crate::cache_file::{Key, hash};
use crate::gpu::Context;
use crate::gpu::shaders::{SHADERS, Shader};
use crate::scene::{Material, Meter, Naming, Quality, Scene};
use glam::Vec3;

/// Version of the contents and of the host's algorithms, which no shader hash covers.
const CONTENTS: u32 = 11;

/// Dependencies that distinguish the entries of a folder. A new program or driver replaces the
/// entry of the old one.
pub(super) const OF_NAME: &[&str] = &["device", "geometry", "materials", "viewpoints", "settings"];

/// The key of a scene as it was given, with its triangles in their own order.
pub(super) fn key(context: &Context, scene: &Scene) -> Key {
    Key::default()
        .with("program", program(context))
        .with("device", hash(context.name().as_bytes()))
        .with("driver", hash(context.driver().as_bytes()))
        .with("geometry", geometry(scene))
        .with("materials", materials(&scene.materials))
        .with("viewpoints", viewpoints(&scene.viewpoints()))
        .with("settings", settings(scene))
}

/// Hash of the settings. Own records are a view's, and are not stored.
fn settings(scene: &Scene) -> [u64; 2] {
    let quality = Quality { record_error: 1.0, ..scene.quality.clone() };
    hash(format!("{quality:?} {:?}", scene.naming()).as_bytes())
}

fn program(context: &Context) -> [u64; 2] {
    let mut text = format!("{} {CONTENTS}", env!("CARGO_PKG_VERSION"));
    for Shader { stem, .. } in SHADERS {
        let shader = context.shader(stem);
        text += &format!(" {stem} {} {:x?}", shader.source_hash, hash(&shader.bytes));
    }
    hash(text.as_bytes())
}

fn push(words: &mut Vec<u32>, v: Vec3) {
    words.extend(v.to_array().map(f32::to_bits));
}

/// Hash of what light paths depend on, beside triangles, viewpoints and program.
pub(in crate::renderer) fn surroundings(scene: &Scene) -> [u64; 2] {
    let (low, high) = scene.bounds();
    let mut words = Vec::new();
    push(&mut words, low);
    push(&mut words, high);
    push_others(&mut words, scene);
    let parts = [hash(bytemuck::cast_slice(&words)), materials(&scene.materials), settings(scene)];
    hash(bytemuck::cast_slice(&parts))
}

fn geometry(scene: &Scene) -> [u64; 2] {
    let mut words = Vec::new();
    for triangle in &scene.triangles {
        triangle.positions.iter().chain(&triangle.normals).for_each(|&v| push(&mut words, v));
        words.push(triangle.material);
    }
    if scene.naming() == Naming::Place {
        // Models that can move have a tree of their own.
        words.extend(scene.movable_triangles().into_iter().map(u32::from));
    }
    push_others(&mut words, scene);
    hash(bytemuck::cast_slice(&words))
}

/// All geometry but triangles.
fn push_others(words: &mut Vec<u32>, scene: &Scene) {
    for corner in scene.texture_coordinates.iter().flatten() {
        words.extend(corner.to_array().map(f32::to_bits));
    }
    words.extend(scene.opacity.contents());
    words.push(scene.emission.sky_side());
    for region in &scene.cell_sizes.regions {
        [region.low, region.high].into_iter().for_each(|v| push(words, v));
        words.push(region.halvings);
    }
    words.push((scene.cell_sizes.reach_m as f32).to_bits());
    for pane in &scene.panes {
        pane.positions.iter().chain([&pane.colour]).for_each(|&v| push(words, v));
    }
    for (position, normal) in scene.meters.iter().flat_map(Meter::points) {
        [position, normal].into_iter().for_each(|v| push(words, v));
    }
}

/// Hash of all properties but the names: each affects light paths, at once or after an edit.
fn materials(materials: &[Material]) -> [u64; 2] {
    let mut words = Vec::new();
    for material in materials {
        // Light paths do not depend on emission.
        let Material { diffuse, texture, specular, exponent, editable, .. } = material;
        push(&mut words, *diffuse);
        push(&mut words, *specular);
        words.extend([exponent.to_bits(), u32::from(*editable)]);
        let Some(texture) = texture else {
            words.push(0);
            continue;
        };
        words.extend([1, texture.wrapping()]);
        words.extend(texture.image.size);
        words.extend(texture.image.codes.iter().flatten().map(|&code| u32::from(code)));
    }
    hash(bytemuck::cast_slice(&words))
}

fn viewpoints(points: &[Vec3]) -> [u64; 2] {
    // The order of the points makes no difference.
    let mut words: Vec<[u32; 3]> = points.iter().map(|point| point.to_array().map(f32::to_bits)).collect();
    words.sort_unstable();
    hash(bytemuck::cast_slice(&words))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::scene::{Image, OpacityMaps, Texture};
    use glam::Vec2;
    use std::sync::Arc;

    fn material() -> Material {
        let image = Arc::new(Image { size: [1, 2], codes: vec![[1, 2, 3], [4, 5, 6]] });
        Material {
            name: "paper".to_owned(),
            diffuse: Vec3::splat(0.5),
            texture: Some(Texture { image, is_clamped: false, is_atlas: false }),
            specular: Vec3::splat(0.2),
            exponent: 20.0,
            editable: false,
            emission: Vec3::ZERO,
            emitting_sides: None,
        }
    }

    #[test]
    fn every_property_of_a_material_but_its_name_counts() {
        let hash = |change: &dyn Fn(&mut Material)| {
            let mut material = material();
            change(&mut material);
            materials(&[material])
        };
        let same = hash(&|_| {});
        assert_eq!(same, hash(&|material| material.name.clear()));
        let changes: [&dyn Fn(&mut Material); 8] = [
            &|material| material.diffuse.x = 0.4,
            &|material| material.specular.z = 0.1,
            &|material| material.exponent = 21.0,
            &|material| material.editable = true,
            &|material| material.texture = None,
            &|material| material.texture.as_mut().unwrap().is_clamped = true,
            &|material| material.texture.as_mut().unwrap().is_atlas = true,
            &|material| {
                let image = Arc::new(Image { size: [2, 1], codes: vec![[1, 2, 3], [4, 5, 6]] });
                material.texture.as_mut().unwrap().image = image;
            },
        ];
        for (number, change) in changes.into_iter().enumerate() {
            assert_ne!(same, hash(change), "change {number}");
        }
        assert_ne!(materials(&[material()]), materials(&[material(), material()]));
    }

    #[test]
    fn every_property_of_a_triangle_counts() {
        let hash = |change: &dyn Fn(&mut Scene)| {
            let mut scene = crate::scene::shapes::closed_box(Vec3::ONE, 0.5);
            scene.texture_coordinates = vec![[Vec2::ZERO; 3]; scene.triangles.len()];
            change(&mut scene);
            geometry(&scene)
        };
        let same = hash(&|_| {});
        let changes: [&dyn Fn(&mut Scene); 7] = [
            &|scene| scene.triangles[3].positions[1].x += 0.1,
            &|scene| scene.triangles[3].normals[2].y += 0.1,
            &|scene| scene.triangles[3].material = 1,
            &|scene| scene.texture_coordinates[3][0].x = 0.5,
            &|scene| scene.triangles.swap(3, 5),
            &|scene| scene.opacity = opacity(scene, 3, 0.5),
            &|scene| scene.opacity = opacity(scene, 4, 0.5),
        ];
        for (number, change) in changes.into_iter().enumerate() {
            assert_ne!(same, hash(change), "change {number}");
        }
        let cut =
            |triangle, limit| hash(&|scene: &mut Scene| scene.opacity = opacity(scene, triangle, limit));
        assert!(cut(3, 0.5) != cut(4, 0.5) && cut(3, 0.5) != cut(3, 0.6));
    }

    /// Holes at one corner of one triangle.
    fn opacity(scene: &Scene, triangle: usize, limit: f64) -> OpacityMaps {
        let levels: Vec<u32> =
            (0..scene.triangles.len()).map(|index| 4 * u32::from(index == triangle)).collect();
        OpacityMaps::new(&levels, |_, centre| centre.x > limit)
    }

    #[test]
    fn every_viewpoint_counts_and_their_order_does_not() {
        let [a, b, c] = [Vec3::X, Vec3::Y, Vec3::Z];
        assert_eq!(viewpoints(&[a, b]), viewpoints(&[b, a]));
        assert_ne!(viewpoints(&[a, b]), viewpoints(&[a, c]));
        assert_ne!(viewpoints(&[a, b]), viewpoints(&[a]));
    }
}

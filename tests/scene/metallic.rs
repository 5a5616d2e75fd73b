//! Metalness and roughness of glTF and MTL files as a Phong lobe, beside Disney's BRDF. Mitsuba 3
//! has that in `principled` [Burley 2012]: GGX of α = roughness², separable Smith shadowing,
//! Fresnel of index 1.5, Schlick's for metals, and a diffuse lobe with retro-reflection.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use lightpaths::cpu::brdf::{brdf, luminance};
use lightpaths::scene::LoadOptions;
use lightpaths::scene::material::Material;
use lightpaths::types::Reflectance;
use serde_json::json;

use super::gltf::{load_text, square};
use super::{SQUARE, close, load_files};

const BASE: [f64; 3] = [0.8, 0.5, 0.2];

struct Disney {
    metal: f64,
    roughness: f64,
}

impl Disney {
    /// The microfacet lobe, 1/sr.
    fn specular(&self, incident: DVec3, outgoing: DVec3) -> DVec3 {
        let half = (incident + outgoing).normalize();
        let a2 = self.roughness.powi(4);
        let distribution = a2 / (PI * ((a2 - 1.0) * half.z * half.z + 1.0).powi(2));
        let shadowing = |way: DVec3| 2.0 * way.z / (way.z + (a2 + (1.0 - a2) * way.z * way.z).sqrt());
        let cosine = incident.dot(half);
        let schlick = DVec3::from(BASE).lerp(DVec3::ONE, (1.0 - cosine).powi(5));
        let fresnel = self.metal * schlick + (1.0 - self.metal) * dielectric(cosine);
        fresnel * distribution * shadowing(incident) * shadowing(outgoing) / (4.0 * incident.z * outgoing.z)
    }

    /// The diffuse lobe, 1/sr.
    fn diffuse(&self, incident: DVec3, outgoing: DVec3) -> DVec3 {
        let half = (incident + outgoing).normalize();
        let [i, o] = [incident, outgoing].map(|way| (1.0 - way.z).powi(5));
        let retro = 2.0 * self.roughness * outgoing.dot(half).powi(2);
        let lobe = (1.0 - 0.5 * i) * (1.0 - 0.5 * o) + retro * (i + o + i * o * (retro - 1.0));
        (1.0 - self.metal) * lobe / PI * DVec3::from(BASE)
    }
}

/// Fresnel's reflectance for an index of 1.5.
fn dielectric(cosine: f64) -> f64 {
    const INDEX: f64 = 1.5;
    let inner = (1.0 - (1.0 - cosine * cosine) / (INDEX * INDEX)).sqrt();
    let parallel = (INDEX * cosine - inner) / (INDEX * cosine + inner);
    let perpendicular = (cosine - INDEX * inner) / (cosine + INDEX * inner);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

fn way(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

/// Luminance of the directional albedo: the midpoint rule over equal projected solid angles.
fn albedo(reflected: impl Fn(DVec3) -> DVec3) -> f64 {
    const STEPS: [u32; 2] = [500, 500];
    let mut sum = DVec3::ZERO;
    for ring in 0..STEPS[0] {
        let radius = ((f64::from(ring) + 0.5) / f64::from(STEPS[0])).sqrt();
        for step in 0..STEPS[1] {
            let (sin, cos) = (TAU * (f64::from(step) + 0.5) / f64::from(STEPS[1])).sin_cos();
            sum += reflected(DVec3::new(radius * cos, radius * sin, (1.0 - radius * radius).sqrt()));
        }
    }
    luminance((sum * PI / f64::from(STEPS[0] * STEPS[1])).as_vec3())
}

/// Angle off the normal, degrees, where a lobe that is lit along the normal falls to half of its
/// peak. Returns 90 if the lobe stays above.
fn half_width(lobe: impl Fn(DVec3) -> DVec3) -> f64 {
    let peak = lobe(DVec3::Z).y;
    (1..900)
        .map(|tenth| 0.1 * f64::from(tenth))
        .find(|&angle| lobe(way(angle)).y < 0.5 * peak)
        .unwrap_or(90.0)
}

fn of_gltf(metal: f64, roughness: f64) -> Material {
    let mut file = square();
    let colour = [BASE[0], BASE[1], BASE[2], 1.0];
    let surface = json!({ "baseColorFactor": colour, "metallicFactor": metal, "roughnessFactor": roughness });
    file.root["materials"] = json!([{ "name": "a", "pbrMetallicRoughness": surface }]);
    file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
    load_text(&file.text()).unwrap().materials.swap_remove(0)
}

/// Metalness, roughness, then Disney's and our albedos at 0°, 30° and 60°, and both half widths.
type Row = (f64, f64, [f64; 3], [f64; 3], [f64; 2]);

const TABLE: [Row; 10] = [
    (0.0, 0.2, [0.58, 0.58, 0.62], [0.56, 0.56, 0.54], [3.0, 4.0]),
    (0.0, 0.4, [0.58, 0.58, 0.62], [0.56, 0.56, 0.54], [12.0, 15.0]),
    (0.0, 0.6, [0.58, 0.58, 0.61], [0.56, 0.56, 0.56], [33.0, 90.0]),
    (0.0, 0.8, [0.58, 0.58, 0.60], [0.56, 0.56, 0.56], [90.0, 90.0]),
    (0.0, 1.0, [0.57, 0.57, 0.59], [0.56, 0.56, 0.56], [90.0, 90.0]),
    (1.0, 0.2, [0.54, 0.54, 0.55], [0.54, 0.47, 0.27], [3.0, 4.0]),
    (1.0, 0.4, [0.52, 0.52, 0.52], [0.54, 0.47, 0.27], [12.0, 15.0]),
    (1.0, 0.6, [0.45, 0.44, 0.43], [0.50, 0.44, 0.27], [33.0, 36.0]),
    (1.0, 0.8, [0.30, 0.30, 0.33], [0.31, 0.31, 0.31], [90.0, 90.0]),
    (1.0, 1.0, [0.17, 0.18, 0.22], [0.19, 0.19, 0.19], [90.0, 90.0]),
];

/// `docs/files.md` prints this table.
#[test]
fn albedos_and_widths_of_lobes_beside_disneys() {
    let mut is_same = true;
    for (metal, roughness, disney, ours, widths) in TABLE {
        let reference = Disney { metal, roughness };
        let Material { diffuse, specular, exponent, .. } = of_gltf(metal, roughness);
        let material = Reflectance { diffuse, exponent, specular, flags: 0 };
        let found_disney = [0.0, 30.0, 60.0].map(|angle| {
            let incident = way(angle);
            albedo(|out| reference.specular(incident, out) + reference.diffuse(incident, out))
        });
        let found_ours =
            [0.0, 30.0, 60.0].map(|angle| albedo(|out| brdf(&material, DVec3::Z, out, way(angle))));
        let lobe = Reflectance { diffuse: Vec3::ZERO, ..material };
        let ours_width = half_width(|out| brdf(&lobe, DVec3::Z, out, DVec3::Z));
        let found_widths = [half_width(|out| reference.specular(DVec3::Z, out)), ours_width];
        let pairs = found_disney.iter().zip(&disney).chain(found_ours.iter().zip(&ours));
        is_same &= pairs.into_iter().all(|(found, stated)| (found - stated).abs() < 0.006);
        is_same &= found_widths.iter().zip(&widths).all(|(found, stated)| (found - stated).abs() < 0.6);
        println!("{metal} {roughness} {found_disney:.2?} {found_ours:.2?} {found_widths:.0?}");
    }
    assert!(is_same, "the table is another: see above");
}

fn of_mtl(lines: &str) -> (Material, Vec<String>) {
    let (obj, mtl) = (format!("mtllib m.mtl\nusemtl a\n{SQUARE}"), format!("newmtl a\n{lines}"));
    let files: [(&str, &[u8]); 2] = [("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
    let mut scene = load_files(&files, "m.obj", &LoadOptions::default()).unwrap();
    scene.warnings.retain(|warning| !warning.contains(" has no "));
    (scene.materials.swap_remove(0), scene.warnings)
}

#[test]
fn roughness_and_metalness_of_mtl_files_count_as_in_gltf() {
    let base = "Kd 0.8 0.5 0.2\n";
    for (lines, metal, roughness) in [
        ("Pr 0.2\nPm 1\n", 1.0, 0.2),
        ("Pr 0.6\nPm 0.5\n", 0.5, 0.6),
        ("Pr 0.4\n", 0.0, 0.4),
        ("Pm 1\n", 1.0, 1.0),
        ("Pm 7\nPr -1\nPr\n", 1.0, 0.0),
    ] {
        let (found, expected) = (of_mtl(&format!("{base}{lines}")).0, of_gltf(metal, roughness));
        assert!(close(found.diffuse, expected.diffuse), "{lines}: {found:?}, {expected:?}");
        assert!(close(found.specular, expected.specular), "{lines}: {found:?}, {expected:?}");
        assert_eq!(found.exponent, expected.exponent, "{lines}");
    }
    // `Ks` and `Ns` lose, and a warning mentions that if they state another highlight.
    let said = "material \"a\": `Ks` and `Ns` are passed over: `Pr` and `Pm` state another highlight";
    for (lines, is_said) in [
        ("Pr 0.4\n", false),
        ("Pr 0.4\nKs 0 0 0\nNs 500\n", false),
        ("Pr 0.4\nKs 0.04\nNs 19\n", false),
        ("Pr 0.4\nKs 0.04\nNs 900\n", true),
        ("Pr 0.4\nKs 0.5\nNs 19\n", true),
    ] {
        let (found, warnings) = of_mtl(&format!("{base}{lines}"));
        assert!(close(found.specular, Vec3::splat(0.04)), "{lines}: {found:?}");
        let is_found = warnings.iter().any(|warning| warning.ends_with(said));
        assert_eq!((is_found, warnings.len()), (is_said, usize::from(is_said)), "{lines}: {warnings:?}");
    }
}

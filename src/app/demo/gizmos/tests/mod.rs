mod drags;

use glam::{Vec2, Vec3};

use super::*;
use crate::cpu::sampling::sample_3d;
use crate::scene::Camera;

const SIZE: Vec2 = Vec2::new(1200.0, 800.0);
const AREA: u32 = 2;
const SPOT: u32 = 1;

/// A direction, a light and a view of it.
fn case(seed: u32, form: u32) -> (Projection, LightKind, Vec3) {
    let way = |k: u32| (2.0 * sample_3d(seed, k) - 1.0).normalize_or(Vec3::X);
    let middle = 10.0 * sample_3d(seed, 100) - 5.0;
    let sample = sample_3d(seed, 101);
    let position = middle + way(102) * (0.5 + 30.0 * sample.x * sample.x);
    let forward = (middle - position).normalize();
    let camera = Camera {
        name: "camera".into(),
        position,
        target: middle + 0.15 * middle.distance(position) * way(103).reject_from(forward),
        up: forward.any_orthonormal_vector() + 0.3 * forward,
        fov_y_degrees: 20.0 + 70.0 * sample.y,
        size: [1200, 800],
    };
    let (direction, color) = (way(104), Vec3::new(1.0, 2.0, 3.0));
    let kind = match form {
        0 => LightKind::Point { position: middle, intensity: color },
        SPOT => LightKind::Spot {
            position: middle,
            direction,
            intensity: color,
            angle: 0.05 + 1.5 * sample.z,
            penumbra: 0.3,
        },
        AREA => {
            // Edges are relative to half the picture's height at that distance.
            let size = middle.distance(position) * (0.5 * camera.fov_y_degrees).to_radians().tan();
            let u = size * direction * (0.2 + 0.5 * sample.z);
            let v = size * (0.6 * direction.any_orthonormal_vector() + 0.3 * sample.y * direction);
            LightKind::Area { corner: middle, edge_u: u, edge_v: v, radiance: color, samples: 7 }
        }
        _ => LightKind::Directional { direction, irradiance: color },
    };
    (Projection::new(&camera, Vec2::new(20.0, 40.0), SIZE), kind, middle)
}

fn seen(projection: &Projection, point: Vec3) -> Vec2 {
    projection.project(point).unwrap().0
}

fn pointer(seed: u32) -> Vec2 {
    Vec2::new(20.0, 40.0) + SIZE * sample_3d(seed, 200).truncate()
}

/// Screen position of a part's disc.
fn disc(projection: &Projection, kind: &LightKind, anchor: Vec3, requested: Part) -> Option<Vec2> {
    let gizmo = gizmos(projection, kind, anchor).into_iter().find(|gizmo| gizmo.part == requested)?;
    gizmo.shapes.iter().find_map(|shape| match shape {
        Shape::Disc { centre, .. } => Some(*centre),
        _ => None,
    })
}

fn parts() -> Vec<Part> {
    let each = Axis::ALL.into_iter().flat_map(|axis| [Part::Axis(axis), Part::Plane(axis)]);
    each.chain([Part::Middle, Part::Aim, Part::Cone, Part::EdgeU, Part::EdgeV]).collect()
}

#[test]
fn what_is_shown_is_hit() {
    for seed in 0..300 {
        let (projection, kind, anchor) = case(seed, seed % 4);
        let gizmos = gizmos(&projection, &kind, anchor);
        for gizmo in &gizmos {
            for shape in &gizmo.shapes {
                let place = match shape {
                    Shape::Disc { centre, .. } => *centre,
                    Shape::Line(points) => points[0].midpoint(points[1]),
                    Shape::Fill(points) => points.iter().sum::<Vec2>() / points.len() as f32,
                    Shape::Guide(_) => continue,
                };
                // Other gizmos may cover it; alone it is found.
                assert!(hit(&gizmos, place, 5.0).is_some());
                assert_eq!(hit(std::slice::from_ref(gizmo), place, 5.0), Some(gizmo.part));
                assert_eq!(hit(std::slice::from_ref(gizmo), place + 2000.0, 5.0), None);
            }
        }
        if let Some(knob) = disc(&projection, &kind, anchor, Part::Cone) {
            assert_eq!(hit(&gizmos, knob, 5.0), Some(Part::Cone));
        }
    }
}

#[test]
fn what_points_at_the_viewer_is_hidden() {
    let mut camera = Camera {
        name: "camera".into(),
        position: Vec3::new(0.1, 0.2, 5.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        fov_y_degrees: 40.0,
        size: [1200, 800],
    };
    let kind = LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
    let shown = |camera: &Camera| -> Vec<Part> {
        let gizmos = gizmos(&Projection::new(camera, Vec2::ZERO, SIZE), &kind, Vec3::ZERO);
        gizmos.iter().map(|gizmo| gizmo.part).collect()
    };
    use Axis::{X, Y, Z};
    assert_eq!(shown(&camera), [Part::Plane(Z), Part::Axis(X), Part::Axis(Y), Part::Middle]);
    let projection = Projection::new(&camera, Vec2::ZERO, SIZE);
    let shown_at = gizmos(&projection, &kind, Vec3::ZERO);
    assert_eq!(hit(&shown_at, SIZE / 2.0 + Vec2::new(50.0, 1.0), 4.0), Some(Part::Axis(X)));
    assert_eq!(hit(&shown_at, SIZE / 2.0 - Vec2::new(0.0, 50.0), 4.0), Some(Part::Axis(Y)));
    assert_eq!(hit(&shown_at, SIZE / 2.0 + Vec2::new(30.0, -30.0), 4.0), Some(Part::Plane(Z)));
    assert_eq!(hit(&shown_at, SIZE / 2.0 + 3.0, 4.0), Some(Part::Middle));
    camera.position = Vec3::splat(3.0);
    assert_eq!(shown(&camera).len(), 7);
    camera.target = Vec3::splat(6.0);
    assert_eq!(shown(&camera), []);
    // A part behind the camera does not move.
    let projection = Projection::new(&camera, Vec2::ZERO, SIZE);
    for part in parts() {
        for kind in [kind, case(1, SPOT).1.moved_to(Vec3::ZERO)] {
            let drag = Drag::begin(&projection, &kind, part, Vec3::ZERO, SIZE / 2.0);
            assert_eq!(drag.to(&projection, SIZE / 3.0, None), kind);
        }
    }
    // In a small picture no gizmo reaches behind the camera.
    camera.target = Vec3::ZERO;
    let kind = LightKind::Directional { direction: Vec3::ONE.normalize(), irradiance: Vec3::ONE };
    let projection = Projection::new(&camera, Vec2::ZERO, Vec2::new(75.0, 50.0));
    assert_eq!(gizmos(&projection, &kind, Vec3::ZERO).len(), 1);
}

#[test]
fn the_smallest_under_the_pointer_is_hit() {
    let gizmo = |part, shape| Gizmo { part, axis: None, shapes: vec![shape] };
    let gizmos = [
        gizmo(Part::Middle, Shape::Disc { centre: Vec2::ZERO, radius: 9.0 }),
        gizmo(Part::Aim, Shape::Disc { centre: Vec2::new(4.0, 0.0), radius: 6.0 }),
        gizmo(Part::Cone, Shape::Guide(vec![Vec2::splat(-99.0), Vec2::splat(99.0)])),
        // Seen edge-on, without area.
        gizmo(Part::EdgeU, Shape::Fill(vec![Vec2::new(500.0, 0.0); 3])),
    ];
    let at = |x: f32| hit(&gizmos, Vec2::new(x, 0.0), 3.0);
    let expected = [None, Some(Part::Middle), Some(Part::Aim), Some(Part::Aim), None];
    assert_eq!([-12.5, -2.5, 0.0, 12.9, 13.5].map(at), expected);
    assert_eq!(hit(&gizmos, Vec2::splat(50.0), 3.0), None);
}

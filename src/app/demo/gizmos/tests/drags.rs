use super::*;
use crate::cpu::sampling::hash;
use glam::DQuat;

#[test]
fn the_middle_stays_under_the_pointer() {
    for seed in 0..300 {
        let (projection, kind, anchor) = case(seed, seed % 3);
        let (from, before) = projection.project(kind.position().unwrap()).unwrap();
        let to = pointer(seed);
        let drag = Drag::begin(&projection, &kind, Part::Middle, anchor, from);
        let (back, depth) = projection.project(drag.to(&projection, to, None).position().unwrap()).unwrap();
        assert!(back.distance(to) < 0.01, "{seed}: {back} {to}");
        assert!((depth - before).abs() < 1e-4 * before);
        // A drag that starts beside the disc stays beside it.
        let drag = Drag::begin(&projection, &kind, Part::Middle, anchor, from + 5.0);
        let back = seen(&projection, drag.to(&projection, to, None).position().unwrap());
        assert!(back.distance(to - 5.0) < 0.01);
    }
}

#[test]
fn axes_move_one_coordinate() {
    let mut count = 0;
    for seed in 0..300 {
        let (projection, kind, anchor) = case(seed, seed % 3);
        let origin = kind.position().unwrap();
        let metres = scale(&projection, origin).unwrap().1;
        for axis in Axis::ALL {
            let shown = gizmos(&projection, &kind, anchor).iter().any(|gizmo| gizmo.part == Part::Axis(axis));
            let along = origin + axis.unit() * metres * 50.0;
            let aside = Drag::begin(&projection, &kind, Part::Axis(axis), anchor, pointer(seed + 1000));
            let moved = shift(&kind, &aside.to(&projection, pointer(seed), None));
            assert!(axis.others().iter().all(|other| moved[*other as usize] == 0.0), "{moved}");
            if !shown {
                continue;
            }
            let drag = Drag::begin(&projection, &kind, Part::Axis(axis), anchor, seen(&projection, along));
            for by in [-180.0, -3.0, 20.0, 120.0] {
                let way = axis.unit() * metres * by;
                let Some((to, _)) = projection.project(along + way) else { continue };
                let moved = shift(&kind, &drag.to(&projection, to, None));
                assert!(seen(&projection, along + moved).distance(to) < 0.01, "{seed} {axis:?} {by}");
                assert!(moved.distance(way) < 1e-3 * way.length() + 1e-4 * metres, "{moved} {way}");
                count += 1;
            }
        }
    }
    assert!(count > 2500);
}

/// Movement of a light, without the rounding errors of an area's middle.
fn shift(from: &LightKind, to: &LightKind) -> Vec3 {
    let place = |kind: &LightKind| match *kind {
        LightKind::Area { corner, .. } => corner,
        _ => kind.position().unwrap(),
    };
    place(to) - place(from)
}

#[test]
fn planes_keep_the_third_coordinate() {
    for seed in 0..300 {
        let (projection, kind, anchor) = case(seed, seed % 3);
        let origin = kind.position().unwrap();
        let metres = scale(&projection, origin).unwrap().1;
        for gizmo in gizmos(&projection, &kind, anchor) {
            let Part::Plane(axis) = gizmo.part else { continue };
            let mut way = 150.0 * metres * (2.0 * sample_3d(seed, 300) - 1.0);
            way[axis as usize] = 0.0;
            let Some((to, _)) = projection.project(origin + way) else { continue };
            let drag = Drag::begin(&projection, &kind, gizmo.part, anchor, seen(&projection, origin));
            let moved = shift(&kind, &drag.to(&projection, to, None));
            assert!(moved[axis as usize] == 0.0);
            assert!(seen(&projection, origin + moved).distance(to) < 0.01);
            assert!(moved.distance(way) < 1e-3 * way.length() + 1e-4 * metres, "{moved} {way}");
        }
    }
}

#[test]
fn beyond_the_horizon_the_farthest_place_holds() {
    let camera = Camera {
        name: "camera".into(),
        position: Vec3::new(0.0, 2.0, 0.0),
        target: Vec3::new(0.0, 2.0, -1.0),
        up: Vec3::Y,
        fov_y_degrees: 60.0,
        size: [1200, 800],
    };
    let projection = Projection::new(&camera, Vec2::ZERO, SIZE);
    let origin = Vec3::new(0.3, 0.0, -4.0);
    let kind = LightKind::Point { position: origin, intensity: Vec3::ONE };
    for part in [Part::Plane(Axis::Y), Part::Axis(Axis::Z)] {
        let from = seen(&projection, origin);
        let drag = Drag::begin(&projection, &kind, part, origin, from);
        let mut last = 0.0;
        for row in 0..=600 {
            let to = Vec2::new(from.x, from.y - row as f32);
            let moved = shift(&kind, &drag.to(&projection, to, None));
            assert!(moved.z <= last + 0.5 && moved.y == 0.0, "{part:?} {row} {moved} {last}");
            assert!(moved.length() <= 100.01 * origin.distance(camera.position));
            last = moved.z;
        }
        assert!(last < -99.0 * 4.0, "{last}");
    }
}

#[test]
fn aims_stay_under_the_pointer() {
    let mut count = 0;
    for seed in 0..600 {
        let (projection, kind, anchor) = case(seed, 1 + seed % 3);
        let origin = kind.position().unwrap_or(anchor);
        let Some(from) = disc(&projection, &kind, anchor, Part::Aim) else { continue };
        let to = from + 60.0 * (2.0 * sample_3d(seed, 400).truncate() - 1.0);
        // A drag that starts beside the tip stays beside it.
        let turned =
            Drag::begin(&projection, &kind, Part::Aim, anchor, from + 4.0).to(&projection, to + 4.0, None);
        let aimed = aim(&turned).unwrap();
        assert!((aimed.length() - 1.0).abs() < 1e-6);
        if to.distance(seen(&projection, origin)) < 90.0 {
            let tip = disc(&projection, &turned, anchor, Part::Aim).unwrap();
            assert!(tip.distance(to) < 0.01, "{seed}: {tip} {to}");
            count += 1;
        }
        if let (
            LightKind::Area { edge_u: u, edge_v: v, .. },
            LightKind::Area { edge_u, edge_v, samples: 7, radiance, .. },
        ) = (kind, turned)
        {
            let same = |a: f32, b: f32| (a - b).abs() < 1e-5 * u.length().max(v.length()).powi(2);
            assert!(same(u.length_squared(), edge_u.length_squared()));
            assert!(same(v.length_squared(), edge_v.length_squared()) && same(u.dot(v), edge_u.dot(edge_v)));
            assert!(turned.position().unwrap().distance(origin) < 1e-5 && radiance.z == 3.0);
            // Along the shortest way: no rotation around its normal.
            let (before, axis) = (aim(&kind).unwrap(), aim(&kind).unwrap().cross(aimed).normalize());
            assert!((edge_u.dot(axis) - u.dot(axis)).abs() < 1e-3 * u.length(), "{before}");
        }
    }
    assert!(count > 200, "{count}");
}

#[test]
fn aims_pulled_past_the_rim_come_back_on_the_other_side() {
    for seed in 0..100 {
        let (projection, kind, anchor) = case(seed, 3);
        let (Some(from), centre) = (disc(&projection, &kind, anchor, Part::Aim), seen(&projection, anchor))
        else {
            continue;
        };
        let drag = Drag::begin(&projection, &kind, Part::Aim, anchor, from);
        let pulled = |points: f32| from + (from - centre).normalize() * points;
        let mut last = aim(&kind).unwrap();
        for step in 1..4000 {
            let aimed = aim(&drag.to(&projection, pulled(0.1 * step as f32), None)).unwrap();
            // At the rim the aim turns fastest.
            assert!(aimed.angle_between(last) < 0.1, "{seed} {step}: {aimed} {last}");
            last = aimed;
        }
        let reach = AIM * scale(&projection, anchor).unwrap().1 * aim(&kind).unwrap();
        let side = reach.dot(anchor + reach - projection.eye()).signum();
        let opposite = -side * projection.ray(pulled(399.9)).1;
        assert!(last.distance(opposite) < 1e-3, "{seed}: {last} {opposite}");
    }
}

#[test]
fn cones_open_to_the_pointer() {
    for seed in 0..200 {
        let (projection, kind, anchor) = case(seed, SPOT);
        let Some(from) = disc(&projection, &kind, anchor, Part::Cone) else { continue };
        let LightKind::Spot { position, direction, intensity, penumbra, .. } = kind else { unreachable!() };
        for degrees in [1.0f32, 17.0, 45.5, 89.0] {
            let angle = degrees.to_radians();
            let requested = LightKind::Spot { position, direction, intensity, angle, penumbra };
            let Some(to) = disc(&projection, &requested, anchor, Part::Cone) else { continue };
            let opened = Drag::begin(&projection, &kind, Part::Cone, anchor, from - 3.0).to(
                &projection,
                to - 3.0,
                None,
            );
            let LightKind::Spot { angle: opened_by, .. } = opened else { unreachable!() };
            assert!(disc(&projection, &opened, anchor, Part::Cone).unwrap().distance(to) < 0.01);
            assert!((opened_by - angle).abs() < 1e-3, "{seed}: {opened_by} {angle}");
        }
    }
}

#[test]
fn edges_end_under_the_pointer() {
    let mut count = 0;
    for seed in 0..300 {
        let (projection, kind, anchor) = case(seed, AREA);
        let LightKind::Area { corner, edge_u, edge_v, .. } = kind else { unreachable!() };
        for (part, edge) in [(Part::EdgeU, edge_u), (Part::EdgeV, edge_v)] {
            let Some(from) = disc(&projection, &kind, anchor, part) else { continue };
            let Some((to, _)) = projection.project(corner + edge * (0.2 + 1.5 * sample_3d(seed, 500).x))
            else {
                continue;
            };
            let sized = Drag::begin(&projection, &kind, part, anchor, from).to(&projection, to, None);
            let LightKind::Area { corner: same, edge_u: u, edge_v: v, .. } = sized else { unreachable!() };
            let (changed, kept) = if part == Part::EdgeU { (u, v == edge_v) } else { (v, u == edge_u) };
            assert!(kept && same == corner);
            assert!(seen(&projection, corner + changed).distance(to) < 0.01, "{seed}");
            // An edge dragged through its corner keeps a positive length.
            let Some((to, _)) = projection.project(corner - edge) else { continue };
            let LightKind::Area { edge_u: u, edge_v: v, .. } =
                Drag::begin(&projection, &kind, part, anchor, from).to(&projection, to, None)
            else {
                unreachable!()
            };
            let changed = if part == Part::EdgeU { u } else { v };
            assert!(changed.dot(edge) > 0.0 && changed.length() < 1.01e-3);
            count += 1;
        }
    }
    assert!(count > 200);
}

#[test]
fn no_pointer_breaks_a_light() {
    for seed in 0..4000 {
        let form = hash(seed) % 4;
        let (projection, kind, anchor) = case(seed, form);
        for part in parts() {
            let wild = |k: u32| match hash(seed ^ hash(k)) % 6 {
                0 => pointer(k) * 1e30,
                1 => (pointer(k) - 500.0) * 1e3,
                2 => Vec2::new(f32::NAN, 3.0),
                3 => Vec2::splat(f32::NEG_INFINITY),
                _ => 3.0 * pointer(seed ^ k) - 600.0,
            };
            let start = if seed % 7 == 0 { wild(1) } else { pointer(seed) };
            let drag = Drag::begin(&projection, &kind, part, anchor, start);
            let snap = [None, Some(0.25), Some(0.0), Some(f32::NAN)][seed as usize % 4];
            for k in 2..6 {
                let to = wild(k);
                let dragged = drag.to(&projection, to, snap);
                assert!(is_sane(&dragged), "{seed} {part:?} {start} {to}: {dragged:?}");
                assert_eq!(dragged, drag.to(&projection, to, snap));
                assert!(to.is_finite() || dragged == kind);
            }
            if start.is_finite() {
                assert_eq!(format!("{:?}", drag.to(&projection, start, Some(0.1))), format!("{kind:?}"));
            }
        }
    }
}

/// Whether a scene file can hold the light.
fn is_sane(kind: &LightKind) -> bool {
    let is_unit = |direction: Vec3| (direction.length() - 1.0).abs() < 1e-5;
    let is_near = |place: Vec3| place.is_finite() && place.length() < 1e4;
    match *kind {
        LightKind::Point { position, .. } => is_near(position),
        LightKind::Spot { position, direction, angle, .. } => {
            is_near(position) && is_unit(direction) && (0.01..=90.0).contains(&f64::from(angle).to_degrees())
        }
        LightKind::Area { corner, edge_u, edge_v, .. } => {
            let [u, v] = [edge_u.as_dvec3(), edge_v.as_dvec3()];
            is_near(corner) && is_near(edge_u) && u.cross(v).length() > 1e-2 * u.length() * v.length()
        }
        LightKind::Directional { direction, .. } => is_unit(direction),
        // They have no gizmos.
        LightKind::Surface { .. } | LightKind::Sky { .. } => true,
    }
}

#[test]
fn snaps() {
    for seed in 0..200 {
        let (projection, kind, anchor) = case(seed, seed % 4);
        let is_whole = |value: f32, step: f32| (value / step - (value / step).round()).abs() < 1e-2;
        for part in parts() {
            let drag = Drag::begin(&projection, &kind, part, anchor, pointer(seed));
            let dragged = drag.to(&projection, pointer(seed + 1), Some(0.5));
            match (dragged, part) {
                (_, Part::Middle) if seed % 4 < 3 => {
                    assert!(shift(&kind, &dragged).to_array().iter().all(|metres| is_whole(*metres, 0.5)));
                }
                (LightKind::Directional { direction, .. }, Part::Aim) => {
                    assert!(is_whole(direction.y.asin().to_degrees(), 15.0), "{direction}");
                }
                (LightKind::Spot { angle, .. }, Part::Cone) => {
                    assert!(is_whole(angle.to_degrees(), 5.0) || angle < 2e-4, "{angle}");
                }
                _ => {}
            }
        }
    }
}

#[test]
fn rings_turn_by_the_angle_that_the_pointer_goes_along_them() {
    let mut count = 0;
    for seed in 0..300 {
        let (projection, kind, _) = case(seed, seed % 3);
        let origin = kind.position().unwrap();
        let metres = scale(&projection, origin).unwrap().1;
        for gizmo in rings(&projection, origin) {
            let Part::Turn(axis) = gizmo.part else { panic!("{:?}", gizmo.part) };
            let [u, v] = axis.others().map(|axis| axis.unit());
            let at =
                |angle: f32| seen(&projection, origin + RING * metres * (angle.cos() * u + angle.sin() * v));
            assert_eq!(hit(std::slice::from_ref(&gizmo), at(0.7), TOLERANCE), Some(gizmo.part));
            for (from, to) in [(0.3_f32, 0.4_f32), (0.7, 2.5), (1.0, -1.5)] {
                let found = turn(&projection, origin, axis, [at(from), at(to)]);
                assert!((found - f64::from(to - from)).abs() < 2e-3, "{seed} {axis:?}: {found}");
                count += 1;
            }
            // From both sides, the thumb of the right hand points along the axis.
            let quarter = DQuat::from_axis_angle(axis.unit().as_dvec3(), 0.5) * u.as_dvec3();
            assert!(quarter.distance((0.5_f32.cos() * u + 0.5_f32.sin() * v).as_dvec3()) < 1e-6);
        }
    }
    assert!(count > 1500, "{count}");
}

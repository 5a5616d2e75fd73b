//! Accessibility of path vertices: each ray, and beside a wall.

use crate::common::assert_silent;
use crate::world::{Random, World};
use glam::Vec3;
use lightpaths::cpu;
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::passes::precompute::gather_rays::Hemisphere;
use lightpaths::passes::precompute::visibility::accessibility::{AccessibilityPoint, open_rays};
use lightpaths::scene::{Naming, shapes};
use std::f64::consts::PI;

const SEED: u32 = 12;

#[test]
fn open_rays_equal_the_reference() {
    let world = World::room();
    let mut random = Random::new(31);
    let cases = [(0, 4, 0.2), (1, 16, 0.2), (63, 4, 0.05), (64, 16, 0.4), (65, 1, 0.2), (2_503, 4, 0.6)];
    for ((count, rays, reach), naming) in
        cases.into_iter().flat_map(|case| [(case, Naming::Number), (case, Naming::Place)])
    {
        let names = (SEED, naming);
        let points: Vec<AccessibilityPoint> = (0..count)
            .map(|_| {
                let (position, _, side) = world.surface_point(&mut random);
                AccessibilityPoint { position, side }
            })
            .collect();
        let hemisphere = Hemisphere::new(rays);
        let found = open_rays(&world.context, &world.buffers, &points, hemisphere, reach, names).unwrap();
        assert_eq!(found.len(), count);
        let [(_, rings), (_, sectors)] = hemisphere.constants();
        let reference = |point: &AccessibilityPoint| {
            let strata = Strata { rings, sectors };
            cpu::accessibility::open_rays(
                world.geometry(),
                strata,
                (point.position, point.side),
                reach,
                names,
            )
        };
        // A ray that ends within an ulp of the reach, or passes an edge, may
        // give different results.
        let differ = points.iter().zip(&found).filter(|(point, found)| reference(point) != **found).count();
        assert!(differ * 500 <= count, "{differ} of {count} points differ");
        let open: u32 = found.iter().sum();
        assert!(
            count < 1_000 || (open > rays * count as u32 / 4 && open < rays * count as u32 * 9 / 10),
            "{open}"
        );
    }
    assert_silent(&world.context);
}

/// At distance d from an infinite wall, the fraction of cosine-distributed rays that meet it within
/// r is that of the unit disc beyond d/r.
#[test]
fn a_wall_hides_a_segment_of_the_disc() {
    let world = World::new(&shapes::closed_box(Vec3::splat(4.0), 0.5), 8);
    let names = (SEED, Naming::Number);
    let floor = world.surfaces.iter().position(|surface| surface.normal.y.abs() > 0.9).unwrap();
    let height = world.triangles[floor].positions[0].y;
    let side = 2 * floor as u32 + u32::from(world.surfaces[floor].normal.y * height > 0.0);
    let reach = 1.0_f32;
    for distance in [0.02_f32, 0.2, 0.5, 0.9, 1.1] {
        let position = Vec3::new(2.0 - distance, height, 0.1);
        let hemisphere = Hemisphere::new(4_096);
        let point = AccessibilityPoint { position, side };
        let open = open_rays(&world.context, &world.buffers, &[point], hemisphere, reach, names).unwrap()[0];
        let [(_, rings), (_, sectors)] = hemisphere.constants();
        let k = f64::from(distance / reach).min(1.0);
        let hidden = (k.acos() - k * (1.0 - k * k).sqrt()) / PI;
        let found = 1.0 - f64::from(open) / f64::from(rings * sectors);
        // The edge of the segment crosses some strata, where the jitter decides.
        assert!((found - hidden).abs() < 0.005, "{found} instead of {hidden} at {distance} m");
    }
    assert_silent(&world.context);
}

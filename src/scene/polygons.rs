//! Triangulation of polygons.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Area that triangles may miss or cover twice, as a fraction of the polygon's: corners in decimal
/// notation are not exactly planar.
const INEXACT: f64 = 1e-6;

/// Largest polygon whose ears are clipped, in corners. The time can grow with their square, up to
/// ten seconds at this limit.
const CORNERS: usize = 1 << 16;

/// Divides polygons into triangles, and counts inexact results.
#[derive(Default)]
pub(super) struct Triangulator {
    /// Polygons whose triangles do not cover their area once: they intersect themselves, are bent
    /// too far, or have more than [`CORNERS`].
    pub(super) inexact: usize,
    earcut: Earcut<f64>,
    points: Vec<[f64; 2]>,
    ears: Vec<u32>,
}

impl Triangulator {
    /// Appends the triangles of a polygon to `triangles`. Both `corners` and the result are
    /// indices of `positions`.
    ///
    /// A fan around the first corner is used if it covers the polygon exactly, as for triangles,
    /// convex polygons and many others. Otherwise ears are clipped.
    pub(super) fn divide(&mut self, positions: &[DVec3], corners: &[u32], triangles: &mut Vec<u32>) {
        if corners.len() < 4 {
            triangles.extend_from_slice(corners);
            return;
        }
        let plane = Plane::new(positions, corners);
        if plane.as_ref().is_none_or(|plane| plane.fan_is_exact(positions, corners)) {
            fan(corners, triangles);
            return;
        }
        let Some(plane) = plane.filter(|_| corners.len() <= CORNERS) else {
            self.inexact += 1;
            fan(corners, triangles);
            return;
        };
        self.points.clear();
        self.points
            .extend(corners.iter().map(|&corner| plane.project(positions[corner as usize]).to_array()));
        self.earcut.earcut_slice(&self.points, &[], &mut self.ears);
        let area = |ear: &[u32]| {
            let [a, b, c] =
                [ear[0], ear[1], ear[2]].map(|index| DVec2::from_array(self.points[index as usize]));
            (b - a).perp_dot(c - a)
        };
        let covered: f64 = self.ears.chunks_exact(3).map(|ear| area(ear).abs()).sum();
        if (covered - plane.double_area).abs() > INEXACT * plane.double_area.max(covered) {
            self.inexact += 1;
        }
        if self.ears.is_empty() {
            // Without ears, a fan matches the behaviour of other programs.
            fan(corners, triangles);
            return;
        }
        for ear in self.ears.chunks_exact(3) {
            // The triangles keep the polygon's front side.
            let ear = if area(ear) < 0.0 { [ear[0], ear[2], ear[1]] } else { [ear[0], ear[1], ear[2]] };
            triangles.extend(ear.map(|index| corners[index as usize]));
        }
    }
}

/// The triangles around the first corner.
fn fan(corners: &[u32], triangles: &mut Vec<u32>) {
    for pair in corners[1..].windows(2) {
        triangles.extend([corners[0], pair[0], pair[1]]);
    }
}

/// The plane that a polygon is projected to, in units of the polygon's size.
struct Plane {
    origin: DVec3,
    scale: f64,
    normal: DVec3,
    axes: [DVec3; 2],
    /// Twice the polygon's area along `normal`; regions of opposite winding count as negative.
    double_area: f64,
}

impl Plane {
    /// Newell's plane, whose normal is that of the polygon's vector area. If that is zero (two
    /// equal lobes), the plane of the largest triangle of the fan. `None` if all corners lie on a
    /// line, or too far apart for f64.
    fn new(positions: &[DVec3], corners: &[u32]) -> Option<Self> {
        let origin = positions[corners[0] as usize];
        let size = corners.iter().map(|&corner| (positions[corner as usize] - origin).abs().max_element());
        let scale = 1.0 / size.fold(0.0, f64::max);
        if !scale.is_normal() {
            return None;
        }
        let mut plane =
            Self { origin, scale, normal: DVec3::Z, axes: [DVec3::X, DVec3::Y], double_area: 0.0 };
        let (mut area, mut largest) = (DVec3::ZERO, DVec3::ZERO);
        let mut last = DVec3::ZERO;
        for &corner in &corners[1..] {
            let arm = plane.arm(positions[corner as usize]);
            let cross = last.cross(arm);
            area += cross;
            if cross.length_squared() > largest.length_squared() {
                largest = cross;
            }
            last = arm;
        }
        let direction = if area.length() > INEXACT * largest.length() { area } else { largest };
        plane.normal = direction.try_normalize()?;
        let u = plane.normal.any_orthonormal_vector();
        plane.axes = [u, plane.normal.cross(u)];
        plane.double_area = area.dot(plane.normal);
        Some(plane)
    }

    fn arm(&self, position: DVec3) -> DVec3 {
        (position - self.origin) * self.scale
    }

    fn project(&self, position: DVec3) -> DVec2 {
        let arm = self.arm(position);
        DVec2::new(self.axes[0].dot(arm), self.axes[1].dot(arm))
    }

    /// Whether the fan covers the polygon once: its triangles have one winding, and together turn
    /// at most once around.
    fn fan_is_exact(&self, positions: &[DVec3], corners: &[u32]) -> bool {
        let (mut backwards, mut angle) = (0.0, 0.0);
        let mut last = DVec2::ZERO;
        for &corner in &corners[1..] {
            let arm = self.project(positions[corner as usize]);
            let cross = last.perp_dot(arm);
            backwards += (-cross).max(0.0);
            if corners.len() > 4 && cross != 0.0 {
                angle += cross.atan2(last.dot(arm));
            }
            last = arm;
        }
        backwards <= INEXACT * self.double_area && angle <= std::f64::consts::TAU * (1.0 + INEXACT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of the polygon in the plane z = 0, and the triangulator's counts.
    fn divided(points: &[DVec2]) -> (Vec<[DVec2; 3]>, Triangulator) {
        let positions: Vec<DVec3> = points.iter().map(|point| point.extend(0.0)).collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let (mut triangulator, mut triangles) = (Triangulator::default(), Vec::new());
        triangulator.divide(&positions, &corners, &mut triangles);
        let triangles = triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| points[i as usize]));
        (triangles.collect(), triangulator)
    }

    fn double_area([a, b, c]: [DVec2; 3]) -> f64 {
        (b - a).perp_dot(c - a)
    }

    fn contains([a, b, c]: [DVec2; 3], point: DVec2) -> bool {
        [[a, b, point], [b, c, point], [c, a, point]].into_iter().all(|side| double_area(side) > 0.0)
    }

    /// Whether a point is inside: the parity of the edges that a ray from it crosses.
    fn is_inside(points: &[DVec2], at: DVec2) -> bool {
        let edges = points.iter().zip(points.iter().cycle().skip(1));
        let crosses = |(a, b): &(&DVec2, &DVec2)| {
            (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        edges.filter(crosses).count() % 2 == 1
    }

    fn points(list: &[[f64; 2]]) -> Vec<DVec2> {
        list.iter().copied().map(DVec2::from_array).collect()
    }

    /// A C of eight corners, a comb, a star, a spiral, two squares that touch in a point, a ring
    /// with a cut.
    fn shapes() -> Vec<Vec<DVec2>> {
        let star = |index: u32| {
            DVec2::from_angle(f64::from(index) * std::f64::consts::TAU / 14.0)
                * if index.is_multiple_of(2) { 1.0 } else { 0.3 }
        };
        let comb = (0..20).flat_map(|tooth| {
            let x = f64::from(tooth);
            [[x, 0.0], [x + 0.5, 5.0]]
        });
        let mut comb: Vec<[f64; 2]> = comb.collect();
        comb.extend([[20.0, 5.5], [0.0, 5.5]]);
        let turn = |radius: f64, index: u32| {
            let angle = f64::from(index) * 0.3;
            DVec2::from_angle(angle) * (radius + 0.1 * angle)
        };
        let spiral = (0..60).map(|index| turn(1.4, index)).chain((0..60).rev().map(|index| turn(1.0, index)));
        vec![
            points(&[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [3., 2.], [3., 3.], [0., 3.]]),
            points(&comb),
            (0..14).map(star).collect(),
            spiral.collect(),
            points(&[[0., 0.], [1., 0.], [1., 1.], [2., 1.], [2., 2.], [1., 2.], [1., 1.], [0., 1.]]),
            points(&[
                [0., 0.],
                [4., 0.],
                [4., 4.],
                [0., 4.],
                [0., 0.],
                [1., 1.],
                [1., 3.],
                [3., 3.],
                [3., 1.],
                [1., 1.],
            ]),
        ]
    }

    #[test]
    fn concave_polygons_are_covered_once_from_every_first_corner() {
        for shape in shapes() {
            for first in 0..shape.len() {
                let mut shape = shape.clone();
                shape.rotate_left(first);
                for _ in 0..2 {
                    shape.reverse();
                    let (triangles, counted) = divided(&shape);
                    assert_eq!(counted.inexact, 0, "{shape:?}");
                    let edges = shape.iter().zip(shape.iter().cycle().skip(1));
                    let area: f64 = edges.map(|(a, b)| a.perp_dot(*b)).sum();
                    for x in 0..40 {
                        // Points away from all edges.
                        let at =
                            DVec2::new(0.1237 * f64::from(x) - 1.5, 0.0911 * f64::from((x * 17) % 53) - 1.2);
                        let facing =
                            |t: &&[DVec2; 3]| contains(if area > 0.0 { **t } else { [t[0], t[2], t[1]] }, at);
                        let covering = triangles.iter().filter(facing).count();
                        assert_eq!(covering, usize::from(is_inside(&shape, at)), "{at} of {shape:?}");
                    }
                }
            }
        }
    }

    /// A polygon that a fan covers exactly stays a fan, so that pictures keep their bytes.
    #[test]
    fn convex_polygons_stay_fans() {
        let circle = |count: u32| -> Vec<DVec2> {
            let angle = |index: u32| f64::from(index) * std::f64::consts::TAU / f64::from(count);
            (0..count).map(|index| DVec2::from_angle(angle(index)) * DVec2::new(1e3, 1e-2)).collect()
        };
        let straight =
            points(&[[0., 0.], [0.1, 0.], [0.3, 0.], [0.3, 0.1], [0.3, 0.7], [0., 0.7], [0., 0.2]]);
        let bent_in_first = points(&[[1., 0.3], [3., 0.], [1., 3.], [0., 0.]]);
        for shape in [circle(4), circle(5), circle(64), straight, bent_in_first] {
            let (triangles, _) = divided(&shape);
            let fan: Vec<_> = shape[1..].windows(2).map(|pair| [shape[0], pair[0], pair[1]]).collect();
            assert_eq!(triangles, fan);
        }
        // Also for bent quads: neither diagonal is better.
        let bent = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.4), DVec3::Y];
        let mut triangles = Vec::new();
        Triangulator::default().divide(&bent, &[0, 1, 2, 3], &mut triangles);
        assert_eq!(triangles, [0, 1, 2, 0, 2, 3]);
    }

    #[test]
    fn what_crosses_itself_is_counted() {
        let pentagram = |index: u32| DVec2::from_angle(f64::from(2 * index) * std::f64::consts::TAU / 5.0);
        for shape in [
            points(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]]),
            points(&[[0., 0.], [3., 0.], [3., 1.], [1., -1.], [0., 2.]]),
            (0..5).map(pentagram).collect(),
        ] {
            let (triangles, counted) = divided(&shape);
            assert_eq!(counted.inexact, 1, "{shape:?}");
            assert!(!triangles.is_empty());
        }
    }

    /// A star of a million corners, whose ears would take too long, is counted at once.
    #[test]
    fn polygons_of_too_many_corners_are_counted() {
        let star = |count: u32| -> Vec<DVec2> {
            let angle = |index: u32| f64::from(index) * std::f64::consts::TAU / f64::from(count);
            (0..count).map(|index| DVec2::from_angle(angle(index)) * f64::from(2 + index % 2)).collect()
        };
        assert_eq!(divided(&star(1000)).1.inexact, 0);
        let (triangles, counted) = divided(&star(1_000_000));
        assert_eq!((triangles.len(), counted.inexact), (999_998, 1));
    }

    /// Polygons without area, or with numbers whose squares overflow.
    #[test]
    fn degenerate_polygons_give_finite_work() {
        for scale in [0.0, 1e-300, 1.0, 1e200, f64::MAX] {
            for list in [[[0., 0.], [1., 0.], [0.5, 0.], [0.2, 0.], [0.7, 0.]], [[1., 1.]; 5]] {
                let shape: Vec<DVec2> = points(&list).iter().map(|point| *point * scale).collect();
                let (triangles, _) = divided(&shape);
                assert!(triangles.len() <= 3);
            }
        }
    }
}

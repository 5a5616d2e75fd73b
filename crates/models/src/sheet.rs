//! Surfaces over a rectangle of parameters with a thickness: walls with arches, vaults,
//! cloth, pages, leaves.

use glam::DVec3;

use super::solid::Solid;

/// A solid between two surfaces over the same parameters (u, v) in 0..1, cut into `nu` by `nv`
/// cells. `front` is seen from where ∂u × ∂v points.
pub(super) fn slab(
    [nu, nv]: [usize; 2],
    front: impl Fn(f64, f64) -> DVec3,
    back: impl Fn(f64, f64) -> DVec3,
) -> Solid {
    let mut solid = Solid::default();
    let grid = |solid: &mut Solid, f: &dyn Fn(f64, f64) -> DVec3| -> Vec<u32> {
        let cells =
            (0..=nv).flat_map(|j| (0..=nu).map(move |i| (i as f64 / nu as f64, j as f64 / nv as f64)));
        cells.map(|(u, v)| solid.point(f(u, v))).collect()
    };
    let [front, back] = [grid(&mut solid, &front), grid(&mut solid, &back)];
    let at = |i: usize, j: usize| j * (nu + 1) + i;
    for j in 0..nv {
        for i in 0..nu {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            solid.bent_quad(corners.map(|corner| front[corner]));
            let [a, b, c, d] = corners.map(|corner| back[corner]);
            solid.bent_quad([d, c, b, a]);
        }
    }
    let mut rim: Vec<usize> = (0..nu).map(|i| at(i, 0)).collect();
    rim.extend((0..nv).map(|j| at(nu, j)));
    rim.extend((1..=nu).rev().map(|i| at(i, nv)));
    rim.extend((1..=nv).rev().map(|j| at(0, j)));
    for (here, &a) in rim.iter().enumerate() {
        let b = rim[(here + 1) % rim.len()];
        solid.quad([front[a], back[a], back[b], front[b]]);
    }
    solid
}

/// A sheet of that thickness around a surface.
pub(super) fn sheet(cells: [usize; 2], thickness: f64, middle: impl Fn(f64, f64) -> DVec3) -> Solid {
    let side = |sign: f64| {
        let middle = &middle;
        move |u, v| middle(u, v) + 0.5 * sign * thickness * normal(middle, u, v)
    };
    slab(cells, side(1.0), side(-1.0))
}

/// A leaf: a sheet whose thickness may change along u, and is zero at its rim. Needs two
/// cells each way.
pub(super) fn leaf(
    [nu, nv]: [usize; 2],
    thickness: impl Fn(f64) -> f64,
    middle: impl Fn(f64, f64) -> DVec3,
) -> Solid {
    let mut solid = Solid::default();
    let is_rim = |i: usize, j: usize| i == 0 || j == 0 || i == nu || j == nv;
    let mut grid = |sign: f64, rim: &[u32]| -> Vec<u32> {
        let mut indices = Vec::new();
        for (at, (i, j)) in (0..=nv).flat_map(|j| (0..=nu).map(move |i| (i, j))).enumerate() {
            let (u, v) = (i as f64 / nu as f64, j as f64 / nv as f64);
            indices.push(match (is_rim(i, j), rim.get(at)) {
                (true, Some(&shared)) => shared,
                (true, None) => solid.point(middle(u, v)),
                (false, _) => solid.point(middle(u, v) + 0.5 * sign * thickness(u) * normal(&middle, u, v)),
            });
        }
        indices
    };
    let front = grid(1.0, &[]);
    let back = grid(-1.0, &front);
    for j in 0..nv {
        for i in 0..nu {
            let at = |i: usize, j: usize| j * (nu + 1) + i;
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // A corner cell's diagonal must not lie on the rim alone, because both sides would
            // share the facet.
            let [a, b, c, d] = corners.map(|corner| front[corner]);
            let [e, f, g, h] = corners.map(|corner| back[corner]);
            if (i == 0) == (j == 0) {
                solid.quad([a, b, c, d]);
                solid.quad([g, f, e, h]);
            } else {
                solid.quad([b, c, d, a]);
                solid.quad([h, g, f, e]);
            }
        }
    }
    solid
}

/// The coarsest leaf: a lozenge between the middles of the four rims, with `thickness`
/// in its middle.
pub(super) fn lozenge(thickness: f64, middle: impl Fn(f64, f64) -> DVec3) -> Solid {
    let mut solid = Solid::default();
    let rim = [[0.0, 0.5], [0.5, 0.0], [1.0, 0.5], [0.5, 1.0]].map(|[u, v]| solid.point(middle(u, v)));
    let half = 0.5 * thickness * normal(&middle, 0.5, 0.5);
    let [front, back] = [half, -half].map(|off| solid.point(middle(0.5, 0.5) + off));
    for at in 0..4 {
        let [here, next] = [rim[at], rim[(at + 1) % 4]];
        solid.facets.push([here, next, front]);
        solid.facets.push([next, here, back]);
    }
    solid
}

/// Unit normal ∂u × ∂v by differences.
fn normal(surface: &impl Fn(f64, f64) -> DVec3, u: f64, v: f64) -> DVec3 {
    const STEP: f64 = 1e-4;
    let along_u = surface(u + STEP, v) - surface(u - STEP, v);
    let along_v = surface(u, v + STEP) - surface(u, v - STEP);
    along_u.cross(along_v).normalize()
}

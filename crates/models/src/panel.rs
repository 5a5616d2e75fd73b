//! Flat work with openings: walls, floors of tiles, shelves, window and door frames.

use glam::DVec3;

use super::solid::Solid;

/// A straight block between two opposite corners.
pub(super) fn block(low: [f64; 3], high: [f64; 3]) -> Solid {
    let [x, y, z] = [0, 1, 2].map(|axis| [low[axis], high[axis]]);
    panel(&x, &y, z, |_, _| Some(0))
}

/// A plate in the xy plane between two depths `z`, divided along lines of x and y. `finish` returns
/// the finish of a cell; `None` is an opening. Filled cells must not meet in a corner alone. The
/// rim has the finish of its cell.
pub(super) fn panel(
    xs: &[f64],
    ys: &[f64],
    [back, front]: [f64; 2],
    finish: impl Fn(usize, usize) -> Option<u8>,
) -> Solid {
    let mut solid = Solid::default();
    let (nx, ny) = (xs.len() - 1, ys.len() - 1);
    let is_filled = |i: isize, j: isize| {
        let inside = (0..nx as isize).contains(&i) && (0..ny as isize).contains(&j);
        inside && finish(i as usize, j as usize).is_some()
    };
    let mut corners = vec![[u32::MAX; 2]; (nx + 1) * (ny + 1)];
    for j in 0..=ny {
        for i in 0..=nx {
            let (x, y) = (i as isize, j as isize);
            if [(x, y), (x - 1, y), (x, y - 1), (x - 1, y - 1)].iter().any(|&(x, y)| is_filled(x, y)) {
                corners[j * (nx + 1) + i] = [back, front].map(|z| solid.point(DVec3::new(xs[i], ys[j], z)));
            }
        }
    }
    let at = |i: usize, j: usize| corners[j * (nx + 1) + i];
    for j in 0..ny {
        for i in 0..nx {
            let Some(finish) = finish(i, j) else { continue };
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            solid.quad([a[1], b[1], c[1], d[1]]);
            solid.quad([d[0], c[0], b[0], a[0]]);
            let (x, y) = (i as isize, j as isize);
            for (is_open, [p, q]) in [
                (!is_filled(x, y - 1), [a, b]),
                (!is_filled(x + 1, y), [b, c]),
                (!is_filled(x, y + 1), [c, d]),
                (!is_filled(x - 1, y), [d, a]),
            ] {
                if is_open {
                    solid.quad([p[0], q[0], q[1], p[1]]);
                }
            }
            solid.finish_as(finish);
        }
    }
    solid
}

/// Lines from `from` to `to` at equal distances.
pub(super) fn lines(from: f64, to: f64, cells: usize) -> Vec<f64> {
    (0..=cells).map(|line| from + (to - from) * line as f64 / cells as f64).collect()
}

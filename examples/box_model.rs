//! Writes the model of the built-in Box scene: `cargo run --example box_model > assets/box.obj`.
//!
//! A room of 2×2×2 m without a front wall, and a Utah teapot 1 m wide: 10 + 2 904 triangles. The
//! teapot's control points are Martin Newell's of 1975 (public domain): z is up, the spout
//! points to +x.

use std::collections::HashMap;
use std::fmt::Write as _;

use glam::{DVec2, DVec3};

/// Metres per unit of the control points.
const SCALE: f64 = 0.16;
/// Cosine and sine of the teapot's rotation about the vertical, the spout towards the viewer. They
/// are exact, so that the file is the same on every machine.
const TURN: [f64; 2] = [12.0 / 13.0, 5.0 / 13.0];
/// Position of its axis on the floor, x and z.
const PLACE: DVec2 = DVec2::new(-0.03, 0.1);
/// Depth of the body's lower edge below the floor, metres: it neither floats nor lies in the
/// floor's plane. The teapot's bottom is omitted, since it is never visible.
const SINK: f64 = 0.001;
/// Height of that edge in control point units.
const BASE: f64 = 0.15;

/// Four control points.
type Row = [[f64; 3]; 4];

/// Segments of every quarter of a round part.
const QUARTER: usize = 12;
/// The round parts: control points (r, k, z) of the profile with its segments. The quarter circle
/// of radius r is the Bézier curve (r, 0), (r, -k), (k, -r), (0, -r).
const ROUND: [(Row, usize); 5] = [
    // Rim.
    ([[1.4, 0.784, 2.4], [1.3375, 0.749, 2.53125], [1.4375, 0.805, 2.53125], [1.5, 0.84, 2.4]], 3),
    // Body.
    ([[1.5, 0.84, 2.4], [1.75, 0.98, 1.875], [2.0, 1.12, 1.35], [2.0, 1.12, 0.9]], 4),
    ([[2.0, 1.12, 0.9], [2.0, 1.12, 0.45], [1.5, 0.84, 0.225], [1.5, 0.84, BASE]], 4),
    // Lid, from the top of its knob.
    ([[0.0, 0.0, 3.15], [0.8, 0.45, 3.15], [0.0, 0.0, 2.85], [0.2, 0.112, 2.7]], 4),
    ([[0.2, 0.112, 2.7], [0.4, 0.224, 2.55], [1.3, 0.728, 2.55], [1.3, 0.728, 2.4]], 3),
];

/// The bent parts: the half with y < 0, four half sections of four control points, with the
/// segments around the half and along.
const BENT: [([Row; 4], [usize; 2]); 4] = [
    // Handle.
    (
        [
            [[-1.6, 0.0, 2.025], [-1.6, -0.3, 2.025], [-1.5, -0.3, 2.25], [-1.5, 0.0, 2.25]],
            [[-2.3, 0.0, 2.025], [-2.3, -0.3, 2.025], [-2.5, -0.3, 2.25], [-2.5, 0.0, 2.25]],
            [[-2.7, 0.0, 2.025], [-2.7, -0.3, 2.025], [-3.0, -0.3, 2.25], [-3.0, 0.0, 2.25]],
            [[-2.7, 0.0, 1.8], [-2.7, -0.3, 1.8], [-3.0, -0.3, 1.8], [-3.0, 0.0, 1.8]],
        ],
        [8, 9],
    ),
    (
        [
            [[-2.7, 0.0, 1.8], [-2.7, -0.3, 1.8], [-3.0, -0.3, 1.8], [-3.0, 0.0, 1.8]],
            [[-2.7, 0.0, 1.575], [-2.7, -0.3, 1.575], [-3.0, -0.3, 1.35], [-3.0, 0.0, 1.35]],
            [[-2.5, 0.0, 1.125], [-2.5, -0.3, 1.125], [-2.65, -0.3, 0.9375], [-2.65, 0.0, 0.9375]],
            [[-2.0, 0.0, 0.9], [-2.0, -0.3, 0.9], [-1.9, -0.3, 0.6], [-1.9, 0.0, 0.6]],
        ],
        [8, 9],
    ),
    // Spout.
    (
        [
            [[1.7, 0.0, 1.425], [1.7, -0.66, 1.425], [1.7, -0.66, 0.6], [1.7, 0.0, 0.6]],
            [[2.6, 0.0, 1.425], [2.6, -0.66, 1.425], [3.1, -0.66, 0.825], [3.1, 0.0, 0.825]],
            [[2.3, 0.0, 2.1], [2.3, -0.25, 2.1], [2.4, -0.25, 2.025], [2.4, 0.0, 2.025]],
            [[2.7, 0.0, 2.4], [2.7, -0.25, 2.4], [3.3, -0.25, 2.4], [3.3, 0.0, 2.4]],
        ],
        [9, 9],
    ),
    (
        [
            [[2.7, 0.0, 2.4], [2.7, -0.25, 2.4], [3.3, -0.25, 2.4], [3.3, 0.0, 2.4]],
            [[2.8, 0.0, 2.475], [2.8, -0.25, 2.475], [3.525, -0.25, 2.49375], [3.525, 0.0, 2.49375]],
            [[2.9, 0.0, 2.475], [2.9, -0.15, 2.475], [3.45, -0.15, 2.5125], [3.45, 0.0, 2.5125]],
            [[2.8, 0.0, 2.4], [2.8, -0.15, 2.4], [3.2, -0.15, 2.4], [3.2, 0.0, 2.4]],
        ],
        [9, 9],
    ),
];

/// The room's walls: material, and corners counter-clockwise from inside.
const WALLS: [(&str, [[i32; 3]; 4]); 5] = [
    ("white", [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]),
    ("white", [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]]),
    ("white", [[-1, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]]),
    ("red", [[-1, 0, 1], [-1, 0, -1], [-1, 2, -1], [-1, 2, 1]]),
    ("green", [[1, 0, -1], [1, 0, 1], [1, 2, 1], [1, 2, -1]]),
];

/// A bicubic Bézier patch; the normal ∂u × ∂v points outward.
type Patch = [[DVec3; 4]; 4];

#[derive(Clone, Copy)]
struct Vertex {
    position: DVec3,
    normal: DVec3,
}

/// Value and derivative of a cubic Bézier curve.
fn curve(points: [DVec3; 4], t: f64) -> [DVec3; 2] {
    let step =
        |points: &[DVec3]| -> Vec<DVec3> { points.windows(2).map(|p| p[0] + (p[1] - p[0]) * t).collect() };
    let last = step(&step(&points));
    [step(&last)[0], 3.0 * (last[1] - last[0])]
}

fn evaluate(patch: &Patch, u: f64, v: f64) -> Vertex {
    let rows = patch.map(|row| curve(row, u));
    let [position, along_v] = curve(rows.map(|[value, _]| value), v);
    let [along_u, _] = curve(rows.map(|[_, derivative]| derivative), v);
    // At the lid's pole all values of u are one point, and the surface is horizontal there.
    let normal = if along_u.length() < 1e-9 { DVec3::Z } else { along_u.cross(along_v).normalize() };
    Vertex { position, normal }
}

/// Newell's patches without the bottom, with their segments along u and v.
fn patches() -> Vec<(Patch, [usize; 2])> {
    let mut patches = Vec::new();
    for (profile, segments) in ROUND {
        let quarter = profile
            .map(|[r, k, z]| [(r, 0.0), (r, -k), (k, -r), (0.0, -r)].map(|(x, y)| DVec3::new(x, y, z)));
        let turned = |turns: usize| {
            quarter.map(|row| row.map(|p| (0..turns).fold(p, |p, _| DVec3::new(p.y, -p.x, p.z))))
        };
        patches.extend((0..4).map(|turns| (turned(turns), [QUARTER, segments])));
    }
    for (half, segments) in BENT {
        let half = half.map(|row| row.map(DVec3::from));
        let mirrored =
            half.map(|row| [row[3], row[2], row[1], row[0]].map(|p| p * DVec3::new(1.0, -1.0, 1.0)));
        patches.extend([(half, segments), (mirrored, segments)]);
    }
    patches
}

/// Triangles of a patch; degenerate ones at a pole are omitted.
fn tessellate(patch: &Patch, [columns, rows]: [usize; 2]) -> Vec<[Vertex; 3]> {
    let at = |i: usize, j: usize| evaluate(patch, i as f64 / columns as f64, j as f64 / rows as f64);
    let mut triangles = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for [p, q, r] in [[a, b, c], [a, c, d]] {
                if (q.position - p.position).cross(r.position - p.position).length() > 1e-9 {
                    triangles.push([p, q, r]);
                }
            }
        }
    }
    triangles
}

/// Transforms control points to the room: rotated about the vertical, y up, standing in the floor.
fn place(vertex: Vertex) -> Vertex {
    let [cos, sin] = TURN;
    let turn = |v: DVec3| DVec3::new(cos * v.x + sin * v.y, v.z, sin * v.x - cos * v.y);
    let lift = DVec3::new(PLACE.x, -SCALE * BASE - SINK, PLACE.y);
    Vertex { position: SCALE * turn(vertex.position) + lift, normal: turn(vertex.normal) }
}

/// Numbers lines from 1. Equal lines share a number, which welds patches together.
#[derive(Default)]
struct Lines {
    text: String,
    numbers: HashMap<String, usize>,
}

impl Lines {
    fn number(&mut self, keyword: &str, v: DVec3) -> usize {
        // Rounding and then adding zero avoids "-0.000000".
        let [x, y, z] = v.to_array().map(|c| (c * 1e6).round() / 1e6 + 0.0);
        let line = format!("{keyword} {x:.6} {y:.6} {z:.6}");
        let next = self.numbers.len() + 1;
        *self.numbers.entry(line).or_insert_with_key(|line| {
            self.text.push_str(line);
            self.text.push('\n');
            next
        })
    }
}

/// The text of the OBJ file.
pub(crate) fn obj() -> String {
    let (mut positions, mut normals, mut faces) = (Lines::default(), Lines::default(), String::new());
    for (material, corners) in WALLS {
        let corners =
            corners.map(|[x, y, z]| positions.number("v", DVec3::new(x.into(), y.into(), z.into())));
        let [a, b, c, d] = corners;
        write!(faces, "usemtl {material}\nf {a} {b} {c}\nf {a} {c} {d}\n").expect("a String grows");
    }
    faces.push_str("o teapot\nusemtl teapot\n");
    for (patch, segments) in patches() {
        for triangle in tessellate(&patch, segments) {
            faces.push('f');
            for vertex in triangle.map(place) {
                let (position, normal) =
                    (positions.number("v", vertex.position), normals.number("vn", vertex.normal));
                write!(faces, " {position}//{normal}").expect("a String grows");
            }
            faces.push('\n');
        }
    }
    let header = "# The Box: written by examples/box_model.rs; see LICENSES.md\nmtllib box.mtl\n";
    format!("{header}{}{}o room\n{faces}", positions.text, normals.text)
}

fn main() {
    print!("{}", obj());
}

//! The atrium: a court of 24 × 9 m, open to the sky, between two storeys of arcades with a vaulted
//! walk around it.
//!
//! The origin is in the middle of the court, on the level of the walk; x runs along the court.

mod arcade;
mod columns;
mod court;
mod furnishing;
mod gallery;
mod walk;

use glam::{DAffine3, DVec3};

use super::model::{Finish, Model, at, turn};
use super::outline::Detail;

/// Half the court, to the axes of the columns, along x and z, metres.
const COURT: [f64; 2] = [12.0, 4.5];
/// Distance of the lower columns.
const BAY: f64 = 3.0;
/// Thickness of the walls over the columns.
const WALL: f64 = 0.5;
/// From the inner face of the arcade to the outer wall.
const WALK: f64 = 3.0;
/// Where the lower arches begin.
const SPRINGING: f64 = 3.6;
/// Floor of the upper gallery.
const GALLERY: f64 = 5.6;
/// Top of the upper arcade.
const EAVES: f64 = 9.2;
/// Level of the court.
const GROUND: f64 = -0.45;

/// The materials of the atrium.
struct Finishes {
    limestone: Finish,
    plaster: Finish,
    vault: Finish,
    marble: Finish,
    porphyry: Finish,
    slate: Finish,
    flagstone: Finish,
    terracotta: Finish,
    oak: Finish,
    bronze: Finish,
    leaf: Finish,
    soil: Finish,
    cloth: [Finish; 3],
}

impl Finishes {
    fn new(model: &mut Model) -> Self {
        Self {
            limestone: model.diffuse("limestone", [0.66, 0.58, 0.46]),
            plaster: model.diffuse("plaster", [0.70, 0.52, 0.34]),
            vault: model.diffuse("vault", [0.74, 0.69, 0.60]),
            marble: model.diffuse("marble", [0.76, 0.73, 0.68]),
            porphyry: model.diffuse("porphyry", [0.42, 0.17, 0.12]),
            slate: model.diffuse("slate", [0.24, 0.25, 0.26]),
            flagstone: model.diffuse("flagstone", [0.55, 0.49, 0.40]),
            terracotta: model.diffuse("terracotta", [0.56, 0.26, 0.15]),
            oak: model.diffuse("oak", [0.30, 0.17, 0.09]),
            bronze: model.diffuse("bronze", [0.22, 0.17, 0.10]),
            leaf: model.diffuse("leaf", [0.13, 0.30, 0.07]),
            soil: model.diffuse("soil", [0.12, 0.08, 0.05]),
            cloth: [
                model.diffuse("crimson", [0.55, 0.06, 0.06]),
                model.diffuse("azure", [0.08, 0.17, 0.45]),
                model.diffuse("moss", [0.15, 0.33, 0.12]),
            ],
        }
    }
}

/// The shared context of all parts of the atrium.
struct Site<'a> {
    model: &'a mut Model,
    detail: Detail,
    finishes: Finishes,
}

pub(super) fn build(model: &mut Model, detail: Detail) {
    let finishes = Finishes::new(model);
    let mut site = Site { model, detail, finishes };
    columns::build(&mut site);
    arcade::build(&mut site);
    walk::build(&mut site);
    gallery::build(&mut site);
    court::build(&mut site);
    furnishing::build(&mut site);
}

/// One side of the court. Its local x runs along it and local z out of the court; the origin is on
/// the axis of its columns.
struct Side {
    place: DAffine3,
    /// Half its length, metres.
    half: f64,
}

/// The four sides: the long ones first.
fn sides() -> [Side; 4] {
    let [x, z] = COURT;
    [
        Side { place: at(0.0, 0.0, z), half: x },
        Side { place: at(0.0, 0.0, -z) * turn(180.0), half: x },
        Side { place: at(x, 0.0, 0.0) * turn(90.0), half: z },
        Side { place: at(-x, 0.0, 0.0) * turn(-90.0), half: z },
    ]
}

/// A loop around the court, with the court on its left, `outside` metres from the columns' axes.
fn around(outside: f64, y: f64) -> [DVec3; 4] {
    let [x, z] = COURT.map(|half| half + outside);
    [[-x, z], [x, z], [x, -z], [-x, -z]].map(|[x, z]| DVec3::new(x, y, z))
}

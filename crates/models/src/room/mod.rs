//! The room: a furnished living room of 7 × 5 m, with a doorway to a corridor that has a lamp
//! of its own.
//!
//! The origin is in the middle of the floor; x runs along the room, z towards its front wall. The
//! corridor lies beyond x = 3.5.

mod bookcase;
mod chairs;
mod lamps;
mod pictures;
mod shell;
mod sofa;
mod tables;
mod tableware;
mod window;

use super::model::{Finish, Model};
use super::outline::Detail;

/// Half the floor along x and z, and the height, metres.
const HALF: [f64; 2] = [3.5, 2.5];
const HEIGHT: f64 = 2.75;

/// The materials of the room.
struct Finishes {
    wall: Finish,
    ceiling: Finish,
    woodwork: Finish,
    parquet: [Finish; 3],
    corridor: Finish,
    tiles: [Finish; 2],
    walnut: Finish,
    oak: Finish,
    upholstery: Finish,
    pillows: [Finish; 2],
    curtain: Finish,
    rug: [Finish; 3],
    brass: Finish,
    shade: Finish,
    porcelain: Finish,
    glaze: Finish,
    leaf: Finish,
    soil: Finish,
    paper: Finish,
    night: Finish,
    covers: [Finish; 6],
    paints: [Finish; 4],
    fruit: [Finish; 2],
}

impl Finishes {
    fn new(model: &mut Model) -> Self {
        Self {
            wall: model.diffuse("wall", [0.62, 0.60, 0.50]),
            ceiling: model.diffuse("ceiling", [0.80, 0.79, 0.76]),
            woodwork: model.diffuse("woodwork", [0.76, 0.74, 0.69]),
            parquet: [
                model.diffuse("parquet light", [0.46, 0.29, 0.16]),
                model.diffuse("parquet", [0.40, 0.24, 0.12]),
                model.diffuse("parquet dark", [0.33, 0.19, 0.095]),
            ],
            corridor: model.diffuse("corridor wall", [0.72, 0.55, 0.36]),
            tiles: [
                model.diffuse("tile", [0.68, 0.64, 0.57]),
                model.diffuse("tile dark", [0.20, 0.19, 0.19]),
            ],
            walnut: model.diffuse("walnut", [0.24, 0.135, 0.075]),
            oak: model.diffuse("oak", [0.45, 0.30, 0.17]),
            upholstery: model.diffuse("upholstery", [0.20, 0.31, 0.33]),
            pillows: [model.diffuse("ochre", [0.66, 0.40, 0.10]), model.diffuse("linen", [0.70, 0.65, 0.55])],
            curtain: model.diffuse("curtain", [0.52, 0.12, 0.10]),
            rug: [
                model.diffuse("rug", [0.40, 0.10, 0.09]),
                model.diffuse("rug border", [0.14, 0.16, 0.28]),
                model.diffuse("rug ivory", [0.66, 0.58, 0.44]),
            ],
            brass: model.diffuse("brass", [0.52, 0.38, 0.16]),
            shade: model.diffuse("shade", [0.78, 0.70, 0.55]),
            porcelain: model.diffuse("porcelain", [0.76, 0.76, 0.74]),
            glaze: model.diffuse("glaze", [0.12, 0.28, 0.42]),
            leaf: model.diffuse("leaf", [0.14, 0.31, 0.09]),
            soil: model.diffuse("soil", [0.11, 0.08, 0.055]),
            paper: model.diffuse("paper", [0.76, 0.71, 0.60]),
            night: model.diffuse("night", [0.035, 0.045, 0.07]),
            covers: [
                model.diffuse("cover red", [0.42, 0.08, 0.07]),
                model.diffuse("cover blue", [0.09, 0.16, 0.34]),
                model.diffuse("cover green", [0.10, 0.25, 0.14]),
                model.diffuse("cover brown", [0.30, 0.18, 0.09]),
                model.diffuse("cover sand", [0.62, 0.51, 0.32]),
                model.diffuse("cover black", [0.07, 0.07, 0.08]),
            ],
            paints: [
                model.diffuse("paint sky", [0.45, 0.56, 0.64]),
                model.diffuse("paint hills", [0.22, 0.34, 0.30]),
                model.diffuse("paint field", [0.62, 0.50, 0.20]),
                model.diffuse("paint sun", [0.75, 0.42, 0.16]),
            ],
            fruit: [model.diffuse("orange", [0.72, 0.31, 0.05]), model.diffuse("apple", [0.45, 0.09, 0.06])],
        }
    }
}

/// The shared context of all parts of the room.
struct Site<'a> {
    model: &'a mut Model,
    detail: Detail,
    finishes: Finishes,
}

pub(super) fn build(model: &mut Model, detail: Detail) {
    let finishes = Finishes::new(model);
    let mut site = Site { model, detail, finishes };
    shell::build(&mut site);
    window::build(&mut site);
    bookcase::build(&mut site);
    tables::build(&mut site);
    chairs::build(&mut site);
    tableware::build(&mut site);
    sofa::build(&mut site);
    lamps::build(&mut site);
    pictures::build(&mut site);
}

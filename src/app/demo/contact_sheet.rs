//! The contact sheet: all snapshots as one picture, each with its name.

use std::path::{Path, PathBuf};

use egui::{Color32, FontId};

use super::snapshots::{Snapshot, scaled};
use crate::app::output::OutputFile;
use crate::error::{Error, Result};
use crate::image::write_png;

/// Width of a picture on the sheet, and the space around it, pixels.
const WIDTH: u32 = 480;
const MARGIN: u32 = 16;
/// Height of a name, pixels.
const NAME: u32 = 28;
/// Text size, points.
const TEXT: f32 = 18.0;
const BACKGROUND: [u8; 4] = [24, 24, 24, 255];

/// A picture of any size on the sheet.
struct Tile {
    size: [u32; 2],
    codes: Vec<[u8; 4]>,
    name: Mask,
}

/// A text as coverage, 0..=255 a pixel, row by row.
struct Mask {
    size: [u32; 2],
    coverage: Vec<u8>,
}

/// Saves the sheet under a free name beside the scene's usual path; returns a message.
pub(super) fn save(context: &egui::Context, snapshots: &[Snapshot], scene_to: &str) -> Result<String> {
    if snapshots.is_empty() {
        return Err(Error::Usage("there is no snapshot: N keeps one".to_owned()));
    }
    let tiles: Vec<Tile> = snapshots
        .iter()
        .map(|snapshot| {
            let (size, codes) = scaled(&snapshot.codes, snapshot.size, WIDTH);
            Tile { size, codes, name: mask(context, &snapshot.name) }
        })
        .collect();
    let (size, codes) = sheet(&tiles);
    let stem = Path::new(scene_to).with_extension("");
    let free = |number: u32| PathBuf::from(format!("{}-sheet-{number:03}.png", stem.display()));
    let path = (1..).map(free).find(|path| !path.exists()).expect("numbers do not end");
    OutputFile::check(&path)?.write(|out| write_png(out, size, &codes))?;
    Ok(format!("saved {}", path.display()))
}

/// The tiles row by row from the top left, in nearly as many rows as columns: sRGB codes R, G, B,
/// 255, and their size.
fn sheet(tiles: &[Tile]) -> ([u32; 2], Vec<[u8; 4]>) {
    let columns = (1..).find(|side| side * side >= tiles.len() as u32).unwrap_or(1);
    let rows = (tiles.len() as u32).div_ceil(columns);
    let tile = |axis: usize| tiles.iter().map(|tile| tile.size[axis]).max().unwrap_or(1);
    let step = [tile(0) + MARGIN, tile(1) + NAME + MARGIN];
    let size = [columns * step[0] + MARGIN, rows * step[1] + MARGIN];
    let mut codes = vec![BACKGROUND; (size[0] * size[1]) as usize];
    for (number, tile) in (0..).zip(tiles) {
        let corner = [number % columns * step[0] + MARGIN, number / columns * step[1] + MARGIN];
        let mut put = |[x, y]: [u32; 2], code: [u8; 4]| {
            codes[((corner[1] + y) * size[0] + corner[0] + x) as usize] = code;
        };
        for (index, code) in (0..).zip(&tile.codes) {
            put([index % tile.size[0], index / tile.size[0]], *code);
        }
        let top = step[1] - MARGIN - NAME + 4;
        for (index, coverage) in (0..).zip(&tile.name.coverage) {
            let [x, y] = [index % tile.name.size[0], index / tile.name.size[0]];
            if *coverage > 0 && x < step[0] - MARGIN && y + 4 < NAME {
                let code = (*coverage).max(BACKGROUND[0]);
                put([x, top + y], [code, code, code, 255]);
            }
        }
    }
    (size, codes)
}

/// A line of text in the window's font.
fn mask(context: &egui::Context, text: &str) -> Mask {
    let scale = context.pixels_per_point();
    context.fonts_mut(|fonts| {
        let font = FontId::proportional(TEXT / scale);
        let galley = fonts.layout_no_wrap(text.replace('\n', " "), font, Color32::WHITE);
        let atlas = fonts.image();
        let size = [galley.size().x, galley.size().y].map(|side| (side * scale).ceil().max(1.0) as u32);
        let mut mask = Mask { size, coverage: vec![0; (size[0] * size[1]) as usize] };
        for row in &galley.rows {
            for glyph in &row.glyphs {
                let rect = glyph.uv_rect;
                let corner = (scale * (row.pos + glyph.pos.to_vec2() + rect.offset)).round();
                for (y, v) in (0..).zip(rect.min[1]..rect.max[1]) {
                    for (x, u) in (0..).zip(rect.min[0]..rect.max[0]) {
                        let [x, y] = [corner.x as i64 + x, corner.y as i64 + y];
                        let is_inside = |value: i64, side: u32| (0..i64::from(side)).contains(&value);
                        if is_inside(x, size[0]) && is_inside(y, size[1]) {
                            let place = y as usize * size[0] as usize + x as usize;
                            let texel = atlas[(usize::from(u), usize::from(v))];
                            mask.coverage[place] = mask.coverage[place].max(texel.a());
                        }
                    }
                }
            }
        }
        mask
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(red: u8) -> Tile {
        let name = Mask { size: [2, 2], coverage: vec![0, 255, 128, 0] };
        Tile { size: [10, 5], codes: vec![[red, 0, 0, 255]; 50], name }
    }

    #[test]
    fn tiles_lie_in_rows_with_their_names_below() {
        for (count, columns, rows) in [(1, 1, 1), (2, 2, 1), (5, 3, 2), (24, 5, 5)] {
            let tiles: Vec<Tile> = (0..count).map(|number| tile(100 + number)).collect();
            let ([width, height], codes) = sheet(&tiles);
            assert_eq!(width, columns * (10 + MARGIN) + MARGIN, "{count}");
            assert_eq!(height, rows * (5 + NAME + MARGIN) + MARGIN, "{count}");
            let last = u32::from(count) - 1;
            let corner =
                [last % columns * (10 + MARGIN) + MARGIN, last / columns * (5 + NAME + MARGIN) + MARGIN];
            let at = |x: u32, y: u32| codes[((corner[1] + y) * width + corner[0] + x) as usize];
            assert_eq!(at(0, 0), [99 + count, 0, 0, 255]);
            assert_eq!(at(9, 4), [99 + count, 0, 0, 255]);
            assert_eq!([at(0, 9), at(1, 9), at(0, 10)], [BACKGROUND, [255; 4], [128, 128, 128, 255]]);
            assert_eq!(codes.iter().filter(|code| code[1] == 0).count(), 50 * usize::from(count));
        }
    }

    /// Letters differ, and lie within their mask.
    #[test]
    fn names_are_drawn() {
        let context = egui::Context::default();
        let mut masks = Vec::new();
        let mut output = context.run_ui(egui::RawInput::default(), |ui| {
            masks = ["I", "W", "Snapshot 1", ""].map(|text| mask(ui.ctx(), text)).into();
        });
        output.textures_delta.clear();
        let ink = |mask: &Mask| mask.coverage.iter().filter(|coverage| **coverage > 100).count();
        assert!(
            ink(&masks[0]) > 8 && ink(&masks[1]) > 2 * ink(&masks[0]),
            "{} {}",
            ink(&masks[0]),
            ink(&masks[1])
        );
        assert!(masks[2].size[0] > 4 * masks[1].size[0] && masks[2].size[1] < NAME);
        assert_eq!(ink(&masks[3]), 0);
    }
}

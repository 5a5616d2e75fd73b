//! The table, the map and the page of a judgement.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::regions::{Blocks, Cause, SIDE, SMALL};
use super::{Judgement, Row};
use crate::app::plot;

/// Error at which a colour has its full brightness, as a root mean square.
const LARGE: f64 = 0.5;

/// Brightness of a colour at the smallest error that is shown.
const DIM: f64 = 0.3;

/// Narrowest picture on the page, pixels.
const MIN_WIDTH: u32 = 320;

/// Height of a line of the legend, pixels.
const LINE: u32 = 20;

/// A colour that colour-blind readers can distinguish from the others (Okabe and Ito).
fn colour(cause: Cause) -> [u8; 3] {
    match cause {
        Cause::DirectLight => [230, 159, 0],
        Cause::Records => [86, 180, 233],
        Cause::Clusters => [0, 158, 115],
        Cause::GatherRays => [204, 121, 167],
        Cause::Rest => [220, 220, 220],
        Cause::Small => [24, 24, 24],
    }
}

/// The cause of each pixel's block, brighter where the error is larger.
pub(super) fn map(blocks: Blocks, causes: &[Cause], errors: &[f64], pixels: usize) -> Vec<[u8; 4]> {
    let of_block = |(&cause, &error): (&Cause, &f64)| {
        let decades = (LARGE / SMALL).log10();
        let place = ((error.max(0.0).sqrt() / SMALL).log10() / decades).clamp(0.0, 1.0);
        let light = if cause == Cause::Small { 1.0 } else { DIM + (1.0 - DIM) * place };
        let [r, g, b] = colour(cause).map(|channel| (f64::from(channel) * light).round() as u8);
        [r, g, b, 255]
    };
    let colours: Vec<[u8; 4]> = causes.iter().zip(errors).map(of_block).collect();
    (0..pixels).map(|pixel| colours[blocks.of_pixel(pixel)]).collect()
}

/// The table for a terminal.
pub(super) fn table(judgement: &Judgement) -> String {
    let mut text = format!("{}\n\n", headline(judgement));
    let _ = writeln!(
        text,
        "{:<14}{:>16}{:>10}{:>16}{:>12}{:>14}",
        "stage", "relMSE without", "removes", "light without", "of blocks", "of the error"
    );
    for row in &judgement.stages {
        let Row { stage, relmse_without, removes, light_without, blocks, error } = row;
        let or_dash = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        let _ = writeln!(
            text,
            "{stage:<14}{:>16}{:>10}{:>16}{:>12}{:>14}",
            or_dash(relmse_without.map(|value| format!("{value:.2e}"))),
            or_dash(removes.map(|value| format!("{:.0} %", 100.0 * value))),
            or_dash(light_without.map(|value| format!("{:+.2} %", 100.0 * value))),
            format!("{:.1} %", 100.0 * blocks),
            format!("{:.1} %", 100.0 * error),
        );
    }
    let _ = writeln!(text, "\nworst blocks of {SIDE}x{SIDE} pixels");
    for worst in &judgement.worst {
        let [x, y] = worst.corner;
        let _ = writeln!(text, "({x}, {y}): {:.0} % error, {}", 100.0 * worst.rms, worst.stage);
    }
    text
}

fn headline(judgement: &Judgement) -> String {
    let Judgement { scene, size: [width, height], quality, relmse, relmse_standard_error, light, .. } =
        judgement;
    format!(
        "{scene}, {width}x{height}, {quality}: relMSE {relmse:.2e} ± {relmse_standard_error:.1e}, light {:+.2} %",
        100.0 * light
    )
}

/// Picture and map side by side, with the map's legend.
pub(super) fn svg(judgement: &Judgement, [picture, map]: [&[u8]; 2]) -> String {
    let [width, height] = judgement.size;
    let scale = MIN_WIDTH.div_ceil(width).max(1);
    let (width, height) = (scale * width, scale * height);
    let lines = Cause::ALL.len() as u32 + 3;
    let full = height + lines * LINE;
    let full_width = 2 * width;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {full_width} {full}\" width=\"{full_width}\" height=\"{full}\">\n\
         <title>Which stage errs where</title>\n<rect width=\"{full_width}\" height=\"{full}\" fill=\"#fff\"/>\n"
    );
    for (x, png) in [(0, picture), (width, map)] {
        let _ = writeln!(
            text,
            "<image x=\"{x}\" width=\"{width}\" height=\"{height}\" style=\"image-rendering:pixelated\" \
             href=\"data:image/png;base64,{}\"/>",
            STANDARD.encode(png)
        );
    }
    text += "<g style=\"font:13px system-ui,sans-serif\" fill=\"#1a1a1a\">\n";
    let mut y = height + LINE;
    let _ = writeln!(text, "<text x=\"8\" y=\"{y}\">{}</text>", plot::escape(&headline(judgement)));
    for (cause, row) in Cause::ALL.into_iter().zip(&judgement.stages) {
        y += LINE;
        let [r, g, b] = colour(cause);
        let _ = writeln!(
            text,
            "<rect x=\"8\" y=\"{}\" width=\"14\" height=\"14\" fill=\"rgb({r},{g},{b})\"/>\
             <text x=\"30\" y=\"{y}\">{}: {:.1} % of the blocks, {:.1} % of the error</text>",
            y - 12,
            plot::escape(row.stage),
            100.0 * row.blocks,
            100.0 * row.error
        );
    }
    y += LINE;
    let _ = writeln!(
        text,
        "<text x=\"8\" y=\"{y}\">blocks of {SIDE} pixels; dim: {} % error, bright: {} % and more</text>\n</g>\n</svg>",
        100.0 * SMALL,
        100.0 * LARGE
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_the_colour_of_their_cause_and_grow_brighter_with_the_error() {
        let blocks = Blocks::new([16, 8]);
        let shown = |error: f64| map(blocks, &[Cause::Clusters, Cause::Small], &[error, 1e-9], 128);
        let [r, g, b] = colour(Cause::Clusters);
        assert_eq!(shown(1.0)[0], [r, g, b, 255]);
        let [dark_r, dark_g, dark_b] = colour(Cause::Small);
        assert_eq!(shown(1.0)[8], [dark_r, dark_g, dark_b, 255]);
        let greens: Vec<u8> =
            [2.5e-5, 1e-4, 1e-3, 1e-2, 0.25].map(|error| shown(error)[7 * 16 + 7][1]).into();
        assert!(greens.is_sorted_by(|a, b| a < b), "{greens:?}");
    }
}

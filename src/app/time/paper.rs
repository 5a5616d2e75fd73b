//! What the paper reports for its three scenes. [Yue, tables 1 and 2]

/// Names of the timing columns, in the paper's order. The first five are stages of a frame, `Ttot` a frame in which
/// everything is new, the last three a frame after a light moved, the camera moved, a material changed.
pub(super) const COLUMNS: [&str; 9] =
    ["Tdi", "Tlpe", "Thvds", "Tfg", "Tsplat", "Ttot", "Tlight", "Tview", "Tmat"];

/// A row of the paper's table 2, from a GeForce 7800 GTX.
#[derive(Debug)]
pub(super) struct PaperRow {
    /// Name of our scene that stands in for the paper's.
    pub(super) scene: &'static str,
    /// The paper's name for its scene.
    pub(super) label: &'static str,
    /// Milliseconds, by [`COLUMNS`].
    pub(super) ms: [f64; 9],
}

const ROWS: [PaperRow; 3] = [
    PaperRow { scene: "box", label: "Box", ms: [6.0, 11.0, 11.0, 5.0, 76.0, 109.0, 109.0, 87.0, 1271.0] },
    PaperRow {
        scene: "atrium",
        label: "Sponza",
        ms: [15.0, 15.0, 12.0, 27.0, 122.0, 191.0, 191.0, 164.0, 1310.0],
    },
    PaperRow {
        scene: "room",
        label: "Room",
        ms: [30.0, 23.0, 112.0, 142.0, 281.0, 588.0, 588.0, 453.0, 1807.0],
    },
];

/// The paper's row for one of its scenes; other scenes have none.
pub(super) fn row(scene: &str) -> Option<&'static PaperRow> {
    ROWS.iter().find(|row| row.scene == scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_are_the_sums_that_the_paper_prints() {
        for row in &ROWS {
            let [di, lpe, hvds, fg, splat, total, light, view, _] = row.ms;
            assert_eq!(di + lpe + hvds + fg + splat, total, "{}", row.label);
            assert_eq!((light, view), (total, di + fg + splat), "{}", row.label);
        }
    }
}

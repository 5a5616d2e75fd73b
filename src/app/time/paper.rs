//! The paper's results for its three scenes. [Yue, tables 1 to 3]

/// Names of the timing columns, in the paper's order. The first five are passes of a frame, and
/// `Ttot` is a frame with everything stale. The last three are frames after a light moved, the
/// camera moved, a material changed.
pub(super) const COLUMNS: [&str; 9] =
    ["Tdi", "Tlpe", "Thvds", "Tfg", "Tsplat", "Ttot", "Tlight", "Tview", "Tmat"];

/// Numbers of lights in table 3.
pub(super) const LIGHT_COUNTS: [u32; 4] = [1, 2, 4, 8];

/// The paper's results of a scene, on a Pentium D with a GeForce 7800 GTX.
#[derive(Debug)]
pub(super) struct PaperRow {
    /// Name of our scene that replaces the paper's.
    pub(super) scene: &'static str,
    /// The paper's name for its scene.
    pub(super) label: &'static str,
    pub(super) triangles: u32,
    pub(super) size: [u32; 2],
    pub(super) precompute_minutes: f64,
    /// Frames per second.
    pub(super) fps: f64,
    pub(super) memory_mb: f64,
    /// Milliseconds, by [`COLUMNS`].
    pub(super) ms: [f64; 9],
    /// Frames per second, by [`LIGHT_COUNTS`].
    pub(super) fps_by_lights: [f64; 4],
}

const ROWS: [PaperRow; 3] = [
    PaperRow {
        scene: "box",
        label: "Box",
        triangles: 2914,
        size: [512, 512],
        precompute_minutes: 32.0,
        fps: 9.2,
        memory_mb: 165.0,
        ms: [6.0, 11.0, 11.0, 5.0, 76.0, 109.0, 109.0, 87.0, 1271.0],
        fps_by_lights: [9.1, 8.6, 8.2, 7.2],
    },
    PaperRow {
        scene: "atrium",
        label: "Sponza",
        triangles: 76_154,
        size: [640, 480],
        precompute_minutes: 43.0,
        fps: 5.1,
        memory_mb: 172.0,
        ms: [15.0, 15.0, 12.0, 27.0, 122.0, 191.0, 191.0, 164.0, 1310.0],
        fps_by_lights: [5.2, 4.8, 4.3, 3.6],
    },
    PaperRow {
        scene: "room",
        label: "Room",
        triangles: 141_287,
        size: [640, 480],
        precompute_minutes: 50.0,
        fps: 1.7,
        memory_mb: 197.0,
        ms: [30.0, 23.0, 112.0, 142.0, 281.0, 588.0, 588.0, 453.0, 1807.0],
        fps_by_lights: [1.7, 1.5, 1.2, 1.0],
    },
];

/// The paper's row for a scene. `None` for scenes that are not in the paper.
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
            // The frame rates of tables 1 and 3 are the inverse of those times,
            // except for rounding.
            for fps in [row.fps, row.fps_by_lights[0]] {
                assert!((1000.0 / total - fps).abs() < 0.15, "{}", row.label);
            }
        }
    }
}

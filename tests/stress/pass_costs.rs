//! The cost model of a frame: the bytes that it reports for a pass follow from the sizes
//! of the buffers.

use crate::common::{assert_silent, context};
use crate::{FEW, count, prepare, the_box};
use glam::Vec3;
use lightpaths::renderer::{FrameReport, Renderer};
use lightpaths::scene::{Quality, shapes};

/// Bytes that the gather pass reads and writes for `records` records, each once.
fn gathering(renderer: &Renderer, records: u32) -> u64 {
    let stages = renderer.stages();
    let all = stages.merged_rays.bytes() + stages.gathered.bytes();
    let of_all = (stages.gathered.bytes() / size_of::<lightpaths::types::Record>() as u64).max(1);
    u64::from(records) * all / of_all + stages.cluster_irradiance.bytes()
}

fn passes(report: &FrameReport, name: &str) -> usize {
    report.passes.iter().filter(|pass| pass.name == name).count()
}

#[test]
fn reported_bytes_are_those_of_the_records_that_a_frame_gathers() {
    let mut renderer = prepare(the_box(&[]), Quality { cache_points: 2_000, ..FEW });
    let first = renderer.frame().unwrap();
    let ahead = count(&renderer, "records gathered ahead, for small clusters beside them") as u32;
    assert!(ahead > 0 && passes(&first, "gather") > 1);
    // A frame with several gather passes reports their mean.
    let mean = (first.gathered + ahead) / passes(&first, "gather") as u32;
    assert_eq!(first.bytes["gather"], gathering(&renderer, mean));

    let camera = renderer.scene().cameras[0].clone();
    let target = camera.target + 0.4 * camera.frame()[0] * (camera.target - camera.position).length();
    renderer.move_camera(camera.position, target);
    let moved = renderer.frame().unwrap();
    assert!(moved.gathered > 0 && passes(&moved, "gather") == 1, "{}", moved.gathered);
    assert_eq!(moved.bytes["gather"], gathering(&renderer, moved.gathered));

    // A new view reads the splat weights to build the list of needed records. An edit of a
    // light does not.
    renderer.move_light(0, Vec3::new(0.01, 0.0, 0.0)).unwrap();
    let lit = renderer.frame().unwrap();
    let listed = |report: &FrameReport| report.bytes["needed_records"];
    assert!(listed(&moved) > listed(&lit), "{} and {} bytes", listed(&moved), listed(&lit));
    assert_silent(&context());
}

/// Statistics leave out a fraction whose denominator is zero.
#[test]
fn shares_are_numbers_where_there_is_nothing_to_share() {
    for quality in [
        Quality { cache_points: 0, ..FEW },
        Quality { entry_points: 0, ..FEW },
        Quality { cache_points: 0, entry_points: 0, ..FEW },
    ] {
        let mut renderer = prepare(shapes::closed_box(Vec3::ONE, 0.5), quality);
        renderer.frame().unwrap();
        let statistics = renderer.statistics().unwrap();
        for (name, fraction) in statistics.skipped.iter().chain(&statistics.removed) {
            assert!((0.0..=1.0).contains(fraction), "{name}: {fraction}");
        }
    }
    assert_silent(&context());
}

//! The same inputs give the same bytes, after any history.

use crate::common::{assert_silent, context};
use crate::{FEW, LAYERS, prepare, the_box};
use glam::Vec3;
use lightpaths::renderer::{Renderer, Work};

/// Every layer's bits.
pub(crate) fn bits(renderer: &Renderer) -> Vec<u32> {
    let layers = LAYERS.iter().flat_map(|layer| renderer.layer(*layer).unwrap());
    layers.flat_map(|pixel| pixel.map(f32::to_bits)).collect()
}

fn cold() -> Renderer {
    prepare(the_box(&[]), FEW)
}

#[test]
fn cold_starts_and_the_twentieth_frame_agree_to_the_bit() {
    let mut first = cold();
    first.frame().unwrap();
    let expected = bits(&first);
    assert!(expected.iter().any(|word| *word != 0));
    let mut second = cold();
    second.frame().unwrap();
    assert!(bits(&second) == expected, "two cold starts");
    for _ in 1..20 {
        second.force(Work::Everything);
        second.frame().unwrap();
    }
    assert!(bits(&second) == expected, "the 20th frame");
    assert_silent(&context());
}

#[test]
fn a_light_and_a_camera_edited_are_as_good_as_loaded() {
    let moved = ["light.lamp.position=[0.3,1.2,0.4]", "camera.position=[0.2,1.1,3.5]"].map(str::to_owned);
    let mut loaded = prepare(the_box(&moved), FEW);
    loaded.frame().unwrap();
    let target = loaded.scene().cameras[0].clone();
    let mut edited = cold();
    edited.frame().unwrap();
    edited.move_light(0, loaded.scene().lights[0].kind.position().unwrap()).unwrap();
    edited.frame().unwrap();
    edited.move_camera(target.position, target.target);
    edited.frame().unwrap();
    assert!(bits(&edited) == bits(&loaded));
    assert_silent(&context());
}

/// Frames skip records that no pixel uses and clusters that nothing reads, and compute them when
/// they are needed: all bits equal those of a renderer without skipping.
#[test]
fn what_no_pixel_uses_and_nothing_reads_is_left_out_to_no_effect() {
    let (mut sparing, mut untiring) = (cold(), cold());
    untiring.set_skipping(false);
    let camera = sparing.scene().cameras[0].clone();
    let light = sparing.scene().lights[0].kind.position().unwrap();
    let mut gathered = Vec::new();
    for step in 0..8 {
        for renderer in [&mut sparing, &mut untiring] {
            match step {
                1 | 4 => renderer.move_light(0, light - 0.1 * step as f32 * Vec3::Y).unwrap(),
                2 | 5 | 7 => {
                    renderer.move_camera(camera.position + 0.2 * step as f32 * Vec3::X, camera.target);
                }
                3 => renderer.set_diffuse(0, Vec3::new(0.3, 0.5, 0.4)).unwrap(),
                _ => {}
            }
        }
        gathered.push(sparing.frame().unwrap().gathered);
        let all = untiring.frame().unwrap().gathered;
        assert!(bits(&sparing) == bits(&untiring), "step {step}");
        let points = sparing.statistics().unwrap().counts["cache points"] as u32;
        assert_eq!(all, points, "step {step}");
        // The sixth step has no edit: the frame gathers the remaining records.
        assert!(step != 6 || gathered[4..].iter().sum::<u32>() == points, "{gathered:?} of {points}");
    }
    let (light, view, idle, last) = (gathered[4], gathered[5], gathered[6], gathered[7]);
    println!("{gathered:?} records");
    assert!(light > 100 && light == gathered[3] && view > 0 && view < light && idle > 50 && last == 0);
    let skipped = sparing.statistics().unwrap().skipped;
    for (what, least) in [
        ("clusters that nothing reads", 0.1),
        ("levels whose flux nothing takes", 0.0),
        ("clusters whose flux nothing takes", 0.0),
        ("path vertices whose flux nothing takes", 0.0),
        ("small clusters beside records that nothing reads", 0.1),
    ] {
        println!("{what}: {}", skipped[what]);
        assert!(skipped[what] >= least && skipped[what] < 1.0, "{what}: {}", skipped[what]);
    }
    sparing.move_light(0, Vec3::ZERO.with_y(1.5)).unwrap();
    sparing.frame().unwrap();
    let unused = sparing.statistics().unwrap().skipped["records that no pixel of the view uses"];
    assert!(unused > 0.05 && unused < 0.95, "{unused}");
    assert_silent(&context());
}

//! Surfaces that are lost, go out of date, or come back on another screen: the picture is the same
//! to the byte.

use std::process::Command;

use image::RgbImage;

use crate::demo::Demo;
use crate::display::Display;
use crate::faults::Faults;
use crate::keys;
use crate::layer::{assert_all_destroyed, calls_in};
use crate::picture::{Area, changed_pixels};
use crate::scenarios::{ASIDE, BOX, READY, SIDE, SOON, changed, close, settled};

/// The Box with its panels, under faults.
pub fn open<'a>(display: &'a Display, faults: &Faults, extra: &[&str]) -> Demo<'a> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.arg("demo").args(BOX).args(extra);
    faults.afflict(&mut command);
    command.env("LIGHTPATHS_CALLS", faults.calls());
    let demo = Demo::run(Some(display), command);
    demo.wait_for_line("lightpaths: ready", READY);
    demo.client();
    demo
}

/// The window without the times of frames.
fn whole(demo: &Demo) -> RgbImage {
    demo.client().move_to(ASIDE);
    let mut shown = demo.settled(Some(PANELS));
    // The chart and its numbers change with each rendered frame.
    let (width, height) = shown.dimensions();
    for (x, y, pixel) in shown.enumerate_pixels_mut() {
        if x >= SIDE && y >= PANELS.height && y < height && x < width {
            *pixel = image::Rgb([0; 3]);
        }
    }
    shown
}

/// The picture and the panels above the times.
const PANELS: Area = Area { x: 0, y: 0, width: SIDE + 300, height: 360 };

/// Asserts that the picture is the same, and that input still works.
fn goes_on(demo: &Demo, before: &RgbImage, what: &str) {
    // The window paints again by itself after a failed attempt.
    demo.wait_for_picture(SOON);
    demo.assert_presents(SOON);
    let after = whole(demo);
    assert_eq!(changed_pixels(before, &after, Area::from_image(before), 0), 0, "{what}: the same is shown");
    demo.client().tap(&[], keys::of('2'));
    changed(demo, &after);
    demo.client().tap(&[], keys::of('1'));
    let again = whole(demo);
    assert_eq!(changed_pixels(before, &again, Area::from_image(before), 0), 0, "{what}: and again");
}

#[test]
fn lost_surfaces_outdated_swapchains_and_other_formats_show_the_same_bytes() {
    const FAULTS: [&str; 8] = [
        "vkAcquireNextImageKHR:1:VK_ERROR_SURFACE_LOST_KHR",
        "vkQueuePresentKHR:1:VK_ERROR_SURFACE_LOST_KHR",
        "vkAcquireNextImageKHR:1:VK_ERROR_OUT_OF_DATE_KHR",
        "vkQueuePresentKHR:1:VK_ERROR_OUT_OF_DATE_KHR",
        "vkAcquireNextImageKHR:1:VK_ERROR_OUT_OF_DATE_KHR,vkCreateSwapchainKHR:1:VK_ERROR_SURFACE_LOST_KHR",
        "vkAcquireNextImageKHR:1:VK_ERROR_OUT_OF_DATE_KHR,vkGetPhysicalDeviceSurfaceCapabilitiesKHR:1:VK_ERROR_SURFACE_LOST_KHR",
        "vkAcquireNextImageKHR:1:VK_ERROR_SURFACE_LOST_KHR,vkGetPhysicalDeviceSurfaceFormatsKHR:1:VK_ERROR_SURFACE_LOST_KHR",
        "vkAcquireNextImageKHR:1:VK_ERROR_SURFACE_LOST_KHR,vkQueuePresentKHR:1:VK_ERROR_SURFACE_LOST_KHR",
    ];
    let (display, faults) = (Display::start(), Faults::new());
    let demo = open(&display, &faults, &[]);
    settled(&demo);
    let before = whole(&demo);
    for fault in FAULTS {
        faults.strike(&demo, fault, || demo.client().blot());
        goes_on(&demo, &before, fault);
    }

    // The new screen may have another format.
    let another_format = |demo: &Demo, faults: &Faults, formats: &str| {
        let fault = format!(
            "vkAcquireNextImageKHR:1:VK_ERROR_SURFACE_LOST_KHR,vkGetPhysicalDeviceSurfaceFormatsKHR:1+:{formats}"
        );
        faults.strike(demo, &fault, || demo.client().blot());
        goes_on(demo, &before, formats);
    };
    for formats in ["UNORM", "REVERSED", "UNORM"] {
        another_format(&demo, &faults, formats);
    }
    close(&demo);

    // The same from the start.
    let faults = Faults::new();
    faults.set("vkGetPhysicalDeviceSurfaceFormatsKHR:1+:UNORM");
    let demo = open(&display, &faults, &[]);
    demo.wait_for_line("faults: vkGetPhysicalDeviceSurfaceFormatsKHR", SOON);
    settled(&demo);
    goes_on(&demo, &before, "from the start");
    another_format(&demo, &faults, "SRGB");
    close(&demo);
    // Both kinds of swapchains were created, and no call that creates an object has failed.
    let calls = calls_in(&faults.calls());
    assert_all_destroyed(&calls, "window");
    assert!(calls["vkCreateSwapchainKHR"] > 0 && calls["vkCreateGraphicsPipelines"] > 0, "{calls:?}");
}

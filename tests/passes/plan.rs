//! Frame plans: what each kind of edit makes stale, alone and together with another; and that a
//! frame of any edit is one submission, after which the host reads nothing back.

use crate::common::assert_silent;
use glam::Vec3;
use lightpaths::gpu::barrier::COMPUTE_TO_TRANSFER;
use lightpaths::gpu::{Buffer, Context, ContextOptions, InFlight};
use lightpaths::passes::frame::needed_records::RecordRequest;
use lightpaths::renderer::{
    FramePlan, Gathering, Layer, LightResults, Preview, RecordedFrame, Renderer, Scan, Silent,
};
use lightpaths::scene::{Camera, DisplayTransform, Light, LightKind, Quality, Scene, shapes};
use std::collections::VecDeque;
use std::sync::Arc;

/// A room with two lights, one of them large, and an editable material which may become glossy.
fn scene(may_be_glossy: bool) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.6);
    scene.quality =
        Quality { entry_points: 2_000, cache_points: 200, gather_rays: 32, cells: 8, ..Quality::DRAFT };
    scene.cameras[0].size = [33, 17];
    scene.materials[0].editable = may_be_glossy;
    let (edge_u, edge_v) = (Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.2));
    let corner = Vec3::new(0.1, 0.3, 0.1);
    let kind = LightKind::Area { corner, edge_u, edge_v, radiance: Vec3::ONE, samples: 20 };
    scene.lights.push(Light::new("large", kind));
    scene
}

type Edit = (&'static str, fn(&mut Renderer));

/// An edit of each kind that keeps the number of lights. None of two together undoes the other.
const EDITS: &[Edit] = &[
    ("nothing", |_| ()),
    ("a light moves", |renderer| renderer.move_light(0, Vec3::new(0.1, 0.2, 0.0)).unwrap()),
    ("a light moves to a wall", |renderer| renderer.move_light(0, Vec3::new(0.4999, 0.1, 0.2)).unwrap()),
    ("a light changes its colour", |renderer| {
        let kind = renderer.scene().lights[1].kind;
        renderer.set_light(1, kind.with_emission(Vec3::new(1.0, 2.0, 3.0))).unwrap();
    }),
    ("the camera moves", |renderer| renderer.move_camera(Vec3::new(0.2, 0.0, 0.4), Vec3::ZERO)),
    ("the exposure changes", |renderer| renderer.set_exposure(1.0)),
    ("the weights of light change", |renderer| renderer.set_light_weights([1.0, 0.5])),
    ("an albedo changes", |renderer| renderer.set_diffuse(0, Vec3::new(0.5, 0.4, 0.3)).unwrap()),
];

/// Further edits.
const MORE: &[Edit] = &[
    ("a light is switched off", |renderer| renderer.switch_light(1, false).unwrap()),
    ("a light is switched on", |renderer| renderer.switch_light(1, true).unwrap()),
    ("a light is added", |renderer| {
        let kind = renderer.scene().lights[0].kind.moved_to(Vec3::new(-0.2, 0.1, 0.1));
        renderer.add_light(Light::new("third", kind)).unwrap();
    }),
    ("a light is removed", |renderer| drop(renderer.remove_light(0).unwrap())),
    ("the only light changes its colour", |renderer| {
        let kind = renderer.scene().lights[0].kind;
        renderer.set_light(0, kind.with_emission(Vec3::new(3.0, 2.0, 1.0))).unwrap();
    }),
];

fn renderer(context: &Arc<Context>, may_be_glossy: bool) -> Renderer {
    let mut renderer = Renderer::new(context, scene(may_be_glossy), &mut Silent).unwrap();
    settle(&mut renderer);
    renderer
}

/// Renders until nothing is stale.
fn settle(renderer: &mut Renderer) {
    for _ in 0..3 {
        renderer.frame().unwrap();
    }
    assert!(renderer.plan().is_idle() && renderer.plan().gather == Gathering::Nothing);
}

/// Renders the frame of an edit, and asserts that it is one submission without a read-back.
fn assert_one_submission(context: &Arc<Context>, renderer: &mut Renderer, (what, edit): Edit) {
    for step in ["the edit", "the idle frame", "the last frame"] {
        let before = (context.submission_count(), context.read_back_bytes());
        if step == "the edit" {
            edit(renderer);
            assert_eq!(context.submission_count(), before.0, "{what}: submissions of the edit itself");
        }
        let report = renderer.frame().unwrap();
        assert_eq!(context.submission_count() - before.0, 1, "{what}, {step}: submissions");
        assert_eq!(context.read_back_bytes(), before.1, "{what}, {step}: bytes read back");
        assert!(!report.needs_precompute, "{what}");
    }
    assert_eq!(context.take_redundant_barriers(), [""; 0], "{what}");
}

#[test]
fn frames_of_all_edits_are_one_submission() {
    // A device of its own: submissions of other tests would count.
    let context = Context::new(&ContextOptions { validation: true, ..ContextOptions::default() }).unwrap();
    for may_be_glossy in [false, true] {
        let renderer = &mut renderer(&context, may_be_glossy);
        context.take_redundant_barriers();
        for &edit in EDITS.iter().chain(MORE) {
            assert_one_submission(&context, renderer, edit);
        }
        if may_be_glossy {
            let glossy: Edit = ("a material becomes glossy", |renderer| {
                renderer.set_material(0, Vec3::splat(0.3), Vec3::splat(0.4), 30.0).unwrap();
            });
            for edit in [glossy, EDITS[1], EDITS[4]] {
                assert_one_submission(&context, renderer, edit);
            }
        }
        // A picture of another size takes no submission more, and no pipeline.
        let made = context.pipelines_made();
        renderer.resize([40, 30]).unwrap();
        renderer.frame().unwrap();
        assert_eq!(context.pipelines_made(), made, "pipelines of another size");
        // Nor does a second renderer, or the preview.
        let scene = scene(may_be_glossy);
        let (camera, lights) = (scene.cameras[0].clone(), scene.lights.clone());
        Renderer::new(&context, scene.clone(), &mut Silent).unwrap().frame().unwrap();
        assert_eq!(context.pipelines_made(), made, "pipelines of a second renderer");
        let mut preview = Preview::new(&context, scene.clone()).unwrap();
        let before = context.submission_count();
        preview.frame(&camera, &lights, &scene.materials, DisplayTransform::default()).unwrap();
        assert_eq!(context.submission_count() - before, 1, "submissions of the preview");
        // A scene that may be glossy composes with another variant.
        let variants = u32::from(may_be_glossy);
        assert!(context.pipelines_made() - made <= variants, "pipelines of the preview");
    }
    assert!(context.take_validation_messages().is_empty());
}

#[test]
fn frames_whose_passes_wait_only_for_their_data_have_the_same_bits() {
    let context = crate::common::context();
    for may_be_glossy in [false, true] {
        let mut serialised = renderer(&context, may_be_glossy);
        let mut free = renderer(&context, may_be_glossy);
        free.set_serialised(false);
        for (what, edit) in EDITS.iter().chain(MORE) {
            for renderer in [&mut serialised, &mut free] {
                edit(renderer);
            }
            for step in ["the edit", "the idle frame"] {
                let [expected, found] = [&mut serialised, &mut free].map(|renderer| {
                    renderer.frame().unwrap();
                    let records: Vec<u32> = renderer.stages().records.read().unwrap();
                    let picture = renderer.layer(Layer::Beauty).unwrap();
                    (records, picture, renderer.display().unwrap())
                });
                assert!(found == expected, "{what}, {step}");
            }
        }
    }
    assert_silent(&context);
}

/// What a frame does after two edits, from what it does after each.
fn together(a: &FramePlan, b: &FramePlan) -> FramePlan {
    let light = |(a, b): (&LightResults, &LightResults)| LightResults {
        cleared: a.cleared || b.cleared,
        factors: a.factors || b.factors,
        irradiance: a.irradiance || b.irradiance,
        clusters: a.clusters || b.clusters,
        hits: a.hits || b.hits,
        highlights: a.highlights || b.highlights,
    };
    let mut both = FramePlan {
        view: a.view || b.view,
        lobe_rays: a.lobe_rays || b.lobe_rays,
        pixel_batches: a.pixel_batches || b.pixel_batches,
        lights: a.lights.iter().zip(&b.lights).map(light).collect(),
        direct_sum: a.direct_sum || b.direct_sum,
        scan: match (a.scan, b.scan) {
            (Scan::None, other) | (other, Scan::None) => other,
            (Scan::Materials(a), Scan::Materials(b)) => Scan::Materials(a | b),
            _ => Scan::All,
        },
        hierarchy: a.hierarchy || b.hierarchy,
        splat: a.splat || b.splat,
        gloss: a.gloss || b.gloss,
        compose: a.compose || b.compose,
        display: a.display || b.display,
        ..a.clone()
    };
    both.uploads.emission |= b.uploads.emission;
    both.uploads.materials |= b.uploads.materials;
    both.gather = match (both.hierarchy, both.view) {
        (true, view_is_new) => {
            Gathering::List(RecordRequest { view_is_new, none_is_current: true, all: false })
        }
        (false, _) => Gathering::Nothing,
    };
    both
}

#[test]
fn plans_of_two_edits_are_what_each_plans() {
    let context = crate::common::context();
    for may_be_glossy in [false, true] {
        let mut renderer = renderer(&context, may_be_glossy);
        let start = renderer.scene().clone();
        let mut plan_of = |edits: &[Edit]| {
            // Back to the start.
            renderer.set_camera(&start.cameras[0]);
            (0..)
                .zip(&start.lights)
                .for_each(|(index, light)| renderer.set_light(index, light.kind).unwrap());
            renderer.set_exposure(0.0);
            renderer.set_light_weights([1.0, 1.0]);
            renderer.set_diffuse(0, start.materials[0].diffuse).unwrap();
            settle(&mut renderer);
            edits.iter().for_each(|(_, edit)| edit(&mut renderer));
            renderer.plan()
        };
        let alone: Vec<FramePlan> = EDITS.iter().map(|&edit| plan_of(&[edit])).collect();
        for (first, a) in EDITS.iter().zip(&alone) {
            for (second, b) in EDITS.iter().zip(&alone).filter(|(second, _)| second.0 != first.0) {
                let mut found = plan_of(&[*first, *second]);
                let expected = together(a, b);
                // A change of colour leaves the table dirty until a frame traces to a light.
                assert!(found.uploads.lights || !expected.lights.iter().any(|light| light.factors));
                found.uploads.lights = expected.uploads.lights;
                // Whether the marks of the last view are kept depends on earlier frames.
                if let Gathering::List(request) = &mut found.gather {
                    request.view_is_new = found.view;
                }
                assert_eq!(found, expected, "{}, {}", first.0, second.0);
            }
        }
        assert_ne!(alone[1], alone[0]);
    }
}

#[test]
fn plans_name_what_runs() {
    let context = crate::common::context();
    let mut renderer = renderer(&context, true);
    assert_eq!(renderer.plan().to_string(), "nothing\n");
    let all = LightResults {
        cleared: false,
        factors: true,
        irradiance: true,
        clusters: true,
        hits: true,
        highlights: true,
    };
    renderer.move_light(0, Vec3::new(0.1, 0.2, 0.0)).unwrap();
    let plan = renderer.plan();
    assert_eq!(plan.lights, [all, LightResults::default()]);
    let request = RecordRequest { view_is_new: false, none_is_current: true, all: false };
    assert!(plan.uploads.lights && !plan.view && !plan.pixel_batches && plan.scan == Scan::None);
    assert!([Gathering::Listed, Gathering::List(request)].contains(&plan.gather), "{:?}", plan.gather);
    let lines = plan.to_string();
    for line in [
        "upload the lights",
        "light 0: irradiance at pixels, form factors, flux of clusters, glossy hits, highlights",
        "sum of direct light",
        "hierarchy: live set, near field",
        "compose",
    ] {
        assert!(lines.lines().any(|found| found == line), "`{line}` in\n{lines}");
    }
    // A frame leaves nothing of its plan to the next.
    renderer.frame().unwrap();
    assert_eq!(renderer.plan().lights, [LightResults::default(); 2]);
    let camera = renderer.scene().cameras[0].clone();
    renderer.set_camera(&Camera { position: camera.position + 0.01, ..camera });
    let plan = renderer.plan();
    assert!(plan.view && plan.pixel_batches && !plan.hierarchy && !plan.uploads.lights);
    assert!(plan.lights.iter().all(|light| light.irradiance && light.hits && !light.factors));
}

/// Frames as the window submits them: the next one is recorded and submitted before the last one
/// has ended.
#[derive(Default)]
struct Window {
    in_flight: VecDeque<(InFlight, RecordedFrame)>,
    most: usize,
    shown: Vec<Buffer>,
}

impl Window {
    /// Submits a frame with a copy of its picture.
    fn frame(&mut self, context: &Arc<Context>, renderer: &mut Renderer) {
        self.end_frames(renderer, 1);
        let (mut recorder, frame) = renderer.begin_frame().unwrap();
        let in_flight = loop {
            let display = renderer.display_buffer();
            let shown = Buffer::storage(context, "shown", display.bytes()).unwrap();
            recorder.barrier(COMPUTE_TO_TRANSFER);
            recorder.copy(display, &shown);
            let in_flight = recorder.submit().unwrap();
            if frame.has_lists() {
                in_flight.wait().unwrap();
                if !renderer.fits(&frame).unwrap() {
                    recorder = renderer.record_frame(&frame).unwrap();
                    continue;
                }
            }
            self.shown.push(shown);
            break in_flight;
        };
        renderer.frame_is_valid(&frame);
        self.in_flight.push_back((in_flight, frame));
        self.most = self.most.max(self.in_flight.len());
    }

    fn end_frames(&mut self, renderer: &mut Renderer, most: usize) {
        while self.in_flight.len() > most {
            let (in_flight, frame) = self.in_flight.pop_front().unwrap();
            renderer.end_frame(&frame, in_flight.wait().unwrap()).unwrap();
        }
    }
}

#[test]
fn two_frames_in_flight_have_the_bits_of_frames_one_after_another() {
    let context = crate::common::context();
    for (may_be_glossy, is_serialised) in [(false, false), (true, true)] {
        let mut expected = renderer(&context, may_be_glossy);
        let mut found = renderer(&context, may_be_glossy);
        found.set_serialised(is_serialised);
        let (mut window, mut pictures) = (Window::default(), Vec::new());
        let resized: Edit = ("another size", |renderer| renderer.resize([40, 30]).unwrap());
        let edits = || EDITS.iter().chain(MORE).chain([&resized]).chain(EDITS);
        for (what, edit) in edits() {
            edit(&mut found);
            // The idle frame, and one without work, are in flight with edits, too.
            for _ in 0..3 {
                window.frame(&context, &mut found);
            }
            edit(&mut expected);
            for step in 0..3 {
                expected.frame().unwrap();
                pictures.push((*what, step, expected.display_buffer().read::<u32>().unwrap()));
            }
        }
        assert_eq!(window.most, 2, "frames in flight");
        window.end_frames(&mut found, 0);
        for ((what, step, picture), shown) in pictures.iter().zip(&window.shown) {
            assert_eq!(*picture, shown.read::<u32>().unwrap(), "{what}, frame {step}");
        }
        assert_eq!(pictures.len(), window.shown.len());
        for layer in [Layer::Beauty, Layer::Indirect] {
            assert_eq!(expected.layer(layer).unwrap(), found.layer(layer).unwrap(), "{layer:?}");
        }
        assert!(found.plan().is_idle() && found.plan().gather == Gathering::Nothing, "nothing is stale");
    }
    assert_silent(&context);
}

//! The cost of frames without a clock: commands, rays, bytes and items of the frame of each edit
//! stay below limits that no noise reaches. A change that needs more raises a limit here, and says
//! why in its commit.

use glam::Vec3;
use lightpaths::gpu::{CommandCounts, Context, ContextOptions};
use lightpaths::renderer::{FrameReport, Renderer, Silent, Work};
use lightpaths::scene::{LoadOptions, Scene};
use std::sync::Arc;

/// The counts of a frame, in the order of the columns of [`LIMITS`].
const COUNTS: [&str; 14] = [
    "submissions",
    "dispatches",
    "barriers",
    "barriers without waits",
    "bytes read back",
    "camera rays",
    "shadow rays",
    "kilobytes",
    "fragments",
    "mixed fragments",
    "shadow edges",
    "records weighed",
    "splat weights",
    "records gathered",
];

/// The edits, in the order of the rows of [`LIMITS`].
const EDITS: [(&str, Option<Work>); 6] = [
    ("everything", Some(Work::Everything)),
    ("a light", Some(Work::Light(0))),
    ("the camera", Some(Work::View)),
    ("a material", Some(Work::Material)),
    ("a colour", Some(Work::Colour)),
    ("nothing", None),
];

type Counts = [u64; COUNTS.len()];

/// Upper limits of each scene: commands as they are, other counts with 5 % in reserve.
const LIMITS: [(&str, [Counts; EDITS.len()]); 3] = [
    (
        "box",
        [
            [1, 70, 79, 39, 0, 19_200, 49_100, 23_000, 2750, 165, 212, 198_000, 60_100, 2750],
            [1, 35, 41, 26, 0, 0, 49_100, 14_100, 2750, 165, 212, 198_000, 60_100, 2750],
            [1, 50, 57, 39, 0, 19_200, 28_400, 14_300, 2680, 163, 217, 201_000, 60_300, 76],
            [1, 31, 35, 26, 0, 0, 0, 14_400, 2680, 0, 0, 201_000, 60_300, 2680],
            [1, 3, 4, 4, 0, 0, 0, 1920, 2680, 0, 0, 201_000, 60_300, 0],
            [1, 9, 13, 11, 0, 0, 0, 2900, 2680, 0, 0, 201_000, 60_300, 1960],
        ],
    ),
    (
        "atrium",
        [
            [1, 70, 79, 39, 0, 19_200, 124_000, 33_700, 22_700, 3590, 834, 1_840_000, 82_900, 1760],
            [1, 35, 41, 26, 0, 0, 124_000, 22_500, 22_700, 3590, 834, 1_840_000, 82_900, 1760],
            [1, 50, 57, 39, 0, 19_200, 104_000, 20_700, 22_700, 3630, 857, 1_850_000, 83_300, 51],
            [1, 31, 35, 26, 0, 0, 0, 20_600, 22_700, 0, 0, 1_850_000, 83_300, 1750],
            [1, 3, 4, 4, 0, 0, 0, 3120, 22_700, 0, 0, 1_850_000, 83_300, 0],
            [1, 9, 13, 11, 0, 0, 0, 3670, 22_700, 0, 0, 1_850_000, 83_300, 2840],
        ],
    ),
    (
        "room",
        [
            [1, 90, 103, 39, 0, 19_200, 196_000, 34_900, 19_800, 4660, 846, 2_110_000, 91_100, 2070],
            [1, 39, 46, 27, 0, 0, 113_000, 19_900, 19_800, 3110, 662, 2_110_000, 91_100, 2070],
            [1, 58, 67, 39, 0, 19_200, 158_000, 22_400, 19_800, 4890, 838, 2_090_000, 91_600, 62],
            [1, 32, 35, 26, 0, 0, 0, 18_900, 19_800, 0, 0, 2_090_000, 91_600, 2080],
            [1, 23, 25, 21, 0, 0, 0, 14_800, 19_800, 0, 0, 2_090_000, 91_600, 2080],
            [1, 9, 13, 11, 0, 0, 0, 3100, 19_800, 0, 0, 2_090_000, 91_600, 2510],
        ],
    ),
];

/// A small picture of a built-in scene.
fn renderer(context: &Arc<Context>, name: &str) -> Renderer {
    let mut set: Vec<String> = [
        "camera.size=[160,120]",
        "quality.preset=\"draft\"",
        "quality.entry_points=20000",
        "quality.cache_points=4000",
        "quality.gather_rays=64",
        "quality.directions=64",
    ]
    .map(str::to_owned)
    .to_vec();
    if name != "box" {
        set.push("model.0.triangles=10000".to_owned());
    }
    let scene = Scene::load(name, &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    Renderer::new(context, scene, &mut Silent).unwrap()
}

/// A renderer whose lists have their capacity.
fn settled(context: &Arc<Context>, name: &str) -> Renderer {
    let mut renderer = renderer(context, name);
    renderer.frame().unwrap();
    round(context, &mut renderer);
    renderer
}

/// Makes an edit and renders its frame.
fn edited(context: &Context, renderer: &mut Renderer, edit: Option<Work>) -> (FrameReport, CommandCounts) {
    let before = context.command_counts();
    match edit {
        Some(Work::View) => {
            let camera = renderer.scene().cameras[0].clone();
            let step = 0.01 * (camera.target - camera.position).length() * camera.frame()[0];
            renderer.move_camera(camera.position + step, camera.target + step);
        }
        Some(work) => renderer.force(work),
        None => {}
    }
    (renderer.frame().unwrap(), context.command_counts() - before)
}

/// Counts of a frame of each edit, and the frames' reports. The camera is where it was afterwards.
fn round(context: &Context, renderer: &mut Renderer) -> Vec<(Counts, FrameReport)> {
    let camera = renderer.scene().cameras[0].clone();
    let mut frames = |is_serialised| {
        renderer.set_serialised(is_serialised);
        let frames = EDITS.map(|(_, edit)| edited(context, renderer, edit));
        renderer.set_camera(&camera);
        renderer.frame().unwrap();
        frames
    };
    let free = frames(false).map(|(_, commands)| commands.barriers);
    let counted = frames(true).into_iter().zip(free);
    counted.map(|((report, commands), free)| (counts(&report, commands, free), report)).collect()
}

fn counts(report: &FrameReport, commands: CommandCounts, free_barriers: u64) -> Counts {
    // Each command of a frame belongs to a pass, if the frame has one.
    let dispatches: u32 = report.passes.iter().map(|pass| pass.dispatches).sum();
    let barriers: u32 = report.passes.iter().map(|pass| pass.barriers).sum();
    assert_eq!(u64::from(dispatches), commands.dispatches);
    assert!(report.passes.is_empty() || u64::from(barriers) == commands.barriers);
    let bytes: u64 = report.passes.iter().map(|pass| report.bytes.get(pass.name).unwrap_or(&0)).sum();
    let camera_rays = report.rays.get("primary").copied().unwrap_or(0);
    [
        commands.submissions,
        commands.dispatches,
        commands.barriers,
        free_barriers,
        commands.read_back_bytes,
        camera_rays,
        report.rays.values().sum::<u64>() - camera_rays,
        bytes / 1000,
        report.counts.fragments,
        report.counts.mixed_fragments,
        report.counts.shadow_edges,
        report.counts.weighed_records,
        report.counts.splat_weights,
        report.gathered.into(),
    ]
}

#[test]
fn frames_of_edits_cost_no_more_than_their_limits() {
    // A device of its own: commands of other tests would count.
    let context = Context::new(&ContextOptions::default()).unwrap();
    let mut above = Vec::new();
    for (scene, limits) in LIMITS {
        let mut renderer = settled(&context, scene);
        let found = round(&context, &mut renderer);
        if scene == "box" {
            renderer = settled(&context, scene);
        }
        let again = round(&context, &mut renderer);
        for (((edit, _), (counts, _)), (other, _)) in EDITS.iter().zip(&found).zip(&again) {
            println!("{scene}, {edit}: {counts:?}");
            assert_eq!(counts, other, "{scene}, {edit}: counts of two runs");
        }
        for (((edit, _), (counts, _)), limits) in EDITS.iter().zip(&found).zip(&limits) {
            let columns = COUNTS.iter().zip(counts.iter().zip(limits));
            let too_many = columns.filter(|(_, (count, limit))| count > limit);
            above.extend(
                too_many.map(|(what, (count, limit))| {
                    format!("{scene}, {edit}: {what} {count}, {limit} at most")
                }),
            );
        }
    }
    assert!(above.is_empty(), "{above:#?}");
}

#[test]
fn frames_trace_and_dispatch_what_their_edit_needs() {
    let context = Context::new(&ContextOptions::default()).unwrap();
    let mut renderer = settled(&context, "box");
    let frames = round(&context, &mut renderer);
    let passes = |edit: usize| frames[edit].1.passes.iter().map(|pass| (pass.name, pass.dispatches));
    // The Box has one light, whose colour is a factor of the picture.
    assert_eq!(passes(4).collect::<Vec<_>>(), [("compose", 2), ("tonemap", 1)]);
    for edit in 3..6 {
        assert_eq!(frames[edit].1.rays.len(), 0, "{}: rays", EDITS[edit].0);
    }
    let traced: Vec<_> = frames[1].1.rays.keys().copied().collect();
    assert_eq!(traced, ["direct", "form_factors", "shadow_edges"]);
    // The first idle frame has gathered all records; the next one has nothing to do.
    for records in [None, Some(0)] {
        let (report, commands) = edited(&context, &mut renderer, None);
        assert!(records.is_none_or(|records| report.gathered == records && report.passes.is_empty()));
        assert_eq!([commands.submissions, commands.read_back_bytes], [1, 0]);
    }
    // A forced edit has the commands of a real one.
    let mut light = |edit: &dyn Fn(&mut Renderer)| {
        let before = context.command_counts();
        edit(&mut renderer);
        renderer.frame().unwrap();
        context.command_counts() - before
    };
    let force = |renderer: &mut Renderer| renderer.force(Work::Light(0));
    // The first frame after the idle one lists the records of the view.
    light(&force);
    let forced = light(&force);
    let moved = light(&|renderer| {
        let position = renderer.scene().lights[0].kind.position().unwrap();
        renderer.move_light(0, position + Vec3::splat(0.01)).unwrap();
    });
    assert_eq!(forced, moved);
}

/// Shadow rays of a moved light from pixels, fragments, mixed ones and entry points, if points that
/// see it alike take one ray, and rays that this spares: upper and lower limits, 5 % in reserve.
const COMMON_RAYS: [(&str, u64, u64); 3] =
    [("box", 26_400, 10_100), ("atrium", 95_800, 9500), ("room", 87_700, 12_500)];

/// Samples of the first light of a scene at most.
const MOST_SAMPLES: u64 = 10;

#[test]
fn points_that_see_a_light_alike_take_few_rays() {
    let tuning = vec!["finds_alike=1".parse().unwrap()];
    let context = Context::new(&ContextOptions { tuning, ..ContextOptions::default() }).unwrap();
    let above = COMMON_RAYS.iter().filter_map(|&(scene, limit, fewest)| {
        let mut renderer = settled(&context, scene);
        let (report, _) = edited(&context, &mut renderer, Some(Work::Light(0)));
        let rays: u64 = report.rays.values().sum();
        println!("{scene}: {:?}, {} spared", report.rays, report.counts.spared_rays);
        // A point takes a ray to a light's sample, has one spared, or needs none.
        let (spared, points) = (report.counts.spared_rays, 160 * 120 + report.counts.fragments + 20_000);
        assert!(spared >= fewest && rays + spared <= MOST_SAMPLES * points, "{scene}: {spared} spared");
        (rays > limit).then(|| format!("{scene}: {rays} rays, {limit} at most"))
    });
    assert_eq!(above.collect::<Vec<_>>(), [""; 0]);
}

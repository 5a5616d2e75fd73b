//! Profiling sessions, which replace the tables of `time`, with one scene.

use std::path::PathBuf;

use clap::Args;

use super::replay::Replay;
use super::{Time, statistics, trace};
use crate::app::output::OutputFile;
use crate::app::{capture, overlap};
use crate::error::{Error, Result};
use crate::renderer::Work;
use crate::scene::Scene;

/// The scene where none is named.
const DEFAULT_SCENE: &str = "box";

/// What to do instead of tables.
#[derive(Debug, Args)]
#[group(id = "session", multiple = false, conflicts_with_all = ["json", "lights", "predict"])]
pub(super) struct SessionArgs {
    /// Instead of tables, of one scene [default: box]: writes when host and device did what in the
    /// precomputation and in N frames of each kind of edit, as trace events for Perfetto
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Instead of tables, of one scene [default: box]: does one pass of the frame alone, N times,
    /// 1 to 100000
    #[arg(long, num_args = 2, value_names = ["PASS", "N"], conflicts_with = "frames")]
    repeat: Option<Vec<String>>,
    /// Instead of tables, of one scene [default: box]: has RenderDoc capture one frame in which
    /// everything is new, to files whose names begin so; the program must run under RenderDoc
    #[arg(long, value_name = "FILE_TEMPLATE", conflicts_with = "frames")]
    capture: Option<PathBuf>,
    /// Instead of tables, of one scene [default: box]: prints what the driver tells of each kernel,
    /// such as registers and spills
    #[arg(long, conflicts_with = "frames")]
    statistics: bool,
    /// Instead of tables, of one scene [default: box]: prints what the frame of an edit does
    #[arg(long, value_name = "EDIT", conflicts_with = "frames")]
    plan: Option<PlannedEdit>,
}

/// An edit whose frame is planned.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(super) enum PlannedEdit {
    /// Nothing has changed since the last frame.
    Nothing,
    /// Every result is stale, as in the first frame.
    Everything,
    /// The first light moves.
    Light,
    /// Lights change their colours.
    Colour,
    /// The camera moves.
    Camera,
    /// A material changes.
    Material,
}

/// A session with valid arguments.
pub(super) enum Session {
    Trace(OutputFile),
    Repeat(Replay),
    Capture(PathBuf),
    Statistics,
    Plan(PlannedEdit),
}

impl SessionArgs {
    /// The requested session, if any.
    pub(super) fn chosen(&self) -> Result<Option<Session>> {
        let Self { trace, repeat, capture, statistics, plan } = self;
        Ok(match (trace, repeat, capture, plan) {
            (Some(file), ..) => Some(Session::Trace(OutputFile::check(file)?)),
            (_, Some(words), ..) => Some(Session::Repeat(Replay::parse(&words[0], &words[1])?)),
            (_, _, Some(template), _) => {
                capture::check_template(template)?;
                Some(Session::Capture(template.clone()))
            }
            (.., Some(edit)) => Some(Session::Plan(*edit)),
            _ if *statistics => Some(Session::Statistics),
            _ => None,
        })
    }
}

impl Session {
    pub(super) fn run(self, time: &Time) -> Result<()> {
        let spec = match &time.scenes[..] {
            [] => DEFAULT_SCENE,
            [one] => one,
            [_, second, ..] => {
                return Err(Error::Usage(format!(
                    "two scenes, `{second}` the second: profile one at a time"
                )));
            }
        };
        let scene = time.scene_args.load_lit(spec)?;
        overlap::refuse_inputs(time.session.trace.as_deref(), &scene.inputs)?;
        scene.warnings.iter().for_each(|warning| time.device_args.warn(warning));
        if cfg!(debug_assertions) {
            time.device_args.warn("this is a debug build; its times mean little");
        }
        match self {
            Self::Trace(output) => trace::run(time, scene, &output),
            Self::Repeat(repeat) => repeat.run(time, scene),
            Self::Capture(template) => capture_frame(time, scene, &template),
            Self::Statistics => statistics::run(time, scene),
            Self::Plan(edit) => print_plan(time, scene, edit),
        }
    }
}

/// Prints what the frame of an edit does.
fn print_plan(time: &Time, scene: Scene, edit: PlannedEdit) -> Result<()> {
    let context = time.device_args.open()?;
    let mut renderer = time.device_args.renderer(&context, scene)?;
    renderer.set_skipping(!time.no_skip);
    // The second frame gathers the records that the view does not use.
    renderer.frame()?;
    renderer.frame()?;
    match edit {
        PlannedEdit::Nothing => {}
        PlannedEdit::Everything => renderer.force(Work::Everything),
        PlannedEdit::Light => renderer.force(Work::Light(0)),
        PlannedEdit::Colour => renderer.force(Work::Colour),
        PlannedEdit::Camera => renderer.force(Work::View),
        PlannedEdit::Material => renderer.force(Work::Material),
    }
    let edit = clap::ValueEnum::to_possible_value(&edit)
        .map_or_else(String::new, |value| value.get_name().to_owned());
    crate::app::print(&format!("{}, {edit}:\n{}", renderer.scene().name, renderer.plan()))
}

/// Captures a frame after a warm-up frame that creates all resources.
fn capture_frame(time: &Time, scene: Scene, template: &std::path::Path) -> Result<()> {
    let context = time.device_args.open()?;
    let capture = capture::attach(template)?;
    let mut renderer = time.device_args.renderer(&context, scene)?;
    renderer.set_skipping(!time.no_skip);
    renderer.frame()?;
    renderer.force(Work::Everything);
    let (_, file) = capture.frame(|| renderer.frame())?;
    time.device_args.report_validation(&context);
    crate::app::print_line(&format!("{}: one frame", file.display()))
}

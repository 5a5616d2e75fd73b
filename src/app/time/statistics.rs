//! `time --statistics`: the driver's statistics of each kernel.

use std::fmt::Write;

use super::Time;
use crate::app::args::device_label;
use crate::error::Result;
use crate::gpu::{Context, ContextOptions, PipelineStatistics};
use crate::renderer::Renderer;
use crate::renderer::Silent;
use crate::scene::Scene;

pub(super) fn run(time: &Time, scene: Scene) -> Result<()> {
    let options = ContextOptions { statistics: true, ..time.device_args.context_options() };
    let context = Context::new(&options)?;
    let head = format!("{}, {}", device_label(&context), context.driver());
    if context.pipeline_statistics().is_none() {
        let why = "the driver lacks VK_KHR_pipeline_executable_properties";
        return crate::app::print(&format!("{head}: no statistics of kernels, {why}\n"));
    }
    let name = scene.name.clone();
    let mut renderer = Renderer::new(&context, scene, &mut Silent)?;
    renderer.set_skipping(!time.no_skip);
    // Some pipelines are created at first use.
    renderer.frame()?;
    time.device_args.report_validation(&context);
    let told = context.pipeline_statistics().unwrap_or_default();
    crate::app::print(&format!("{head}: kernels of {name}\n{}", table(told)))
}

/// Kernels by name; equal ones are listed once.
fn table(mut told: Vec<PipelineStatistics>) -> String {
    told.sort_by_key(|kernel| kernel.stem);
    let mut text = String::new();
    for alike in told.chunk_by(|a, b| a == b) {
        let PipelineStatistics { stem, executable, subgroup_size, statistics } = &alike[0];
        let mut line = |words: std::fmt::Arguments<'_>| {
            writeln!(text, "{words}").expect("writing to a string cannot fail");
        };
        let count = if alike.len() > 1 { format!(", {} alike", alike.len()) } else { String::new() };
        line(format_args!("\n{stem} ({executable}{count})"));
        if *subgroup_size > 0 {
            line(format_args!("  {:<32}{subgroup_size}", "subgroup size"));
        }
        for statistic in statistics {
            line(format_args!("  {:<32}{}", statistic.name, statistic.value));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Statistic;

    #[test]
    fn kernels_that_are_alike_are_listed_once() {
        let kernel = |stem, registers: &str| PipelineStatistics {
            stem,
            executable: "main".into(),
            subgroup_size: 32,
            statistics: vec![Statistic {
                name: "Register Count".into(),
                description: String::new(),
                value: registers.into(),
            }],
        };
        let text = table(vec![kernel("gather", "40"), kernel("blend", "16"), kernel("gather", "40")]);
        let words: Vec<&str> = text.split_whitespace().collect();
        let expected = "blend (main) subgroup size 32 Register Count 16 \
                        gather (main, 2 alike) subgroup size 32 Register Count 40";
        assert_eq!(words.join(" "), expected);
        let other = table(vec![kernel("gather", "40"), kernel("gather", "48")]);
        assert_eq!(other.matches("gather").count(), 2);
    }
}

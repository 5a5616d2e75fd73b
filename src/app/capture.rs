//! `--capture`: a RenderDoc capture of one frame.

use std::path::Path;

use super::output::OutputFile;
use crate::error::{Error, Result};
use crate::gpu::Capture;

/// Refuses a template whose folder is not writable.
pub(super) fn check_template(template: &Path) -> Result<()> {
    let Some(stem) = template.file_name() else {
        return Err(Error::output(template, "is a folder; name the beginning of a file in it"));
    };
    let mut name = stem.to_owned();
    // RenderDoc names its file about like this.
    name.push("_capture.rdc");
    OutputFile::check(&template.with_file_name(name)).map(|_| ())
}

/// Attaches to RenderDoc and sets the capture path. The device must be open.
pub(super) fn attach(template: &Path) -> Result<Capture> {
    let capture = Capture::attached().ok_or_else(|| {
        Error::Usage(
            "--capture: RenderDoc is not attached; run `renderdoccmd capture -w lightpaths ...`, or start lightpaths from its window"
                .into(),
        )
    })?;
    capture.set_template(template)?;
    Ok(capture)
}

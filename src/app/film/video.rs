//! Encodes a film's frames as one file with ffmpeg.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::ValueEnum;

use crate::app::args::shell_word;
use crate::app::interrupt;
use crate::app::output::OutputFile;
use crate::error::{Error, Result};
use crate::scene::Film;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Video {
    /// H.264
    Mp4,
    /// VP9
    Webm,
    /// Frames only, no video
    None,
}

/// Number of digits of a frame number in its file name.
pub(super) fn digits(frame_count: u32) -> usize {
    frame_count.saturating_sub(1).to_string().len().max(5)
}

/// A video to encode.
pub(super) struct Job<'a> {
    /// Folder of the frames.
    pub(super) folder: &'a Path,
    pub(super) film: &'a Film,
    pub(super) video: Video,
}

impl Job<'_> {
    /// Encodes the video. `None` if ffmpeg is not installed.
    ///
    /// # Errors
    /// ffmpeg fails, or the file cannot be written.
    pub(super) fn encode(&self) -> Result<Option<PathBuf>> {
        let path = self.folder.join(self.file_name());
        let mut is_installed = true;
        OutputFile::check(&path)?.write_by_name(|temporary| {
            let mut command = Command::new("ffmpeg");
            command.current_dir(self.folder).args(self.arguments()).arg(temporary);
            match interrupt::run(&mut command) {
                Ok((status, _)) if status.success() => Ok(true),
                Ok((status, said)) => {
                    let said = String::from_utf8_lossy(&said);
                    let last = said.lines().map(str::trim).rfind(|line| !line.is_empty());
                    let said = last.unwrap_or("nothing").to_owned();
                    Err(Error::output(&path, format!("ffmpeg failed ({status}): {said}")))
                }
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    is_installed = false;
                    Ok(false)
                }
                Err(error) => Err(Error::output(&path, format!("ffmpeg cannot be run: {error}"))),
            }
        })?;
        Ok(is_installed.then_some(path))
    }

    /// The equivalent command for a user.
    pub(super) fn typed(&self) -> String {
        let words = self.arguments().into_iter().chain([self.file_name()]);
        let words = words.map(|word| shell_word(&word)).collect::<Vec<_>>().join(" ");
        format!("cd {} && ffmpeg {words}", shell_word(&self.folder.to_string_lossy()))
    }

    pub(super) fn file_name(&self) -> String {
        format!("{}.{}", self.film.name, self.format())
    }

    fn format(&self) -> &'static str {
        if self.video == Video::Webm { "webm" } else { "mp4" }
    }

    /// All arguments except the output file. Chroma is stored for every second pixel, so sides must
    /// be even: an odd side gets a black line.
    fn arguments(&self) -> Vec<String> {
        let (fps, count) = (self.film.fps.to_string(), self.film.frame_count.to_string());
        let pattern = format!("frame-%0{}d.png", digits(self.film.frame_count));
        let filters = "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv";
        let read = ["-y", "-nostdin", "-loglevel", "error", "-f", "image2", "-start_number", "0"];
        let frames = ["-framerate", &fps, "-i", &pattern, "-frames:v", &count, "-vf", filters];
        let colours = ["-pix_fmt", "yuv420p", "-color_range", "tv", "-colorspace", "bt709"];
        let transfer = ["-color_primaries", "bt709", "-color_trc", "iec61966-2-1"];
        let codec: &[&str] = match self.video {
            Video::Webm => &["-c:v", "libvpx-vp9", "-crf", "22", "-b:v", "0", "-row-mt", "1"],
            _ => &["-c:v", "libx264", "-preset", "slow", "-crf", "16", "-movflags", "+faststart"],
        };
        let words = [&read[..], &frames, &colours, &transfer, codec, &["-f", self.format()]].concat();
        words.into_iter().map(str::to_owned).collect()
    }
}

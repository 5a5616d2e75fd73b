//! Errors that a user can meet, one variant for each cause, and the exit codes of the command line.

use std::path::{Path, PathBuf};

/// Result of every fallible call in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure that a user caused or can fix. Programmer errors panic instead.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An argument that cannot be used: the value found, and the values expected.
    #[error("{0}")]
    Usage(String),
    /// An error in an input file, with its line (1-based) if there is one.
    #[error("{}{}: {message}", .file.display(), .line.map(|line| format!(":{line}")).unwrap_or_default())]
    Input {
        /// The offending file, as the user named it.
        file: PathBuf,
        /// 1-based line number.
        line: Option<usize>,
        /// What is wrong, and what to do.
        message: String,
    },
    /// An output file that cannot be written.
    #[error("{}: {message}", .file.display())]
    Output {
        /// The file that cannot be written.
        file: PathBuf,
        /// What is wrong, and what to do.
        message: String,
    },
    /// No Vulkan device can be used: the devices found, the reasons against each, and the
    /// driver to install.
    #[error("no usable Vulkan device: {0}")]
    NoDevice(String),
    /// There is no display for a window: the reason, and the command to run instead.
    #[error("no window can be opened: {0}; `lightpaths render` and `lightpaths film` need no display")]
    NoDisplay(String),
    /// The device lacks memory: the need, the limit, and the setting to lower.
    #[error("out of device resources: {0}")]
    OutOfMemory(String),
    /// A Vulkan call failed after start-up.
    #[error("{call} failed: {}{}", code(*.result), more(*.result, .pass.as_deref()))]
    Vulkan {
        /// The Vulkan function.
        call: &'static str,
        /// The code that it returned.
        result: ash::vk::Result,
        /// The last pass recorded, when the device was lost.
        pass: Option<String>,
    },
    /// A picture with values that are infinite or not numbers.
    #[error(
        "{count} {} of the picture{} {} not finite, the first at ({}, {}) from the top left: {}, {}, {}; nothing was written. \
         This is a fault of the program: report it with the scene, and try --method path",
        if *.count == 1 { "pixel" } else { "pixels" },
        if .layer.is_empty() { String::new() } else { format!("'s layer `{}`", .layer) },
        if *.count == 1 { "is" } else { "are" },
        .first[0], .first[1], .value[0], .value[1], .value[2],
    )]
    NotFinite {
        /// Layer of the picture; empty for the main one.
        layer: String,
        /// How many pixels.
        count: usize,
        /// Column and row of the first.
        first: [usize; 2],
        /// The radiance that is not finite.
        value: [f32; 3],
    },
    /// A comparison or a picture above the bound that the caller set.
    #[error("{0}")]
    Comparison(String),
    /// The caller has cancelled a precomputation: [`Progress::is_cancelled`](crate::Progress).
    #[error("the precomputation was cancelled")]
    Cancelled,
}

impl Error {
    /// End of an [`Error::OutOfMemory`] without an out-of-memory hint.
    pub(crate) const SMALLER: &str = "a smaller preset or image needs less";

    /// An [`Error::NoDevice`] if drivers are installed and find no device.
    pub(crate) fn no_device_found() -> Self {
        let message = "the drivers found none: install your GPU's driver, or the package mesa-vulkan-drivers to render on the processor";
        Self::NoDevice(message.to_owned())
    }

    /// An [`Error::Input`] about a whole file.
    pub fn input(file: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::Input { file: file.as_ref().to_owned(), line: None, message: message.into() }
    }

    /// An [`Error::Input`] about one line (1-based) of a file.
    pub fn input_at(file: impl AsRef<Path>, line: usize, message: impl Into<String>) -> Self {
        Self::Input { file: file.as_ref().to_owned(), line: Some(line), message: message.into() }
    }

    /// An [`Error::Output`] about a file that cannot be written.
    pub fn output(file: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::Output { file: file.as_ref().to_owned(), message: message.into() }
    }

    /// Whether a smaller request may fit: the device is as it was.
    pub(crate) fn is_out_of_memory(&self) -> bool {
        use ash::vk::Result as Code;
        match self {
            Self::OutOfMemory(_) => true,
            Self::Vulkan { result, .. } => {
                [Code::ERROR_OUT_OF_DEVICE_MEMORY, Code::ERROR_OUT_OF_HOST_MEMORY].contains(result)
            }
            _ => false,
        }
    }

    /// The process exit code: 1 comparison failed or work cancelled, 2 bad input, 3 no device or
    /// display, 4 device failure or a picture that is not finite.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Comparison(_) | Self::Cancelled => 1,
            Self::Usage(_) | Self::Input { .. } | Self::Output { .. } => 2,
            Self::NoDevice(_) | Self::NoDisplay(_) => 3,
            Self::OutOfMemory(_) | Self::Vulkan { .. } | Self::NotFinite { .. } => 4,
        }
    }
}

/// Vulkan's name of a code, such as `VK_ERROR_DEVICE_LOST`.
pub(crate) fn code(result: ash::vk::Result) -> String {
    format!("VK_{result:?}")
}

/// The advice that follows the code of a failed call.
fn more(result: ash::vk::Result, pass: Option<&str>) -> String {
    use ash::vk::Result as Code;
    let pass = pass.map(|pass| format!(" (last pass: {pass})")).unwrap_or_default();
    let hint = match result {
        Code::ERROR_OUT_OF_DEVICE_MEMORY | Code::ERROR_OUT_OF_HOST_MEMORY => Error::SMALLER,
        Code::ERROR_DEVICE_LOST => {
            "the driver has given the device up: see the system's log, and try a smaller preset or image"
        }
        _ => return pass,
    };
    format!("{pass}; {hint}")
}

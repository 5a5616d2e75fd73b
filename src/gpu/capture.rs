//! RenderDoc captures, if the program runs under RenderDoc. The program sets the bounds of a frame.

use std::ffi::{CString, c_void};
use std::path::{Path, PathBuf};
use std::ptr;

use renderdoc_sys as renderdoc;

use crate::error::{Error, Result};

/// RenderDoc's functions. The program never loads it: to see all calls, it must be
/// loaded before Vulkan.
pub struct Capture {
    api: *const renderdoc::RENDERDOC_API_1_1_2,
    /// Keeps the library loaded.
    _library: Library,
}

#[cfg(unix)]
type Library = libloading::os::unix::Library;
#[cfg(windows)]
type Library = libloading::os::windows::Library;

/// The library, if it is already loaded.
#[cfg(unix)]
fn loaded() -> Option<Library> {
    // `libloading` does not define this flag.
    const RTLD_NOLOAD: i32 = if cfg!(target_vendor = "apple") { 0x10 } else { 0x4 };
    // SAFETY: with this flag nothing is loaded, so that no initialiser runs.
    unsafe { Library::open(Some("librenderdoc.so"), libloading::os::unix::RTLD_NOW | RTLD_NOLOAD) }.ok()
}

#[cfg(windows)]
fn loaded() -> Option<Library> {
    Library::open_already_loaded("renderdoc.dll").ok()
}

/// A function of RenderDoc's table. The first version has all of them.
macro_rules! function {
    ($from:expr) => {
        $from.expect("RenderDoc has all functions of the version that it gave")
    };
}

impl Capture {
    /// RenderDoc, if this process has loaded it. Its layer comes with the Vulkan instance, so call
    /// this when a [`Context`](super::Context) is open.
    pub fn attached() -> Option<Self> {
        let library = loaded()?;
        let mut api = ptr::null_mut::<c_void>();
        // SAFETY: the symbol is of that type, and writes where the functions of that version are:
        // as long as the library.
        let told = unsafe {
            let get = library.get::<renderdoc::pRENDERDOC_GetAPI>(b"RENDERDOC_GetAPI\0").ok()?;
            (*get)?(renderdoc::eRENDERDOC_API_Version_1_1_2, &raw mut api)
        };
        (told == 1 && !api.is_null()).then_some(Self { api: api.cast_const().cast(), _library: library })
    }

    /// Sets the prefix of the names of captures; RenderDoc adds a number and `.rdc`.
    ///
    /// # Errors
    /// A file cannot have this name.
    pub fn set_template(&self, template: &Path) -> Result<()> {
        let text = template.to_str().and_then(|text| CString::new(text).ok());
        let text = text.ok_or_else(|| Error::output(template, "is no name that RenderDoc takes"))?;
        // SAFETY: RenderDoc copies the text.
        unsafe { function!((*self.api).__bindgen_anon_2.SetCaptureFilePathTemplate)(text.as_ptr()) };
        Ok(())
    }

    /// Captures all work of the device during `frame`, on any device: no frame is presented.
    /// Returns the file.
    ///
    /// # Errors
    /// The errors of `frame`; [`Error::Usage`] if RenderDoc captured nothing.
    pub fn frame<T>(&self, frame: impl FnOnce() -> Result<T>) -> Result<(T, PathBuf)> {
        let any = ptr::null_mut();
        // SAFETY: null stands for the only device and for no window. What was begun is ended, also
        // after a failure.
        let (value, captured) = unsafe {
            function!((*self.api).StartFrameCapture)(any, any);
            let value = frame();
            (value, function!((*self.api).EndFrameCapture)(any, any) == 1)
        };
        let file = self.last_file().filter(|_| captured);
        let file = file
            .ok_or_else(|| Error::Usage("--capture: RenderDoc captured nothing; its log says why".into()));
        Ok((value?, file?))
    }

    /// The newest capture.
    fn last_file(&self) -> Option<PathBuf> {
        // SAFETY: the length is asked for first, and the buffer holds as many bytes.
        let name = unsafe {
            let last = function!((*self.api).GetNumCaptures)().checked_sub(1)?;
            let get = function!((*self.api).GetCapture);
            let mut length = 0;
            if get(last, ptr::null_mut(), &raw mut length, ptr::null_mut()) != 1 {
                return None;
            }
            let mut name = vec![0_u8; length as usize];
            get(last, name.as_mut_ptr().cast(), &raw mut length, ptr::null_mut());
            name
        };
        let text = name.split(|byte| *byte == 0).next()?;
        Some(PathBuf::from(String::from_utf8_lossy(text).into_owned()))
    }
}

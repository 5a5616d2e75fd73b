//! An image that was read, and the sizes that are read.

/// Largest width and height, pixels; as for our own images.
const MAX_SIDE: usize = 16_384;
/// Largest expansion factor of zlib.
const ZLIB_GROWTH: usize = 1032;
/// Largest ratio of decoded bytes to file bytes: grey PNGs of one bit a pixel grow
/// eightfold in addition.
const MAX_GROWTH: usize = 8 * ZLIB_GROWTH;

/// An image, or one layer of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels; the display window's for an EXR.
    pub size: [u32; 2],
    /// Upper left corner of an EXR's display window. `None` for a PNG, which has no position.
    pub origin: Option<[i32; 2]>,
    /// Linear values, row by row from the top. Black outside an EXR's data window.
    pub pixels: Vec<[f32; 3]>,
    /// The file's sRGB values, 0..=1. `None` if it is no display image (PNG).
    pub display: Option<Vec<[f32; 3]>>,
}

/// Refuses sizes above the limits, and files that are too small for their decoded size, before
/// memory is allocated.
pub(super) fn check_size(
    [width, height]: [usize; 2],
    decoded_bytes: usize,
    file_bytes: usize,
) -> Result<(), String> {
    if width.min(height) == 0 || width.max(height) > MAX_SIDE {
        return Err(format!("it is {width}×{height} pixels large, 1 to {MAX_SIDE} either way expected"));
    }
    if decoded_bytes > file_bytes.saturating_mul(MAX_GROWTH) {
        return Err(format!("it is damaged: {file_bytes} bytes cannot hold {width}×{height} pixels"));
    }
    Ok(())
}

//! Limits of a scene's files. Larger input is refused before memory is allocated for it.
//! `docs/reliability.md` has the reason for each limit.

/// Bytes of a scene's or a film's TOML file.
pub const TOML_BYTES: u64 = 4 << 20;
/// Bytes of an OBJ file.
pub const OBJ_BYTES: u64 = 2 << 30;
/// Bytes of an MTL file.
pub const MTL_BYTES: u64 = 16 << 20;
/// Bytes of an image's file.
pub const IMAGE_BYTES: u64 = 640 << 20;
/// Bytes of a name, a path or any other text in a scene's files.
pub const NAME_BYTES: usize = 4096;
/// `[[model]]`s of a scene.
pub const MODELS: usize = 1024;
/// Triangles of all models.
pub const TRIANGLES: usize = 1 << 26;
/// MTL files that an OBJ file names.
pub const LIBRARIES: usize = 256;
/// Names of a folder that is searched without regard to case.
pub const FOLDER_NAMES: usize = 1 << 16;
/// Materials of all models, and `[[material]]`s of a scene.
pub const MATERIALS: usize = 1 << 16;
/// Bytes of a photometric file.
pub const IES_BYTES: u64 = 16 << 20;
/// Measured intensities of all luminaires. The device's table names words by floats.
pub const INTENSITIES: usize = 1 << 23;
/// Lights of a scene, including lights that a film adds.
pub const LIGHTS: usize = 1024;
/// `[[meter]]`s of a scene.
pub const METERS: usize = 1024;
/// Measuring points of all meters.
pub const METER_POINTS: usize = 1 << 14;
/// `[[camera]]`s of a scene.
pub const CAMERAS: usize = 1024;
/// Keys of a film for its camera, for all its lights, and for all its materials.
pub const FILM_KEYS: usize = 1 << 16;
/// Frames of a film.
pub const FILM_FRAMES: u32 = 1_000_000;
/// Width and height of an image, texels.
pub const IMAGE_SIDE: u32 = 8192;
/// Texels of all images together.
pub const TEXELS: u64 = 1 << 29;
/// Decoded bytes of an image per byte of its file: zlib's best ratio is 1032, and grey images of
/// one bit a texel grow eightfold.
pub const IMAGE_GROWTH: u64 = 8256;
/// Decoded bytes that a WebP of any length may have: an image of one colour takes a few bytes.
pub const WEBP_BYTES: u64 = 64 << 20;
/// Scans of a JPEG; programs write 1 to 20. Each scan passes over the whole image.
pub const JPEG_SCANS: usize = 32;

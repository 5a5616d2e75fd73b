//! Thousands of damaged and generated files. Readers terminate, return no index beyond its list,
//! and take memory in proportion to their input. The same functions are fuzzed (`make fuzz`), and
//! `fuzz/corpus` holds the finds.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod memory;
mod random;
#[allow(unreachable_pub, dead_code, reason = "the library of the fuzzing package")]
#[path = "../../fuzz/src/lib.rs"]
mod readers;

use memory::peak;
use random::{Random, damaged};
use std::path::Path;

/// The good files of a target and its former failures, by name.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let files = std::fs::read_dir(folder).unwrap().map(|entry| {
        let path = entry.unwrap().path();
        (path.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(path).unwrap())
    });
    let mut files: Vec<_> = files.collect();
    files.sort();
    assert!(!files.is_empty());
    files
}

/// Memory limit of a reader: bytes for each byte of its input, plus bytes.
type Bound = (usize, usize);

/// Lists grow by doubling, and exist twice if one is made from another; plus the rest of the scene.
const TEXTS: Bound = (600, 4 << 20);
/// Four times the largest growth of an image: decoded, as colours, with its transparency, and
/// in the scene.
const IMAGES: Bound = (4 * 8256, 4 << 20);

/// Reads the corpus of a target, whose files named `good` are good, and files generated
/// from it. `good_of_thousand` of a thousand must be good: beyond this range the test would
/// cover too little.
fn hold(
    target: &str,
    read: impl Fn(&[u8]) -> bool,
    count: usize,
    make: impl Fn(&mut Random, &[(String, Vec<u8>)]) -> Vec<u8>,
    (factor, more): Bound,
    good_of_thousand: std::ops::Range<usize>,
) {
    let corpus = corpus(target);
    let within = |bytes: &[u8], what: &str| {
        let (is_taken, peak) = peak(|| read(bytes));
        let most = factor * bytes.len() + more;
        if peak > most {
            // A second run, because caches are filled only once.
            let (_, peak) = memory::peak(|| read(bytes));
            assert!(peak <= most, "{target}: {what}: {} bytes took {peak}, {most} at most", bytes.len());
        }
        is_taken
    };
    for (name, bytes) in &corpus {
        assert!(within(bytes, name) || !name.starts_with("good"), "{target}: {name} is good");
    }
    let mut random = Random(1);
    let mut taken = 0;
    for number in 0..count {
        let bytes = make(&mut random, &corpus);
        taken +=
            usize::from(within(&bytes, &format!("number {number}: {:?}", bytes.escape_ascii().to_string())));
    }
    assert!(good_of_thousand.contains(&(1000 * taken / count)), "{target}: {taken} of {count} were good");
}

fn any(random: &mut Random, corpus: &[(String, Vec<u8>)]) -> Vec<u8> {
    let (_, bytes) = &corpus[random.below(corpus.len())];
    damaged(random, bytes)
}

#[test]
fn scene_files() {
    let make = |random: &mut Random, corpus: &[(String, Vec<u8>)]| match random.below(2) {
        0 => any(random, corpus),
        _ => random::toml(random, readers::TOML),
    };
    hold("toml", readers::toml, 300, make, TEXTS, 100..600);
}

#[test]
fn films() {
    let make = |random: &mut Random, corpus: &[(String, Vec<u8>)]| match random.below(2) {
        0 => any(random, corpus),
        _ => random::toml(
            random,
            &String::from_utf8_lossy(&corpus.iter().find(|(name, _)| name == "good").unwrap().1),
        ),
    };
    hold("film", readers::film, 300, make, TEXTS, 100..600);
}

#[test]
fn models() {
    let make = |random: &mut Random, corpus: &[(String, Vec<u8>)]| match random.below(2) {
        0 => any(random, corpus),
        _ => random::obj(random),
    };
    hold("obj", readers::obj, 500, make, TEXTS, 100..600);
}

#[test]
fn gltf_models() {
    hold("gltf", readers::gltf, 500, any, TEXTS, 100..700);
}

#[test]
fn scans() {
    hold("ply", readers::ply, 500, any, TEXTS, 100..800);
    hold("stl", readers::stl, 500, any, TEXTS, 100..900);
}

#[test]
fn materials() {
    let make = |random: &mut Random, corpus: &[(String, Vec<u8>)]| match random.below(2) {
        0 => any(random, corpus),
        _ => random::mtl(random),
    };
    // Only unprintable names are refused.
    hold("mtl", readers::mtl, 250, make, TEXTS, 500..990);
}

#[test]
fn luminaires() {
    // A file of few angles may ask for the finest grid, which exists as f64, too.
    hold("luminaire", readers::luminaire, 500, any, (600, 8 << 20), 100..800);
}

#[test]
fn textures() {
    let make = |random: &mut Random, corpus: &[(String, Vec<u8>)]| match random.below(3) {
        0 => random::image(random),
        _ => any(random, corpus),
    };
    hold("texture", readers::texture, 400, make, IMAGES, 100..800);
}

/// A colour profile of zeros, compressed a thousandfold, which no pixel needs. As part of a texture
/// it takes no memory.
#[test]
fn a_packed_colour_profile_takes_no_memory() {
    let mut info = png::Info::with_size(2, 2);
    (info.color_type, info.bit_depth) = (png::ColorType::Rgb, png::BitDepth::Eight);
    info.icc_profile = Some(vec![0; 64 << 20].into());
    let mut bytes = Vec::new();
    let mut writer = png::Encoder::with_info(&mut bytes, info).unwrap().write_header().unwrap();
    writer.write_image_data(&[9; 12]).unwrap();
    writer.finish().unwrap();
    assert!(bytes.len() < 1 << 20 && bytes.windows(4).any(|name| name == b"iCCP"), "{}", bytes.len());
    readers::texture(&bytes);
    let (is_taken, peak) = peak(|| readers::texture(&bytes));
    assert!(is_taken && peak < 4 << 20, "{peak} bytes for {}", bytes.len());
}

#[test]
fn images_to_compare() {
    let make = |random: &mut Random, corpus: &[(String, Vec<u8>)]| match random.below(3) {
        0 => random::image(random),
        _ => any(random, corpus),
    };
    hold("image", readers::image, 1500, make, IMAGES, 50..800);
}

#[test]
fn stored_light_paths() {
    hold("cache", readers::cache, 250, any, (64, 4 << 20), 20..900);
}

/// Writes images in the form of other programs, which text cannot hold.
#[test]
#[ignore = "writes into fuzz/corpus"]
fn make_corpus() {
    use image::{ImageFormat, RgbImage};
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let picture = RgbImage::from_fn(9, 7, |x, y| image::Rgb([20 * x as u8, 30 * y as u8, 90]));
    picture.save_with_format(folder.join("texture/good.jpeg"), ImageFormat::Jpeg).unwrap();
    picture.save_with_format(folder.join("texture/good.bmp"), ImageFormat::Bmp).unwrap();
    picture.save_with_format(folder.join("texture/good.tiff"), ImageFormat::Tiff).unwrap();
    let floats = image::DynamicImage::ImageRgb8(picture.clone()).into_rgb32f();
    floats.save_with_format(folder.join("texture/good.hdr"), ImageFormat::Hdr).unwrap();
    floats.save_with_format(folder.join("texture/good.exr"), ImageFormat::OpenExr).unwrap();
    let picture = image::DynamicImage::ImageRgb8(picture).into_rgba8();
    picture.save_with_format(folder.join("texture/good.gif"), ImageFormat::Gif).unwrap();
    let pixels: Vec<[f32; 3]> = (0..15).map(|i| [i as f32, 1.0, 0.25]).collect();
    let layers = ["", "direct"].map(|name| lightpaths::image::ExrLayer {
        name,
        channels: &["R", "G", "B"],
        pixels: &pixels,
    });
    let mut exr = std::io::Cursor::new(Vec::new());
    lightpaths::image::write_exr(&mut exr, [5, 3], &layers).unwrap();
    std::fs::write(folder.join("image/good.exr"), exr.into_inner()).unwrap();
    let mut png = Vec::new();
    lightpaths::image::write_png(&mut png, [2, 1], &[[0, 128, 255, 255], [10, 11, 12, 255]]).unwrap();
    std::fs::write(folder.join("image/good.png"), png).unwrap();
}

/// The chunks of a PNG: kind and contents.
fn chunks(png: &[u8]) -> Vec<([u8; 4], Vec<u8>)> {
    let mut all = Vec::new();
    let mut rest = &png[8..];
    while !rest.is_empty() {
        let length = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize;
        all.push((rest[4..8].try_into().unwrap(), rest[8..8 + length].to_vec()));
        rest = &rest[12 + length..];
    }
    all
}

/// A PNG of one pixel, with a chunk before its pixels.
fn png_with(kind: &[u8; 4], contents: &[u8]) -> Vec<u8> {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::ChunkType(*kind), contents).unwrap();
    writer.write_image_data(&[10, 20, 30]).unwrap();
    writer.finish().unwrap();
    png
}

/// A stream of zlib that is 64 MiB of zeros when decompressed.
fn zeros() -> Vec<u8> {
    let (width, height) = (1 << 14, 1 << 12);
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, width, height);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![0; (width * height) as usize]).unwrap();
    writer.finish().unwrap();
    chunks(&png).into_iter().filter(|(kind, _)| kind == b"IDAT").flat_map(|(_, data)| data).collect()
}

/// The reader ignores colour profiles and texts, and does not decompress them.
#[test]
fn what_an_image_has_beside_its_pixels_takes_no_memory() {
    let zeros = zeros();
    assert!(zeros.len() < 100_000, "{} bytes", zeros.len());
    for (kind, start) in
        [(b"iCCP", &b"profile\0\0"[..]), (b"zTXt", b"Comment\0\0"), (b"iTXt", b"Comment\0\x01\0\0\0")]
    {
        let png = png_with(kind, &[start, &zeros].concat());
        let (picture, peak) = peak(|| lightpaths::image::parse(&png, None));
        let name = String::from_utf8_lossy(kind);
        assert_eq!(picture.unwrap().size, [1, 1], "{name}");
        assert!(peak < 2 << 20, "{name}: {} bytes took {peak}", png.len());
    }
}

/// Sizes that the length of a file rules out are refused before memory is allocated.
#[test]
fn images_that_say_they_are_large_take_no_memory() {
    for (color, depth) in [(0, 1), (0, 16), (2, 8), (3, 8), (6, 16)] {
        let header =
            [&16_384_u32.to_be_bytes()[..], &16_384_u32.to_be_bytes(), &[depth, color, 0, 0, 0]].concat();
        let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
        for (kind, data) in
            [(b"IHDR", &header[..]), (b"PLTE", &[7; 6]), (b"IDAT", &zeros()[..999]), (b"IEND", &[])]
        {
            png.extend([&(data.len() as u32).to_be_bytes()[..], kind, data, &[0; 4]].concat());
        }
        let (refusal, peak) = peak(|| readers::image(&png));
        assert!(!refusal && peak < 4 << 20, "kind {color} of {depth} bits: {} bytes took {peak}", png.len());
    }
}

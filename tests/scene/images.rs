//! Kinds of image files: each is written in memory, read as an image of a material and compared.

use image::{DynamicImage, ImageFormat, Rgb, Rgb32FImage, RgbImage, Rgba32FImage};
use lightpaths::scene::material::MAX_ALBEDO;
use lightpaths::scene::{LoadOptions, Scene};
use std::sync::Arc;

use super::textures::{CODES, MTL, SQUARE, encoded, load, load_with, pixels, texture};

fn codes(name: &str, bytes: &[u8]) -> (Scene, Vec<[u8; 3]>) {
    let mtl = format!("newmtl wall\nmap_Kd {name}\n");
    let scene = load(SQUARE, &mtl, &[(name, bytes)]).unwrap();
    assert!(scene.materials[0].texture.is_some(), "{name}: {:?}", scene.warnings);
    let codes = texture(&scene).image.codes.clone();
    (scene, codes)
}

#[test]
fn lossless_kinds_keep_their_codes() {
    let rgb = DynamicImage::ImageRgb8(pixels());
    let deep = DynamicImage::ImageRgb16(rgb.to_rgb16());
    let rgba = DynamicImage::ImageRgba8(rgb.to_rgba8());
    for (name, bytes) in [
        ("a.webp", encoded(rgb.clone(), ImageFormat::WebP)),
        ("alpha.webp", encoded(rgba.clone(), ImageFormat::WebP)),
        ("a.tif", encoded(rgb.clone(), ImageFormat::Tiff)),
        ("deep.tiff", encoded(deep.clone(), ImageFormat::Tiff)),
        ("deep.png", encoded(deep, ImageFormat::Png)),
        ("alpha.tga", encoded(rgba, ImageFormat::Tga)),
        ("palette.png", palette()),
        // The contents determine the kind.
        ("wrong.jpg", encoded(rgb, ImageFormat::WebP)),
    ] {
        let (scene, codes) = codes(name, &bytes);
        assert_eq!(codes, CODES, "{name}");
        assert_eq!(scene.warnings, [""; 0], "{name}");
    }
}

/// A PNG of four colours with two bits for each texel.
fn palette() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Two);
    encoder.set_palette(CODES.concat());
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[0b0001_0000, 0b1011_0000]).unwrap();
    writer.finish().unwrap();
    bytes
}

/// Floats are linear: 0.2159 is code 128, 0.5 is code 188.
#[test]
fn images_of_floats_are_linear_and_bounded() {
    let values = [0.0, 0.215_86, 0.5, 1.0];
    let image = |scale: f32| {
        Rgb32FImage::from_fn(4, 1, |x, _| Rgb([scale * values[x as usize], 0.0, scale * values[x as usize]]))
    };
    let expected: Vec<[u8; 3]> = [0, 128, 188, 255].iter().map(|&code| [code, 0, code]).collect();
    let near = |found: &[[u8; 3]], expected: &[[u8; 3]]| {
        // Radiance files have mantissas of eight bits.
        found.iter().zip(expected).all(|(a, b)| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1))
    };
    for (name, format) in [("a.hdr", ImageFormat::Hdr), ("a.exr", ImageFormat::OpenExr)] {
        let (scene, found) = codes(name, &encoded(image(0.999), format));
        assert!(near(&found, &expected), "{name}: {found:?}");
        assert!(scene.warnings.iter().all(|warning| !warning.contains("above 1")), "{:?}", scene.warnings);
        let (scene, found) = codes(name, &encoded(image(4.0), format));
        assert_eq!(found[2..], [[255, 0, 255]; 2], "{name}");
        let said = "material \"wall\": values above 1 of images are taken as 1, and scaled";
        assert!(scene.warnings[0].contains(said), "{:?}", scene.warnings);
        assert!((scene.materials[0].diffuse.max_element() - MAX_ALBEDO).abs() < 1e-5);
    }
    let tiff = DynamicImage::ImageRgb32F(image(1.0));
    assert_eq!(codes("a.tiff", &encoded(tiff, ImageFormat::Tiff)).1, expected);
    let clear = Rgba32FImage::from_pixel(1, 1, image::Rgba([0.5, 0.5, 0.5, 0.25]));
    let (scene, found) = codes("a.exr", &encoded(clear, ImageFormat::OpenExr));
    assert_eq!(found, [[188; 3]]);
    assert!(scene.warnings[0].contains("transparency of images"), "{:?}", scene.warnings);
}

/// A camera that was held on its side states so in EXIF data.
#[test]
fn jpegs_are_turned_upright() {
    let picture = RgbImage::from_fn(32, 16, |x, _| Rgb(if x < 16 { [250, 0, 0] } else { [0, 0, 250] }));
    let jpeg = encoded(picture, ImageFormat::Jpeg);
    let with_orientation = |value: u8| {
        let exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0";
        let rest = [value, 0, 0, 0, 0, 0, 0, 0];
        let length = ((2 + exif.len() + rest.len()) as u16).to_be_bytes();
        [&jpeg[..2], &[0xff, 0xe1], &length, exif, &rest, &jpeg[2..]].concat()
    };
    let is_red = |code: [u8; 3]| code[0] > 200 && code[2] < 50;
    for (value, size, first, last) in [
        (1, [32, 16], true, false),
        (2, [32, 16], false, true),
        (3, [32, 16], false, true),
        (6, [16, 32], true, false),
        (8, [16, 32], false, true),
        (99, [32, 16], true, false),
    ] {
        let (scene, codes) = codes("a.jpg", &with_orientation(value));
        assert_eq!(texture(&scene).image.size, size, "{value}");
        assert_eq!([is_red(codes[0]), is_red(codes[codes.len() - 1])], [first, last], "{value}");
    }
}

/// A WebP of one colour takes few bytes, however large it is.
#[test]
fn a_webp_may_be_long_when_it_is_decoded() {
    let webp = |side: u32| {
        let mut bits = Vec::new();
        let mut push = |value: u32, count: u32| bits.extend((0..count).map(|bit| value >> bit & 1));
        push(0x2f, 8);
        push(side - 1, 14);
        push(side - 1, 14);
        // No alpha, version 0, no transform, no cache, one group of prefix codes.
        push(0, 1 + 3 + 1 + 1 + 1);
        for symbol in [CODES[3][1], CODES[3][0], CODES[3][2], 255, 0] {
            // A code of one symbol of eight bits: texels take no bits.
            push(0b101, 3);
            push(symbol.into(), 8);
        }
        let byte = |bits: &[u32]| (0..).zip(bits).map(|(at, bit)| (bit << at) as u8).sum::<u8>();
        let data: Vec<u8> = bits.chunks(8).map(byte).collect();
        let length = |bytes: usize| (bytes as u32).to_le_bytes();
        let data = [&data[..], &vec![0; data.len() % 2]].concat();
        [b"RIFF", &length(12 + data.len())[..], b"WEBPVP8L", &length(data.len()), &data].concat()
    };
    let large = webp(4096);
    assert!(large.len() < 50, "{} bytes", large.len());
    let codes = codes("a.webp", &large).1;
    assert!(codes.len() == 4096 * 4096 && codes.iter().all(|code| *code == CODES[3]));
    let scene = load(SQUARE, "newmtl wall\nmap_Kd a.webp\n", &[("a.webp", &webp(6000))]).unwrap();
    assert!(scene.warnings[0].contains("cannot hold 6000×6000 texels"), "{:?}", scene.warnings);
}

/// One image in memory for models that name the same file, or copies of it.
#[test]
fn an_image_is_read_once() {
    let png = encoded(pixels(), ImageFormat::Png);
    let toml = super::good_toml() + "[[model]]\nfile = \"m.obj\"\ntranslate = [2, 0, 0]\n";
    let mtl = format!("{MTL}newmtl other\nmap_Kd copy.png\n");
    let images = [("a.png", &png[..]), ("copy.png", &png)];
    let scene = load_with(&toml, SQUARE, &mtl, &images, &LoadOptions::default()).unwrap();
    let images: Vec<_> = scene.materials.iter().map(|material| material.texture.as_ref().unwrap()).collect();
    assert_eq!(images.len(), 4);
    assert!(images.iter().all(|texture| Arc::ptr_eq(&texture.image, &images[0].image)));
    let read = scene.inputs.iter().filter(|file| file.ends_with("a.png")).count();
    assert_eq!(read, 1, "{:?}", scene.inputs);
}

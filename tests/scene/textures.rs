//! Images of materials: formats, options, texture coordinates, and refused images.

use std::io::Cursor;

use glam::{DVec2, DVec3, Vec2, Vec3};
use image::{DynamicImage, ImageFormat, Rgb, RgbImage, RgbaImage};
use lightpaths::Result;
use lightpaths::cpu::textures::{linear, pack_colour, sample, unpack_colour};
use lightpaths::scene::material::MAX_ALBEDO;
use lightpaths::scene::{Image, LoadOptions, Scene, Texture};
use std::sync::Arc;

use super::{good_toml, load_files, set};

/// A unit square whose corners lie at the corners of its image.
pub(super) const SQUARE: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
usemtl wall\nf 1/1 2/2 3/3 4/4\n";
pub(super) const MTL: &str = "newmtl wall\nmap_Kd a.png\n";

/// Two texels beside each other, and two below them.
pub(super) const CODES: [[u8; 3]; 4] = [[252, 0, 0], [0, 252, 0], [0, 0, 252], [128, 64, 32]];

pub(super) fn pixels() -> RgbImage {
    RgbImage::from_fn(2, 2, |x, y| Rgb(CODES[(2 * y + x) as usize]))
}

pub(super) fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

pub(super) fn tga() -> Vec<u8> {
    encoded(pixels(), ImageFormat::Tga)
}

fn png() -> Vec<u8> {
    encoded(pixels(), ImageFormat::Png)
}

pub(super) fn load_with(
    toml: &str,
    obj: &str,
    mtl: &str,
    images: &[(&str, &[u8])],
    options: &LoadOptions,
) -> Result<Scene> {
    let mut files = vec![("s.toml", toml.as_bytes()), ("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
    files.extend(images);
    load_files(&files, "s.toml", options)
}

pub(super) fn load(obj: &str, mtl: &str, images: &[(&str, &[u8])]) -> Result<Scene> {
    load_with(&good_toml(), obj, mtl, images, &LoadOptions::default())
}

pub(super) fn texture(scene: &Scene) -> &Texture {
    scene.materials[0].texture.as_ref().unwrap()
}

#[test]
fn every_format_is_read_and_multiplies_kd() {
    let grey = DynamicImage::ImageRgb8(pixels()).into_luma8();
    let deep = DynamicImage::ImageRgb8(pixels()).into_rgb16();
    for (name, bytes) in [
        ("a.png", png()),
        ("a.tga", tga()),
        ("deep.png", encoded(deep, ImageFormat::Png)),
        ("a.bmp", encoded(pixels(), ImageFormat::Bmp)),
        ("a.gif", encoded(DynamicImage::ImageRgb8(pixels()).into_rgba8(), ImageFormat::Gif)),
        // The contents determine the format, not the name.
        ("a.jpg", png()),
    ] {
        let scene = load(SQUARE, &format!("newmtl wall\nmap_Kd {name}\nKd 0.5 0.6 0.7\n"), &[(name, &bytes)]);
        let scene = scene.unwrap();
        assert_eq!(texture(&scene).image.codes, CODES, "{name}");
        assert_eq!(scene.materials[0].diffuse, Vec3::new(0.5, 0.6, 0.7));
        assert_eq!(scene.warnings, [""; 0], "{name}");
    }
    let scene = load(SQUARE, MTL, &[("a.png", &encoded(grey.clone(), ImageFormat::Png))]).unwrap();
    assert_eq!(texture(&scene).image.codes, grey.pixels().map(|p| [p.0[0]; 3]).collect::<Vec<_>>());
    assert_eq!(scene.materials[0].diffuse, Vec3::ONE, "an image alone is not dimmed");
    let scene = load(SQUARE, &format!("{MTL}Kd 0 0 0\n"), &[("a.png", &png())]).unwrap();
    assert!(
        scene.warnings[0].contains("\"wall\": is black: its image is multiplied"),
        "{:?}",
        scene.warnings
    );

    let flat = RgbImage::from_pixel(16, 16, Rgb([200, 100, 50]));
    let jpeg = encoded(flat, ImageFormat::Jpeg);
    let scene = load(SQUARE, "newmtl wall\nmap_Kd a b.jpeg\n", &[("a b.jpeg", &jpeg)]).unwrap();
    let apart = |code: &[u8; 3]| code.iter().zip([200_u8, 100, 50]).all(|(a, b)| a.abs_diff(b) <= 3);
    assert!(texture(&scene).image.codes.iter().all(apart) && texture(&scene).image.size == [16, 16]);
}

#[test]
fn transparency_is_passed_over_with_one_warning() {
    let opaque = RgbaImage::from_pixel(2, 2, image::Rgba([1, 2, 3, 255]));
    let mut clear = opaque.clone();
    clear.get_pixel_mut(1, 1).0[3] = 254;
    let [opaque, clear] = [opaque, clear].map(|image| encoded(image, ImageFormat::Png));
    assert_eq!(load(SQUARE, MTL, &[("a.png", &opaque)]).unwrap().warnings, [""; 0]);
    let mtl = "newmtl wall\nmap_Kd a.png\nnewmtl other\nmap_Kd b.png\n";
    let scene = load(SQUARE, mtl, &[("a.png", &clear), ("b.png", &clear)]).unwrap();
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0]
            .ends_with("the transparency of images is passed over (2 in all, this is the first)"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn options_place_the_image() {
    let corners = |scene: &Scene| {
        let [first, second] = [0, 1].map(|index| scene.texture_coordinates[index]);
        [first[0], first[1], first[2], second[2]]
    };
    let square = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let image: &[(&str, &[u8])] = &[("a.png", &png())];
    let scene = load(SQUARE, MTL, image).unwrap();
    assert_eq!((corners(&scene), texture(&scene).is_clamped), (square, false));

    let mtl = "newmtl wall\nmap_Kd -s 2 3 1 -o 0.25 -clamp on -mm 0 1 -cc off a.png\n";
    let scene = load(SQUARE, mtl, image).unwrap();
    let placed = square.map(|corner| Vec2::new(2.0, 3.0) * corner + Vec2::new(0.25, 0.0));
    assert_eq!((corners(&scene), texture(&scene).is_clamped), (placed, true));
    assert!(
        scene.warnings[0].contains("options of `map_Kd` are passed over: -mm; -cc"),
        "{:?}",
        scene.warnings
    );

    // A file name may be a number; backslashes may separate folders.
    let scene = load(SQUARE, "newmtl wall\nmap_Kd -s 2 7\n", &[("7", &png())]).unwrap();
    assert_eq!(corners(&scene)[2], Vec2::new(2.0, 1.0));
    load(SQUARE, "newmtl wall\nmap_Kd .\\a.png\n", image).unwrap();
}

#[test]
fn coordinates_follow_their_corners() {
    let image: &[(&str, &[u8])] = &[("a.png", &png())];
    // Faces with and without coordinates, with normals and with negative indices,
    // one triangle mirrored.
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvn 0 1 0\nvt 0.5\nvt 0.25 0.75 0 # w\nusemtl wall\n\
f 1/1/1 2/2/1 3/1/1\nf 1 3 4\n";
    let scene = load(obj, MTL, image).unwrap();
    let [a, b] = [Vec2::new(0.5, 0.0), Vec2::new(0.25, 0.75)];
    assert_eq!(scene.texture_coordinates, [[a, b, a], [Vec2::ZERO; 3]]);
    assert!(scene.warnings[0].contains("1 triangles of materials with an image have no texture coordinates"));
    let negative = obj.replace("1/1/1 2/2/1 3/1/1", "1/-2 2/-1 3/-2");
    assert_eq!(load(&negative, MTL, image).unwrap().texture_coordinates[0], [a, b, a]);
    let toml = good_toml().replace("m.obj\"", "m.obj\"\nscale = [-1, 1, 1]");
    let scene = load_with(&toml, obj, MTL, image, &LoadOptions::default()).unwrap();
    assert_eq!(scene.texture_coordinates[0], [a, a, b]);

    let mut reordered = scene.clone();
    reordered.reorder(&[1, 0]);
    assert_eq!(reordered.texture_coordinates, [scene.texture_coordinates[1], scene.texture_coordinates[0]]);
    assert_eq!(reordered.triangles[0], scene.triangles[1]);
}

#[test]
fn a_diffuse_albedo_in_the_scene_file_replaces_an_image() {
    let image: &[(&str, &[u8])] = &[("a.png", &png())];
    let toml = good_toml() + "[[material]]\nname = \"wall\"\nspecular = [0.1, 0.1, 0.1]\n";
    let scene = load_with(&toml, SQUARE, MTL, image, &LoadOptions::default()).unwrap();
    assert!(scene.materials[0].texture.is_some() && scene.warnings.len() == 1, "its highlights give way");
    let toml = toml.replace("specular", "diffuse");
    let scene = load_with(&toml, SQUARE, MTL, image, &LoadOptions::default()).unwrap();
    assert_eq!((&scene.materials[0].texture, scene.materials[0].diffuse), (&None, Vec3::splat(0.1)));
    assert!(scene.texture_coordinates.is_empty(), "no image is left");
    let options = set(&["material.wall.diffuse=[0.2, 0.2, 0.2]"]);
    let scene = load_with(&toml, SQUARE, MTL, image, &options).unwrap();
    assert_eq!(scene.materials[0].diffuse, Vec3::splat(0.2));
}

/// If an image cannot be used, the material keeps its `Kd`, and a warning has file,
/// line and reason.
#[test]
fn images_that_cannot_be_used_are_named() {
    let png = png();
    let leaves_out = |rest: &str, bytes: &[u8], expected: &str| {
        let mtl = format!("newmtl wall\nKd 0.1 0.2 0.3\nmap_Kd {rest}\n");
        let scene = load(SQUARE, &mtl, &[("a.png", bytes), ("a.tga", bytes)]).unwrap();
        let material = &scene.materials[0];
        assert!(material.texture.is_none() && material.diffuse == Vec3::new(0.1, 0.2, 0.3));
        let said = &scene.warnings[0];
        let start =
            "m.mtl:3: material \"wall\": images that cannot be used are left out, `Kd` is taken instead: ";
        assert!(said.contains(&format!("{start}{expected}")), "expected {expected:?}, found {said:?}");
    };
    leaves_out("b.png", &png, "\"b.png\" does not exist: check the path");
    leaves_out("a.png", &png[..60], "\"a.png\" is no readable Png: ");
    leaves_out("a.png", b"", "\"a.png\" is no PNG, JPEG, WebP, TIFF, TGA, BMP, GIF, HDR or EXR: convert it");
    leaves_out("a.png", b"GIF89a......", "\"a.png\" is no readable Gif: ");
    leaves_out("a.png", b"BM............", "\"a.png\" is no readable Bmp: ");
    leaves_out("a.png", b"DDS ............", "\"a.png\" is a DDS image, which is not read: ");
    leaves_out("a.tga", b"0123456789", "\"a.tga\" is no readable Tga: ");
    let wide = encoded(RgbImage::new(8193, 1), ImageFormat::Png);
    leaves_out(
        "a.png",
        &wide,
        "\"a.png\" is 8193×1 texels large, 1 to 8192 either way can be used: scale it",
    );
    let jpeg = encoded(RgbImage::new(64, 64), ImageFormat::Jpeg);
    let scan = jpeg.windows(2).position(|pair| pair == [0xff, 0xda]).unwrap();
    let end = jpeg.len() - 2;
    let often = [&jpeg[..scan], &jpeg[scan..end].repeat(100), &jpeg[end..]].concat();
    leaves_out("a.png", &often, "\"a.png\" has 100 scans, 32 at most are decoded: save it anew");
    // A palette whose length is no multiple of three.
    let chunk = |name: &[u8], data: &[u8]| {
        let checked = [name, data].concat();
        [&(data.len() as u32).to_be_bytes()[..], &checked, &crc32(&checked).to_be_bytes()].concat()
    };
    for length in [1, 2, 4, 5, 767] {
        let palette = [
            b"\x89PNG\r\n\x1a\n",
            &chunk(b"IHDR", &[0, 0, 0, 1, 0, 0, 0, 1, 8, 3, 0, 0, 0])[..],
            &chunk(b"PLTE", &vec![7; length]),
            &chunk(b"IDAT", &[0x78, 0x9c, 0x63, 0x60, 0, 0, 0, 2, 0, 1]),
            &chunk(b"IEND", &[]),
        ];
        leaves_out("a.png", &palette.concat(), "\"a.png\" is ");
    }
}

/// The checksum of a PNG's chunk.
fn crc32(bytes: &[u8]) -> u32 {
    let fold = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| fold(crc)))
}

#[test]
fn a_jpeg_that_was_cut_is_used_and_said_to_be_damaged() {
    let image = RgbImage::from_fn(64, 64, |x, y| Rgb([(7 * x + 3 * y) as u8, (x * y) as u8, 90]));
    let jpeg = encoded(image, ImageFormat::Jpeg);
    let warnings = |bytes: &[u8]| {
        let scene = load(SQUARE, "newmtl wall\nKd 0.9\nmap_Kd a.jpg\n", &[("a.jpg", bytes)]).unwrap();
        assert_eq!(texture(&scene).image.size, [64, 64]);
        scene.warnings
    };
    assert_eq!(warnings(&jpeg), [""; 0]);
    assert_eq!(warnings(&[&jpeg[..], b"more"].concat()), [""; 0]);
    for cut in [2, 10, jpeg.len() / 3] {
        let [said] = &warnings(&jpeg[..jpeg.len() - cut])[..] else { panic!("one warning") };
        assert!(
            said.contains("images are damaged: ") && said.contains("a.jpg\" is damaged: it ends early"),
            "{said}"
        );
    }
}

#[test]
fn an_image_is_a_bilinear_function_of_decoded_codes() {
    // A quarter, a half and the ends of the range, by the standard's formula to nine digits.
    for (code, expected) in [(0, 0.0), (10, 0.003_035_269_8), (64, 0.051_269_458_4), (128, 0.215_860_500_1)] {
        assert!((linear(code) - expected).abs() < 1e-9, "{code}: {}", linear(code));
    }
    assert_eq!(linear(255), 1.0);

    let image = Arc::new(Image { size: [2, 2], codes: CODES.to_vec() });
    let [a, b, c, d] = CODES.map(|codes| DVec3::from(codes.map(linear)));
    for is_clamped in [false, true] {
        let texture = Texture { image: image.clone(), is_clamped, is_atlas: false };
        let at = |u: f64, v: f64| sample(&texture, DVec2::new(u, v));
        let is = |found: DVec3, expected: DVec3| {
            assert!((found - expected).abs().max_element() < 1e-12, "{is_clamped}: {found} {expected}");
        };
        // The centres of texels, rows from the top; half-way between; at the border, with the
        // texels beyond it.
        is(at(0.25, 0.75), a);
        is(at(0.75, 0.75), b);
        is(at(0.25, 0.25), c);
        is(at(0.75, 0.25), d);
        is(at(0.375, 0.75), 0.75 * a + 0.25 * b);
        is(at(0.5, 0.5), 0.25 * (a + b + c + d));
        let border = if is_clamped { a } else { 0.5 * (a + b) };
        is(at(0.0, 0.75), border);
        is(at(0.25, 1.0), if is_clamped { a } else { 0.5 * (a + c) });
        // Beyond it.
        is(at(-7.75, 3.75), a);
        is(at(2.25, -0.25), if is_clamped { d } else { a });
    }
}

#[test]
fn packed_colours_are_near_and_exact_at_the_ends() {
    for end in [DVec3::ZERO, DVec3::ONE, DVec3::X, DVec3::Z] {
        assert_eq!(unpack_colour(pack_colour(end)), end);
    }
    for step in 0..=1000 {
        let value = f64::from(step) / 1000.0;
        let error = (unpack_colour(pack_colour(DVec3::splat(value))) - value).abs();
        let bound = value.sqrt() / 1023.0 + 0.25 / 1023.0_f64.powi(2);
        assert!(error.max_element() <= bound, "{value}: {error}");
    }
}

/// Albedos that reflect all light are lowered when the scene is loaded, from any source. The
/// brightest texel of an image counts.
#[test]
fn albedos_are_bounded_and_one_warning_names_the_first() {
    let most = MAX_ALBEDO;
    let load = |mtl: &str, more: &str, texel: u8| {
        let image = RgbImage::from_pixel(2, 2, Rgb([texel, texel / 2, 0]));
        let image: &[(&str, &[u8])] = &[("a.png", &encoded(image, ImageFormat::Png))];
        load_with(&(good_toml() + more), SQUARE, mtl, image, &LoadOptions::default()).unwrap()
    };
    let white = "newmtl wall\nKd 1 1 1\n";
    let image = "newmtl wall\nKd 1 1 1\nmap_Kd a.png\n";
    let shiny = "newmtl wall\nKd 0.6 0.6 0.5\nKs 0.395 0.395 0.395\nNs 10\n";
    let grey = "newmtl wall\nKd 0.5 0.5 0.5\n";
    let override_white = "[[material]]\nname = \"wall\"\ndiffuse = [1.0, 0.2, 0.0]\n";
    let override_shiny = "[[material]]\nname = \"wall\"\nspecular = [0.5, 0.5, 0.5]\nexponent = 5.0\n";
    for (mtl, more, texel) in [
        (white, "", 0),
        (image, "", 255),
        (shiny, "", 0),
        (grey, override_white, 0),
        (grey, override_shiny, 0),
    ] {
        let scene = load(mtl, more, texel);
        let material = &scene.materials[0];
        let texel = material.texture.as_ref().map_or(Vec3::ONE, |texture| texture.image.brightest());
        let albedo = (material.diffuse * texel + material.specular).max_element();
        assert!(albedo <= most && albedo > most - 1e-5, "{albedo}");
        let told: Vec<_> = scene.warnings.iter().filter(|warning| warning.contains("0.99")).collect();
        assert!(told.len() == 1 && told[0].contains("\"wall\""), "{:?}", scene.warnings);
    }
    for (mtl, more, texel) in [(grey, "", 0), (image, "", 250), ("newmtl wall\nKd 0.99 0.5 0\n", "", 0)] {
        let scene = load(mtl, more, texel);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    // If there are several materials, the warning names the first and counts the others.
    let two = SQUARE.replace("f 1/1", "f 1/1 2/2 3/3\nusemtl other\nf 1/1");
    let mtl = format!("{white}newmtl other\nKd 1 1 1\n");
    let scene = load_with(&good_toml(), &two, &mtl, &[], &LoadOptions::default()).unwrap();
    let told = scene.warnings.iter().filter(|warning| warning.contains("2 in all")).count();
    let about = scene.warnings.iter().filter(|warning| warning.contains("0.99")).count();
    assert_eq!((told, about), (1, 1), "{:?}", scene.warnings);
}

const WITH_IMAGE: &str = "[[material]]\nname = \"wall\"\nimage = \"b.png\"\n";

fn with_image(obj: &str, mtl: &str, more: &str) -> Result<Scene> {
    let blue = encoded(RgbImage::from_pixel(4, 2, Rgb([0, 0, 200])), ImageFormat::Png);
    let toml = format!("{}{WITH_IMAGE}{more}", good_toml());
    load_with(&toml, obj, mtl, &[("a.png", &png()), ("b.png", &blue)], &LoadOptions::default())
}

#[test]
fn the_scene_file_gives_materials_an_image() {
    // Whether the model has one or a colour, which does not count.
    for mtl in [MTL, "newmtl wall\nKd 0.1 0.2 0.3\n", ""] {
        let scene = with_image(SQUARE, mtl, "").unwrap();
        assert_eq!(texture(&scene).image.size, [4, 2], "{mtl}");
        let (diffuse, image) = (scene.materials[0].diffuse, texture(&scene).image.clone());
        assert_eq!((diffuse, image.codes[0]), (Vec3::ONE, [0, 0, 200]), "{mtl}");
        // The model's own coordinates.
        assert_eq!(scene.texture_coordinates[0], [Vec2::ZERO, Vec2::X, Vec2::ONE], "{mtl}");
        assert!(scene.inputs.iter().any(|file| file.ends_with("b.png")), "{:?}", scene.inputs);
    }
    let tinted = with_image(SQUARE, MTL, "tint = [0.5, 0.25, 1.0]\n").unwrap();
    assert_eq!(tinted.materials[0].diffuse, Vec3::new(0.5, 0.25, 1.0));
    for (more, why) in
        [("diffuse = [1, 1, 1]\n", "takes the place of `diffuse`"), ("image_width = 0.0\n", "image_width")]
    {
        let error = with_image(SQUARE, MTL, more).unwrap_err().to_string();
        assert!(error.contains(why) && error.contains("s.toml:"), "{error}");
    }
    let toml = format!("{}{WITH_IMAGE}", good_toml());
    let missing = load_with(&toml, SQUARE, MTL, &[("a.png", &png())], &LoadOptions::default()).unwrap_err();
    assert!(missing.to_string().contains("b.png") && missing.to_string().contains("image"), "{missing}");
    let alone = format!("{}[[material]]\nname = \"wall\"\nimage_width = 2\n", good_toml());
    let alone = load_with(&alone, SQUARE, MTL, &[("a.png", &png())], &LoadOptions::default()).unwrap_err();
    assert!(alone.to_string().contains("belongs to an image"), "{alone}");
}

#[test]
fn images_are_laid_on_faces_without_coordinates() {
    // Four metres wide, two high: each axis once, far from the origin.
    let mtl = "newmtl wall\nKd 1 1 1\n";
    let faces = [
        ("v 1000000 0 0\nv 1000004 0 0\nv 1000004 2 0\nf 1 2 3\n", [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]),
        ("v 0 1000000 0\nv 0 1000000 4\nv 0 1000002 4\nf 1 2 3\n", [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]),
        ("v 0 0 0\nv 4 0 0\nv 4 0 -2\nf 1 2 3\n", [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]),
        ("v -3 0 0\nv 1 0 0\nv 1 -2 0\nf 1 2 3\n", [[0.25, 0.0], [1.25, 0.0], [1.25, -1.0]]),
    ];
    for (face, expected) in faces {
        let scene =
            with_image(&format!("mtllib m.mtl\nusemtl wall\n{face}"), mtl, "image_width = 4\n").unwrap();
        assert_eq!(scene.texture_coordinates, [expected.map(Vec2::from)], "{face}");
        assert_eq!(scene.warnings, [""; 0], "{face}");
    }
}

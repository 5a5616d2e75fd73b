//! Input beyond a limit is refused, in a line that states the number, and before
//! memory is allocated.

use lightpaths::scene::limits::{
    self, CAMERAS, FILM_KEYS, IMAGE_BYTES, IMAGE_SIDE, LIBRARIES, LIGHTS, MATERIALS, MODELS, MTL_BYTES,
    NAME_BYTES, OBJ_BYTES, TOML_BYTES,
};
use lightpaths::scene::{Film, LoadOptions, Scene};

use super::refused::message;
use super::{CAMERA, HEAD, LIGHT, SQUARE, good_toml, load, load_files};

fn refuses(toml: &str, obj: &str, expected: &str) {
    let found = message(load(toml, obj));
    assert!(found.contains(expected), "expected {expected:?}, found {found:?}");
    assert!(found.len() < 12_000, "{} bytes: {}", found.len(), &found[..200]);
}

fn lights(count: usize) -> String {
    (0..count).map(|number| LIGHT.replace("lamp", &format!("lamp {number}"))).collect()
}

/// Sparse files have any length, and take no space.
#[test]
fn files_are_not_too_long() {
    let obj = format!("mtllib m.mtl\nusemtl a\nvt 0 0\n{SQUARE}");
    for (name, most, words) in [
        ("s.toml", TOML_BYTES, "s.toml: "),
        ("m.obj", OBJ_BYTES, "s.toml:2: model.0.file: "),
        // The rest of the scene is loaded without these.
        ("m.mtl", MTL_BYTES, "m.obj:1: mtllib: libraries that cannot be used are left out"),
        ("i.png", IMAGE_BYTES, "m.mtl:2: material \"a\": images that cannot be used are left out"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("s.toml"), good_toml()).unwrap();
        std::fs::write(at("m.obj"), &obj).unwrap();
        std::fs::write(at("m.mtl"), "newmtl a\nmap_Kd i.png\n").unwrap();
        std::fs::File::create(at(name)).unwrap().set_len(most + 1).unwrap();
        let loaded = Scene::load(at("s.toml").to_str().unwrap(), &LoadOptions::default());
        let said = match loaded {
            Ok(scene) => scene.warnings[0].replace(&format!("{}/", folder.path().display()), ""),
            refused => message(refused),
        };
        let expected = format!("has {} bytes, {most} at most", most + 1);
        assert!(said.starts_with(words) && said.contains(&expected), "{said}");
    }
}

#[test]
fn lists_are_not_too_long() {
    let good = good_toml();
    assert!(load(&format!("{HEAD}{CAMERA}{}", lights(LIGHTS)), SQUARE).is_ok());
    refuses(
        &format!("{HEAD}{CAMERA}{}", lights(LIGHTS + 1)),
        SQUARE,
        "light: 1025 of them are too many: 1024 at most",
    );
    refuses(
        &format!("{}{good}", HEAD.repeat(MODELS)),
        SQUARE,
        "s.toml:2049: model: 1025 of them are too many",
    );
    let cameras = CAMERA.replace("[camera]", "[[camera]]").repeat(CAMERAS + 1);
    refuses(&format!("{HEAD}{cameras}{LIGHT}"), SQUARE, "camera: 1025 of them are too many");
    let materials = "[[material]]\nname = \"a\"\n".repeat(MATERIALS + 1);
    refuses(&format!("{good}{materials}"), SQUARE, "material: 65537 of them are too many");
}

#[test]
fn names_are_not_too_long() {
    let good = good_toml();
    let long = "a".repeat(NAME_BYTES + 1);
    refuses(&good.replace("lamp", &long), SQUARE, "name: has 4097 bytes, 4096 at most");
    refuses(&good.replace("m.obj", &long), SQUARE, "file: has 4097 bytes, 4096 at most");
    for keyword in ["usemtl", "mtllib"] {
        refuses(&good, &format!("{keyword} {long}\n{SQUARE}"), "is no printable name of at most 4096 bytes");
        refuses(
            &good,
            &format!("{keyword} \u{1b}[2J\n{SQUARE}"),
            "is no printable name of at most 4096 bytes",
        );
    }
    // The message about a long line is short.
    let long = "x".repeat(1 << 20);
    for line in ["v 0 0 ", "f 1 2 ", "v "] {
        refuses(&good, &format!("{SQUARE}{line}{long}\n"), "m.obj:6: ");
    }
    for line in ["vt ", "f 1 2 3/", "", "x"] {
        let scene = load(&good, &format!("{SQUARE}{line}{long}\n")).unwrap();
        let bytes: usize = scene.warnings.iter().map(String::len).sum();
        assert!((1..1000).contains(&bytes), "{line}: {:?}", scene.warnings);
    }
    refuses(&format!("{good}{long} = 1\n"), SQUARE, "unknown key `xxxx");
    refuses(&good.replace("\"point\"", &format!("{long:?}")), SQUARE, "light.lamp.kind: has 1048576 bytes");
    refuses(
        &good.replace("[0, 1, 0]", &format!("{long:?}")),
        SQUARE,
        "three numbers was expected, found the string",
    );
    // The message about another key contains the name.
    refuses(&good.replace("lamp\"", "la\\nmp\"\nangle = 1"), SQUARE, "light.la mp.");
    let mtl = ["newmtl ", "newmtl a\nKd ", "newmtl a\nmap_Kd -clamp ", "newmtl a\nmap_Kd -", "newmtl a\n"];
    for start in mtl {
        let (obj, mtl) = (format!("mtllib m.mtl\n{SQUARE}"), format!("{start}{long}\n"));
        let files = [("s.toml", good.as_bytes()), ("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
        let found = match load_files(&files, "s.toml", &LoadOptions::default()) {
            Ok(scene) => scene.warnings.join(" "),
            refused => message(refused),
        };
        let is_refused = found.contains("newmtl: ");
        assert_eq!(is_refused, start == "newmtl ", "{}", &found[..found.len().min(500)]);
        assert!((50..2000).contains(&found.len()), "{}: {}", found.len(), &found[..found.len().min(500)]);
    }
}

#[test]
fn materials_are_not_too_many() {
    let good = good_toml();
    let used = |count: usize| (0..count).map(|number| format!("usemtl a{number}\n")).collect::<String>();
    assert!(load(&good, &format!("{}{SQUARE}", used(MATERIALS))).is_ok());
    refuses(
        &good,
        &format!("{}{SQUARE}", used(MATERIALS + 1)),
        "m.obj:65537: usemtl: there are more than 65536 materials",
    );
    refuses(
        &good,
        &format!("{}{SQUARE}", "mtllib m.mtl\n".repeat(LIBRARIES + 1)),
        "m.obj:257: mtllib: there are more than 256 of them",
    );
    let defined: String = (0..=MATERIALS).map(|number| format!("newmtl a{number}\n")).collect();
    let obj = format!("mtllib m.mtl\n{SQUARE}");
    let files = [("s.toml", good.as_bytes()), ("m.obj", obj.as_bytes()), ("m.mtl", defined.as_bytes())];
    let found = message(load_files(&files, "s.toml", &LoadOptions::default()));
    assert!(found.contains("m.mtl:65537: newmtl: there are more than 65536 materials"), "{found}");
    // Two models, each with the maximum number.
    let two = format!("{HEAD}{good}");
    refuses(
        &two,
        &format!("{}{SQUARE}", used(MATERIALS)),
        "the models have more than 65536 materials together",
    );
    // An unknown name is compared with the known ones: the message lists only some of them.
    refuses(
        &format!("{good}[[material]]\nname = \"b\"\n"),
        &format!("{}{SQUARE}", used(MATERIALS)),
        "and 65496 more",
    );
}

/// A PNG without pixel data, with correct checksums.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_chunk(png::chunk::IDAT, &[0x78, 0x9c]).unwrap();
    bytes
}

#[test]
fn images_are_not_larger_than_their_files_can_hold() {
    let obj = "mtllib m.mtl\nusemtl a\nvt 0 0\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nf 1/1 2/1 3/1\n";
    let mtl = b"newmtl a\nmap_Kd i.png\n";
    let said = |image: &[u8]| {
        let files = [("m.obj", obj.as_bytes()), ("m.mtl", mtl), ("i.png", image)];
        load_files(&files, "m.obj", &LoadOptions::default()).unwrap().warnings.swap_remove(0)
    };
    let found = said(&png_header(60_000, 60_000));
    assert!(found.contains("is 60000×60000 texels large, 1 to 8192 either way can be used"), "{found}");
    let found = said(&png_header(IMAGE_SIDE, IMAGE_SIDE));
    assert!(found.contains("bytes cannot hold 8192×8192 texels"), "{found}");
    let found = said(&png_header(16, 16));
    assert!(found.contains("is no readable Png: "), "{found}");
}

/// Nine images of the largest size, each in a small file.
#[test]
fn images_are_not_too_large_together() {
    let mut image = Vec::new();
    let mut encoder = png::Encoder::new(&mut image, IMAGE_SIDE, IMAGE_SIDE);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    let row_bytes = IMAGE_SIDE as usize * IMAGE_SIDE as usize / 8;
    encoder.write_header().unwrap().write_image_data(&vec![0; row_bytes]).unwrap();
    assert!(image.len() < 100_000, "{}", image.len());
    let mtl: String = (0..9).map(|number| format!("newmtl a{number}\nmap_Kd i{number}.png\n")).collect();
    let obj = "mtllib m.mtl\nusemtl a0\nvt 0 0\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nf 1/1 2/1 3/1\n";
    let names: Vec<String> = (0..9).map(|number| format!("i{number}.png")).collect();
    let mut files = vec![("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
    // The same bytes would be read once.
    let images: Vec<Vec<u8>> = (0..9).map(|number| [&image[..], &[number]].concat()).collect();
    files.extend(names.iter().zip(&images).map(|(name, image)| (name.as_str(), image.as_slice())));
    let found = load_files(&files, "m.obj", &LoadOptions::default()).unwrap().warnings.swap_remove(0);
    let expected =
        "i8.png\" is 8192×8192 texels large, and the scene's images may have 0 more at most: scale them";
    assert!(found.contains(expected), "{found}");
}

#[test]
fn films_are_not_too_long() {
    let refuses = |film: String, expected: &str| {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("f.toml");
        std::fs::write(&file, format!("scene = \"box\"\nduration = 2\n{film}")).unwrap();
        let loaded = Film::load(file.to_str().unwrap(), &LoadOptions::default()).map(|(_, scene)| scene);
        let found = message(loaded);
        assert!(found.contains(expected), "{found}");
    };
    let key = |number: usize| format!("[[camera]]\ntime = {number}\n");
    refuses((0..=FILM_KEYS).map(key).collect(), "camera: 65537 of them are too many: 65536 at most");
    let light = |number: usize| LIGHT.replace("lamp", &format!("l{number}")) + "time = 0\n";
    refuses((0..LIGHTS).map(light).collect(), "there are 1024 lights: no more can be added");
    // Speeds between two keys at almost the same time are not finite.
    let place =
        |time: &str, x: u32| format!("[[light]]\nname = \"lamp\"\ntime = {time}\nposition = [{x}, 0, 0]\n");
    let three = format!("{}{}{}", place("0", 0), place("1e-320", 1), place("2", 2));
    refuses(three, "there is another key of it at");
}

/// A transform that makes all coordinates of a vertex NaN or infinite.
#[test]
fn numbers_stay_numbers_under_transforms() {
    // The others have the largest valid size. A NaN does not reach the bounding box as long as
    // other corners follow, in the order of the faces.
    let huge = "v 1e308 1e308 1e308\nv 0 0 0\nv 1e-9 0 0\nv 0 1e-9 0\nf 1 2 3\nf 2 3 4\n";
    let mut refused = 0;
    for (x, y) in (0..24).flat_map(|x| (0..24).map(move |y| (15 * x, 15 * y))) {
        let model = format!("{HEAD}scale = 1e9\nrotate = [{x}, {y}, 60]\n");
        match load(&format!("{model}{CAMERA}{LIGHT}"), huge) {
            Ok(scene) => {
                assert!(scene.triangles.iter().all(|t| t.positions.iter().all(|p| p.is_finite())), "{x} {y}");
            }
            Err(error) => {
                refused += 1;
                assert_eq!(error.exit_code(), 2);
            }
        }
    }
    assert_eq!(refused, 576);
    assert!(Scene::load("box", &LoadOptions::default()).is_ok());
}

/// The limits in the documentation are those of the code.
#[test]
fn the_page_states_the_limits() {
    let page = include_str!("../../docs/reliability.md");
    let mib = |bytes: u64| match bytes >> 30 {
        0 => format!("{} MiB", bytes >> 20),
        gib => format!("{gib} GiB"),
    };
    let count = |count: u64| {
        let digits = count.to_string();
        let groups = digits.as_bytes().rchunks(3).rev();
        let groups: Vec<&str> = groups.map(|group| std::str::from_utf8(group).unwrap()).collect();
        if count < 10_000 { digits.clone() } else { groups.join(" ") }
    };
    for (name, stated) in [
        ("TOML_BYTES", mib(TOML_BYTES)),
        ("OBJ_BYTES", mib(OBJ_BYTES)),
        ("MTL_BYTES", mib(MTL_BYTES)),
        ("IMAGE_BYTES", mib(IMAGE_BYTES)),
        ("NAME_BYTES", format!("{} bytes", count(NAME_BYTES as u64))),
        ("MODELS", count(MODELS as u64)),
        ("TRIANGLES", count(limits::TRIANGLES as u64)),
        ("LIBRARIES", count(LIBRARIES as u64)),
        ("MATERIALS", count(MATERIALS as u64)),
        ("LIGHTS", count(LIGHTS as u64)),
        ("CAMERAS", count(CAMERAS as u64)),
        ("FILM_KEYS", count(FILM_KEYS as u64) + " each"),
        ("FILM_FRAMES", count(limits::FILM_FRAMES.into())),
        ("IMAGE_SIDE", format!("{} texels", count(IMAGE_SIDE.into()))),
        ("TEXELS", count(limits::TEXELS)),
        ("IMAGE_GROWTH", count(limits::IMAGE_GROWTH)),
        ("WEBP_BYTES", mib(limits::WEBP_BYTES)),
        ("JPEG_SCANS", count(limits::JPEG_SCANS as u64)),
        ("FOLDER_NAMES", count(limits::FOLDER_NAMES as u64)),
    ] {
        assert!(page.contains(&format!(" | {stated} | `{name}` | ")), "{name} is {stated}");
    }
}

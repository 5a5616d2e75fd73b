//! OBJ and MTL files as other programs write and read them, valid or not: each gives a picture and
//! one warning for each kind.

use glam::Vec3;
use image::{ImageFormat, RgbImage};
use lightpaths::scene::{LoadOptions, Scene};

use super::refused::message;
use super::{CAMERA, LIGHT, SQUARE, close, load_files};

/// Loads `m.obj` beside these files. Warnings come without the folder's name.
fn load(obj: &[u8], files: &[(&str, &[u8])]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let toml = format!("[[model]]\nfile = \"m.obj\"\n{CAMERA}{LIGHT}");
    for (name, bytes) in [("m.obj", obj), ("s.toml", toml.as_bytes())].iter().chain(files) {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let spec = folder.path().join("s.toml");
    let mut scene = Scene::load(spec.to_str().unwrap(), &LoadOptions::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let name = format!("{}/", folder.path().display());
    scene.warnings.iter_mut().for_each(|warning| *warning = warning.replace(&name, ""));
    scene
}

fn with_mtl(mtl: &str) -> Scene {
    let obj = format!("mtllib m.mtl\nusemtl a\n{SQUARE}");
    load(obj.as_bytes(), &[("m.mtl", mtl.as_bytes())])
}

fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    RgbImage::new(2, 2).write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn faces_without_normals_borrow_none() {
    let obj = format!("{SQUARE}vn 1 1 0\nv 2 0 0\nfo 2//1 5//1 3//1\nl 1 2 3\nf 2 5 4\n");
    let scene = load(obj.as_bytes(), &[]);
    let tilted = scene.triangles.iter().filter(|t| !close(t.normals[0], t.geometric_normal())).count();
    assert_eq!((scene.triangles.len(), tilted), (4, 1));
}

/// Two squares that meet at a right angle, without normals.
#[test]
fn smoothing_groups_share_normals_at_common_vertices() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nv 1 1 -1\nv 0 1 -1\n";
    let with = |first: &str, second: &str, more: &str| {
        let obj = format!("{vertices}{first}\nf 1 2 3 4\n{second}\nf 4 3 5 6\n{more}");
        let scene = load(obj.as_bytes(), &[]);
        assert!(scene.warnings.iter().all(|said| said.contains("defined nowhere")), "{:?}", scene.warnings);
        scene
    };
    // Normals at the free and at the common edge of the first square.
    let normals = |scene: &Scene| {
        let at = |z: f64| {
            let triangle = &scene.triangles[0];
            let is_there =
                |&corner: &usize| (f64::from(triangle.positions[corner].z) + scene.origin.z - z).abs() < 1e-6;
            triangle.normals[(0..3).find(is_there).unwrap()]
        };
        [at(0.0), at(-1.0)]
    };
    let between = Vec3::new(0.0, 1.0, 1.0).normalize();
    for (first, second, common) in [
        ("s 1", "", between),
        ("s 1", "usemtl other", between),
        ("s on", "s on", between),
        ("s 1", "s 2", Vec3::Y),
        ("s 1", "s off", Vec3::Y),
        ("s 0", "s 0", Vec3::Y),
        ("", "", Vec3::Y),
    ] {
        let [free, found] = normals(&with(first, second, ""));
        assert!(close(free, Vec3::Y) && close(found, common), "{first}, {second}: {found}");
    }
    // A polygon counts by its angle, however many triangles it has.
    let fan = with("s 1", "", "v 2 0 -0.5\nf 2 7 3\n");
    assert!(close(normals(&fan)[1].normalize() * Vec3::new(0.0, 1.0, 1.0), normals(&fan)[1]));
    // Stated normals take precedence.
    let stated = format!("{vertices}vn 0 1 0.2\ns 1\nf 1//1 2//1 3//1 4//1\nf 4 3 5 6\n");
    let scene = load(stated.as_bytes(), &[]);
    assert!(close(scene.triangles[0].normals[0], Vec3::new(0.0, 1.0, 0.2).normalize()));
    assert!(scene.triangles[2..].iter().all(|triangle| close(triangle.normals[0], Vec3::Z)));
}

#[test]
fn faces_lack_what_the_file_does_not_have() {
    // The first face has a normal that comes later, the second a normal that does not exist, the
    // last one a normal of its own.
    let obj = format!(
        "{}f 1//1 2//1 3//1\nf 1/1/2 3/1/2 4/1/2\nv 0 1 0\nf 1//-9 2//-9 5//-9\nf 2/x 3/0 5/7\nvn 0 1 0.5\nvt 0 0\n",
        SQUARE.rsplit_once("f ").unwrap().0
    );
    let scene = load(obj.as_bytes(), &[]);
    let tilted = Vec3::new(0.0, 1.0, 0.5).normalize();
    let smooth = |index: usize| close(scene.triangles[index].normals[0], tilted);
    assert_eq!([0, 1, 2, 3].map(smooth), [true, false, false, false]);
    assert_eq!(
        scene.warnings,
        [
            "m.obj:6: faces name normals that are not in the file, and have none (2 in all, this is the first)",
            "m.obj:9: faces name texture coordinates that are not in the file, and have none"
        ]
    );
}

#[test]
fn trifles_of_obj_files_are_one_warning_a_kind() {
    let mut obj = SQUARE.replace("v 1 0 0\n", "v 1 0 0 1 1 1\n").replace("v 1 0 -1\n", "v 1 0 -1 1\n");
    obj +=
        &"f 1 2\nvt x\nvt nan nan\nl 1 2\np 1\ncurv 0 1 2\nusemtl\ng\no\ns\nmtllib\nvn 1\nend\n".repeat(700);
    let scene = load(obj.as_bytes(), &[]);
    assert_eq!(scene.materials.len(), 1);
    assert_eq!(
        scene.warnings,
        [
            "m.obj:6: faces with fewer than 3 corners are passed over (700 in all, this is the first)",
            "m.obj:7: texture coordinates that are no numbers, or beyond 1e6, are taken as 0: \"x\"; \"nan nan\" (1400 in all, this is the first)",
            "m.obj:9: lines and points have no surface, and are passed over (1400 in all, this is the first)",
            "m.obj:11: statements that are not known are passed over: \"curv\" (700 in all, this is the first)",
        ]
    );
}

#[test]
fn lines_and_letters_are_those_of_every_system() {
    let plain = load(SQUARE.as_bytes(), &[]);
    let mac = SQUARE.replace('\n', "\r");
    let dos = SQUARE.replace('\n', "\r\n");
    let joined = SQUARE.replace("f 1 2 3 4", "f 1 2 \\\n3 4").replace("v 1 0 0", "v 1 \\\r\n 0 0");
    let comment = format!("# C:\\models\\\n{SQUARE}");
    for obj in [&mac, &dos, &joined, &comment] {
        let scene = load(obj.as_bytes(), &[]);
        assert_eq!((&scene.triangles, scene.warnings.len()), (&plain.triangles, 0), "{obj:?}");
    }
    let wide: Vec<u8> = format!("\u{feff}{SQUARE}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(load(&wide, &[]).triangles, plain.triangles);

    let obj = [b"mtllib m.mtl\nusemtl caf\xe9\n# \xff\n", SQUARE.as_bytes()].concat();
    let scene = load(&obj, &[("m.mtl", "newmtl caf\u{e9}\nKd 0.1 0.1 0.1\n".as_bytes())]);
    assert_eq!((scene.materials[0].name.as_str(), scene.materials[0].diffuse.x), ("caf\u{e9}", 0.1));
    assert_eq!(
        scene.warnings,
        ["m.obj: the text is not UTF-8, and is taken as Latin-1 (or UTF-16, where it is marked so)"]
    );
}

#[test]
fn materials_without_a_name_are_the_default() {
    let obj = format!("mtllib m.mtl\nusemtl\n{SQUARE}");
    let named = load(obj.as_bytes(), &[("m.mtl", b"newmtl\nKd 0.2 0.2 0.2\n")]);
    assert_eq!((named.materials[0].diffuse.x, named.triangles[0].material), (0.2, 0));
    let lone = load(obj.as_bytes(), &[("m.mtl", b"")]);
    assert_eq!((lone.materials[0].diffuse.x, lone.warnings.len()), (0.7, 0));
}

#[test]
fn what_is_passed_over_in_mtl_files_is_named() {
    let neutral = "newmtl a\nKd 0.5 0.5 0.5\nKa 1 1 1\nKe 0 0 0\nNi 1.45\nd 1.0\nTr 0\nTf 1 1 1\nillum 2\nPr 1\nPm 0\nPs 0\nPc 0\nPcr 0.03\naniso 0\n";
    assert_eq!(with_mtl(neutral).warnings, [""; 0]);
    // A single statement is named, with file, line and material.
    for (line, named) in [
        ("d 0.5", "`d` is passed over (transparency): surfaces are opaque"),
        ("Tr 0.25", "`Tr` is passed over (transparency): surfaces are opaque"),
        ("d -halo 0.2", "`d` is passed over (transparency): surfaces are opaque"),
        ("Tf 0.2 0.4 1", "`Tf` is passed over (transparency): surfaces are opaque"),
        ("map_opacity a.png", "`map_opacity` is passed over (transparency): surfaces are opaque"),
        (
            "map_d gone.png",
            "opacity maps that cannot be used are left out: surfaces are opaque: \"gone.png\" does not exist: check the path",
        ),
        ("illum 7", "`illum` is passed over (transparency): surfaces are opaque"),
        ("illum 3", "`illum` is passed over (mirror reflections)"),
        ("map_Bump -bm 0.2 a.png", "`map_Bump` is passed over (bumps)"),
        ("bump a.png", "`bump` is passed over (bumps)"),
        ("norm a.png", "`norm` is passed over (bumps)"),
        ("disp a.png", "`disp` is passed over (displacement)"),
        ("map_Pr a.png", "`map_Pr` is passed over (roughness)"),
        ("map_Pm a.png", "`map_Pm` is passed over (metal)"),
        ("Pr", "`Pr` without a number is passed over"),
        ("Pm 2", "`Pm` below 0 or above 1 is clamped"),
        ("refl -type sphere a.png", "`refl` is passed over (reflection maps)"),
        ("map_Ns a.png", "`map_Ns` is passed over (images of highlights)"),
        ("Ka 0.5 0.5 0.5", "`Ka` is passed over, and there is no `Kd`: the material is grey"),
        ("sparkle 3", "statements that are not known are passed over: \"sparkle\""),
        ("Kd spectral a.rfl", "colours that are not red, green and blue are passed over: `Kd spectral`"),
        ("Kd xyz 1 1 1", "colours that are not red, green and blue are passed over: `Kd xyz`"),
        ("Kd 0,5 0,5 0,5", "colours that are no numbers are passed over: Kd \"0,5 0,5 0,5\""),
        ("Kd", "colours that are no numbers are passed over: Kd \"\""),
        ("Kd -1 0 0", "`Kd` below 0 or above 1e6 is clamped"),
        ("Ks inf 0 0", "`Ks` below 0 or above 1e6 is clamped"),
        ("Ns -5", "`Ns` below 0 or above 1e6 is clamped"),
        ("Ns x", "`Ns` without a number is passed over"),
        ("map_Kd", "`map_Kd` without the name of an image is passed over"),
        (
            "map_Kd gone.png",
            "images that cannot be used are left out, `Kd` is taken instead: \"gone.png\" does not exist: check the path",
        ),
    ] {
        let scene = with_mtl(&format!("newmtl a\n\n{line}\n"));
        assert_eq!(scene.warnings[0], format!("m.mtl:3: material \"a\": {named}"));
        let others = scene.warnings.len() - 1;
        assert_eq!(others, usize::from(line.starts_with("Ks inf")), "{:?}", scene.warnings);
    }
    // Many statements of one kind give one warning.
    let many: String =
        (0..500).map(|number| format!("newmtl m{number}\nd 0.5\nNi 1.5\nfoo{number} 1\n")).collect();
    let scene = with_mtl(&format!("Kd 1 1 1\n{many}newmtl a\n"));
    assert_eq!(
        scene.warnings,
        [
            "m.mtl:1: statements before the first `newmtl` are passed over",
            "m.mtl:5: material \"m0\": statements that are not known are passed over: \"foo0\"; \"foo1\"; \"foo2\"; \"foo3\"; \"foo4\"; \"foo5\"; \"foo6\"; \"foo7\"; and others (500 in all, this is the first)",
            "m.mtl:3: material \"m0\": `d` is passed over (transparency): surfaces are opaque (500 in all, this is the first)",
            "m.mtl:4: material \"m0\": `Ni` is passed over (refraction) (500 in all, this is the first)",
        ]
    );
}

#[test]
fn numbers_of_materials_stand_for_what_they_can() {
    let material = |lines: &str| with_mtl(&format!("newmtl a\n{lines}")).materials.swap_remove(0);
    assert_eq!(material("Kd 0.3\n").diffuse, Vec3::splat(0.3));
    assert_eq!(material("Kd 0.3 0.2 # two\n").diffuse, Vec3::new(0.3, 0.2, 0.2));
    assert_eq!(material("kd 0.3 0.2 0.1\nKS 0.5\nns 40\n").specular, Vec3::splat(0.5));
    assert_eq!(material("Kd -1 0.5 0\nNs -4\n").diffuse, Vec3::new(0.0, 0.5, 0.0));
    assert_eq!(material("Ns -4\n").exponent, 1.0);
    assert_eq!(material("Kd x\nKd 0.1 \\\n0.2 0.3\n").diffuse, Vec3::new(0.1, 0.2, 0.3));
    // Codes in place of fractions keep their hue.
    assert!(close(material("Kd 255 51 0\n").diffuse, Vec3::new(0.99, 0.198, 0.0)));
}

/// The specular albedo is lowered, so that light paths end with the defaults of exporters,
/// and colours stay.
#[test]
fn materials_reflect_less_than_they_receive() {
    let scene = with_mtl(
        "newmtl a\nKd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nNs 250\nnewmtl b\nKd 0.9 0.1 0.1\nKs 0.5 0.5 0.25\nnewmtl c\nKd 1\nKs 0.2\nnewmtl d\nKd 0.8\nKs 0.2\n",
    );
    let [a, b, c, d] = &scene.materials[..] else { panic!("{:?}", scene.materials) };
    assert!(a.diffuse == Vec3::splat(0.8) && close(a.specular, Vec3::splat(0.19)));
    assert!(b.diffuse == Vec3::new(0.9, 0.1, 0.1) && close(b.specular, Vec3::new(0.09, 0.09, 0.045)));
    assert!(close(c.diffuse, Vec3::splat(0.99)) && c.specular == Vec3::ZERO);
    assert!(close(d.diffuse, Vec3::splat(0.99 * 0.8)) && close(d.specular, Vec3::splat(0.99 * 0.2)));
    let [mended, bounded] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(mended.contains("material \"a\" reflected more than it receives: its highlights are dimmed, to an albedo of 0.99 (3 in all"), "{mended}");
    assert!(
        bounded.contains("material \"c\" reflected all light") && bounded.contains("2 in all"),
        "{bounded}"
    );
}

#[test]
fn libraries_are_found_where_they_can_be() {
    let grey = b"newmtl a\nKd 0.1 0.1 0.1\n";
    let colour = |line: &str, files: &[(&str, &[u8])]| {
        let scene = load(format!("mtllib {line}\nusemtl a\n{SQUARE}").as_bytes(), files);
        (scene.materials[0].diffuse.x, scene.warnings)
    };
    for (line, file) in [
        ("m.mtl n.mtl", "n.mtl"),
        ("n.mtl o.mtl m.mtl", "m.mtl"),
        ("my own.mtl", "my own.mtl"),
        ("x.mtl my own.mtl", "my own.mtl"),
        ("a b.mtl", "a"),
        ("M.MTL", "m.mtl"),
        ("m.mtl", "M.Mtl"),
        ("SUB\\m.mtl", "sub/M.mtl"),
        ("sub/../SUB/m.mtl", "sub/M.mtl"),
        ("C:\\work\\m.mtl", "m.mtl"),
        ("/models/m.mtl", "M.mtl"),
        ("../../m.mtl", "m.mtl"),
    ] {
        let (found, warnings) = colour(line, &[(file, grey)]);
        assert_eq!(found, 0.1, "{line}: {warnings:?}");
    }
    let (grey, warnings) = colour("gone.mtl", &[]);
    let gone = "m.obj:1: mtllib: libraries that cannot be used are left out, and what they define is grey: \"gone.mtl\" does not exist: check the path";
    assert_eq!(
        (grey, &warnings[..]),
        (0.7, &[gone.to_owned(), "m.obj:2: material \"a\" is defined nowhere: taken as grey".to_owned()][..])
    );
    // One warning for all undefined materials.
    let used: String = (0..1449).map(|number| format!("usemtl m{number}\n")).collect();
    let scene = load(format!("mtllib gone.mtl\n{used}{SQUARE}").as_bytes(), &[]);
    assert!(
        scene.warnings.len() == 2 && scene.warnings[1].ends_with("grey (1449 in all, this is the first)"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn images_are_found_where_they_can_be() {
    let obj =
        format!("mtllib sub/m.mtl\nusemtl a\nvt 0 0\n{}", SQUARE.replace("f 1 2 3 4", "f 1/1 2/1 3/1 4/1"));
    let texture = |image: &str, file: &str| {
        let mtl = format!("newmtl a\nKd 0.5 0.5 0.5\nmap_Kd {image}\n");
        let scene = load(obj.as_bytes(), &[("sub/m.mtl", mtl.as_bytes()), (file, &png())]);
        assert_eq!(scene.materials[0].diffuse, Vec3::splat(0.5));
        (scene.materials[0].texture.is_some(), scene.warnings)
    };
    for (image, file, warnings) in [
        ("i.png", "sub/i.png", 0),
        ("..\\i.png", "i.png", 0),
        ("SP_LUK.PNG", "sub/sp_luk.png", 1),
        ("Textures\\Wall 1.png", "sub/textures/wall 1.PNG", 1),
        ("../Textures/i.png", "textures/i.png", 1),
        ("D:\\maps\\i.png", "sub/i.png", 1),
        ("/maps/i.png", "sub/I.png", 1),
        ("\\\\server\\maps\\i.png", "sub/i.png", 1),
        ("maps/i.png", "sub/i.png", 1),
        ("i.png", "sub/I\u{c9}.png", 2),
        ("../../i.png", "sub/i.png", 1),
    ] {
        let (has_texture, said) = texture(image, file);
        assert_eq!((has_texture, said.len().min(1)), (warnings < 2, warnings.min(1)), "{image}: {said:?}");
    }
    let (_, said) = texture("SP_LUK.PNG", "sub/sp_luk.png");
    assert_eq!(
        said[0],
        "sub/m.mtl:3: material \"a\": files are found under another name: \"SP_LUK.PNG\" as \"sub/sp_luk.png\""
    );
}

#[test]
fn files_of_other_kinds_are_named() {
    for (name, expected) in [
        ("a.blend", "a.blend: is a Blender file, which is not read: export it as glTF"),
        ("a.fbx", "is an FBX model"),
        ("a.usdz", "is a USD scene"),
        ("a.dae", "is a COLLADA model"),
        ("a.obj.gz", "is an archive, which is not read: unpack it"),
        ("a.mtl", "is a list of materials, which is not read: give the .obj file"),
        (
            "a.foo",
            "\"a.foo\" is no scene: a .toml scene file, a .glb, .gltf, .obj, .ply or .stl model or a built-in scene (box, atrium, room) was expected",
        ),
        ("models/a", "\"models/a\" is no scene"),
        ("bos", "unknown built-in scene `bos`: did you mean `box`?"),
    ] {
        let found = message(Scene::load(name, &LoadOptions::default()));
        assert!(found.contains(expected), "{name}: {found}");
    }
    let toml = format!("[[model]]\nfile = \"a.FBX\"\n{CAMERA}{LIGHT}");
    let files = [("s.toml", toml.as_bytes()), ("a.FBX", SQUARE.as_bytes())];
    let found = message(load_files(&files, "s.toml", &LoadOptions::default()));
    assert!(
        found.starts_with("s.toml:2: model.0.file: \"a.FBX\" is an FBX model, which is not read"),
        "{found}"
    );
}

/// The face of a letter C, from any first corner; as a fan, each would be closed to a square.
#[test]
fn concave_faces_keep_their_notch() {
    let corners = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]];
    let vertices: String = corners.map(|[x, y]| format!("v {x} {y} 0\n")).concat();
    for first in 0..8 {
        for is_reversed in [false, true] {
            let mut order: Vec<usize> = (0..8).map(|index| 1 + (first + index) % 8).collect();
            if is_reversed {
                order.reverse();
            }
            let face: String = order.iter().map(|index| format!(" {index}")).collect();
            let scene = load(format!("{vertices}f{face}\n").as_bytes(), &[]);
            assert!((scene.area_m2() - 7.0).abs() < 1e-5, "{order:?}: {}", scene.area_m2());
            assert_eq!((scene.triangles.len(), scene.warnings.len()), (6, 0));
            let side = if is_reversed { -1.0 } else { 1.0 };
            assert!(scene.triangles.iter().all(|triangle| triangle.geometric_normal().z == side));
        }
    }
    let bow = load(b"v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\nf 1 3 2\n", &[]);
    assert!(
        bow.warnings
            .iter()
            .any(|warning| warning.starts_with("m.obj: 1 polygons cross themselves, are bent or have")),
        "{:?}",
        bow.warnings
    );
}

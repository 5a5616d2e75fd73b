//! Scene files of models alone, and `--strict`.

use super::*;

#[test]
fn the_scene_file_of_a_model_gives_its_picture() {
    let folder = folder_with(&[("cube.obj", CUBE)]);
    let made = run(&folder, &["init", "cube.obj", "-o", "a.toml"]);
    assert!(made.status.success() && stdout(&made) == "a.toml: the scene of cube.obj\n", "{made:?}");
    let text = fs::read_to_string(folder.path().join("a.toml")).unwrap();
    for expected in [
        "# cube.obj: keys, units and ranges are in `lightpaths help scene`.\n",
        "# cube.obj has no camera: one was placed inside at ",
        "# cube.obj has no light: a lamp of ",
        "--exposure auto",
        "file = \"cube.obj\"",
        "\n# [[material]]\n# name = ",
    ] {
        assert!(text.contains(expected), "{expected:?} is missing: {text}");
    }
    let render = |scene: &str, picture: &str| {
        let output = run(&folder, &[&["render", scene, "-o", picture], &SMALL[..]].concat());
        assert!(output.status.success(), "{output:?}");
        stderr(&output)
    };
    assert!(render("cube.obj", "cube.exr").contains("has no camera"));
    assert_eq!(render("a.toml", "a.exr"), "", "nothing is assumed any more");
    let same = run(&folder, &["compare", "a.exr", "cube.exr", "--max-relmse", "0"]);
    assert!(same.status.success(), "{same:?}");

    // The model alone is exposed automatically, the scene file if asked.
    assert!(render("cube.obj", "cube.png").contains("exposed by "));
    let asked =
        run(&folder, &[&["render", "a.toml", "-o", "a.png", "--exposure", "auto"], &SMALL[..]].concat());
    let (asked, read) = (stderr(&asked), |name| fs::read(folder.path().join(name)).unwrap());
    assert_eq!(read("a.png"), read("cube.png"));
    let stops = asked.trim().rsplit(' ').next().unwrap();
    assert!(stops.parse::<f32>().is_ok_and(|stops| stops != 0.0), "{asked}");
    let with = |scene: &str, stops: &str| {
        let output =
            run(&folder, &[&["render", scene, "-o", "b.png", "--exposure", stops], &SMALL[..]].concat());
        assert!(output.status.success() && !stderr(&output).contains("exposed by"), "{output:?}");
        read("b.png")
    };
    assert_eq!(with("cube.obj", stops), read("a.png"));
    assert_ne!(with("cube.obj", "0"), read("a.png"));
    assert_eq!(render("a.toml", "c.png"), "");
    assert_eq!(with("a.toml", "0"), read("c.png"));

    // The comments are sections of a scene file.
    let lines = text
        .lines()
        .map(|line| line.strip_prefix("# ").filter(|line| line.contains('=') || line.contains("[[")));
    let sections: Vec<&str> = lines.zip(text.lines()).map(|(bare, line)| bare.unwrap_or(line)).collect();
    fs::write(folder.path().join("b.toml"), sections.join("\n")).unwrap();
    assert!(render("b.toml", "b.exr").is_empty());

    // The file states what flags decide.
    let made = run(&folder, &["init", "cube.obj", "--outside", "--up", "z", "-o", "z.toml"]);
    assert!(made.status.success(), "{made:?}");
    let text = fs::read_to_string(folder.path().join("z.toml")).unwrap();
    assert!(text.contains("placed outside at ") && text.contains("up = [0.0, 0.0, 1.0]"), "{text}");
    let refused = run(&folder, &["init", "cube.obj", "--inside", "--outside", "-o", "y.toml"]);
    assert_refused(&refused, 2, &["--inside", "--outside"]);

    // Without -o, beside the model; never over a file.
    assert!(run(&folder, &["init", "cube.obj"]).status.success());
    assert_refused(
        &run(&folder, &["init", "cube.obj"]),
        2,
        &["cube.toml", "exists: name another file with -o"],
    );
    assert_refused(&run(&folder, &["init", "cube.obj", "-o", "a.obj"]), 2, &["let it end in .toml"]);
    assert_refused(&run(&folder, &["init", "none.obj", "-o", "c.toml"]), 2, &["none.obj", "does not exist"]);
}

#[test]
fn strict_makes_warnings_errors() {
    let folder = folder_with(&[
        ("cube.obj", CUBE),
        ("cube.toml", CUBE_SCENE),
        ("glass.mtl", "newmtl a\nd 0.5\n"),
        ("glass.obj", &format!("mtllib glass.mtl\nusemtl a\n{CUBE}")),
        ("glass.toml", &CUBE_SCENE.replace("cube.obj", "glass.obj")),
    ]);
    let render =
        |scene: &str| run(&folder, &[&["render", scene, "-o", "a.exr", "--strict"], &SMALL[..]].concat());
    assert!(render("cube.toml").status.success());
    assert_refused(&render("cube.obj"), 2, &["cube.obj: --strict: ", "has no camera", "(2 such warnings)"]);
    assert_refused(
        &render("glass.toml"),
        2,
        &["--strict: ", "glass.mtl:2: material \"a\": `d` is passed over"],
    );
}

//! Light paths in files and folders.

use super::*;

/// Precomputes the light paths of the cube at small settings, without a picture.
fn precompute(folder: &TempDir, cube: &TempDir, file: &str) -> Output {
    let scene = cube.path().join("cube.toml");
    run(folder, &[&["precompute", scene.to_str().unwrap(), "-o", file], &SMALL[2..]].concat())
}

fn paths_in(folder: &TempDir) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder.path().join("cache")).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn a_file_of_light_paths_gives_the_same_picture() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let made = precompute(&folder, &cube, "cube.paths");
    assert!(made.status.success() && stdout(&made).contains("cube.paths: light paths of cube"), "{made:?}");
    let picture = |arguments: &[&str]| {
        let output = render_cube(&folder, &cube, &[&["-o", "a.exr"], arguments].concat()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        (fs::read(folder.path().join("a.exr")).unwrap(), stderr(&output))
    };
    let (fresh, _) = picture(&[]);
    assert_eq!(picture(&["--cache", "cube.paths"]), (fresh.clone(), String::new()));

    // A stale and then a damaged file are replaced, with one line that gives the reason.
    let (_, said) = picture(&["--cache", "cube.paths", "--set", "quality.seed=5"]);
    assert!(said.contains("cube.paths is out of date: settings has changed"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let file = folder.path().join("cube.paths");
    let mut bytes = fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&file, bytes).unwrap();
    let (other, said) = picture(&["--cache", "cube.paths", "--set", "quality.seed=5"]);
    assert!(said.contains("cube.paths is damaged: the checksum of section"), "{said}");
    assert_eq!(picture(&["--cache", "cube.paths", "--set", "quality.seed=5"]), (other, String::new()));
    assert_eq!(listing(&folder), ["a.exr", "cube.paths"]);
}

#[test]
fn processes_that_keep_the_same_light_paths_do_not_harm_each_other() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let fresh = render_cube(&folder, &cube, &["-o", "fresh.exr"]).output().unwrap();
    assert!(fresh.status.success());
    let fresh = fs::read(folder.path().join("fresh.exr")).unwrap();
    // Twice: into an empty folder, and over a damaged file.
    for round in 0..2 {
        let start = |name: &str| {
            let mut command = render_cube(&folder, &cube, &["--cache", "cache", "-o", name]);
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
        };
        let children = ["a.exr", "b.exr"].map(start);
        for (child, name) in children.into_iter().zip(["a.exr", "b.exr"]) {
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success(), "{output:?}");
            assert!(fs::read(folder.path().join(name)).unwrap() == fresh, "round {round}, {name}");
        }
        let files = paths_in(&folder);
        assert_eq!(files.len(), 1, "{files:?}");
        let last = render_cube(&folder, &cube, &["--cache", "cache", "-o", "c.exr"]).output().unwrap();
        assert_eq!(stderr(&last), "", "what is kept is whole");
        assert!(fs::read(folder.path().join("c.exr")).unwrap() == fresh);
        fs::write(&files[0], b"no light paths").unwrap();
    }
}

#[test]
fn a_folder_keeps_to_its_limit() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let keep = |seed: u32, limit: &str| {
        let seed = format!("quality.seed={seed}");
        let arguments = ["--cache", "cache", "--cache-limit", limit, "--set", &seed, "-o", "a.exr"];
        let output = render_cube(&folder, &cube, &arguments).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        stderr(&output)
    };
    let said = keep(1, "1k");
    assert!(said.contains("are not kept: the limit is 1024") && said.lines().count() == 1, "{said}");
    assert!(paths_in(&folder).is_empty());
    assert_eq!(keep(1, "1G"), "");
    let first = paths_in(&folder);
    let limit = (fs::metadata(&first[0]).unwrap().len() * 3 / 2).to_string();
    assert_eq!(keep(2, &limit), "");
    let second = paths_in(&folder);
    assert!(second.len() == 1 && second != first, "{second:?}");
}

#[test]
fn what_cannot_be_kept_is_refused() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let refused = |arguments: &[&str], words: &[&str]| {
        assert_refused(&render_cube(&folder, &cube, arguments).output().unwrap(), 2, words);
    };
    refused(&["-o", "a.exr", "--cache", "c", "--method", "path"], &["--cache", "--method lightpaths"]);
    refused(&["-o", "a.exr", "--cache-limit", "4G"], &["--cache"]);
    refused(&["-o", "a.exr", "--cache", "c", "--cache-limit", "1.5G"], &["500M"]);
    fs::write(folder.path().join("file"), "text").unwrap();
    refused(&["-o", "a.exr", "--cache", "file", "--cache-limit", "4G"], &["--cache-limit", "folder"]);
    refused(&["-o", "a.exr", "--cache", "file/below"], &["file/below", "cannot be made"]);
    assert_refused(&precompute(&folder, &cube, "no/such/folder"), 2, &["no folder", "create it first"]);
    assert_refused(&precompute(&folder, &cube, "."), 2, &["is a folder"]);
}

/// A sparse file takes no space on the disk, but memory when it is read.
#[test]
fn a_file_that_is_longer_than_it_says_is_refused_and_stays() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    assert!(precompute(&folder, &cube, "cube.paths").status.success());
    let file = folder.path().join("cube.paths");
    let whole = fs::metadata(&file).unwrap().len();
    for length in [whole + 1, 40 << 30, 65 << 30] {
        fs::File::options().write(true).open(&file).unwrap().set_len(length).unwrap();
        let output = render_cube(&folder, &cube, &["-o", "a.exr", "--cache", "cube.paths"]).output().unwrap();
        assert_refused(&output, 2, &["cube.paths", &length.to_string()]);
        assert_eq!(fs::metadata(&file).unwrap().len(), length);
    }
    // Only the magic number of such a file; the rest is a hole.
    fs::write(&file, "lpstored").unwrap();
    fs::File::options().write(true).open(&file).unwrap().set_len(40 << 30).unwrap();
    let output = render_cube(&folder, &cube, &["-o", "a.exr", "--cache", "cube.paths"]).output().unwrap();
    assert_refused(&output, 2, &["cube.paths"]);
    fs::File::create(&file).unwrap().set_len(40 << 30).unwrap();
    let output = render_cube(&folder, &cube, &["-o", "a.exr", "--cache", "cube.paths"]).output().unwrap();
    assert_refused(&output, 2, &["cube.paths", "holds no light paths"]);
    // In a folder, a file has its key in the name, so it is replaced.
    let keep = || render_cube(&folder, &cube, &["-o", "a.exr", "--cache", "cache"]).output().unwrap();
    assert!(keep().status.success());
    let kept = &paths_in(&folder)[0];
    fs::File::options().write(true).open(kept).unwrap().set_len(40 << 30).unwrap();
    let output = keep();
    assert!(
        output.status.success() && stderr(&output).contains("is damaged: it has 42949672960 bytes"),
        "{output:?}"
    );
}

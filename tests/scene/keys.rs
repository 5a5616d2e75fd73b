//! The list of keys of a scene file against the reader and against the documentation.

use super::load;
use lightpaths::scene::keys::{self, KEYS, Key, SECTIONS};
use std::fmt::Write as _;

const KINDS: [&str; 4] = ["point", "spot", "area", "directional"];
const OBJ: &str = "usemtl wall\nv 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n";

/// Keys that state the power of a light, each instead of intensity, radiance or irradiance.
const POWERS: [&str; 5] = ["lumens", "candela", "nits", "lux", "watts"];

/// The kind of section with the kind of a light: lights and meters have kinds.
fn kind_of(section: &str, kind: &'static str) -> &'static str {
    match (section, kind) {
        ("meter", "area") => "plane",
        ("meter", "spot") => "region",
        ("meter", _) => "point",
        _ => kind,
    }
}

/// A scene file in which every key of every section has its example, and `change` another value.
/// Left out are keys that exclude others, unless they change.
fn file(kind: &'static str, change: Option<(&Key, &str)>) -> String {
    let mut text = String::new();
    let changes = |section: &str, name: &str| {
        change.is_some_and(|(other, _)| other.section == section && other.name == name)
    };
    let has_colour = changes("light", "kelvin") || changes("light", "tint");
    let has_power = has_colour || POWERS.iter().any(|power| changes("light", power));
    for (section, _) in SECTIONS {
        let is_list = ["model", "light", "material", "meter"].contains(&section);
        let _ = writeln!(text, "{}", if is_list { format!("[[{section}]]") } else { format!("[{section}]") });
        let kind = kind_of(section, kind);
        for key in KEYS.iter().filter(|key| key.belongs_to(section, Some(kind))) {
            let changed = change.filter(|(other, _)| std::ptr::eq(*other, key));
            let power = if kind == "directional" { "lux" } else { "lumens" };
            let is_left_out = match key.name {
                _ if changed.is_some() => false,
                "intensity" | "radiance" | "irradiance" if section == "light" => has_power,
                name if POWERS.contains(&name) => !(has_colour && name == power),
                "built_in" | "triangles" | "tint" | "matrix" | "kelvin" => true,
                "translate" | "rotate" | "scale" => changes("model", "matrix"),
                "diffuse" => changes("material", "tint"),
                // No such file is there.
                "image" | "image_width" | "ies" | "turn" => true,
                "file" => changes("model", "built_in") || changes("model", "triangles"),
                _ => false,
            };
            let value = match changed {
                Some((_, value)) => value.to_owned(),
                None if key.name == "kind" => format!("{kind:?}"),
                None => key.example.to_owned(),
            };
            if !is_left_out {
                let _ = writeln!(text, "{} = {value}", key.name);
            }
        }
        if section == "model" && changes("model", "triangles") {
            text.push_str("built_in = \"room\"\n");
        }
    }
    text
}

#[test]
fn the_reader_takes_every_key_that_is_listed_and_refuses_what_is_out_of_range() {
    for kind in KINDS {
        load(&file(kind, None), OBJ).unwrap_or_else(|error| panic!("{kind}: {error}"));
        for key in KEYS.iter().filter(|key| key.belongs_to(key.section, Some(kind_of(key.section, kind)))) {
            let is_alone = ["built_in", "triangles", "tint", "matrix", "kelvin"].contains(&key.name)
                || POWERS.contains(&key.name);
            if is_alone && !key.example.is_empty() {
                load(&file(kind, Some((key, key.example))), OBJ)
                    .unwrap_or_else(|error| panic!("{}: {error}", key.name));
            }
            if !key.refused.is_empty() {
                let error = load(&file(kind, Some((key, key.refused))), OBJ)
                    .err()
                    .unwrap_or_else(|| panic!("{}.{} = {} is taken", key.section, key.name, key.refused));
                assert!(error.to_string().contains(key.name), "{}: {error}", key.name);
            }
        }
    }
}

#[test]
fn keys_that_are_not_listed_are_unknown() {
    for (section, _) in SECTIONS {
        let mut text = file("point", None);
        let header = text.find(&format!("[{section}]")).unwrap();
        let keys = header + text[header..].find('\n').unwrap() + 1;
        text.insert_str(keys, "nonsense = 1\n");
        let error = load(&text, OBJ).err().unwrap_or_else(|| panic!("{section}: {text}"));
        assert!(error.to_string().contains("unknown key `nonsense`"), "{section}: {error}");
    }
}

/// `LIGHTPATHS_BLESS=1` writes the tables.
#[test]
fn the_documentation_lists_the_keys() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene-files.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once("<!-- keys -->\n").expect("where the tables begin");
    let (tables, after) = rest.split_once("\n<!-- end of keys -->").expect("where they end");
    if std::env::var_os("LIGHTPATHS_BLESS").is_some() {
        let text = format!("{before}<!-- keys -->\n{}\n<!-- end of keys -->{after}", keys::tables());
        std::fs::write(path, text).unwrap();
    } else {
        assert!(tables == keys::tables(), "run: LIGHTPATHS_BLESS=1 cargo test --test scene documentation");
    }
}

//! The keys of a scene file: what the readers accept, `lightpaths help scene` prints
//! and `docs/scene-files.md` lists.

use std::fmt::Write as _;

/// A key of a section.
pub struct Key {
    /// Section: `model`, `camera`, `light`, `environment`, `material`, `meter`,
    /// `picture` or `quality`.
    pub section: &'static str,
    /// Kinds of light or meter that have it, separated by blanks. Empty: all.
    kinds: &'static str,
    /// Name in the file.
    pub name: &'static str,
    /// Type and unit of the value.
    pub value: &'static str,
    /// Accepted values. Empty: every value of the type.
    pub range: &'static str,
    /// Value if the file states none; `needed` if the file must state one.
    pub default: &'static str,
    /// What the key does, one line.
    pub meaning: &'static str,
    /// A value that is accepted.
    pub example: &'static str,
    /// A value that is refused. Empty: no value of the type is.
    pub refused: &'static str,
}

/// Sections in the order of a scene file, and what each holds.
pub const SECTIONS: [(&str, &str); 8] = [
    ("model", "[[model]]: a model, in world space; at least one"),
    ("camera", "[camera], or [[camera]] for several; the first is used unless --camera names another"),
    ("light", "[[light]]: a light of one of four kinds"),
    ("environment", "[environment]: light from all directions, seen where rays leave the scene"),
    ("material", "[[material]]: replaces properties of the models' material of that name"),
    ("meter", "[[meter]]: a light meter, for the command measure"),
    ("picture", "[picture]: how the picture is displayed; arguments of the command line win"),
    ("quality", "[quality]: settings of the precomputation; defaults are those of the preset"),
];

macro_rules! keys {
    ($($section:literal $kinds:literal {
        $($name:ident: $value:literal, $range:literal, $default:literal, $meaning:literal, $example:literal, $refused:literal;)*
    })*) => {
        /// All keys, section by section.
        pub const KEYS: &[Key] = &[$($(Key {
            section: $section,
            kinds: $kinds,
            name: stringify!($name),
            value: $value,
            range: $range,
            default: $default,
            meaning: $meaning,
            example: $example,
            refused: $refused,
        },)*)*];
    };
}

keys! {
    "model" "" {
        file: "text", "", "needed, or built_in", "Path of a model (`.glb`, `.gltf`, `.obj`, `.ply`, `.stl`), relative to the scene file", "\"m.obj\"", "";
        built_in: "text", "box, atrium, room", "none", "A model of the program instead of a file", "\"room\"", "\"house\"";
        name: "text", "", "its file's without the ending", "Name for --set model.NAME.KEY and for films", "\"chair\"", "\"\"";
        triangles: "integer", "10 000 to 20 000 000", "the model's", "Triangles of atrium or room, approximately", "10000", "9";
        translate: "3 numbers, m", "±1e12", "[0, 0, 0]", "Offset, applied last", "[1.0, 0.0, 0.0]", "[1e13, 0.0, 0.0]";
        rotate: "3 numbers, degrees", "±360", "[0, 0, 0]", "Rotation about x, then y, then z", "[0.0, 90.0, 0.0]", "[0.0, 400.0, 0.0]";
        scale: "1 or 3 numbers", "1e-9 to 1e9, either sign", "1", "Scale, applied first", "2.0", "0.0";
        matrix: "4 rows of 4 numbers", "±1e12, invertible", "none", "Transform of column vectors instead of the three above; the last row is 0, 0, 0, 1", "[[1, 0, 0, 2], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]", "[[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]";
        hidden: "true or false", "", "false", "Leaves out the model's surface; its materials, lights and cameras stay", "false", "1";
        movable: "true or false", "", "false", "The model can move: the noise far from it then stays", "true", "1";
        material: "text", "", "the model's", "Material of all faces: of the model, or a [[material]] of the scene file", "\"wall\"", "\"\"";
    }
    "camera" "" {
        name: "text", "", "\"camera\"", "Name for --camera", "\"c\"", "";
        position: "3 numbers, m", "±1e12", "needed", "Centre of projection", "[0.0, 1.0, 3.4]", "[1e13, 0.0, 0.0]";
        target: "3 numbers, m", "±1e12", "needed", "Point in the middle of the image", "[0.0, 1.0, 0.0]", "[0.0, 1.0, 3.4]";
        up: "3 numbers", "", "[0, 1, 0]", "Direction that is up in the image", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 1.0]";
        fov_y: "number, degrees", "0.01 to 179", "40", "Vertical field of view", "50.0", "180.0";
        size: "2 integers, pixels", "1 to 16 384", "[512, 512]", "Width and height of the image", "[64, 48]", "[0, 48]";
    }
    "light" "" {
        name: "text", "", "none", "Name for --set light.NAME.KEY and for films", "\"l\"", "";
        kind: "text", "point, spot, area, directional", "needed", "Kind of the light", "", "\"sun\"";
        on: "true or false", "", "true", "Whether the light emits", "false", "";
        group: "text", "", "none", "Group whose lights are dimmed together in the window", "\"ceiling\"", "\"\"";
    }
    "light" "point spot" {
        position: "3 numbers, m", "±1e12", "needed", "Position of the light", "[0.0, 1.9, 0.0]", "[1e13, 0.0, 0.0]";
        intensity: "3 numbers, W/sr", "0 to 1e15", "needed, or a power", "Radiant intensity, red, green, blue", "[5.0, 5.0, 5.0]", "[-1.0, 0.0, 0.0]";
        candela: "number, cd", "0 to 1e15", "none", "Luminous intensity, on the axis of a spot, instead of intensity", "100.0", "-1.0";
    }
    "light" "spot directional" {
        direction: "3 numbers", "not zero", "needed", "Direction in which light leaves", "[0.0, -1.0, 0.0]", "[0.0, 0.0, 0.0]";
    }
    "light" "spot" {
        angle: "number, degrees", "0.01 to 90", "needed, or ies", "Half of the cone's opening angle", "30.0", "91.0";
        penumbra: "number", "0 to 1", "0", "Part of the angle over which intensity falls to zero", "0.5", "2.0";
        ies: "text", "", "none", "Photometric file (`.ies` of LM-63, `.ldt` of EULUMDAT) with the intensity in each direction, relative to the scene file; instead of angle", "", "";
        turn: "number, degrees", "±360", "0", "Turn of the measured intensities about the axis; beside ies", "", "";
    }
    "light" "area" {
        corner: "3 numbers, m", "±1e12", "needed", "Corner of the parallelogram", "[0.0, 1.9, 0.0]", "[1e13, 0.0, 0.0]";
        edge_u: "3 numbers, m", "±1e12", "needed", "First edge from the corner", "[0.5, 0.0, 0.0]", "[0.0, 0.0, 0.0]";
        edge_v: "3 numbers, m", "±1e12", "needed", "Second edge; light leaves towards edge_u × edge_v", "[0.0, 0.0, 0.5]", "[0.5, 0.0, 0.0]";
        radiance: "3 numbers, W/m²/sr", "0 to 1e15", "needed, or a power", "Emitted radiance, red, green, blue", "[4.0, 4.0, 4.0]", "[-1.0, 0.0, 0.0]";
        nits: "number, cd/m²", "0 to 1e15", "none", "Luminance instead of radiance", "1000.0", "-1.0";
        samples: "integer", "1 to 4 096", "10", "Point samples of the light; penumbrae have more", "16", "0";
        visible: "true or false", "", "false", "Whether it is a surface that is seen, which cannot be moved then", "true", "";
    }
    "light" "directional" {
        irradiance: "3 numbers, W/m²", "0 to 1e15", "needed, or lux", "Irradiance of a surface that faces the light", "[1.0, 1.0, 1.0]", "[-1.0, 0.0, 0.0]";
        lux: "number, lx", "0 to 1e15", "none", "Illuminance of such a surface instead of irradiance", "50000.0", "-1.0";
    }
    "light" "point spot area" {
        lumens: "number, lm", "0 to 1e15", "none", "Luminous flux instead of intensity or radiance", "800.0", "-1.0";
        watts: "number, W", "0 to 1e15", "none", "Radiant flux of white light as bright, instead of intensity or radiance", "10.0", "-1.0";
    }
    "light" "point spot area directional" {
        kelvin: "number, K", "1 667 to 25 000", "white", "Colour of a power: that of a black body", "2700.0", "500.0";
        tint: "3 numbers", "0 to 1", "white", "Colour of a power; beside kelvin its factor", "[1.0, 0.9, 0.8]", "[2.0, 0.0, 0.0]";
    }
    "environment" "" {
        radiance: "3 numbers, W/m²/sr", "0 to 1e15", "[1, 1, 1]", "Radiance of the sky; with an image, its factor", "[0.5, 0.6, 0.8]", "[-1.0, 0.0, 0.0]";
        image: "text", "", "none: one colour", "Panorama, width twice the height: `.hdr`, `.exr`, `.png` …; its middle shows −z, its upper edge +y", "", "";
        rotate: "number, degrees", "±360", "0", "Rotation about y", "90.0", "400.0";
        samples: "integer", "1 to 1 024", "64", "Directional lights at most, for bright spots of the image", "16", "0";
        sun_elevation: "number, degrees", "0 to 90", "no sun", "Height of the sun in a clear sky [Hosek 2012]; not with image", "45.0", "-5.0";
        sun_azimuth: "number, degrees", "-360 to 360", "0", "Direction of the sun from -Z towards +X", "120.0", "400.0";
        turbidity: "number", "1 to 10", "3", "2 is clear air, 10 haze", "2.5", "0.5";
        ground: "3 numbers", "0 to 1", "[0.2, 0.2, 0.2]", "Albedo of the ground below the horizon", "[0.3, 0.3, 0.2]", "[2.0, 0.0, 0.0]";
    }
    "material" "" {
        name: "text", "", "needed", "Name of the material in the model", "\"wall\"", "";
        diffuse: "3 numbers", "0 to 1", "the model's", "Diffuse albedo; replaces an image", "[0.5, 0.5, 0.5]", "[2.0, 0.0, 0.0]";
        image: "text", "", "the model's", "Path of an image: diffuse albedo as sRGB codes; not with diffuse", "\"wood.png\"", "\"\"";
        image_width: "number, metres", "1e-6 to 1e6", "1", "Width of that image where the model has no image coordinates", "2.5", "0.0";
        tint: "3 numbers", "0 to 1", "the model's; white with image", "Factor of the image; not with diffuse", "[0.9, 0.9, 0.9]", "[2.0, 0.0, 0.0]";
        specular: "3 numbers", "0 to 1", "the model's", "Albedo of the Phong lobe", "[0.3, 0.3, 0.3]", "[2.0, 0.0, 0.0]";
        exponent: "number", "1 to 1e6", "the model's", "Exponent of the Phong lobe", "40.0", "0.5";
        editable: "true or false", "", "false", "Whether the material may become glossy at run time", "true", "";
        emission: "3 numbers, W/m²/sr", "0 to 1e15", "the model's", "Radiance that its surface emits; it is then a light of this name", "[4.0, 4.0, 4.0]", "[-1.0, 0.0, 0.0]";
        emitting_sides: "text", "front, back, both", "the model's, or those with free space before them", "Sides of its surface that emit", "\"front\"", "\"top\"";
        hidden: "true or false", "", "the model's", "Whether its triangles are left out", "false", "";
        thin: "true or false", "", "the model's", "Whether its surface is a pane of its diffuse colour: light passes, and none is reflected", "true", "";
        opacity: "number", "0 to 1", "the model's; 0 if thin", "Fraction of light that does not pass; below 1 the surface is a pane", "0.25", "2.0";
    }
    "meter" "" {
        name: "text", "", "none", "Name for --set meter.NAME.KEY and for tables", "\"desk\"", "";
        kind: "text", "point, plane, region", "needed", "Kind of the meter", "", "\"line\"";
    }
    "meter" "point" {
        position: "3 numbers, m", "±1e12", "needed", "Position of the meter", "[0.0, 0.8, 0.0]", "[1e13, 0.0, 0.0]";
        normal: "3 numbers", "not zero", "needed", "Direction in which it faces", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]";
    }
    "meter" "plane" {
        corner: "3 numbers, m", "±1e12", "needed", "Corner of the parallelogram", "[-0.5, 0.8, 0.5]", "[1e13, 0.0, 0.0]";
        edge_u: "3 numbers, m", "±1e12", "needed", "First edge from the corner", "[1.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]";
        edge_v: "3 numbers, m", "±1e12", "needed", "Second edge; the meter faces edge_u × edge_v", "[0.0, 0.0, -1.0]", "[0.5, 0.0, 0.0]";
        grid: "2 integers", "1 to 128", "as in EN 12464-1", "Points along both edges, in the middles of equal cells", "[4, 3]", "[0, 3]";
    }
    "meter" "region" {
        points: "list of 3 numbers, m", "±1e12", "needed", "Points on surfaces of any form; they count alike", "[[0.0, 0.8, 0.0], [0.2, 0.8, 0.0]]", "[]";
        normals: "list of 3 numbers", "not zero", "needed", "Direction in which each of them faces", "[[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]", "[[0.0, 1.0, 0.0]]";
    }
    "picture" "" {
        exposure: "number, stops", "±50", "0", "Brightens the picture", "1.5", "100.0";
        tone: "text", "standard, none, filmic, aces, agx", "standard", "Tone curve", "\"agx\"", "\"reinhard\"";
        white_balance: "number, K", "1 667 to 25 000", "6504", "Colour temperature that is displayed as white", "2700.0", "100.0";
        tint: "number", "±50", "0", "Moves that white to green, in thousandths of CIE 1960 uv", "-5.0", "60.0";
    }
    "quality" "" {
        preset: "text", "draft, paper, high", "paper", "Where all other settings come from", "\"draft\"", "\"best\"";
        entry_points: "integer", "1 to 16 777 216", "100 000; 400 000; 1 600 000", "Light paths, one from each entry point", "1000", "0";
        cache_points: "integer", "1 to 1 000 000", "16 000; 40 000; 80 000", "Cache points at most", "300", "0";
        gather_rays: "integer, 4·k²", "4 to 65 536", "144; 256; 784", "Gather rays of a cache point", "16", "17";
        directions: "integer, a square", "1 to 65 536", "144; 256; 256", "Outgoing directions of glossy clusters", "16", "17";
        gloss_rays: "integer", "1 to 4 096", "32; 32; 64", "Rays of a glossy pixel into a lobe too sharp for records", "4", "0";
        cells: "integer, a power of two", "8 to 256", "32; 64; 128", "Cells of the hierarchy along the longest axis", "8", "9";
        occlusion: "true or false", "", "true", "Whether rays read the children of clusters whose parts see different surroundings", "false", "";
        gap_rounds: "integer", "0 to 16", "0; 0; 3", "Extra gather iterations in narrow cavities", "1", "17";
        edge_samples: "integer", "0 to 256", "16; 16; 64", "Samples of a light on each surface in a pixel that shows an edge; four times as many find these surfaces; 0: none", "4", "257";
        record_error: "number", "0.01 to 1", "1; 0.14; 0.1", "Relative difference of a pixel's records under random light from which on it gathers for itself while the view stands; 1: none does", "0.1", "0.0";
        seed: "integer", "0 to 4 294 967 295", "0", "Seed of all sampling; equal seeds give equal bytes", "7", "-1";
    }
}

impl Key {
    /// Whether the section, for lights or meters of that kind, has the key.
    pub fn belongs_to(&self, section: &str, kind: Option<&str>) -> bool {
        let has_kind = |kind| self.kinds.split(' ').any(|one| one == kind);
        self.section == section && (self.kinds.is_empty() || kind.is_none_or(has_kind))
    }
}

/// Names of the keys of a section; of a light or meter of that kind.
pub(super) fn names(section: &str, kind: Option<&str>) -> Vec<&'static str> {
    KEYS.iter().filter(|key| key.belongs_to(section, kind)).map(|key| key.name).collect()
}

/// Lists the keys as text for a terminal.
pub fn help() -> String {
    let mut text = String::from(
        "Keys of a scene file (TOML). Any of them can be set on the command line:\n\
         --set camera.fov_y=50, --set light.NAME.on=false, --set quality.cells=32.\n\
         Lengths are metres, angles degrees, colours linear Rec.709.\n",
    );
    for (section, title) in SECTIONS {
        let _ = write!(text, "\n{title}\n");
        let rows: Vec<[String; 5]> = of(section).map(row).collect();
        let widths = [0, 1, 2, 3].map(|column| {
            rows.iter().map(|row: &[String; 5]| row[column].chars().count()).max().unwrap_or(0)
        });
        for [name, value, range, default, meaning] in rows {
            let [a, b, c, d] = widths;
            let _ = writeln!(text, "  {name:a$}  {value:b$}  {range:c$}  {default:d$}  {meaning}");
        }
    }
    text.push_str(
        "\nWhere the default of a setting has three numbers they are those of draft, paper and high.\n",
    );
    text
}

/// Lists the keys as tables in Markdown.
pub fn tables() -> String {
    let mut text = String::new();
    for (section, title) in SECTIONS {
        let _ = write!(text, "\n### {}\n\n{}.\n\n", section, title.replace('[', "\\["));
        text.push_str("| key | value | range | default | meaning |\n|---|---|---|---|---|\n");
        for [name, value, range, default, meaning] in of(section).map(row) {
            let _ = writeln!(text, "| `{name}` | {value} | {range} | {default} | {meaning} |");
        }
    }
    text
}

fn of(section: &str) -> impl Iterator<Item = &'static Key> {
    KEYS.iter().filter(move |key| key.section == section)
}

fn row(key: &'static Key) -> [String; 5] {
    let kinds = key.kinds.replace(' ', ", ");
    let meaning =
        if kinds.is_empty() { key.meaning.to_owned() } else { format!("{} ({kinds})", key.meaning) };
    [key.name, key.value, key.range, key.default, &meaning].map(str::to_owned)
}

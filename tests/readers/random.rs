//! Generated files: damaged good ones, and files of valid form with random contents.

/// A linear congruential generator (Knuth's MMIX constants), its upper bits.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }

    pub(super) fn of<'a, T: ?Sized>(&mut self, all: &[&'a T]) -> &'a T {
        all[self.below(all.len())]
    }
}

/// Tokens that may break readers of texts.
const TOKENS: [&[u8]; 24] = [
    b"nan",
    b"-1",
    b"1e308",
    b"1e-320",
    b"0",
    b"/",
    b"\n",
    b" ",
    b"[",
    b"]",
    b"[[",
    b"\"",
    b"=",
    b"99999999999999999999",
    b"4294967296",
    b"#",
    b"\xff",
    b".",
    b"\0",
    b"\x1b[",
    b"../",
    b"-",
    b",",
    b"\\",
];

/// Good bytes with damage at up to four positions: bytes changed, left out, inserted,
/// doubled, cut off.
pub(super) fn damaged(random: &mut Random, good: &[u8]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len() + 1);
        let end = (at + random.below(5)).min(bytes.len());
        match random.below(7) {
            0 => drop(bytes.splice(at..end, random.of(&TOKENS).iter().copied())),
            1 => drop(bytes.splice(at..at, random.of(&TOKENS).iter().copied())),
            2 => drop(bytes.drain(at..end)),
            3 => bytes[at..end].iter_mut().for_each(|byte| *byte = random.below(256) as u8),
            4 => bytes[at..end].iter_mut().for_each(|byte| *byte ^= 1 << random.below(8)),
            5 => {
                let end = (at + random.below(200)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                let to = random.below(bytes.len() + 1);
                drop(bytes.splice(to..to, part));
            }
            _ if random.below(4) == 0 => bytes.truncate(at),
            _ => (),
        }
    }
    bytes
}

/// A number, good or bad.
fn number(random: &mut Random) -> String {
    let bad = ["nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "-0", "", "x", "1e", "0x10", "1_0"];
    match random.below(40) {
        0 => random.of(&bad).to_owned(),
        1 => format!("{}e{}", random.below(10), random.below(300) as i32 - 150),
        2..8 => "0".to_owned(),
        _ => format!("{}", random.below(41) as f32 * 0.25 - 5.0),
    }
}

/// An index that is mostly valid.
fn index(random: &mut Random, count: usize) -> String {
    match random.below(60) {
        0 => random.of(&["0", "", "4294967296", "-2147483649", "9223372036854775807", "x"]).to_owned(),
        1 => format!("{}", count + 1),
        2..10 => format!("-{}", 1 + random.below(count)),
        _ => format!("{}", 1 + random.below(count)),
    }
}

fn words(random: &mut Random, count: usize) -> String {
    (0..count).map(|_| number(random) + " ").collect()
}

/// Lines of an OBJ file in any order.
pub(super) fn obj(random: &mut Random) -> Vec<u8> {
    let mut text = String::new();
    // Mostly, vertices come before the faces that use them.
    for keyword in ["v", "v", "v", "v", "v", "vn", "vt"] {
        text += &format!("{keyword} {} {} {}\n", random.below(9), random.below(9), random.below(9));
    }
    for _ in 0..random.below(30) {
        let line = match random.below(12) {
            0 | 1 => format!("v {}", words(random, 3)),
            2 => format!("vn {}", words(random, 3)),
            3 => {
                let count = 1 + random.below(3);
                format!("vt {}", words(random, count))
            }
            4 => format!("usemtl {}", random.of(&["a", "b", "c", "d e", "", "\u{1b}x", "é"])),
            5 => format!(
                "mtllib {}",
                random.of(&["m.mtl", "m.mtl", "m.mtl", "none.mtl", "../m.mtl", "/m.mtl", ""])
            ),
            6 => random.of(&["o x", "g", "s 1", "# c", "l 1 2", "p 1", "\u{feff}", "call x"]).to_owned(),
            _ => {
                let has = random.below(4);
                let corners = 3 + random.below(4) - usize::from(random.below(30) == 0);
                let corner = |random: &mut Random| match has {
                    0 => index(random, 5),
                    1 => format!("{}/{}", index(random, 5), index(random, 1)),
                    2 => format!("{}//{}", index(random, 5), index(random, 1)),
                    _ => format!("{}/{}/{}", index(random, 5), index(random, 1), index(random, 1)),
                };
                format!("f {}", (0..corners).map(|_| corner(random) + " ").collect::<String>())
            }
        };
        text += &line;
        text += random.of(&["\n", "\n", "\n", "\r\n", " \n", " # x\n"]);
    }
    text.into_bytes()
}

/// Lines of an MTL file.
pub(super) fn mtl(random: &mut Random) -> Vec<u8> {
    let mut text = "newmtl a\n".to_owned();
    for _ in 0..random.below(14) {
        let line = match random.below(7) {
            0 => format!("newmtl {}", random.of(&["a", "b", "c", "undefined", "", "\u{1b}"])),
            1 => format!("Kd {}", words(random, 3).replace('-', "")),
            2 => format!("Ks {}", words(random, 3).replace('-', "")),
            3 => format!("Ns {}", words(random, 1).replace('-', "")),
            4 => format!("Ke {}", words(random, 3)),
            5 => random.of(&["illum 2", "map_Ks x.png", "d 0.5", "Tr", "# c", "Kd"]).to_owned(),
            _ => {
                let mut options = String::new();
                for _ in 0..random.below(3) {
                    let option = random.of(&[
                        "-s",
                        "-o",
                        "-mm",
                        "-t",
                        "-clamp on",
                        "-clamp",
                        "-bm 1",
                        "-blendu off",
                        "-x",
                    ]);
                    let count = random.below(4);
                    options += &format!("{option} {}", words(random, count));
                }
                format!(
                    "map_Kd {options}{}",
                    random.of(&["i.png", "i.png", "i.png", "../i.png", "none.png", "m.obj", ""])
                )
            }
        };
        text += &line;
        text.push('\n');
    }
    text.into_bytes()
}

/// A scene file or a film, made of `good`'s tables in another order, with some of their keys
/// and other values.
pub(super) fn toml(random: &mut Random, good: &str) -> Vec<u8> {
    let tables: Vec<&str> = good.split("\n\n").collect();
    let mut text = String::new();
    let first = tables[0].to_owned();
    let mut chosen = vec![first];
    for table in &tables[1..] {
        for _ in 0..[0, 2, 1][random.below(30).min(2)] {
            chosen.push((*table).to_owned());
        }
    }
    for table in chosen {
        for line in table.lines() {
            let line = match (line.split_once(" = "), random.below(300)) {
                (Some(_), 0) => continue,
                (Some((key, _)), 1) => {
                    format!("{key} = [{}]", words(random, 3).trim_end().replace(' ', ", "))
                }
                (Some((key, _)), 2) => format!("{key} = {}", number(random)),
                (Some((key, _)), 3) => {
                    format!("{key} = \"{}\"", random.of(&["a", "lamp", "../m.obj", "point", "\\u0007", ""]))
                }
                (Some((key, _)), 4) => format!(
                    "{key} = {}",
                    random.of(&["true", "{ a = 1 }", "[[1], [2]]", "1979-05-27", "[]", "''"])
                ),
                (Some((_, value)), 5) => {
                    format!("{} = {value}", random.of(&["name", "kind", "time", "file", "scene", "x"]))
                }
                (None, 6) => line.replace("[[", "[").replace("]]", "]"),
                _ => line.to_owned(),
            };
            text += &line;
            text.push('\n');
        }
    }
    text.into_bytes()
}

/// The start of an image: a size that may be invalid, and pixels that end early.
pub(super) fn image(random: &mut Random) -> Vec<u8> {
    let side = |random: &mut Random| match random.below(4) {
        0 => random.below(8),
        1 => random.below(1 << 14),
        2 => random.below(1 << 31),
        _ => [1, 16, 8192, 8193, 65_535, 60_000][random.below(6)],
    };
    let (width, height) = (side(random), side(random));
    let pixels: Vec<u8> = (0..random.below(64)).map(|_| random.below(256) as u8).collect();
    if random.below(2) == 0 {
        let (w, h) = ((width as u16).to_le_bytes(), (height as u16).to_le_bytes());
        let kind = [1, 2, 3, 9, 10, 11][random.below(6)];
        let depth = [8, 15, 16, 24, 32][random.below(5)];
        let head = [
            0,
            u8::from(kind % 8 == 1),
            kind,
            0,
            0,
            random.below(4) as u8,
            0,
            24,
            0,
            0,
            0,
            0,
            w[0],
            w[1],
            h[0],
            h[1],
            depth,
            0x20,
        ];
        return [&head[..], &pixels].concat();
    }
    let chunk =
        |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_be_bytes()[..], kind, data, &[0; 4]].concat();
    let kind = [[0, 1], [0, 8], [2, 8], [2, 16], [4, 8], [6, 16], [3, 4]][random.below(7)];
    let head = [
        &(width as u32).to_be_bytes()[..],
        &(height as u32).to_be_bytes(),
        &[kind[1], kind[0], 0, 0, random.below(2) as u8],
    ]
    .concat();
    let start = chunk(b"IHDR", &head);
    [
        b"\x89PNG\r\n\x1a\n",
        &start[..],
        &chunk(b"PLTE", &[7; 48]),
        &chunk(b"IDAT", &[&[0x78, 0x9c], &pixels[..]].concat()),
        &chunk(b"IEND", &[]),
    ]
    .concat()
}

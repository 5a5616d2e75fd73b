//! Ignored statements of MTL files, and their effect on the picture.

/// The effect of an ignored statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missed {
    /// No effect: a comment, a neutral value, or a property that is not rendered.
    Nothing,
    /// The named effect.
    Effect(&'static str),
    /// Light that passes through surfaces.
    Transparency,
    /// The ambient colour; it matters if the material has no other.
    Ambient,
    /// The index of refraction; it matters if light passes through.
    Refraction,
    Unknown,
}

/// The effect of an ignored statement; `keyword` is in lower case.
pub(super) fn missed(keyword: &str, rest: &str) -> Missed {
    use Missed::{Ambient, Effect, Nothing, Refraction, Transparency, Unknown};
    let unless = |is_neutral: bool, effect: Missed| if is_neutral { Nothing } else { effect };
    match keyword {
        "" => Nothing,
        comment if comment.starts_with('#') || comment.starts_with("//") => Nothing,
        "d" => unless(all(rest, |value| value >= 1.0), Transparency),
        "tr" => unless(all(rest, |value| value <= 0.0), Transparency),
        // Exporters write 0 or 1 for opaque materials.
        "tf" => unless(all(rest, |value| value == 0.0) || all(rest, |value| value == 1.0), Transparency),
        "illum" => match rest.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()) {
            Some(model) if [4.0, 6.0, 7.0, 9.0].contains(&model) => Transparency,
            Some(model) if [3.0, 5.0, 8.0].contains(&model) => Effect("mirror reflections"),
            Some(10.0) => Effect("shadows on surfaces that are not seen"),
            Some(0.0..=2.0) => Nothing,
            _ => Unknown,
        },
        "map_tr" | "map_tf" | "map_opacity" | "map_alpha" => Transparency,
        "ka" | "map_ka" => unless(all(rest, |value| value <= 0.0), Ambient),
        "ni" => Refraction,
        "map_bump" | "bump" | "norm" | "map_norm" | "map_kn" | "map_normal" => Effect("bumps"),
        "disp" | "map_disp" => Effect("displacement"),
        "decal" | "map_decal" => Effect("decals"),
        "refl" | "map_refl" | "sharpness" => Effect("reflection maps"),
        "map_ns" => Effect("images of highlights"),
        "map_pr" => Effect("roughness"),
        "map_pm" => Effect("metal"),
        "ps" => unless(all(rest, |value| value == 0.0), Effect("sheen")),
        "map_ps" => Effect("sheen"),
        "pc" => unless(all(rest, |value| value == 0.0), Effect("clear coat")),
        "map_pc" | "map_pcr" => Effect("clear coat"),
        "aniso" => unless(all(rest, |value| value == 0.0), Effect("anisotropy")),
        // Without clear coat and anisotropy these have no meaning. The renderer chooses the
        // filtering of images itself.
        "pcr" | "anisor" | "map_aat" => Nothing,
        _ => Unknown,
    }
}

/// Whether the line has numbers, and all of them satisfy `is_so`.
fn all(rest: &str, is_so: impl Fn(f64) -> bool) -> bool {
    let mut numbers = rest.split_whitespace().take_while(|word| !word.starts_with('#')).peekable();
    numbers.peek().is_some() && numbers.all(|word| word.parse().is_ok_and(&is_so))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neutral_values_are_not_missed() {
        for neutral in [
            "d 1",
            "d 1.000 # opaque",
            "tr 0",
            "tr 0.0",
            "tf 1 1 1",
            "tf 0 0 0",
            "illum 0",
            "illum 1",
            "illum 2",
            "ka 0 0 0",
            "ps 0",
            "pc 0",
            "pcr 0.03",
            "aniso 0",
            "anisor 0",
            "# c",
            "#c",
            "",
            "map_aat on",
        ] {
            let (keyword, rest) = neutral.split_once(' ').unwrap_or((neutral, ""));
            assert_eq!(missed(keyword, rest), Missed::Nothing, "{neutral}");
        }
        for (other, expected) in [
            ("d 0.05", Missed::Transparency),
            ("d -halo 1", Missed::Transparency),
            ("d", Missed::Transparency),
            ("tr 0.95", Missed::Transparency),
            ("tf 0.5 1 1", Missed::Transparency),
            ("tf xyz 1 1 1", Missed::Transparency),
            ("map_opacity a.png", Missed::Transparency),
            ("illum 4", Missed::Transparency),
            ("illum 7", Missed::Transparency),
            ("illum 3", Missed::Effect("mirror reflections")),
            ("illum 11", Missed::Unknown),
            ("illum x", Missed::Unknown),
            ("bump a.png", Missed::Effect("bumps")),
            ("norm a.png", Missed::Effect("bumps")),
            ("map_pr a.png", Missed::Effect("roughness")),
            ("map_pm a.png", Missed::Effect("metal")),
            ("ka 1 1 1", Missed::Ambient),
            ("ni 1.45", Missed::Refraction),
            ("foo 1", Missed::Unknown),
        ] {
            let (keyword, rest) = other.split_once(' ').unwrap_or((other, ""));
            assert_eq!(missed(keyword, rest), expected, "{other}");
        }
    }
}

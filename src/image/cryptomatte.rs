//! Mattes of objects and materials: ids with the fraction of the pixel that each covers, by the
//! Cryptomatte specification 1.2.

use std::collections::BTreeMap;
use std::io::Cursor;

/// Ids of a pixel, by falling coverage. Further ones are left out.
pub const LEVELS: usize = 6;

/// A set of mattes.
pub struct Cryptomatte {
    /// Name of the set, with which the names of its channels begin.
    pub name: &'static str,
    /// Id and covered fraction of each pixel: rank by rank.
    pub ranks: [Vec<[f32; 2]>; LEVELS],
    /// Names of the ids, as JSON.
    manifest: String,
}

/// MurmurHash3 of a name, 32 bits, seed 0.
fn hash(name: &str) -> u32 {
    murmur3::murmur3_32(&mut Cursor::new(name), 0).expect("bytes in memory can be read")
}

/// The bits of a name's id. The specification flips one bit of a hash whose float would be
/// denormal, infinite or NaN.
pub fn id_bits(name: &str) -> u32 {
    let hash = hash(name);
    if matches!(hash >> 23 & 255, 0 | 255) { hash ^ 1 << 23 } else { hash }
}

impl Cryptomatte {
    /// Ranks what pixels show. `pixels` holds indices of `names`, each with a covered fraction; an
    /// index may be repeated. Only names in `pixels` are in the manifest.
    pub fn new<P: IntoIterator<Item = (usize, f32)>>(
        name: &'static str,
        names: &[&str],
        pixels: impl Iterator<Item = P>,
    ) -> Self {
        let ids: Vec<u32> = names.iter().map(|name| id_bits(name)).collect();
        let mut is_shown = vec![false; names.len()];
        let mut ranks: [Vec<[f32; 2]>; LEVELS] = Default::default();
        let mut found: Vec<(u32, f32)> = Vec::new();
        for pixel in pixels {
            found.clear();
            for (index, fraction) in pixel {
                is_shown[index] = true;
                match found.iter_mut().find(|(id, _)| *id == ids[index]) {
                    Some((_, sum)) => *sum += fraction,
                    None => found.push((ids[index], fraction)),
                }
            }
            found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            for (rank, values) in ranks.iter_mut().enumerate() {
                let of_id = |(id, fraction): &(u32, f32)| [f32::from_bits(*id), *fraction];
                values.push(found.get(rank).map_or([0.0; 2], of_id));
            }
        }
        let shown = names.iter().zip(&ids).zip(is_shown).filter(|(_, is_shown)| *is_shown);
        let shown: BTreeMap<&str, String> =
            shown.map(|((name, id), _)| (*name, format!("{id:08x}"))).collect();
        let manifest = serde_json::to_string(&shown).expect("names are plain data");
        Self { name, ranks, manifest }
    }

    /// The attributes of the file's header that describe the set.
    pub fn attributes(&self) -> [(String, String); 4] {
        let key = &format!("{:08x}", hash(self.name))[..7];
        [
            ("name", self.name),
            ("hash", "MurmurHash3_32"),
            ("conversion", "uint32_to_float32"),
            ("manifest", &self.manifest),
        ]
        .map(|(what, value)| (format!("cryptomatte/{key}/{what}"), value.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vectors that several implementations of MurmurHash3 publish.
    #[test]
    fn hashes_are_those_of_other_implementations() {
        for (name, expected) in [
            ("", 0),
            ("hello", 0x248b_fa47),
            ("Hello, world!", 0xc036_3e43),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(hash(name), expected, "{name}");
        }
    }

    #[test]
    fn ids_are_normal_floats() {
        let mut flipped = 0;
        for number in 0..20_000 {
            let name = format!("object {number}");
            let (hash, bits) = (hash(&name), id_bits(&name));
            assert!(f32::from_bits(bits).is_normal(), "{name}");
            if hash != bits {
                assert!(!f32::from_bits(hash).is_normal() && hash ^ bits == 1 << 23, "{name}");
                flipped += 1;
            }
        }
        // 2 of 256 exponents.
        assert!((100..220).contains(&flipped), "{flipped}");
    }

    #[test]
    fn parts_are_ranked_and_equal_names_are_one() {
        let names = ["a", "b", "never seen", "a", "c"];
        let pixels = [vec![(0, 0.25), (1, 0.4), (3, 0.25)], vec![], vec![(4, 1.0)]];
        let made = Cryptomatte::new("CryptoObject", &names, pixels.into_iter());
        let rank = |rank: usize, pixel: usize| {
            let [id, fraction] = made.ranks[rank][pixel];
            (id.to_bits(), fraction)
        };
        assert_eq!(
            [rank(0, 0), rank(1, 0), rank(2, 0)],
            [(id_bits("a"), 0.5), (id_bits("b"), 0.4), (0, 0.0)]
        );
        assert_eq!([rank(0, 1), rank(0, 2)], [(0, 0.0), (id_bits("c"), 1.0)]);
        let manifest: BTreeMap<String, String> = serde_json::from_str(&made.manifest).unwrap();
        assert_eq!(manifest.keys().collect::<Vec<_>>(), ["a", "b", "c"]);
        assert_eq!(manifest["b"], format!("{:08x}", id_bits("b")));
    }
}

//! Counted notes on ignored and repaired statements of models: one warning per kind.

use std::collections::HashMap;

/// Largest number of names in a warning.
const NAMES: usize = 8;

/// Notes by kind, in the order of their first occurrence.
#[derive(Default)]
pub(super) struct Notes {
    kinds: Vec<Kind>,
    index: HashMap<String, usize>,
}

struct Kind {
    what: String,
    /// First occurrence: file, line, material.
    place: String,
    count: usize,
    /// Names of the affected items, each once.
    names: Vec<String>,
    has_more_names: bool,
}

impl Notes {
    /// Counts one occurrence of the kind `what`, a clause that follows `place` and a colon.
    pub(super) fn add(&mut self, what: &str, place: impl FnOnce() -> String) {
        self.kind(what, place).count += 1;
    }

    /// Counts a named occurrence, see [`Self::add`]. The warning lists the first names.
    pub(super) fn add_named(&mut self, what: &str, name: &str, place: impl FnOnce() -> String) {
        let kind = self.kind(what, place);
        kind.count += 1;
        if !kind.names.iter().any(|known| known == name) {
            if kind.names.len() < NAMES {
                kind.names.push(name.to_owned());
            } else {
                kind.has_more_names = true;
            }
        }
    }

    /// Adds a count that was made elsewhere. A count of zero adds nothing.
    pub(super) fn add_total(&mut self, count: usize, what: &str, place: impl FnOnce() -> String) {
        if count > 0 {
            self.kind(&format!("{count} {what}"), place).count += 1;
        }
    }

    /// Merges the notes of another reader.
    pub(super) fn absorb(&mut self, others: Self) {
        for Kind { what, place, count, names, has_more_names } in others.kinds {
            let kind = self.kind(&what, || place);
            kind.count += count;
            kind.has_more_names |= has_more_names || kind.names.len() + names.len() > NAMES;
            let names = names.into_iter().filter(|name| !kind.names.contains(name)).collect::<Vec<_>>();
            kind.names.extend(names.into_iter().take(NAMES - kind.names.len()));
        }
    }

    fn kind(&mut self, what: &str, place: impl FnOnce() -> String) -> &mut Kind {
        let index = match self.index.get(what) {
            Some(&index) => index,
            None => {
                let (what, place) = (what.to_owned(), place());
                self.index.insert(what.clone(), self.kinds.len());
                self.kinds.push(Kind { what, place, count: 0, names: Vec::new(), has_more_names: false });
                self.kinds.len() - 1
            }
        };
        &mut self.kinds[index]
    }

    /// One sentence per kind, in the order of their first occurrence.
    pub(super) fn sentences(&self) -> impl Iterator<Item = String> {
        self.kinds.iter().map(|Kind { what, place, count, names, has_more_names }| {
            let mut text = format!("{place}: {what}");
            if !names.is_empty() {
                text = text + ": " + &names.join("; ");
            }
            if *has_more_names {
                text += "; and others";
            }
            if *count > 1 {
                text += &format!(" ({count} in all, this is the first)");
            }
            text
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_one_sentence() {
        let mut notes = Notes::default();
        for line in 1..=1449 {
            notes.add("`d` is passed over", || format!("m.mtl:{line}"));
            notes.add_named("unknown", &format!("x{}", line % 20), || format!("m.mtl:{line}"));
        }
        notes.add("`Tr` is passed over", || "m.mtl:9".to_owned());
        let mut whole = Notes::default();
        whole.add("`d` is passed over", || "first.mtl:1".to_owned());
        whole.absorb(notes);
        assert_eq!(
            whole.sentences().collect::<Vec<_>>(),
            [
                "first.mtl:1: `d` is passed over (1450 in all, this is the first)",
                "m.mtl:1: unknown: x1; x2; x3; x4; x5; x6; x7; x8; and others (1449 in all, this is the first)",
                "m.mtl:9: `Tr` is passed over",
            ]
        );
    }
}

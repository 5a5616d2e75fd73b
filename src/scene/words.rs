//! Words of messages: excerpts of the input, and suggestions.

/// Longest excerpt in a message, in characters.
const MAX_SHOWN: usize = 200;
/// Longest word that is compared with others to find typing errors, bytes.
const MAX_HINT_BYTES: usize = 64;
/// Numbers of words that are compared with an unknown one, and that are listed.
const MAX_WORDS_COMPARED: usize = 10_000;
const MAX_WORDS_SHOWN: usize = 40;

/// "unknown key `fov`: did you mean `fov_y`? Possible: …".
pub(crate) fn unknown(what: &str, possible: &[&str], found: &str) -> String {
    // The comparison takes the product of both lengths, so long texts are skipped.
    let is_word = |word: &str| word.len() <= MAX_HINT_BYTES;
    let words = possible.iter().filter(|word| is_word(word) && is_word(found)).take(MAX_WORDS_COMPARED);
    let nearest = words.map(|word| (distance(word, found), *word)).min();
    let hint = match nearest {
        Some((distance, word)) if distance <= 1 + found.len() / 4 => format!("did you mean `{word}`? "),
        _ => String::new(),
    };
    let mut list = possible[..possible.len().min(MAX_WORDS_SHOWN)]
        .iter()
        .map(|word| printable(word))
        .collect::<Vec<_>>()
        .join(", ");
    match possible.len() {
        0 => list.push_str("none"),
        count if count > MAX_WORDS_SHOWN => list += &format!(" and {} more", count - MAX_WORDS_SHOWN),
        _ => (),
    }
    format!("unknown {what} `{}`: {hint}possible: {list}", printable(found))
}

/// Levenshtein distance in bytes. The longest words are scene keys, so the rows are short.
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// The text cut to one line, without characters that would break it.
pub(super) fn printable(text: &str) -> String {
    let shown = text.chars().take(MAX_SHOWN).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(MAX_SHOWN).is_some() { shown + "…" } else { shown }
}

/// The text or its start, in quotation marks.
pub(super) fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// Joins lines of text to one.
pub(super) fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}

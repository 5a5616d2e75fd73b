#!/usr/bin/env bash
# Keeps the language of code and documents plain: see docs/glossary.md. Prints file, line and the word to use for
# each term that the glossary replaces, and counts long sentences, long lines and doc lines that say nothing.
#
#   scripts/check_words.sh              fails on a replaced term, or if a count is above its limit below
#   scripts/check_words.sh --figures    prints the counts
#   scripts/check_words.sh --show NAME  prints what a count counts, with file and line
#
# The records of docs/decisions/archive.md stay as they were written.
set -euo pipefail
export LC_ALL=C.UTF-8
cd "$(dirname "$0")/.."
git rev-parse --is-inside-work-tree >/dev/null 2>&1 || exit 0

code=(src crates glsl tests examples fuzz/src python build.rs)
prose=(README.md ARCHITECTURE.md docs ':!docs/decisions/archive.md' ':!docs/glossary.md')
status=0

# Prints the lines of "$3…" that match $1, a regular expression in any case, with what to say instead.
replaced() {
    local pattern=$1 use=$2
    shift 2
    if git grep -nIPi "$pattern" -- "$@" | sed "s|\$| -> $use|" | cut -c1-220; then status=1; fi
}

terms() {
    local all=("${code[@]}" "${prose[@]}")
    replaced '\btwins?\b|_twin' 'reference' "${all[@]}"
    replaced '\bdeposit(s|ed)?\b|deposit_' 'contribution' "${all[@]}"
    replaced '\bshin(e|es|ing|er)\b|_shine|shining_' 'active (light), glossy (material)' "${all[@]}"
    replaced '\bmatt\b' 'diffuse' "${all[@]}"
    replaced 'near.?lamps' 'near-light correction' "${all[@]}"
    replaced '\bopenness' 'ambient accessibility' "${all[@]}"
    replaced '\bray.?bundles?\b|\bbundles?\b(?! (of|compiler))' 'merged rays' "${code[@]}"
    replaced '\breflectors?\b|reflector_' 'gather target' "${all[@]}"
    replaced '\bburied\b|\bunburied\b' 'interior' "${all[@]}"
    replaced '\bclosed.?places?\b' 'enclosure' "${all[@]}"
    replaced '\bnarrow.?gaps?\b' 'narrow cavity' "${all[@]}"
    replaced '\bunmixed\b' 'consistent' "${all[@]}"
    replaced '\bcut.short\b' 'truncated' "${all[@]}"
    replaced '\bjournal\b' 'timeline' "${all[@]}" ':!docs/references.md'
    replaced '\brivals?\b(?!")' 'baseline' "${all[@]}" ':!src/app/sweep/results.rs'
    replaced '\bsurvey(s|ed|or)?\b' 'size field' "${all[@]}"
    replaced '\bfollows_addresses\b' 'USE_BUFFER_DEVICE_ADDRESS' "${all[@]}"
    replaced '\bdealt\b' 'swizzled' "${code[@]}"
    replaced 'gloss.?slots?\b|slot.?reads?\b' 'gloss bin' "${all[@]}"
    replaced '(hvds|light|cluster|highlight)_?layers?\b' 'flux or irradiance of a light' "${all[@]}"
    replaced '\b(near|split).?parts?\b' 'near-field patch, chunk' "${all[@]}"
    replaced '\bshares?_(?!of_(copy|floor))|_shares?\b(?!_of)' 'fraction, weight' src/passes src/renderer src/cpu glsl
    replaced '\b(weight|contribution)_?runs?\b' 'range' "${all[@]}"
    replaced 'kept from falling' 'clamped' "${all[@]}"
    replaced '\bpath_?(names|groups)\b' 'path streams, path ranges' "${all[@]}"
    replaced '\bgathered_again\b' 'extra iterations' "${all[@]}"
    replaced '\bbound_albedo\b|\bbounded_light\b' 'clamp' "${all[@]}"
    replaced '\b(least|most)_[a-z]+(?=\b)(?<!_of_comes_first)' 'min_, max_' glsl src/passes src/gpu
}

# Sentences of documents, a line each: file, line, number of words. Code blocks, drawings and headings are none;
# each cell of a table counts by itself.
sentences() {
    git ls-files -- "${prose[@]}" | grep '\.md$' | while read -r file; do
        awk -v file="$file" '
            function flush(   count, i, words, parts) {
                gsub(/\]\([^)]*\)/, "]", text); gsub(/`[^`]*`/, "x", text)
                count = split(text, parts, /[.!?]["\x27)*_]*( |$)/)
                for (i = 1; i <= count; i++) {
                    words = gsub(/[^[:space:]]+/, "&", parts[i])
                    if (words > 0) print file ":" start ": " words " words" kind ": " substr(parts[i], 1, 80)
                }
                text = ""
            }
            /^```/ { flush(); is_code = !is_code; next }
            is_code || /^#/ || /^ *</ || /^\|[-| :]*$/ { flush(); next }
            /^\|/ {
                flush(); start = NR; cells = split($0, cell, "|")
                kind = " in a cell"
                for (i = 2; i < cells; i++) { text = cell[i]; flush() }
                kind = ""
                next
            }
            /^[[:space:]]*$/ || /^ *[-*] / || /^ *[0-9]+\. / { flush() }
            { if (text == "") start = NR; line = $0; sub(/^ *([-*]|[0-9]+\.) /, "", line); text = text " " line }
            END { flush() }' "$file"
    done
}

long_sentences() { sentences | awk '{ count = $2 } count > 40'; }
# Doc lines of two words or fewer.
short_docs() { git grep -nIE '^ *//[/!] +[^ ]+( [^ ]+)?$' -- src crates examples python | grep -vE '# (Errors|Panics)$' || true; }
# Comments and prose that are longer than 100 columns; tables and links are not wrapped.
long_comments() { git grep -nIP '^(?=.{101}) *//(?!! \|)' -- "${code[@]}" || true; }
long_prose() {
    git grep -nIP '^(?! *(\||!\[|\[|<|https?:)).{101}' -- "${prose[@]}" | grep -a '^[^:]*\.md:' || true
}
banned() {
    git grep -nIPi '\b(nobody|all that|so many|so large a|without a word|takes? care of|those that)\b' -- "${code[@]}" "${prose[@]}" | grep -vE '"[^"]*(nobody|so many)[^"]*"' || true
}

count() { "$1" | wc -l | tr -d ' '; }

# NAME LIMIT: a count may fall, never rise. Lower the limit when it does.
limits='long_sentences 0
short_docs 20
long_comments 0
long_prose 0
banned 0'

case ${1:-} in
    --show) "$2" ;;
    --figures)
        sentences | grep -av ' words in a cell: ' | awk '{ words += $2 }
            END { printf "mean words a sentence outside of tables: %.1f of %d sentences\n", words / NR, NR }'
        awk '{ all += length($0); digits += gsub(/[0-9]/, "&") }
            END { printf "README.md: %d lines, %.1f %% digits\n", NR, 100 * digits / all }' README.md
        while read -r name limit; do echo "$name: $(count "$name") (limit $limit)"; done <<<"$limits"
        ;;
    *)
        terms
        while read -r name limit; do
            found=$(count "$name")
            if [ "$found" -gt "$limit" ]; then
                echo "check_words: $name: $found, $limit at most: scripts/check_words.sh --show $name" >&2
                status=1
            fi
        done <<<"$limits"
        [ "$status" -eq 0 ] || echo 'check_words: plain words are in docs/glossary.md' >&2
        exit "$status"
        ;;
esac

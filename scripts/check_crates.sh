#!/bin/sh
# Checks the crates that are used against deny.toml: where they come from, and their licences. Needs nothing but Cargo. Then, with cargo-deny, its
# own checks, among them advisories, which need its database; says which of them were not made.
#
#   scripts/check_crates.sh [--advisories]
#
#   --advisories  fails where advisories cannot be checked
set -eu
cd "$(dirname "$0")/.."
export PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin"
status=0

complain() {
    echo "check_crates: $*" >&2
    status=1
}

# --- Sources: of the registry, with a checksum, or here ---------------------------------------------------------------

for lock in Cargo.lock fuzz/Cargo.lock; do
    if grep '^source = ' "$lock" | grep -vF '"registry+https://github.com/rust-lang/crates.io-index"'; then
        complain "$lock: a crate that is not from the registry"
    fi
    from=$(grep -c '^source = ' "$lock") sums=$(grep -c '^checksum = ' "$lock")
    [ "$from" = "$sums" ] || complain "$lock: $from crates from the registry, $sums checksums"
done

# --- Licences: expressions of those that deny.toml allows -------------------------------------------------------------

# Prints crates whose licence, `NAME VERSION|EXPRESSION` a line, allows none of our uses. OR binds weakest; a slash is an old OR.
refused_licences() {
    awk -F '|' '
        FNR == NR { if (match($0, /^    "[^"]*",$/)) allowed[substr($0, 6, length($0) - 7)] = 1; next }
        function peek() { return word[at] }
        function atom(    is_allowed, name) {
            if (peek() == "(") { at++; is_allowed = any(); at++; return is_allowed }
            name = word[at++]
            if (peek() == "WITH") { name = name " WITH " word[at + 1]; at += 2 }
            return name in allowed
        }
        function all(    is_allowed) {
            is_allowed = atom()
            while (peek() == "AND") { at++; is_allowed = atom() && is_allowed }
            return is_allowed
        }
        function any(    is_allowed) {
            is_allowed = all()
            while (peek() == "OR") { at++; is_allowed = all() || is_allowed }
            return is_allowed
        }
        {
            expression = $2
            gsub("/", " OR ", expression)
            gsub(/[()]/, " & ", expression)
            count = split(expression, word, " ")
            word[count + 1] = ""
            at = 1
            if (count == 0 || !any() || at <= count) print $1 ": " ($2 == "" ? "none" : $2)
        }
    ' deny.toml -
}

# What Cargo would build, for every platform.
crates=$(cargo tree --locked --workspace --all-features --target all --edges normal,build,dev --prefix none --format '{p}|{l}' | sed '/^$/d; s/ (\*)//' | sort -u)
count=$(echo "$crates" | wc -l)
# Crates of this tree are named with their folder.
refused=$(echo "$crates" | grep -v ' (/.*|' | refused_licences)
[ -z "$refused" ] || complain "licences that deny.toml does not allow:
$refused"
[ "$count" -gt 50 ] || complain "only $count crates were found"
[ "$status" = 0 ] && echo "check_crates: sources and licences of $count crates are as deny.toml wants them" >&2

# --- cargo-deny -------------------------------------------------------------------------------------------------------

why=
if ! command -v cargo-deny >/dev/null 2>&1; then
    why="cargo-deny is not installed (cargo install cargo-deny --locked)"
else
    cargo deny --locked check bans licenses sources >&2 || status=1
    if cargo deny --locked fetch db >/dev/null 2>&1; then
        cargo deny --locked check --disable-fetch advisories >&2 || status=1
    else
        why="its database cannot be fetched"
    fi
fi
if [ -n "$why" ]; then
    echo "check_crates: advisories were NOT checked: $why" >&2
    if [ "${1:-}" = --advisories ]; then status=1; fi
fi
exit $status

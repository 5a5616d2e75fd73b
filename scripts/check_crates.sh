#!/bin/sh
# Checks the crates that are used with cargo-deny against deny.toml: where they come from, and their licences. Then advisories, which need their
# database. Says which of these were not checked.
#
#   scripts/check_crates.sh [--advisories]
#
#   --advisories  fails where advisories cannot be checked
set -eu
cd "$(dirname "$0")/.."
export PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin"
status=0

if ! command -v cargo-deny >/dev/null 2>&1; then
    echo "check_crates: sources, licences and advisories were NOT checked: cargo-deny is not installed (make deny)" >&2
    [ "${1:-}" != --advisories ]
    exit
fi
cargo deny --locked --workspace check bans licenses sources >&2 || status=1
cargo deny --locked --manifest-path python/Cargo.toml --config deny.toml check bans licenses sources >&2 || status=1
# Fuzzing is no part of the program: its licences do not matter.
cargo deny --locked --manifest-path fuzz/Cargo.toml --config deny.toml check bans sources >&2 || status=1
if cargo deny --locked fetch db >/dev/null 2>&1; then
    cargo deny --locked --workspace check --disable-fetch advisories >&2 || status=1
else
    echo "check_crates: advisories were NOT checked: their database cannot be fetched" >&2
    if [ "${1:-}" = --advisories ]; then status=1; fi
fi
exit $status

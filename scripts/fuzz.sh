#!/bin/sh
# Fuzzes readers, one after the other, from the committed corpus. What is found on the way is kept in fuzz/found, for the next run; an input that
# makes a reader fail is in fuzz/artifacts, and belongs into fuzz/corpus with the fix.
#
#   scripts/fuzz.sh READER...
set -eu
cd "$(dirname "$0")/.."
seconds=${SECONDS_EACH:-60}
export PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin"

if ! cargo +nightly --version >/dev/null 2>&1; then
    echo "fuzz: a nightly compiler is missing. Type:  rustup toolchain install nightly --profile minimal" >&2
    exit 1
fi
if ! command -v cargo-fuzz >/dev/null 2>&1; then
    cargo install cargo-fuzz --locked
fi
for reader in "$@"; do
    mkdir -p "fuzz/found/$reader"
    echo "fuzz: $reader, $seconds seconds" >&2
    # 2 GB: the largest image that a small file may hold, with what AddressSanitizer keeps beside it.
    cargo +nightly fuzz run "$reader" "fuzz/found/$reader" "fuzz/corpus/$reader" -- \
        -max_total_time="$seconds" -max_len=65536 -timeout=20 -rss_limit_mb=2048 -print_final_stats=1
done

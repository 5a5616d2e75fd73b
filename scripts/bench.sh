#!/usr/bin/env bash
# Times this tree against another commit on the same machine. The two take turns, so that a drift of the machine touches both alike, and
# change places from round to round.
#
#   scripts/bench.sh COMMIT [OPTIONS OF `time`...]
#
# ROUNDS=5 says how many rounds. The other commit is built in out/bench, and so are all results kept. Ends with 1 if a column has become
# slower for certain (see examples/time_ratios.rs), with 2 if there is no such commit.
set -euo pipefail

cd "$(dirname "$0")/.."
[ $# -ge 1 ] || { echo "usage: scripts/bench.sh COMMIT [OPTIONS OF time...]" >&2; exit 2; }
base=$1
shift
rounds=${ROUNDS:-5}
case $rounds in ''|*[!0-9]*|0|1|2) echo "bench: ROUNDS=$rounds: at least 3 are needed for a confidence that says anything" >&2; exit 2 ;; esac
commit=$(git rev-parse --verify --quiet "$base^{commit}") || { echo "bench: there is no commit $base" >&2; exit 2; }
cargo=${CARGO:-cargo}
out=out/bench
tree=$out/$commit

if [ ! -f "$tree/Cargo.toml" ]; then
    mkdir -p "$tree"
    git archive "$commit" | tar -x -C "$tree"
fi
echo "bench: building this tree and $base ($(git log -1 --format='%h %s' "$commit"))" >&2
"$cargo" build --release --locked --quiet --bin lightpaths
"$cargo" build --release --locked --quiet --example time_ratios
"$cargo" build --release --locked --quiet --bin lightpaths --manifest-path "$tree/Cargo.toml" --target-dir "$out/target"
# The next build of another commit replaces the binary.
cp "$out/target/release/lightpaths" "$tree/lightpaths"
rm -f "$out"/old-*.json "$out"/new-*.json

run() {
    echo "bench: round $2 of $rounds, $1" >&2
    case $1 in
        old) "$tree/lightpaths" time "${@:3}" --quiet --json "$out/old-$2.json" >/dev/null ;;
        new) target/release/lightpaths time "${@:3}" --quiet --json "$out/new-$2.json" >/dev/null ;;
    esac
}

for ((round = 1; round <= rounds; ++round)); do
    order=(old new)
    ((round % 2)) || order=(new old)
    for which in "${order[@]}"; do run "$which" "$round" "$@"; done
done
"$cargo" run --release --locked --quiet --example time_ratios -- "$out"

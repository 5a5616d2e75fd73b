#!/usr/bin/env bash
# Builds all tests, runs the test binaries three at a time, and prints what each took and the twenty
# slowest tests. Fails if a binary fails, and prints the whole output of that binary.
#
#   scripts/test.sh [FILTER…]    FILTER: as for `cargo test -- FILTER`
#
# A test binary runs its tests one after another (.cargo/config.toml), so the time of a test is the
# time between two lines of its output. Three binaries at a time keep two cores busy: one of them waits for
# its device or for a window. JOBS=1 runs one at a time, SLOWEST=50 prints as many tests.
set -euo pipefail
export LC_ALL=C
cd "$(dirname "$0")/.."
CARGO=${CARGO:-cargo}

# Seconds since some moment. Bash before 5 has whole seconds only.
now() { echo "${EPOCHREALTIME:-$SECONDS}"; }

# Runs the test binary $2, called $1, with the arguments after it. Leaves in $DIR: $1.log, its output;
# $1.times, a line a test; $1.cpu, its processor seconds (user, system) and seconds on the clock.
run_one() {
    local name=$1 binary=$2 status=0
    shift 2
    { TIMEFORMAT='%U %S %R' && time "$binary" "$@" 2>&1; } 2>"$DIR/$name.cpu" |
        note_times "$name" >"$DIR/$name.log" || status=$?
    if [ "$status" -ne 0 ]; then cat "$DIR/$name.log"; fi
    printf '     Running %s (%s)\n%s\n' "$name" \
        "$(awk '{ printf "%.0f s of processor time, %.0f s", $1 + $2, $3 }' "$DIR/$name.cpu")" \
        "$(grep '^test result:' "$DIR/$name.log" || echo "no result: exit status $status")"
    return "$status"
}

# Copies its input, and writes for each test when the one before it and the test itself ended.
note_times() {
    local last end line
    last=$(now)
    while IFS= read -r line; do
        printf '%s\n' "$line"
        case $line in
            'test '*' ... ignored'*) ;;
            'test '*' ... '*)
                end=$(now)
                line=${line#test }
                echo "$last $end $1 ${line%% ... *}" >>"$DIR/$1.times"
                last=$end
                ;;
        esac
    done
}

# Names and paths of test binaries from what cargo writes. First one that needs most shaders, with two that
# need no device: the driver keeps what it has compiled. Then the longest, so that none is left running
# alone at the end.
binaries() {
    local order='stress readers scene window physics cli passes failures cache soak' name path
    sed -n 's/^ *Executable \(unittests \)\{0,1\}\([^ ]*\) (\(.*\))$/\2 \3/p' | while read -r name path; do
        # Unit tests have the name of their crate.
        [ "$name" != src/lib.rs ] || { name=${path##*/} && name=${name%-*}; }
        name=${name#tests/} name=${name#examples/}
        name=${name%.rs} name=${name%/main}
        echo "$name $path"
    done | awk -v order="$order" '
        BEGIN { count = split(order, first, " ") }
        { path[$1] = $2; names[NR] = $1 }
        END {
            for (i = 1; i <= count; i++) if (first[i] in path) { print first[i], path[first[i]]; delete path[first[i]] }
            for (i = 1; i <= NR; i++) if (names[i] in path) print names[i], path[names[i]]
        }'
}

# `scripts/test.sh --one`: a process of its own for each binary, started by xargs below.
if [ "${1:-}" = --one ]; then
    shift
    run_one "$@"
    exit
fi

DIR=$(mktemp -d)
export DIR
trap 'rm -rf "$DIR"' EXIT

start=$SECONDS
# Only the library and the program are optimised (profile.test): see scripts/rustc_for_tests.sh.
RUSTC_WORKSPACE_WRAPPER=$PWD/scripts/rustc_for_tests.sh $CARGO test --locked -p lightpaths -p lightpaths-models \
    --lib --example time_ratios --example relight --test '*' --no-run 2>&1 | tee "$DIR/cargo"
built=$((SECONDS - start))
status=0
# The example on the library's page has to compile.
if [ $# -eq 0 ]; then
    RUSTC_WORKSPACE_WRAPPER=$PWD/scripts/rustc_for_tests.sh $CARGO test --locked -p lightpaths --doc || status=1
fi

# Processes inherit ignored signals from nohup and from background jobs. Tests of signals need the default
# action, which GNU env restores and a shell cannot.
usual=(env --default-signal=HUP,INT,TERM)
"${usual[@]}" true 2>/dev/null || usual=()

# Pipelines that the driver has compiled stay with what cargo has.
export CARGO_MANIFEST_DIR=$PWD RUST_TEST_THREADS=1 LIGHTPATHS_PIPELINES=$PWD/target/pipelines
# Tests use the values of the device class, not those that the user has measured.
export LIGHTPATHS_TUNING=
# No blank may end a line: xargs would join the next one to it.
binaries <"$DIR/cargo" | sed "s|\$|${*:+ $*}|" | ${usual[@]+"${usual[@]}"} xargs -P "${JOBS:-3}" -L 1 "$0" --one || status=1

echo
echo 'The twenty slowest tests, seconds on the clock while another binary ran beside:'
# `sort | head` would end in a broken pipe, which pipefail takes for a failure: sed reads all.
cat "$DIR"/*.times | awk '{ printf "%7.1f  %s::%s\n", $2 - $1, $3, $4 }' | sort -rn | sed -n "1,${SLOWEST:-20}p"
awk -v built="$built" -v all="$((SECONDS - start))" '
    { cpu += $1 + $2 }
    END { printf "\nBuilt in %d s; tests took %.0f s of processor time; %d s in all.\n", built, cpu, all }' "$DIR"/*.cpu
exit "$status"

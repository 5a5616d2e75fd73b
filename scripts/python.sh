#!/bin/sh
# Builds the Python package into a virtual environment, out/python-venv, and runs its tests.
#
#   scripts/python.sh [TEST...]    TEST: a file, class or method, as for `python -m unittest`
#
# The profile is that of the tests of Rust, whose dependencies are then built once. PROFILE=release builds what
# `pip install` builds.
set -eu
cd "$(dirname "$0")/.."
export PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin"
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
venv=$PWD/out/python-venv
# An environment that was interrupted while it was made has no such file.
if [ ! -e "$venv"/complete ]; then
    python3 -m venv --clear "$venv"
    "$venv"/bin/python -m pip install --quiet --disable-pip-version-check -r python/requirements-tests.txt || {
        echo "run: the packages of python/requirements-tests.txt cannot be installed" >&2
        exit 75
    }
    touch "$venv"/complete
fi
# Without isolation, pip uses the maturin of the environment and downloads nothing.
export PATH="$venv/bin:$PATH"
"$venv"/bin/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall \
    -C "build-args=--profile ${PROFILE:-dev}" ./python
# The tests use the values of the device class, not those that the user has measured.
export LIGHTPATHS_TUNING='' LIGHTPATHS_PIPELINES="$CARGO_TARGET_DIR/pipelines"
cd python/tests
if [ $# -eq 0 ]; then set -- discover; fi
exec "$venv"/bin/python -m unittest "$@"

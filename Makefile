# The house's commands. What is missing on the machine is installed first: see scripts/setup.sh.

CARGO ?= cargo
# rustup puts cargo here; a shell that was open before the installation does not know yet.
export PATH := $(PATH):$(HOME)/.cargo/bin

.PHONY: help run demo screenshots test python stress soak fuzz lint audit deny mutants ablation bench tables figures film scale peers spirv shaders structure setup clean

help:
	@echo 'make run    build, render the Box to out/box.png and time it'
	@echo 'make demo   open the window'
	@echo 'make screenshots pictures of the window, into docs/images'
	@echo 'make test   all tests but those of make stress and make soak; prints the twenty slowest'
	@echo 'make python build the Python package into out/python-venv and test it (needs python3)'
	@echo 'make stress full sizes of the tests of docs/numerics.md, and scenes of ten million triangles, every call and allocation that fails (8 GB of memory, forty minutes on two cores)'
	@echo 'make soak   eight renders at once at the paper'"'"'s settings, then an hour of edits'
	@echo 'make fuzz   readers of files from strangers, SECONDS=60 each (needs a nightly compiler)'
	@echo 'make mutants small faults in the code, and which of them the tests see (hours; needs python3 and glslc)'
	@echo 'make audit  advisories against the crates that are used (needs a network)'
	@echo 'make lint   formatting, lints, documentation, tree and word checks, and licences if cargo-deny is installed'
	@echo 'make deny   install cargo-deny'
	@echo 'make ablation error, time and memory without each measure against light leaks (an hour on two cores; docs/visibility.md)'
	@echo 'make bench  times of this tree against another commit, BASE=HEAD~1, in turns'
	@echo 'make tables the paper'"'"'s tables 1 to 3 for every built-in scene (15 minutes at most on two cores), into out/tables.json'
	@echo 'make figures the paper'"'"'s figures 4 to 6, into out/figures (ten minutes on two cores)'
	@echo 'make film   the built-in film of the Box, into out/film (docs/films.md)'
	@echo 'make scale  time and memory against sizes, into out/scale'
	@echo 'make peers  Mitsuba and Cycles on the Box beside ours, into out/peers (1.5 GB, an hour on two cores)'
	@echo 'make spirv  rebuild spirv/ from glsl/ (needs cmake and a C++ compiler)'
	@echo 'make shaders tests that compile shaders (needs the same)'
	@echo 'make structure draws the modules and their imports, docs/images/structure.svg (needs python3)'
	@echo 'make setup  install what any of these needs'
	@echo 'make clean  remove what was built'

run:
	@scripts/setup.sh
	@mkdir -p out
	$(CARGO) build --release --locked
	@$(CARGO) run --quiet --release --locked -- render box -o out/box.png
	@$(CARGO) run --quiet --release --locked -- time box --frames 5 --lights 1
	@echo && echo 'The picture is in out/box.png.'

demo:
	@scripts/setup.sh
	$(CARGO) run --release --locked -- demo

# Pictures of the window into docs/images.
screenshots:
	@scripts/setup.sh --tests
	$(CARGO) test --locked --test window -- --ignored screenshots

# Which tests, e.g. `make test TESTS=resize`.
TESTS ?=

test:
	@scripts/setup.sh --tests
	@CARGO='$(CARGO)' scripts/test.sh $(TESTS)

# Which tests, e.g. `make python PYTHON_TESTS=test_errors.Refusals`; PROFILE=release builds as pip does.
PYTHON_TESTS ?=

python:
	@scripts/setup.sh --python
	@PROFILE='$(PROFILE)' scripts/python.sh $(PYTHON_TESTS)

stress:
	@scripts/setup.sh --tests
	$(CARGO) test --release --locked --test scene -- --ignored places_of_one_and_ten
	$(CARGO) test --release --locked --test physics -- --ignored --nocapture
	$(CARGO) test --release --locked --test stress -- --ignored --nocapture --skip what_each_measure_buys
	$(CARGO) test --release --locked --test failures -- --ignored --nocapture

soak:
	@scripts/setup.sh --tests
	LIGHTPATHS_TUNING= $(CARGO) test --release --locked --test soak -- --ignored --nocapture --test-threads 1

lint:
	@scripts/setup.sh --lint
	$(CARGO) fmt --all --check
	$(CARGO) fmt --manifest-path python/Cargo.toml --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings
	@if command -v python3 >/dev/null; then $(CARGO) clippy --locked --manifest-path python/Cargo.toml --all-targets -- -D warnings; fi
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc --locked --workspace --no-deps
	@scripts/check_tree.sh
	@scripts/check_words.sh
	@if command -v python3 >/dev/null; then scripts/structure.py --check && scripts/import_circles.py && scripts/mutants.py check; fi
	@scripts/check_crates.sh

# Unoptimised: it takes half as long to build, and checks within seconds.
deny:
	@scripts/setup.sh --lint
	@command -v cargo-deny >/dev/null || $(CARGO) install cargo-deny --version 0.20.2 --locked --debug

audit: deny
	@scripts/check_crates.sh --advisories

# How long each reader is fuzzed, and which, e.g. `make fuzz SECONDS=600 READERS='obj cache'`.
SECONDS ?= 60
READERS ?= toml film obj gltf ply stl mtl luminaire texture image cache

fuzz:
	@scripts/setup.sh
	@SECONDS_EACH='$(SECONDS)' scripts/fuzz.sh $(READERS)

# How many faults in Rust and in GLSL.
MUTANTS ?= --rust 150 --glsl 40

mutants:
	@scripts/setup.sh --tests
	@scripts/mutants.py build $(MUTANTS)
	@scripts/mutants.py run
	@scripts/mutants.py report

# The environment selects cases and settings: see `what_each_measure_buys` in tests/stress/measures.rs.
ablation:
	@scripts/setup.sh
	$(CARGO) test --release --locked --test stress what_each_measure_buys -- --ignored --nocapture

# What `make bench` compares with, and options of `time`, e.g. `make bench BASE=v0.1.0 BENCH='atrium --frames 9 --lights 1'`.
BASE ?= HEAD~1
BENCH ?= box --preset draft --frames 9 --lights 1

bench:
	@scripts/setup.sh
	@CARGO='$(CARGO)' scripts/bench.sh '$(BASE)' $(BENCH)

tables:
	@scripts/setup.sh
	@mkdir -p out
	$(CARGO) run --release --locked -- time --frames 5 --json out/tables.json

# Options of the figures, e.g. `make figures FIGURES='box --seconds 300'`.
FIGURES ?=

figures:
	@scripts/setup.sh
	@mkdir -p out
	$(CARGO) run --release --locked -- figures $(FIGURES) -o out/figures

# Options of the film, e.g. `make film FILM='atrium --preset draft'`.
FILM ?= box

film:
	@scripts/setup.sh
	@mkdir -p out
	$(CARGO) run --release --locked -- film $(FILM) -o out/film

# Options of the sizes, e.g. `make scale SCALE='atrium --lights 1,2,4'`.
SCALE ?= room

scale:
	@scripts/setup.sh
	@mkdir -p out
	$(CARGO) run --release --locked -- scale $(SCALE) -o out/scale

# Options of the table, e.g. `make peers PEERS='atrium --spp 16,64'`.
PEERS ?= box
PEERS_PYTHON = $(or $(LIGHTPATHS_PEERS),bench/peers)/.venv-mitsuba/bin/python

peers:
	@scripts/setup.sh
	@python3 bench/peers/install.py
	$(CARGO) build --release --locked
	$(PEERS_PYTHON) -m unittest discover -q bench/peers
	$(PEERS_PYTHON) bench/peers/selftest.py
	$(PEERS_PYTHON) bench/peers/run.py witness
	$(PEERS_PYTHON) bench/peers/run.py $(PEERS)

# Draws the modules and their imports: docs/images/structure.svg
structure:
	scripts/structure.py

spirv:
	@scripts/setup.sh
	LIGHTPATHS_BLESS=1 $(CARGO) test --locked --features shaderc --test interface

shaders:
	@scripts/setup.sh --tests
	$(CARGO) test --locked --features shaderc --test interface --test reload
	$(CARGO) test --locked --features shaderc --test window shaders::

setup:
	@scripts/setup.sh --lint
	@scripts/setup.sh --tests

clean:
	$(CARGO) clean
	rm -rf out

#!/usr/bin/env python3
"""Tries mutants: small faults in the code, each of which some test ought to see.

    scripts/mutants.py build [--rust N] [--glsl N] [--seed S]   choose faults, build once with all of them
    scripts/mutants.py run [--minutes M] [--jobs J] [--seconds S] [--again [ID…]] try those that were not tried yet
    scripts/mutants.py report                                   print the table of docs/testing.md
    scripts/mutants.py check                                    fail if a chosen fault has lost its line

Every Rust mutant is compiled into one build as `if crate::mutant(ID) { changed } else { original }`, and the
environment variable LP_MUTANT chooses one: 150 mutants cost one build instead of 150. GLSL mutants are
compiled by glslc when their turn comes; the build reads SPIR-V from the folder LP_MUTANT_SPIRV first.
A mutant is tried against the tests that reach its line (a shader: the tests that dispatch it), the quickest first,
until one fails or they have taken long enough. Two mutants are tried at a time.
Everything lies in target/mutants; the tree itself is not changed.
"""

import argparse
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "mutants"
TREE = WORK / "tree"
SITES, RESULTS = WORK / "sites.json", WORK / "results.json"
RUST = ["src/passes", "src/renderer", "src/cpu", "src/gpu"]
# Test binaries in the order in which a mutant is tried.
ORDER = ["lightpaths", "hazards", "device", "interface", "passes", "cache", "physics", "stress", "scene", "soak",
         "cli", "failures", "window"]
# These start the program, which does not know for which test it runs.
BY_PROGRAM = ["cli", "failures", "window"]
# A mutant that makes tests take so many times as long has hung them.
HANGS = 6
# Seconds of the tests of one process: few at first, for most mutants are seen at once.
CHUNKS = [3, 15, 60, 1e9]
# Four times as many of those that compare a pass with its reference: nothing else looks as closely.
CLOSE = {"passes": 4}

SWAPS = [(" + ", " - "), (" - ", " + "), (" * ", " / "), (" / ", " * "), (" < ", " <= "), (" <= ", " < "),
         (" > ", " >= "), (" >= ", " > "), (" == ", " != "), (" != ", " == "), (" && ", " || "), (" || ", " && "),
         (".max(", ".min("), (".min(", ".max("), (" << ", " >> "), (" + 1", " + 2"), (" - 1", " - 0"),
         ("true", "false"), ("false", "true"), (".div_ceil(", " / ("), ("max(", "min("), ("min(", "max(")]
HOOK = """
/// Whether the mutant of that number is tried; notes in the file LP_MUTANT_COVER which test reached it first.
#[doc(hidden)]
pub fn mutant(id: u32) -> bool {
    use std::sync::atomic::{AtomicU32, Ordering};
    static CHOSEN: std::sync::LazyLock<u32> =
        std::sync::LazyLock::new(|| std::env::var("LP_MUTANT").map_or(0, |id| id.parse().unwrap_or(0)));
    static SEEN: [AtomicU32; 4096] = [const { AtomicU32::new(0) }; 4096];
    if *CHOSEN == 0 && SEEN[id as usize].swap(mutant_test(), Ordering::Relaxed) != mutant_test() {
        mutant_cover(&id.to_string());
    }
    *CHOSEN == id
}

static MUTANT_TEST: std::sync::Mutex<(u32, String)> = std::sync::Mutex::new((1, String::new()));

/// The number of the test that runs: tests run one after another, each in a thread of its name.
fn mutant_test() -> u32 {
    use std::sync::atomic::{AtomicU32, Ordering};
    static NUMBER: AtomicU32 = AtomicU32::new(1);
    std::thread_local!(static NAMED: () = {
        if let Some(name) = std::thread::current().name().filter(|name| *name != "main") {
            *MUTANT_TEST.lock().unwrap() = (1 + NUMBER.fetch_add(1, Ordering::Relaxed), name.to_owned());
        }
    });
    NAMED.with(|()| NUMBER.load(Ordering::Relaxed))
}

pub(crate) fn mutant_cover(what: &str) {
    static PATH: std::sync::LazyLock<Option<std::ffi::OsString>> =
        std::sync::LazyLock::new(|| std::env::var_os("LP_MUTANT_COVER"));
    if let Some(path) = &*PATH {
        use std::io::Write;
        mutant_test();
        let line = format!("{what} {}\\n", MUTANT_TEST.lock().unwrap().1);
        let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
        let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
    }
}
"""


# A shader is read from the folder of the mutant first.
WORDS = ("        let (words, rest) = self.bytes.as_chunks::<4>();\n", """\
        let folder = std::env::var_os("LP_MUTANT_SPIRV").map(std::path::PathBuf::from);
        let changed = folder.and_then(|folder| std::fs::read(folder.join(format!("{}.spv", self.stem))).ok());
        let bytes = changed.as_deref().unwrap_or(&self.bytes);
        let (words, rest) = bytes.as_chunks::<4>();
""")
# A test reaches the shaders that it dispatches: who compiled them is chance.
BIND = ("        check_bindings(self.pass_name, program, push, bindings);\n        if self.leaves_out {\n", """\
        check_bindings(self.pass_name, program, push, bindings);
        crate::mutant_cover(program.stem);
        if self.leaves_out {
""")


# Mutants that are always tried, because nothing saw them once: file, what stands there (once), what it becomes.
CHOSEN = [
    ("src/renderer/edits.rs", "(old.exponent != new.exponent || ", "((!crate::mutant(ID) && old.exponent != new.exponent) || "),
    ("src/renderer/lights.rs", "        self.caches.drain(own);",
     "        if crate::mutant(ID) { self.caches.swap_remove(own.start); } else { self.caches.drain(own); }"),
    ("src/renderer/precompute_cache/key.rs", "words.extend([exponent.to_bits(),",
     "words.extend([if crate::mutant(ID) { 0 } else { exponent.to_bits() },"),
    ("src/renderer/precompute_cache/key.rs", "texture.wrapping()", "if crate::mutant(ID) { 0 } else { texture.wrapping() }"),
    ("src/renderer/precompute_cache/key.rs", "points.iter().map(|point| point",
     "points.iter().take(if crate::mutant(ID) { 1 } else { usize::MAX }).map(|point| point"),
    ("src/renderer/lights.rs", "            gloss.sample_count = sample_count;",
     "            if !crate::mutant(ID) { gloss.sample_count = sample_count; }"),
    ("src/renderer/edits.rs", "        *old = camera;\n        self.world.enclosures.is_due = true;",
     "        *old = camera;\n        self.world.enclosures.is_due |= !crate::mutant(ID);"),
    ("src/renderer/reopen.rs", "        opened.set_display_transform(self.image.display_transform);",
     "        if !crate::mutant(ID) { opened.set_display_transform(self.image.display_transform); }"),
    ("src/passes/frame/form_factors.rs", "*next += (chunk.items.len() as u32).div_ceil(BATCH);",
     "*next += if crate::mutant(ID) { chunk.items.len() as u32 / BATCH } else { (chunk.items.len() as u32).div_ceil(BATCH) };"),
    ("src/gpu/split_buffer.rs", "storage_range_bytes / size_of::<T>() as u64;",
     "storage_range_bytes / size_of::<T>() as u64 + u64::from(crate::mutant(ID));"),
    ("src/cpu/emission.rs", "mean.cos() * lost)", "mean.cos() * if crate::mutant(ID) { 0.0 } else { lost })"),
    ("src/passes/loop_limit.rs", "    if !is_truncated {", "    if !is_truncated || crate::mutant(ID) {"),
    ("glsl/shafts.comp", "float slack = 0.25 * shaft.offset * length(across);", "float slack = 0.0;"),
    ("glsl/include/bvh.glsl", "vec3 slack = 4e-7 * (abs(base) + 255.0 * abs(cell));", "vec3 slack = vec3(0.0);"),
    ("glsl/form_factors.comp", "if (!loops_completed(push.point_count)) truncated_loops[0] = LOOP_TRUNCATED;", ""),
    ("glsl/light_paths.comp", "loops_completed(push.path_count) ? count : LOOP_TRUNCATED", "count"),
    ("glsl/gloss_rays.comp", "if (!loops_completed(push.stride)) truncated_loops[0] = LOOP_TRUNCATED;", ""),
    ("glsl/primary.comp", "if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;", ""),
]


def chosen_sites():
    for file, old, new in CHOSEN:
        text = (ROOT / file).read_text()
        assert text.count(old) == 1, f"{file} has {text.count(old)} of: {old}"
        # Lines of a file keep their numbers: the last of the lines that change carries the change.
        line, old, new = text[:text.index(old)].count("\n") + old.count("\n"), old.split("\n")[-1], new.split("\n")[-1]
        whole = text.split("\n")[line]
        kind = "glsl" if file.startswith("glsl") else "rust"
        yield {"kind": kind, "file": file, "line": line, "old": whole.strip(), "new": new.strip() or "nothing",
               "template": whole.replace(old, new), "chosen": True}


def swaps(text, chance):
    """The text with one operator changed; None if it has none."""
    found = [(old, new) for old, new in SWAPS if old in text]
    if not found:
        return None
    old, new = chance.choice(found)
    places = [m.start() for m in re.finditer(re.escape(old), text)]
    place = chance.choice(places)
    return text[:place] + new + text[place + len(old):]


def rust_mutant(line, chance):
    """What a line becomes, as a template with ID, and the change in words; None if nothing is tried there."""
    if '"' in line or "//" in line or "'" in line or "assert" in line:
        return None
    if m := re.match(r"^(\s+)(let (?:mut )?\w+(?:: [^=]+)? = )(.+);$", line):
        changed = swaps(m[3], chance)
        return changed and (f"{m[1]}{m[2]}if crate::mutant(ID) {{ {changed} }} else {{ {m[3]} }};", changed)
    if m := re.match(r"^(\s+)(\} else )?if (?!let )(.+) \{$", line):
        changed = (swaps(m[3], chance) if chance.random() < 0.7 else None) or f"!({m[3]})"
        test = f"if crate::mutant(ID) {{ {changed} }} else {{ {m[3]} }}"
        return f"{m[1]}{m[2] or ''}if ({test}) {{", f"if {changed}"
    if m := re.match(r"^(\s+)(\*?[\w.\[\]]+) ([-+*/|]=|=) (.+);$", line):
        if m[3] != "=":
            other = {"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "|=": "="}[m[3]]
            changed = f"{m[2]} {other} {m[4]};"
        else:
            rest = swaps(m[4], chance)
            changed = f"{m[2]} = {rest};" if rest else ""
        return f"{m[1]}if crate::mutant(ID) {{ {changed} }} else {{ {line.strip()} }}", changed or "nothing"
    if re.match(r"^\s+(?:self|rec|pass|renderer|\w+)(?:\.\w+)*\.\w+\(.*\)\??;$", line):
        return re.sub(r"^(\s+)(.+)$", r"\1if !crate::mutant(ID) { \2 }", line), "nothing"
    return None


def rust_sites(chance):
    for folder in RUST:
        for path in sorted((ROOT / folder).rglob("*.rs")):
            for number, line in enumerate(path.read_text().split("\n")):
                if line.strip() == "#[cfg(test)]":
                    break
                if line in WORDS[0] + BIND[0]:
                    continue
                if made := rust_mutant(line, chance):
                    yield {"kind": "rust", "file": str(path.relative_to(ROOT)), "line": number, "old": line.strip(),
                           "new": made[1], "template": made[0]}


def glsl_sites(chance):
    for path in sorted((ROOT / "glsl").rglob("*.[cg][ol][ms]*")):
        for number, line in enumerate(path.read_text().split("\n")):
            code = line.split("//")[0]
            if not re.search(r";\s*$|\{\s*$", code) or re.match(r"\s*(layout|#|const|shared|struct)", code):
                continue
            changed = "" if code.strip() == "barrier();" else swaps(code, chance)
            if changed is not None:
                yield {"kind": "glsl", "file": str(path.relative_to(ROOT)), "line": number, "old": code.strip(),
                       "new": changed.strip() or "nothing", "template": changed}


def instrument(sites):
    """Lays out the tree anew and writes the chosen mutants into it."""
    TREE.mkdir(parents=True, exist_ok=True)
    for name in subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).split("\n"):
        if name and (ROOT / name).is_file():
            (TREE / name).parent.mkdir(parents=True, exist_ok=True)
            text = (ROOT / name).read_bytes()
            if name == "src/lib.rs":
                text += HOOK.encode()
            chosen = [s for s in sites if s["file"] == name and s["kind"] == "rust"]
            if chosen:
                lines = text.decode().split("\n")
                for site in chosen:
                    lines[site["line"]] = site["template"].replace("ID", str(site["id"]), 1)
                text = "\n".join(lines).encode()
            if name == "src/gpu/shaders.rs":
                text = patch(text.decode(), WORDS).encode()
            if name == "src/gpu/recorder/passes.rs":
                text = patch(text.decode(), BIND).encode()
            if not (TREE / name).exists() or (TREE / name).read_bytes() != text:
                (TREE / name).write_bytes(text)


def patch(text, change):
    old, new = change
    assert old in text, f"no longer in the source: {old}"
    return text.replace(old, new)


def build(options):
    chance = random.Random(options.seed)
    rust, glsl = list(rust_sites(chance)), list(glsl_sites(chance))
    print(f"{len(rust)} places in Rust, {len(glsl)} in GLSL, seed {options.seed}")
    # Some do not compile, where an operator stands for something else: more are chosen than wanted.
    rust = sorted(chance.sample(rust, min(len(rust), options.rust * 5 // 4)), key=lambda s: (s["file"], s["line"]))
    glsl = chance.sample(glsl, min(len(glsl), options.glsl * 5 // 4))
    always = list(chosen_sites())
    places = {(site["file"], site["line"]) for site in always}
    rust, glsl = ([site for site in sites if (site["file"], site["line"]) not in places] for sites in (rust, glsl))
    for number, site in enumerate(always + rust + glsl):
        site["id"] = number + 1
    always_rust = [site for site in always if site["kind"] == "rust"]
    command = ["cargo", "test", "--locked", "--no-run", "--message-format=json", "--lib", "--tests"]
    environment = {**os.environ, "CARGO_TARGET_DIR": str(WORK / "target"), "RUSTFLAGS": "-A warnings"}
    while True:
        instrument(always_rust + rust)
        check = [*command[:1], "check", "--locked", "--lib", "--message-format=json"]
        wrong = broken(subprocess.run(check, cwd=TREE, env=environment, capture_output=True, text=True), always_rust + rust)
        if not wrong:
            break
        print(f"{len(wrong)} mutants do not compile")
        rust = [site for site in rust if site["id"] not in wrong]
    rust = always_rust + sorted(chance.sample(rust, min(len(rust), options.rust)), key=lambda s: s["id"])
    instrument(rust)
    glsl = [site for site in always if site["kind"] == "glsl"] + glsl
    made = subprocess.run(command, cwd=TREE, env=environment, stdout=subprocess.PIPE, text=True)
    if made.returncode:
        sys.exit("the tests do not build")
    messages = [json.loads(line) for line in made.stdout.split("\n") if line.startswith("{")]
    made = [m for m in messages if m.get("executable") and m["profile"]["test"] and m["target"]["kind"] != ["bin"]]
    binaries = {m["target"]["name"]: m["executable"] for m in made}
    binaries = {name: binaries[name] for name in ORDER}
    SITES.write_text(json.dumps({"sites": rust + glsl, "glsl": options.glsl, "binaries": binaries, "baseline": {}}))


def broken(check, sites):
    """Numbers of the mutants on whose lines the compiler found an error."""
    wrong = set()
    for line in check.stdout.split("\n"):
        message = json.loads(line).get("message") if line.startswith("{") else None
        if not isinstance(message, dict) or message.get("level") != "error":
            continue
        places = {(span["file_name"], span["line_start"] - 1) for span in message["spans"]}
        wrong |= {site["id"] for site in sites if (site["file"], site["line"]) in places}
        if message["spans"] and not wrong:
            sys.exit(f"the tree does not compile: {message['rendered']}")
    return wrong


def test(binary, mutant, timeout, tests=(), cover=None, spirv=None):
    """Runs tests of a binary until one fails. Returns its name, "hang", or None; and the seconds of each that ended."""
    environment = {**os.environ, "RUST_TEST_THREADS": "1", "CARGO_MANIFEST_DIR": str(TREE), "LP_MUTANT": str(mutant),
                   "RUSTC_BOOTSTRAP": "1"}
    environment |= {"LP_MUTANT_COVER": str(cover)} if cover else {}
    environment |= {"LP_MUTANT_SPIRV": str(spirv)} if spirv else {}
    begun = time.monotonic()
    command = [binary, "-Zunstable-options", "--report-time", *(["--exact", *tests] if tests else [])]
    process = subprocess.Popen(command, cwd=TREE, env=environment, stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, start_new_session=True)
    failed, text = None, ""
    os.set_blocking(process.stdout.fileno(), False)
    while failed is None:
        ended = process.poll() is not None
        text += (process.stdout.read() or b"").decode(errors="replace")
        if match := re.search(r"^test (\S+).* FAILED", text, re.M):
            failed = match[1]
        elif ended:
            names = re.findall(r"^test (\S+)", text, re.M)
            failed = None if process.returncode == 0 else (names or ["no test"])[-1] + " (ended the process)"
            break
        elif time.monotonic() - begun > timeout:
            failed = "hang"
        else:
            time.sleep(0.05)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    times = re.findall(r"^test (\S+)(?: - should panic)? \.\.\. ok <([\d.]+)s>", text, re.M)
    return failed, {name: float(seconds) for name, seconds in times}


def cover(known):
    """Notes which tests reach a mutant or dispatch a shader, and how long each takes without one."""

    def of(name):
        file = WORK / f"{name}.reached"
        binary, times, reached, failed = known["binaries"][name], {}, {}, None
        listed = subprocess.check_output([binary, "--list"], text=True, cwd=TREE)
        names = re.findall(r"^(\S+): test$", listed, re.M)
        for tests in [[test] for test in names] if name in BY_PROGRAM else [[]]:
            file.unlink(missing_ok=True)
            seen, seconds = test(binary, 0, 3600, tests, cover=file)
            failed = failed or seen
            times |= seconds
            for line in file.read_text().split("\n") if file.exists() else []:
                words = line.split(" ")
                by = tests[0] if tests else words[-1]
                if len(words) == 2 and by in seconds:
                    reached.setdefault(words[0], set()).add(by)
        reached = {key: sorted(tests) for key, tests in reached.items()}
        print(f"{name}: {sum(times.values()):.0f} s, reaches {len(reached)}" + (f", FAILS: {failed}" if failed else ""),
              flush=True)
        return name, {"times": times, "reached": reached, "failed": failed}

    with ThreadPoolExecutor(2) as pool:
        known["baseline"] |= dict(pool.map(of, [name for name in known["binaries"] if name not in known["baseline"]]))
    SITES.write_text(json.dumps(known))
    reached = {key for base in known["baseline"].values() for key in base["reached"]}
    missed = [site for site in known["sites"] if site["kind"] == "rust" and str(site["id"]) not in reached]
    print(f"{len(missed)} mutants are reached by no test")


def compile_glsl(site):
    """Compiles the shaders that a mutated line reaches. Returns their folder and stems; None if it does not compile."""
    folder, sources = WORK / f"spirv-{site['id']}", WORK / f"glsl-{site['id']}"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.rmtree(sources, ignore_errors=True)
    shutil.copytree(ROOT / "glsl", sources)
    folder.mkdir()
    changed = sources / Path(site["file"]).relative_to("glsl")
    lines = changed.read_text().split("\n")
    lines[site["line"]] = site["template"]
    changed.write_text("\n".join(lines))
    stems = [shader.stem for shader in sorted(sources.glob("*.comp")) if changed in includes(shader, sources)]
    for stem in stems:
        command = ["glslc", "--target-env=vulkan1.2", "-O0", "-fshader-stage=compute", str(sources / f"{stem}.comp"),
                   "-o", str(folder / f"{stem}.spv")]
        if subprocess.run(command, capture_output=True).returncode:
            stems = []
    shutil.rmtree(sources)
    return (folder, stems) if stems else None


def includes(path, folder):
    found = {path}
    for name in re.findall(r'^#include "(.*)"', path.read_text(), re.M):
        found |= includes(folder / name, folder)
    return found


def attempt(site, known, most_seconds):
    """The test that sees a mutant; None if none does, "compiler" if it is no program."""
    spirv, keys = None, [str(site["id"])]
    if site["kind"] == "glsl":
        made = compile_glsl(site)
        if made is None:
            return "compiler"
        spirv, keys = made
    queues = {}
    for name, base in known["baseline"].items():
        reached = {test for key in keys for test in base["reached"].get(key, [])}
        queues[name] = sorted(reached, key=base["times"].get)
    left = most_seconds
    try:
        for most in CHUNKS:
            for name, tests in queues.items():
                times, chunk, seconds = known["baseline"][name]["times"], [], 0
                while tests and (not chunk or seconds + times[tests[0]] < min(CLOSE.get(name, 1) * most, left)):
                    seconds += times[tests[0]]
                    chunk.append(tests.pop(0))
                if not chunk or left < 0:
                    continue
                left -= seconds
                number = site["id"] if site["kind"] == "rust" else 0
                failed, _ = test(known["binaries"][name], number, 60 + HANGS * seconds, chunk, spirv=spirv)
                if failed:
                    return f"{name}::{failed}"
    finally:
        if spirv:
            shutil.rmtree(spirv)
    return None


def run(options):
    known = json.loads(SITES.read_text())
    if known["baseline"].keys() != known["binaries"].keys():
        cover(known)
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    stop = time.monotonic() + 60 * options.minutes

    def of(site):
        tried = sum(r["kind"] == "glsl" and r["by"] != "compiler" for r in results.values())
        if time.monotonic() > stop or site["kind"] == "glsl" and tried >= known["glsl"] + len(CHOSEN):
            return
        results[str(site["id"])] = {**site, "by": attempt(site, known, options.seconds)}
        RESULTS.write_text(json.dumps(results))
        print(f"{site['id']} {site['file']}:{site['line'] + 1}: {results[str(site['id'])]['by'] or 'SURVIVED'}", flush=True)

    if options.again is not None:
        again = options.again or [key for key, outcome in results.items() if not outcome["by"]]
        results = {key: outcome for key, outcome in results.items() if key not in again}
    due = [site for site in known["sites"] if str(site["id"]) not in results]
    # In any order: what was tried when time is up stands for all.
    random.Random(1).shuffle(due)
    with ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(of, due))


def report(_):
    results = [r for r in json.loads(RESULTS.read_text()).values() if r["by"] != "compiler"]
    print("| | tried | caught | share |\n|---|---|---|---|")
    for kind in ("rust", "glsl"):
        for folder in sorted({"/".join(r["file"].split("/")[:2]) if kind == "rust" else "glsl"
                              for r in results if r["kind"] == kind}):
            those = [r for r in results if r["file"].startswith(folder + "/") and r["kind"] == kind]
            caught = sum(r["by"] is not None for r in those)
            print(f"| {folder} | {len(those)} | {caught} | {100 * caught / len(those):.0f} % |")
    print("\n| survivor | was | became |\n|---|---|---|")
    for r in results:
        if r["by"] is None:
            print(f"| {r['file']}:{r['line'] + 1} | `{r['old']}` | `{r['new']}` |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    builder = commands.add_parser("build")
    builder.add_argument("--rust", type=int, default=150)
    builder.add_argument("--glsl", type=int, default=40)
    builder.add_argument("--seed", type=int, default=1)
    builder.set_defaults(call=build)
    runner = commands.add_parser("run")
    runner.add_argument("--jobs", type=int, default=2)
    runner.add_argument("--again", nargs="*", metavar="ID", help="also those that survived, or these of them")
    runner.add_argument("--seconds", type=float, default=100, help="of the tests that a mutant is tried against")
    runner.add_argument("--minutes", type=float, default=1e6)
    runner.set_defaults(call=run)
    commands.add_parser("report").set_defaults(call=report)
    commands.add_parser("check").set_defaults(call=lambda _: list(chosen_sites()))
    options = parser.parse_args()
    # nohup and shells leave signals ignored, which children inherit; tests of signals need them.
    for ignored in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        signal.signal(ignored, signal.SIG_DFL)
    options.call(options)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Tries mutants: small faults in the code, each of which some test ought to see.

    scripts/mutants.py build [--rust N] [--glsl N] [--seed S]   choose faults, build once with all of them
    scripts/mutants.py run [--minutes M]                        try those that were not tried yet
    scripts/mutants.py report                                   print the table of docs/testing.md

Every Rust mutant is compiled into one build as `if crate::mutant(ID) { changed } else { original }`, and the
environment variable LP_MUTANT chooses one: 150 mutants cost one build instead of 150. GLSL mutants are
compiled by glslc when their turn comes; the build reads SPIR-V from the folder LP_MUTANT_SPIRV first.
A mutant is tried against the test binaries that reach its line, the quickest first, until one fails.
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
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "mutants"
TREE = WORK / "tree"
SITES, RESULTS = WORK / "sites.json", WORK / "results.json"
RUST = ["src/passes", "src/renderer", "src/cpu", "src/gpu"]
# Test binaries in the order in which a mutant is tried.
ORDER = ["lightpaths", "hazards", "passes", "stored", "physics", "stress", "failures", "scene", "cli", "soak"]
# A mutant that makes a binary take so many times as long has hung it.
HANGS = 6

SWAPS = [(" + ", " - "), (" - ", " + "), (" * ", " / "), (" / ", " * "), (" < ", " <= "), (" <= ", " < "),
         (" > ", " >= "), (" >= ", " > "), (" == ", " != "), (" != ", " == "), (" && ", " || "), (" || ", " && "),
         (".max(", ".min("), (".min(", ".max("), (" << ", " >> "), (" + 1", " + 2"), (" - 1", " - 0"),
         ("true", "false"), ("false", "true"), (".div_ceil(", " / ("), ("max(", "min("), ("min(", "max(")]
HOOK = """
/// Whether the mutant of that number is tried; notes in the file LP_MUTANT_COVER which were reached.
#[doc(hidden)]
pub fn mutant(id: u32) -> bool {
    use std::sync::atomic::{AtomicBool, Ordering};
    static CHOSEN: std::sync::LazyLock<u32> =
        std::sync::LazyLock::new(|| std::env::var("LP_MUTANT").map_or(0, |id| id.parse().unwrap_or(0)));
    static SEEN: [AtomicBool; 4096] = [const { AtomicBool::new(false) }; 4096];
    if *CHOSEN == 0 && !SEEN[id as usize].swap(true, Ordering::Relaxed) {
        if let Some(path) = std::env::var_os("LP_MUTANT_COVER") {
            use std::io::Write;
            let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
            let _ = file.and_then(|mut file| file.write_all(format!("{id}\\n").as_bytes()));
        }
    }
    *CHOSEN == id
}
"""


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
            if name == "src/gpu/shaders.rs":
                text = patch_shaders(text.decode()).encode()
            chosen = [s for s in sites if s["file"] == name and s["kind"] == "rust"]
            if chosen:
                lines = text.decode().split("\n")
                for site in chosen:
                    lines[site["line"]] = site["template"].replace("ID", str(site["id"]), 1)
                text = "\n".join(lines).encode()
            if not (TREE / name).exists() or (TREE / name).read_bytes() != text:
                (TREE / name).write_bytes(text)


def patch_shaders(text):
    head = "    pub fn words(&self) -> Vec<u32> {\n"
    assert head in text, "src/gpu/shaders.rs has no `words` any more"
    body = """        let folder = std::env::var_os("LP_MUTANT_SPIRV").map(std::path::PathBuf::from);
        let changed = folder.and_then(|folder| std::fs::read(folder.join(format!("{}.spv", self.stem))).ok());
        let bytes = changed.as_deref().unwrap_or(self.bytes);
        let (words, rest) = bytes.as_chunks::<4>();
"""
    return text.replace(head + "        let (words, rest) = self.bytes.as_chunks::<4>();\n", head + body)


def build(options):
    chance = random.Random(options.seed)
    rust, glsl = list(rust_sites(chance)), list(glsl_sites(chance))
    print(f"{len(rust)} places in Rust, {len(glsl)} in GLSL, seed {options.seed}")
    # Some do not compile, where an operator stands for something else: more are chosen than wanted.
    rust = sorted(chance.sample(rust, min(len(rust), options.rust * 5 // 4)), key=lambda s: (s["file"], s["line"]))
    glsl = chance.sample(glsl, min(len(glsl), options.glsl * 5 // 4))
    for number, site in enumerate(rust + glsl):
        site["id"] = number + 1
    command = ["cargo", "test", "--locked", "--no-run", "--message-format=json", "--lib", "--tests"]
    environment = {**os.environ, "CARGO_TARGET_DIR": str(WORK / "target"), "RUSTFLAGS": "-A warnings"}
    while True:
        instrument(rust)
        check = [*command[:1], "check", "--locked", "--lib", "--message-format=json"]
        wrong = broken(subprocess.run(check, cwd=TREE, env=environment, capture_output=True, text=True), rust)
        if not wrong:
            break
        print(f"{len(wrong)} mutants do not compile")
        rust = [site for site in rust if site["id"] not in wrong]
    rust = sorted(chance.sample(rust, min(len(rust), options.rust)), key=lambda s: s["id"])
    instrument(rust)
    made = subprocess.run(command, cwd=TREE, env=environment, stdout=subprocess.PIPE, text=True)
    if made.returncode:
        sys.exit("the tests do not build")
    messages = [json.loads(line) for line in made.stdout.split("\n") if line.startswith("{")]
    binaries = {m["target"]["name"]: m["executable"] for m in messages if m.get("executable") and m["profile"]["test"]}
    binaries = {name: binaries[name] for name in ORDER if name in binaries}
    SITES.write_text(json.dumps({"sites": rust + glsl, "glsl": options.glsl, "binaries": binaries, "baseline": {}}))
    cover(rust)


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


def test(binary, mutant, timeout, cover=None, spirv=None):
    """Runs a test binary until a test fails. Returns that test's name, "hang", or None; and the seconds."""
    environment = {**os.environ, "RUST_TEST_THREADS": "1", "CARGO_MANIFEST_DIR": str(TREE), "LP_MUTANT": str(mutant)}
    environment |= {"LP_MUTANT_COVER": str(cover)} if cover else {}
    environment |= {"LP_MUTANT_SPIRV": str(spirv)} if spirv else {}
    begun = time.monotonic()
    process = subprocess.Popen([binary], cwd=TREE, env=environment, stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True, start_new_session=True)
    failed, last = None, "the whole binary"
    os.set_blocking(process.stdout.fileno(), False)
    text = ""
    while failed is None:
        chunk = process.stdout.read() or ""
        text += chunk
        if match := re.search(r"^test (\S+).* FAILED", text, re.M):
            failed = match[1]
        elif process.poll() is not None and not chunk:
            names = re.findall(r"^test (\S+)", text, re.M)
            failed = None if process.returncode == 0 else (names or [last])[-1] + " (ended the process)"
            break
        elif time.monotonic() - begun > timeout:
            failed = "hang"
        else:
            time.sleep(0.05)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    return failed, time.monotonic() - begun


def cover(rust):
    """Notes which mutants each binary reaches, and how long it takes without one."""
    known = json.loads(SITES.read_text())
    for name, binary in known["binaries"].items():
        file = WORK / f"{name}.reached"
        file.unlink(missing_ok=True)
        failed, seconds = test(binary, 0, 3600, cover=file)
        reached = sorted({int(line) for line in file.read_text().split()}) if file.exists() else []
        known["baseline"][name] = {"seconds": seconds, "reached": reached, "failed": failed}
        print(f"{name}: {seconds:.0f} s, reaches {len(reached)} of {len(rust)}" + (f", FAILS: {failed}" if failed else ""))
        SITES.write_text(json.dumps(known))


def compile_glsl(site):
    """Compiles the shaders that a mutated line reaches. Returns their folder, or None if it does not compile."""
    folder, sources = WORK / "spirv", WORK / "glsl"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.rmtree(sources, ignore_errors=True)
    shutil.copytree(ROOT / "glsl", sources)
    folder.mkdir()
    changed = sources / Path(site["file"]).relative_to("glsl")
    lines = changed.read_text().split("\n")
    lines[site["line"]] = site["template"]
    changed.write_text("\n".join(lines))
    reached = 0
    for shader in sorted(sources.glob("*.comp")):
        if changed not in includes(shader, sources):
            continue
        command = ["glslc", "--target-env=vulkan1.2", "-O0", "-fshader-stage=compute", str(shader), "-o",
                   str(folder / f"{shader.stem}.spv")]
        if subprocess.run(command, capture_output=True).returncode:
            return None
        reached += 1
    return folder if reached else None


def includes(path, folder):
    found = {path}
    for name in re.findall(r'^#include "(.*)"', path.read_text(), re.M):
        found |= includes(folder / name, folder)
    return found


def run(options):
    known = json.loads(SITES.read_text())
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    stop = time.monotonic() + 60 * options.minutes
    for site in known["sites"]:
        if str(site["id"]) in results:
            continue
        if time.monotonic() > stop:
            break
        if site["kind"] == "glsl" and sum(r["kind"] == "glsl" and r["by"] != "compiler" for r in results.values()) >= known["glsl"]:
            continue
        outcome = {**site, "by": None}
        spirv = compile_glsl(site) if site["kind"] == "glsl" else None
        if site["kind"] == "glsl" and spirv is None:
            outcome["by"] = "compiler"
        else:
            for name, binary in known["binaries"].items():
                base = known["baseline"][name]
                if base["failed"] or (site["kind"] == "rust" and site["id"] not in base["reached"]):
                    continue
                if site["kind"] == "glsl" and name in ("lightpaths", "scene", "cli", "soak", "failures"):
                    continue
                failed, _ = test(binary, site["id"] if site["kind"] == "rust" else 0,
                                 60 + HANGS * base["seconds"], spirv=spirv)
                if failed:
                    outcome["by"] = f"{name}::{failed}"
                    break
        results[str(site["id"])] = outcome
        RESULTS.write_text(json.dumps(results))
        print(f"{site['id']} {site['file']}:{site['line'] + 1}: {outcome['by'] or 'SURVIVED'}", flush=True)


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
    runner.add_argument("--minutes", type=float, default=1e6)
    runner.set_defaults(call=run)
    commands.add_parser("report").set_defaults(call=report)
    options = parser.parse_args()
    options.call(options)


if __name__ == "__main__":
    main()

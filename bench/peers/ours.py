"""Runs lightpaths itself: its renders, its times, its judge."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from peers import PeerError

ROOT = Path(__file__).resolve().parents[2]


class Ours:
    """The program, and the options that go with every call."""

    def __init__(self, binary, threads, size=None, device=None, preset=None):
        built = ROOT / "target" / "release" / "lightpaths"
        found = binary or (built if built.exists() else shutil.which("lightpaths"))
        if not found:
            raise PeerError("lightpaths is not built: `cargo build --release`, or name it with --lightpaths FILE")
        self.binary = str(found)
        # Scenes of the table name models of the built-in ones.
        self.scenes = ["--allow-outside"]
        self.common = ["--device", device] if device else []
        if size:
            self.common += ["--size", "x".join(str(n) for n in size)]
        self.preset = ["--preset", preset] if preset else []
        # Mesa's CPU driver asks this.
        self.settings = os.environ | {"LP_NUM_THREADS": str(threads)}

    def call(self, *arguments):
        words = [self.binary, *(str(word) for word in arguments)]
        done = subprocess.run(words, env=self.settings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise PeerError(f"{' '.join(words)}: {done.stderr.strip() or done.returncode}")
        return done.stdout

    def render(self, scene, out, *arguments):
        self.call("render", scene, "-o", out, *self.scenes, *self.common, *arguments)

    def time(self, scene, frames):
        """The scene's entry in the report of `time`, and the device's name."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "time.json"
            self.call("time", scene, "--frames", frames, "--json", file, *self.scenes, *self.common, *self.preset)
            report = json.loads(file.read_text())
        return report["scenes"][0], report["device"]["name"]

    def compare(self, image, reference, *arguments):
        """Errors by name; None, with a line, where they cannot be had."""
        try:
            return json.loads(self.call("compare", image, reference, "--json", *arguments))
        except (PeerError, ValueError) as problem:
            print(f"peers: not compared: {problem}", file=sys.stderr)
            return None

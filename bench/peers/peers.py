"""Starts the peers in their environments, and finds what they need on this machine."""

import glob
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
NAMES = ("mitsuba", "cycles")
LLVM = (
    "/usr/lib/*/libLLVM*.so*",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
)
"""Where Mitsuba's just-in-time compiler may find LLVM, beside where it looks by itself."""


class PeerError(Exception):
    """A peer could not be run."""


def environment(name):
    """Folder of a peer's Python environment; LIGHTPATHS_PEERS may name another parent."""
    return Path(os.environ.get("LIGHTPATHS_PEERS", HERE)) / f".venv-{name}"


def interpreter(name):
    python = environment(name) / "bin" / "python"
    if not python.exists():
        raise PeerError(f"{name} is not installed: `make peers` does that")
    return python


def cores():
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def mitsuba_variant():
    """The fastest variant that works here, and the settings of the process it needs."""
    tried = [os.environ | {}]
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = sorted({os.path.realpath(file) for pattern in LLVM for file in glob.glob(pattern)}, reverse=True)
        tried += [os.environ | {"DRJIT_LIBLLVM_PATH": file} for file in found]
    for settings in tried:
        # LLVM of a kind that it does not know ends the whole process: hence in one of its own.
        if run([interpreter("mitsuba"), HERE / "mitsuba_peer.py", "--probe", "llvm_ad_rgb"], settings).returncode == 0:
            return "llvm_ad_rgb", settings
    print(
        "peers: no LLVM that Mitsuba can use: scalar_rgb it is, several times slower and without Phong", file=sys.stderr
    )
    return "scalar_rgb", dict(os.environ)


def run(command, settings=None):
    return subprocess.run(
        [str(word) for word in command],
        env=settings,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    )


class Peers:
    """The installed peers; finds Mitsuba's variant once."""

    def __init__(self, threads=None):
        self.threads = threads or cores()
        self.variant = None

    def render(self, name, scene, renders, size=None, flat=False):
        """Results as job.py describes them."""
        settings = dict(os.environ)
        if name == "mitsuba":
            self.variant = self.variant or mitsuba_variant()
            settings = self.variant[1]
        with tempfile.TemporaryDirectory() as folder:
            result, job = Path(folder) / "result.json", Path(folder) / "job.json"
            work = {"scene": str(scene), "size": size, "flat": flat, "threads": self.threads, "result": str(result)}
            work |= {"variant": self.variant[0] if name == "mitsuba" else "", "renders": renders}
            job.write_text(json.dumps(work, default=str))
            done = run([interpreter(name), HERE / f"{name}_peer.py", job], settings)
            if not result.exists():
                # What follows in Mitsuba's case are complaints about the sudden end.
                words = (done.stdout + done.stderr).partition("jit_shutdown")[0]
                tail = "\n".join(words.splitlines()[-15:])
                raise PeerError(f"{name} ended with {done.returncode}:\n{tail}")
            return json.loads(result.read_text())

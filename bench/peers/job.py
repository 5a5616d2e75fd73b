"""What run.py asks of a peer and what it gets back, as JSON files: the peers live in environments of their own.

    {"scene": FILE, "size": [w, h] or null, "flat": bool, "variant": NAME, "threads": N, "result": FILE,
     "renders": [{"spp": N, "seed": N, "variance": bool, "denoise": bool, "depth": N, "out": FILE.exr}]}

`depth` bounds the vertices of paths, light included, for Mitsuba; -1 (the default): no bound.

The result repeats each render with `seconds` and `renderer`, or holds {"refused": REASON}.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import exr
import scene as scenes


@dataclass
class Job:
    scene: scenes.Scene
    variant: str
    threads: int
    renders: list
    result: Path

    def finish(self, results):
        self.result.write_text(json.dumps(results))

    def refuse(self, reason):
        self.result.write_text(json.dumps({"refused": reason}))


def load(path):
    raw = json.loads(Path(path).read_text())
    scene = scenes.load(raw["scene"], raw["size"], raw["flat"])
    renders = [{"variance": False, "denoise": False, "seed": 1, "depth": -1} | request for request in raw["renders"]]
    return Job(scene, raw["variant"], raw["threads"], renders, Path(raw["result"]))


def write_picture(path, size, planes):
    """`planes` maps channel names to numpy arrays."""
    exr.write(path, size, {name: plane.astype("<f4").tobytes() for name, plane in planes.items()})

"""Pictures a minute of a scene whose light moves, at equal error: lightpaths in Python beside Mitsuba.

relight.py [SCENE] [options]    in Mitsuba's environment; --help lists the options

Both render into numpy arrays, one after another on the same cores, in rounds. Errors are relMSE against two independent
halves of a reference by Mitsuba, without their noise (see truth.py). Mitsuba's error is one over its samples: that law,
measured at the largest number of samples, gives the samples and the seconds that it needs for the error of ours. The
products of error and samples at all numbers stand below, so that a law that fails shows. Models lose their normals,
because the renderers interpolate them differently (see flat.py).
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import flat
import numpy as np
from peers import PeerError, cores, interpreter, mitsuba_variant
from scene import SceneError, load

HERE = Path(__file__).resolve().parent
PYTHON = HERE.parents[1] / "out" / "python-venv" / "bin" / "python"
REFERENCE_SEEDS = 1000, 1001
PASS = 64
"""Samples per pixel of a pass of the reference."""


def pixels(text):
    width, height = text.split("x")
    return [int(width), int(height)]


def numbers(text):
    return sorted(int(word) for word in text.split(","))


def arguments(words):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="box")
    parser.add_argument("--size", type=pixels, default=[256, 256], metavar="WxH", help="[256x256]")
    parser.add_argument("--preset", default="paper", help="of ours [paper]")
    parser.add_argument("--count", type=int, default=1000, help="pictures of ours [1000]")
    parser.add_argument("--spp", type=numbers, default=[64, 256], help="of Mitsuba; the largest is timed [64,256]")
    parser.add_argument("--mitsuba-count", type=int, default=10, help="pictures of Mitsuba [10]")
    parser.add_argument("--rounds", type=int, default=5, help="turns of each [5]")
    parser.add_argument("--judged", type=int, default=3, help="conditions with a reference [3]")
    parser.add_argument("--reference-spp", type=int, default=2048, help="of both halves together [2048]")
    parser.add_argument("--radius", type=float, default=0.4, help="of the light's circle, metres [0.4]")
    parser.add_argument("--python", type=Path, default=PYTHON, help="that has lightpaths [that of make python]")
    parser.add_argument("--threads", type=int, default=cores(), help="cores for both [all]")
    return parser.parse_args(words)


def conditions(middle, radius, count):
    """Positions of the light, all different, on a disc around its place."""
    for number in range(count):
        turn, reach = 2.0 * math.pi * number * 0.6180339887498949, radius * math.sqrt((number + 0.5) / count)
        yield [middle[0] + reach * math.cos(turn), middle[1], middle[2] + reach * math.sin(turn)]


class Worker:
    """A renderer in a process of its own, which answers each line with a line."""

    def __init__(self, name, python, settings, setup):
        command = [str(python), str(HERE / "relight.py"), "--worker", name]
        self.name = name
        self.process = subprocess.Popen(command, env=settings, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.about = self.ask(setup)

    def ask(self, question):
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise PeerError(f"{self.name} ended with {self.process.wait()}")
        return json.loads(line)

    def picture(self, folder, position, **more):
        file = folder / "picture.npy"
        self.ask({"position": position, "out": str(file), **more})
        return np.load(file).astype(np.float64)

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def serve(render):
    """Answers the questions of a Worker; `render` returns a picture for one."""
    for line in sys.stdin:
        question = json.loads(line)
        start = time.perf_counter()
        image = render(question)
        seconds = time.perf_counter() - start
        if question.get("out"):
            np.save(question["out"], image)
        print(json.dumps({"seconds": seconds}), flush=True)
    # Mitsuba complains about what is still in use when Python ends.
    os._exit(0)


def work_ours(setup):
    import lightpaths

    scene = lightpaths.Scene(setup["scene"], preset=setup["preset"], size=setup["size"], allow_outside=True)
    renderer = lightpaths.Renderer(scene)
    light = next(light for light in renderer.lights.values() if light.kind == "point")
    print(json.dumps({"name": f"lightpaths {lightpaths.__version__} ({renderer.device})"}), flush=True)

    def render(question):
        light.position = question["position"]
        return renderer.render()

    serve(render)


def work_mitsuba(setup):
    import drjit as dr
    import mitsuba as mi
    import mitsuba_peer

    mi.set_variant(setup["variant"])
    if setup["variant"].startswith("llvm"):
        dr.set_thread_count(setup["threads"])
    built = mitsuba_peer.build(load(setup["scene"], setup["size"]))
    fields = mi.traverse(built)
    (key,) = (key for key in fields.keys() if key.startswith("light") and key.endswith("position"))
    each = max(1, mitsuba_peer.SAMPLES_PER_PASS // math.prod(setup["size"]))
    print(json.dumps({"name": f"Mitsuba {mi.__version__} ({setup['variant']})"}), flush=True)

    def render(question):
        fields[key] = question["position"]
        fields.update()
        passes = math.ceil(question["spp"] / each)
        spp = math.ceil(question["spp"] / passes)
        total = 0.0
        for number in range(passes):
            total = total + np.array(mi.render(built, spp=spp, seed=(question["seed"] << 8) + number))
        return total / passes

    serve(render)


def reference(mitsuba, folder, position, spp, seed):
    """A half of the reference."""
    passes = max(1, spp // (2 * PASS))
    images = (mitsuba.picture(folder, position, spp=PASS, seed=(seed << 8) + number) for number in range(passes))
    return sum(images) / passes


def error(image, halves):
    """relMSE without the noise of the reference."""
    a, b = halves
    return float(np.mean((image - a) * (image - b) / (0.5 * (a + b) + 0.01) ** 2))


def judge(worker, folder, judged, **more):
    found = [error(worker.picture(folder, place, seed=7 + n, **more), halves) for n, (place, halves) in enumerate(judged)]
    return sum(found) / len(found)


def main(words):
    args = arguments(words)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: args.threads])
    variant, settings = mitsuba_variant()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = flat.write(args.scene, folder)
        lights = load(scene).lights
        if [light["kind"] for light in lights] != ["point"]:
            raise SceneError(f"{args.scene}: one point light expected, which moves")
        places = list(conditions(lights[0]["position"], args.radius, args.count))
        setup = {"scene": str(scene), "size": args.size, "preset": args.preset, "threads": args.threads}
        ours = Worker("ours", args.python, os.environ | {"LP_NUM_THREADS": str(args.threads)}, setup)
        mitsuba = Worker("mitsuba", interpreter("mitsuba"), settings, setup | {"variant": variant})
        chosen = places[:: math.ceil(len(places) / args.judged)]
        print(f"relight: references of {len(chosen)} conditions, {args.reference_spp} spp each", file=sys.stderr)
        judged = [
            (place, [reference(mitsuba, folder, place, args.reference_spp, seed) for seed in REFERENCE_SEEDS])
            for place in chosen
        ]
        our_error = judge(ours, folder, judged)
        errors = {spp: judge(mitsuba, folder, judged, spp=spp) for spp in args.spp}
        timed = args.spp[-1]
        seconds = {"ours": [], "mitsuba": []}
        for turn in range(args.rounds):
            print(f"relight: round {turn + 1} of {args.rounds}, Mitsuba at {timed} spp", file=sys.stderr)
            for place in places[turn :: args.rounds]:
                seconds["ours"].append(ours.ask({"position": place})["seconds"])
            for number in range(turn, args.mitsuba_count, args.rounds):
                question = {"position": places[number * len(places) // args.mitsuba_count], "spp": timed, "seed": number}
                seconds["mitsuba"].append(mitsuba.ask(question)["seconds"])
        ours.end()
        mitsuba.end()
    needed = timed * errors[timed] / our_error
    of_ours, of_mitsuba = (sum(seconds[key]) / len(seconds[key]) for key in ("ours", "mitsuba"))
    rows = [
        (ours, args.preset, our_error, len(seconds["ours"]), of_ours),
        (mitsuba, f"{timed} spp", errors[timed], len(seconds["mitsuba"]), of_mitsuba),
        (mitsuba, f"{needed:.0f} spp, by the law", our_error, "none", of_mitsuba * needed / timed),
    ]
    print(f"{args.scene}, {args.size[0]}x{args.size[1]} pixels, {args.threads} cores, a light that moves\n")
    print("| renderer | setting | relMSE | pictures | seconds a picture | pictures a minute |")
    print("|---|---|---|---|---|---|")
    for renderer, setting, found, count, each in rows:
        print(f"| {renderer.about['name']} | {setting} | {found:.2e} | {count} | {each:.3f} | {60.0 / each:.2f} |")
    products = ", ".join(f"{spp * found:.3f} at {spp} spp" for spp, found in errors.items())
    print(f"\nError times samples of Mitsuba: {products}. References: {len(judged)} × {args.reference_spp} spp.")


def worker(name):
    setup = json.loads(sys.stdin.readline())
    {"ours": work_ours, "mitsuba": work_mitsuba}[name](setup)


if __name__ == "__main__":
    try:
        worker(sys.argv[2]) if sys.argv[1:2] == ["--worker"] else main(sys.argv[1:])
    except (PeerError, SceneError, OSError) as problem:
        sys.exit(f"relight: {problem}")

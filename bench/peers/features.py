"""Emitting surfaces, skies, holes and panes: our frames and our path tracer against Mitsuba's."""

import argparse
import itertools
import json
import math
import sys
from pathlib import Path

import exr
import flat
import truth
from ours import Ours
from peers import HERE, PeerError, Peers

sys.path.insert(0, str(HERE / "scenes"))

import generate  # noqa: E402

NAMES = "quad", "ball", "sky", "sun", "leaves", "panes", "quad-gloss", "sun-gloss"
SCENES = ["box"] + [HERE / "scenes" / f"{name}.toml" for name in NAMES]
"""The point light of the Box sets the bar."""
SEEDS = 1000, 1001
"""Of the reference's halves."""
VISIBLE = {"spp": 64, "seed": 1002, "depth": 1}
"""A picture of emitters and sky alone. Pixels that show them count for no energy: they are bright and exact."""
ENERGY = 5e-3
"""Bar for the energy ratio's distance from 1."""
WORSE = 2.0
"""Bar for the relMSE of `paper`, over that of the Box."""


def arguments(words, options):
    parser = argparse.ArgumentParser(prog="run.py features", description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES, help="[the Box, then the scenes of bench/peers/scenes]")
    parser.add_argument("--spp", type=int, default=2048, help="of each half of Mitsuba's reference [2048]")
    parser.add_argument("--our-spp", type=int, default=512, help="of our path tracer [512]")
    parser.add_argument("--keep", action="store_true", help="do not render again what an earlier run has rendered")
    options(parser)
    args = parser.parse_args(words)
    args.size = args.size or [160, 120]
    return args


def main(words, options):
    args = arguments(words, options)
    generate.main()
    # Without the Box there is no bar for the relMSE.
    peers, bar, results = Peers(args.threads), math.inf, {}
    ours = Ours(args.lightpaths, args.threads, args.size, args.device)
    print("| scene | ours | energy | R | G | B | relMSE | noise of Mitsuba | noise of its energy | |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|---|")
    for spec in args.scenes:
        folder = args.output / "features"
        # The Box has smooth normals, whose use differs.
        scene = flat.write(spec, folder) if spec == "box" else Path(spec).resolve()
        halves = [(folder / f"{scene.stem}-mitsuba-{half}.exr").resolve() for half in "ab"]
        emitters = halves[0].with_name(f"{scene.stem}-emitters.exr")
        renders = [{"spp": args.spp, "seed": seed, "out": str(file)} for seed, file in zip(SEEDS, halves)]
        renders.append(VISIBLE | {"out": str(emitters)})
        renders = [render for render in renders if not (args.keep and Path(render["out"]).exists())]
        if renders:
            answer = peers.render("mitsuba", scene, renders, args.size)
            if isinstance(answer, dict):
                raise PeerError(answer["refused"])
        standard = truth.of_halves(halves, "Mitsuba", ours, folder / f"{scene.stem}-mitsuba.exr")
        for name, settings in methods(args.our_spp):
            image = folder / f"{scene.stem}-{name.replace(' ', '-')}.exr"
            if not (args.keep and image.exists()):
                ours.render(scene, image, *settings, "--aov", "direct,indirect")
            row = judge(image, standard, halves, emitters, ours)
            if spec == "box" and name == "paper":
                bar = WORSE * row["relmse"]
            row["missed"] = missed(row, bar if name == "paper" else math.inf)
            results[f"{scene.stem}, {name}"] = row
            print(line(scene.stem, name, row), flush=True)
    (args.output / "features" / "features.json").write_text(json.dumps(results, indent=1) + "\n")
    return 0


def methods(samples):
    """Names and options of what is compared."""
    yield f"path {samples}", ("--method", "path", "--spp", samples)
    yield "draft", ("--preset", "draft")
    yield "paper", ("--preset", "paper")


def judge(image, standard, halves, emitters, ours):
    """Energy ratios and relMSE of a picture, and the noise of the reference in both."""
    found = standard.errors(ours.compare(image, standard.file))
    if found is None:
        raise PeerError(f"{image} cannot be compared")
    visible = exr.read(emitters)[1]
    is_counted = [max(rgb) == 0.0 for rgb in zip(*(visible[name] for name in "RGB"))]
    mine, theirs, *both = (sums(file, is_counted) for file in (image, standard.file, *halves))
    scatter = abs(sum(both[0]) - sum(both[1])) / 2.0 / sum(theirs)
    return {
        "energy": sum(mine) / sum(theirs),
        "channels": [a / b for a, b in zip(mine, theirs)],
        "relmse": found["relmse_debiased"],
        "noise": standard.noise,
        "energy_noise": scatter,
    }


def sums(file, is_counted):
    """Sum of each channel over the pixels that count."""
    _, planes = exr.read(file)
    return [math.fsum(itertools.compress(planes[name], is_counted)) for name in "RGB"]


def missed(row, bar):
    """Names of the bars that a row misses."""
    off = max(abs(ratio - 1.0) for ratio in [row["energy"], *row["channels"]])
    return [name for name, is_missed in (("energy", off > ENERGY), ("relMSE", row["relmse"] > bar)) if is_missed]


def line(scene, name, row):
    ratios = [f"{ratio:.4f}" for ratio in [row["energy"], *row["channels"]]]
    errors = [f"{row[key]:.1e}" for key in ("relmse", "noise", "energy_noise")]
    return "| " + " | ".join([scene, name, *ratios, *errors, " ".join(row["missed"])]) + " |"

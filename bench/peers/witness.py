"""Our path tracer against Mitsuba's: energy, and every pixel in units of both renderers' own noise."""

import argparse
import json
from pathlib import Path

import flat
import scene as scenes
from ours import Ours
from peers import HERE, PeerError, Peers

SCENES = ["box", HERE / "scenes" / "box-spot.toml", HERE / "scenes" / "box-area.toml"]
ENERGY = 2e-3
"""Bar for the energy ratio's distance from 1."""
MEAN, RMS, BEYOND = 0.05, 1.05, 6e-3
"""Bars for the z-scores: their mean's distance from 0, their root mean square, the share beyond ±3.

Were both pictures right and their noise normal: 0, 1 and 2.7e-3. At a thousand samples it is not quite normal.
"""


def arguments(words, options):
    parser = argparse.ArgumentParser(prog="run.py witness", description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES, help="[the Box under a point, a spot and an area light]")
    parser.add_argument("--spp", type=int, default=1024, help="of both [1024]")
    parser.add_argument("--seed", type=int, default=1, help="Mitsuba's")
    parser.add_argument(
        "--smooth", action="store_true", help="with the models' normals, whose use differs: see README.md"
    )
    parser.add_argument("--mitsuba-only", action="store_true", help="only write Mitsuba's pictures")
    options(parser)
    return parser.parse_args(words)


def main(words, options):
    args = arguments(words, options)
    peers, results = Peers(args.threads), []
    for spec in args.scenes:
        folder = args.output / "witness"
        scene = scenes.find(spec) if args.smooth else flat.write(spec, folder)
        theirs, mine = ((folder / f"{scene.stem}-{who}.exr").resolve() for who in ("mitsuba", "lightpaths"))
        render = {"spp": args.spp, "seed": args.seed, "variance": True, "out": str(theirs)}
        answer = peers.render("mitsuba", scene, [render], args.size)
        if isinstance(answer, dict):
            raise PeerError(answer["refused"])
        print(
            f"{scene.stem}: {theirs.name}: {answer[0]['renderer']}, {args.spp} spp, {answer[0]['seconds']:.1f} s",
            flush=True,
        )
        if not args.mitsuba_only:
            results.append(judge(args, scene, mine, theirs))
    return 0 if all(results) else 1


def judge(args, scene, mine, theirs):
    """Renders ours, compares; whether it passes."""
    ours = Ours(args.lightpaths, args.threads, args.size, args.device)
    ours.render(scene, mine, "--method", "path", "--spp", args.spp, "--aov", "variance")
    found = ours.compare(mine, theirs, "--z-test")
    if found is None:
        raise PeerError("this lightpaths has no `compare --z-test`")
    Path(mine).with_suffix(".json").write_text(json.dumps(found, indent=1) + "\n")
    passed = abs(found["energy_ratio"] - 1.0) <= ENERGY and abs(found["z_mean"]) <= MEAN
    passed = passed and found["z_rms"] <= RMS and found["z_share_above_3"] <= BEYOND
    print(f"{scene.stem}: {'passed' if passed else 'MISSED'}: {json.dumps(found)}", flush=True)
    return passed

#!/usr/bin/env python3
"""Renders a scene under many lighting conditions, and prints pictures a minute.

    python examples/relight.py [SCENE] [--count N] [--size WxH] [--preset NAME]

Each picture is a numpy array. The first light moves on a circle around its place; its power and its
colour change with it.
"""

import argparse
import math
import time

import numpy as np

import lightpaths


def conditions(count, middle, radius):
    """Position, brightness and red-to-blue ratio of each lighting condition."""
    for number in range(count):
        # Irrational steps: no two conditions are the same.
        turn = 2.0 * math.pi * number * 0.6180339887498949
        reach = radius * math.sqrt((number + 0.5) / count)
        position = (middle[0] + reach * math.cos(turn), middle[1], middle[2] + reach * math.sin(turn))
        yield position, 0.5 + number / count, 0.6 + 0.8 * (number * 0.7548776662466927 % 1.0)


def size(text):
    width, height = text.split("x")
    return int(width), int(height)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="box")
    parser.add_argument("--count", type=int, default=1000, help="pictures [1000]")
    parser.add_argument("--size", type=size, default=(256, 256), metavar="WxH", help="[256x256]")
    parser.add_argument("--preset", default="paper", help="draft, paper or high [paper]")
    parser.add_argument("--radius", type=float, default=0.5, help="of the circle, metres [0.5]")
    parser.add_argument("--device", help="as `lightpaths info` lists them")
    args = parser.parse_args()

    scene = lightpaths.Scene(args.scene, preset=args.preset, size=args.size)
    renderer = lightpaths.Renderer(scene, device=args.device)
    light = next(light for light in renderer.lights.values() if light.kind in ("point", "spot", "area"))
    middle, emission = light.position, np.array(light.emission)
    # The first frame compiles what only frames use.
    renderer.render()

    start = time.perf_counter()
    total = 0.0
    for position, brightness, warmth in conditions(args.count, middle, args.radius):
        light.position = position
        light.emission = emission * brightness * [warmth, 1.0, 2.0 - warmth]
        image = renderer.render()
        total += float(image.mean())
    seconds = time.perf_counter() - start
    print(
        f"{args.count} pictures of {args.size[0]}×{args.size[1]} pixels, preset {args.preset}, {renderer.device}: "
        f"{seconds:.1f} s, {60.0 * args.count / seconds:.0f} pictures a minute; "
        f"precomputed in {renderer.precompute_s:.1f} s; mean radiance {total / args.count:.4f} W/m²/sr"
    )


if __name__ == "__main__":
    main()

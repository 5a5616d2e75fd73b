"""Holds each peer against closed forms: units, cones, orientation, bounces. Exit 1 where one misses.

python3 bench/peers/selftest.py [mitsuba] [cycles]
"""

import sys
import tempfile
from pathlib import Path

import closed_forms
import exr
from peers import NAMES, PeerError, Peers

MEAN = 1e-3
"""Bar for the mean of each channel, relative."""
BLOCK = 1e-2
"""Bar for the mean of each of 4×4 blocks, in units of the picture's mean: a mirrored or shifted picture fails."""


def average(files):
    """Size and mean planes of pictures."""
    pictures = [exr.read(file) for file in files]
    size = pictures[0][0]
    return size, {
        name: [sum(values) / len(files) for values in zip(*(planes[name] for _, planes in pictures))] for name in "RGB"
    }


def errors(case, files):
    """Largest relative error of a channel's mean, and of a block."""
    (width, height), planes = average(files)
    expected = case.picture()
    means, blocks = [], []
    for channel, name in enumerate("RGB"):
        pairs = [(planes[name][k], expected[k][channel]) for k in range(width * height)]
        scale = sum(e for _, e in pairs) / len(pairs) or 1.0
        means.append(abs(sum(v - e for v, e in pairs)) / len(pairs) / scale)
        side = width // 4
        for corner in range(16):
            rows = range(corner // 4 * side, corner // 4 * side + side)
            columns = range(corner % 4 * side, corner % 4 * side + side)
            inside = [pairs[y * width + x] for y in rows for x in columns]
            blocks.append(abs(sum(v - e for v, e in inside)) / len(inside) / scale)
    return max(means), max(blocks)


def main(names):
    peers, failed = Peers(), 0
    print(f"{'peer':9}{'closed form':22}{'mean':>10}{'block':>10}")
    for name in names or NAMES:
        for case in closed_forms.CASES:
            if name not in case.peers:
                continue
            with tempfile.TemporaryDirectory() as folder:
                files = [Path(folder) / f"{seed}.exr" for seed in range(case.repeats)]
                renders = [{"spp": case.samples, "seed": seed, "out": file} for seed, file in enumerate(files)]
                answer = peers.render(name, case.write(folder), renders, [closed_forms.SIZE] * 2)
                if isinstance(answer, dict):
                    raise PeerError(f"{name}, {case.name}: {answer['refused']}")
                mean, block = errors(case, files)
            good = mean <= MEAN and block <= BLOCK
            failed += not good
            print(f"{name:9}{case.name:22}{mean:10.2e}{block:10.2e}{'' if good else '  MISSED'}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except PeerError as problem:
        sys.exit(f"peers: {problem}")

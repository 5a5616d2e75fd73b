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


def errors(case, file):
    """Largest relative error of a channel's mean, and of a block."""
    (width, height), planes = exr.read(file)
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
                out = Path(folder) / "out.exr"
                size = [closed_forms.SIZE] * 2
                answer = peers.render(name, case.write(folder), [{"spp": case.samples, "out": out}], size)
                if isinstance(answer, dict):
                    raise PeerError(f"{name}, {case.name}: {answer['refused']}")
                mean, block = errors(case, out)
            good = mean <= MEAN and block <= BLOCK
            failed += not good
            print(f"{name:9}{case.name:22}{mean:10.2e}{block:10.2e}{'' if good else '  MISSED'}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except PeerError as problem:
        sys.exit(f"peers: {problem}")

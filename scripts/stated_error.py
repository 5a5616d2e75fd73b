#!/usr/bin/env python3
"""Compares stated errors of pictures with true ones: prints a table, draws a plot of blocks.

For each scene, three EXR files of one size:
  lightpaths render SCENE --aov error -o NAME.exr
  lightpaths render SCENE --method path --spp 256 --set quality.seed=101 -o NAME-1.exr
  lightpaths render SCENE --method path --spp 256 --set quality.seed=102 -o NAME-2.exr

Then: scripts/stated_error.py -o PLOT.svg NAME.exr...
It needs the Python packages numpy, OpenEXR and matplotlib."""

import argparse
import io
import pathlib

import matplotlib
import numpy as np
import OpenEXR

BLOCK = 32  # pixels
FACTOR = 1.5  # that stated and true error may differ by


def layers(path):
    with OpenEXR.File(str(path)) as file:
        return {name: channel.pixels.astype(float) for name, channel in file.channels().items()}


def block_means(values):
    """Means over blocks; those at the right and lower border may be smaller."""
    rows = range(0, values.shape[0], BLOCK)
    columns = range(0, values.shape[1], BLOCK)
    return np.array([values[y : y + BLOCK, x : x + BLOCK].mean() for y in rows for x in columns])


def true_error(picture, first, second):
    """Squared relative error of each pixel. The noise of two references is independent, so that it
    cancels in the product; relative to the picture, as the program states it."""
    scale = np.maximum(picture, 0.125 * (first + second)) + 0.01
    return ((picture - first) * (picture - second) / scale**2).mean(axis=2)


def compared(path):
    picture = layers(path)
    references = [layers(path.with_name(f"{path.stem}-{half}.exr"))["RGB"] for half in (1, 2)]
    stated = picture["error.Y"]
    true = block_means(true_error(picture["RGB"], *references))
    return np.sqrt(block_means(stated**2)), np.sqrt(np.maximum(true, 0.0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", required=True, metavar="PLOT.svg", dest="plot")
    parser.add_argument("pictures", nargs="+", type=pathlib.Path, metavar="NAME.exr")
    arguments = parser.parse_args()
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "lightpaths", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(5.2, 4.6))
    low, high = 3e-3, 1.0
    ends = np.array([low, high])
    axes.fill_between(ends, ends / FACTOR, ends * FACTOR, color="0.9", label=f"within a factor of {FACTOR}")
    for path in arguments.pictures:
        stated, true = compared(path)
        known = true > 0.0
        ratio = stated[known] / true[known]
        fraction = ((ratio > 1 / FACTOR) & (ratio < FACTOR)).mean()
        print(f"{path.stem}: {fraction:.0%} of {known.sum()} blocks")
        axes.plot(true[known], stated[known], ".", markersize=4, label=f"{path.stem} ({fraction:.0%})")
    axes.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high))
    axes.set_xlabel(f"true relative error of a block of {BLOCK}×{BLOCK} pixels")
    axes.set_ylabel("stated")
    axes.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    drawn = io.StringIO()
    figure.savefig(drawn, format="svg", metadata={"Date": None})
    lines = [line.rstrip() for line in drawn.getvalue().splitlines()]
    pathlib.Path(arguments.plot).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

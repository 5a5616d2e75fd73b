"""What every picture is held against: two halves of one reference, so that its own noise can be taken out.

With r = (a + b)/2 the mean of (v - a)(v - b)/(r + 0.01)² is free of the noise of a and b, and (v - a)(v - b) is
(v - r)² - ((a - b)/2)²: the relMSE against r, less that of a (or b) against r.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import exr
from peers import PeerError


@dataclass
class Truth:
    """`file` is compared with; `noise` is its relMSE, None where nobody knows; `scatter` is what is left of it."""

    file: Path
    name: str
    noise: float | None = None
    scatter: float = 0.0

    def errors(self, found):
        """Errors as `compare` found them, and the relMSE without the reference's noise where that is known."""
        if found is None or self.noise is None:
            return found
        return found | {"relmse_debiased": found["relmse"] - self.noise}

    def facts(self):
        return {"reference": self.name, "reference_noise": self.noise, "reference_scatter": self.scatter}


def of_halves(files, name, ours, out):
    """A truth whose noise is known. Writes the mean of both pictures to `out`."""
    values = write_mean(files, out)
    # The mean's distance from either half is the same: half their difference.
    found = ours.compare(files[0], out)
    if found is None:
        raise PeerError(f"the halves {files[0]} and {files[1]} cannot be compared")
    noise = found["relmse"]
    return Truth(out, name, noise, noise * math.sqrt(2.0 / values))


def write_mean(files, out):
    """Writes the mean of two pictures' R, G and B; returns how many values it has."""
    try:
        (size, a), (other, b) = (exr.read(file) for file in files)
    except (ValueError, KeyError) as problem:
        raise PeerError(f"a half of the reference: {problem}") from problem
    if size != other:
        raise PeerError(f"{files[0]} has {size[0]}×{size[1]} pixels, {files[1]} has {other[0]}×{other[1]}")
    for file, planes in zip(files, (a, b)):
        for name in "RGB":
            if name not in planes:
                raise PeerError(f"{file} has no channel {name}")
    exr.write(out, size, {name: [0.5 * (x + y) for x, y in zip(a[name], b[name])] for name in "RGB"})
    return 3 * size[0] * size[1]

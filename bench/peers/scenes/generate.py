"""Writes what the scenes of this folder need beside their text: a ball lamp, a leaf and a panorama."""

import math
import struct
import sys
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import closed_forms  # noqa: E402
import exr  # noqa: E402
import scene as scenes  # noqa: E402

LEAF = 32
"""Texels of the leaf's image along each side."""
PANORAMA = 256, 128
"""Texels of the panorama. The program samples as many cells of a sky."""
SUN = math.radians(140.0), math.radians(32.0)
"""Azimuth from -Z towards +X, and elevation."""
SUN_RADIUS = math.radians(2.5)


def ball(file):
    points, faces = closed_forms.icosphere(3)
    # Fronts outwards: the emitting side.
    faces = [face if is_outwards(*(points[k] for k in face)) else face[::-1] for face in faces]
    lines = ["usemtl ball"] + [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in points]
    file.write_text("\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]) + "\n")


def is_outwards(a, b, c):
    return scenes.dot(scenes.cross(scenes.sub(b, a), scenes.sub(c, a)), a) > 0.0


def leaf(file):
    """Two leaves of different sizes, so that no turn or mirror image looks alike; alpha 255 or 0."""

    def is_leaf(x, y):
        for cx, cy, length, turn in ((0.4, 0.55, 0.42, 0.6), (0.8, 0.2, 0.24, -0.9)):
            u = (x - cx) * math.cos(turn) + (y - cy) * math.sin(turn)
            v = (y - cy) * math.cos(turn) - (x - cx) * math.sin(turn)
            if abs(u) < length and abs(v) < 0.5 * length * (1.0 - (u / length) ** 2):
                return True
        return False

    row = [(k + 0.5) / LEAF for k in range(LEAF)]
    write_png(file, [[255 if is_leaf(x, y) else 0 for x in row] for y in row])


def write_png(file, alpha):
    """An image of grey and alpha with 8 bits a channel."""
    rows = b"".join(b"\0" + b"".join(bytes((128, value)) for value in row) for row in alpha)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">2I5B", len(alpha[0]), len(alpha), 8, 4, 0, 0, 0)
    file.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )


def panorama(file):
    """A blue gradient above brown ground, and a sun of some texels."""
    (width, height), planes = PANORAMA, {name: [] for name in "RGB"}
    sun = towards(*SUN)
    for y in range(height):
        for x in range(width):
            azimuth, elevation = math.tau * (x + 0.5) / width - math.pi, math.pi * (0.5 - (y + 0.5) / height)
            here = towards(azimuth, elevation)
            up = max(here[1], 0.0)
            colour = (0.9 - 0.6 * up, 1.0 - 0.4 * up, 1.1) if here[1] > 0.0 else (0.3, 0.25, 0.2)
            if math.acos(min(1.0, sum(a * b for a, b in zip(here, sun)))) < SUN_RADIUS:
                colour = (1500.0, 1300.0, 1000.0)
            for name, value in zip("RGB", colour):
                planes[name].append(value)
    exr.write(file, PANORAMA, planes)


def towards(azimuth, elevation):
    return (
        math.sin(azimuth) * math.cos(elevation),
        math.sin(elevation),
        -math.cos(azimuth) * math.cos(elevation),
    )


def main():
    """Writes the files that are missing."""
    for name, write in (("ball.obj", ball), ("leaf.png", leaf), ("panorama.exr", panorama)):
        if not (HERE / name).exists():
            write(HERE / name)


if __name__ == "__main__":
    main()

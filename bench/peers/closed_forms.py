"""Scenes whose picture is known: a floor under one light of each kind, and a closed sphere."""

import math
from dataclasses import dataclass
from pathlib import Path

import scene as scenes

SIZE = 16
"""Pixels along either side."""
GRID = 8
"""Points along either side of a pixel, over which the known picture is averaged."""
CAMERA = {"position": (0.3, 3.0, 0.2), "target": (0.3, 0.0, 0.2), "up": (0.0, 0.0, -1.0), "fov_y": 40.0}
ALBEDO = (0.5, 0.6, 0.7)
PHONG = {"diffuse": (0.3, 0.2, 0.1), "specular": (0.3, 0.5, 0.6), "exponent": 20.0}


@dataclass
class Case:
    name: str
    light: dict
    irradiance: object
    """Function of a floor point: irradiance there, W/m²; or radiance, where `material` is glossy."""
    peers: tuple = ("mitsuba", "cycles")
    material: dict | None = None
    samples: int = 256
    repeats: int = 1
    """Pictures that are averaged: Cycles sums in f32, which shows at 30 000 samples."""

    def write(self, folder):
        """Its scene file."""
        file = Path(folder) / f"{self.name}.toml"
        (Path(folder) / "floor.obj").write_text(
            "usemtl floor\nv -20 0 20\nv 20 0 20\nv 20 0 -20\nv -20 0 -20\nf 1 2 3 4\n"
        )
        material = self.material or {"diffuse": ALBEDO}
        file.write_text(toml("floor.obj", CAMERA, self.light, material | {"name": "floor"}))
        return file

    def picture(self):
        """Mean radiance of each pixel, row-major from the top left."""
        camera = scenes.Camera(**CAMERA)
        right, up, forward = camera.frame()
        half = math.tan(math.radians(camera.fov_y) / 2.0)
        count = SIZE * GRID
        rows = [[None] * count for _ in range(count)]
        for j in range(count):
            for i in range(count):
                x, y = half * (2.0 * (i + 0.5) / count - 1.0), half * (1.0 - 2.0 * (j + 0.5) / count)
                ray = [f + x * r + y * u for f, r, u in zip(forward, right, up)]
                t = -camera.position[1] / ray[1]
                rows[j][i] = self.radiance(tuple(p + t * d for p, d in zip(camera.position, ray)))
        boxes = [(GRID * (k // SIZE), GRID * (k % SIZE)) for k in range(SIZE * SIZE)]
        return [
            tuple(
                sum(rows[j + dj][i + di][channel] for dj in range(GRID) for di in range(GRID)) / GRID**2
                for channel in range(3)
            )
            for j, i in boxes
        ]

    def radiance(self, point):
        value = self.irradiance(point)
        return value if self.material else tuple(a * e / math.pi for a, e in zip(ALBEDO, value))


def toml(model, camera, light, material):
    """A scene file's text."""
    lines = ["[[model]]", f'file = "{model}"']
    for head, table in (("[camera]", camera), ("[[light]]", light), ("[[material]]", material)):
        lines.append(head)
        for key, value in table.items():
            value = f'"{value}"' if isinstance(value, str) else str(list(value) if isinstance(value, tuple) else value)
            lines.append(f"{key} = {value}")
    return "\n".join(lines) + "\n"


def point_irradiance(light, point):
    """I·cosθ/d², within the cone of a spot."""
    to_light = scenes.sub(light["position"], point)
    distance2 = scenes.dot(to_light, to_light)
    share = 1.0
    if light["kind"] == "spot":
        cosine = -scenes.dot(scenes.unit(light["direction"]), to_light) / math.sqrt(distance2)
        angle, outer = math.acos(min(1.0, cosine)), math.radians(light["angle"])
        inner = outer * (1.0 - light["penumbra"])
        share = 1.0 if angle <= inner else max(0.0, (outer - angle) / (outer - inner) if outer > inner else 0.0)
    return tuple(i * share * to_light[1] / distance2**1.5 for i in light["intensity"])


def polygon_irradiance(light, point):
    """Lambert's formula for a parallelogram above the floor that faces it."""
    u, v = light["edge_u"], light["edge_v"]
    first = scenes.sub(light["corner"], point)
    corners = [scenes.unit(p) for p in (first, add(first, u), add(add(first, u), v), add(first, v))]
    total = 0.0
    for a, b in zip(corners, corners[1:] + corners[:1]):
        total += math.acos(min(1.0, scenes.dot(a, b))) * scenes.unit(scenes.cross(a, b))[1]
    return tuple(radiance * abs(total) / 2.0 for radiance in light["radiance"])


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def glossy(point, to_light):
    """BRDF of PHONG on the floor, towards the camera."""
    to_camera = scenes.unit(scenes.sub(CAMERA["position"], point))
    x, y, z = scenes.unit(to_light)
    cosine = max(0.0, scenes.dot((-x, y, -z), to_camera))
    n = PHONG["exponent"]
    lobe = (n + 2.0) / (2.0 * math.pi) * cosine**n
    return tuple(d / math.pi + s * lobe for d, s in zip(PHONG["diffuse"], PHONG["specular"]))


def glossy_point(light, point):
    brdf = glossy(point, scenes.sub(light["position"], point))
    return tuple(f * e for f, e in zip(brdf, point_irradiance(light, point)))


def glossy_area(light, point, count=12):
    """Sum over count² points of a horizontal quad."""
    total = [0.0] * 3
    area = math.sqrt(scenes.dot(*(scenes.cross(light["edge_u"], light["edge_v"]),) * 2))
    for k in range(count * count):
        u, v = (k % count + 0.5) / count, (k // count + 0.5) / count
        on_light = add(add(light["corner"], scenes.scaled(light["edge_u"], u)), scenes.scaled(light["edge_v"], v))
        to_light = scenes.sub(on_light, point)
        weight = to_light[1] ** 2 / scenes.dot(to_light, to_light) ** 2 * area / count**2
        brdf = glossy(point, to_light)
        total = [t + f * radiance * weight for t, f, radiance in zip(total, brdf, light["radiance"])]
    return tuple(total)


POINT = {"kind": "point", "position": (0.7, 1.5, -0.4), "intensity": (5.0, 3.0, 1.0)}
SPOT = {"kind": "spot", "position": (0.5, 2.0, 0.3), "direction": (-0.2, -1.0, 0.1), "intensity": (4.0, 2.0, 1.0)}
SOFT = SPOT | {"angle": 30.0, "penumbra": 0.6}
HARD = SPOT | {"angle": 25.0, "penumbra": 0.0}
# Between camera and floor, back to the camera: neither seen nor in the way.
AREA = {
    "kind": "area",
    "corner": (0.2, 1.5, 0.1),
    "edge_u": (0.6, 0.0, 0.0),
    "edge_v": (0.0, 0.0, 0.4),
    "radiance": (9.0, 6.0, 3.0),
}
SLANTED = AREA | {"edge_v": (0.3, 0.0, 0.4)}
# Turned round: it shines past the camera, and the floor is dark.
AWAY = AREA | {"edge_u": (0.0, 0.0, 0.4), "edge_v": (0.6, 0.0, 0.0)}
SUN = {"kind": "directional", "direction": (0.3, -1.0, 0.2), "irradiance": (3.0, 2.0, 1.0)}
SUN_COSINE = -scenes.unit(SUN["direction"])[1]

FLOORS = [
    Case("point", POINT, lambda p: point_irradiance(POINT, p)),
    Case("spot", SOFT, lambda p: point_irradiance(SOFT, p), samples=4096),
    Case("spot, hard", HARD, lambda p: point_irradiance(HARD, p), samples=16384),
    Case("area", AREA, lambda p: polygon_irradiance(AREA, p), samples=16384),
    Case("area, slanted", SLANTED, lambda p: polygon_irradiance(SLANTED, p), ("mitsuba",), samples=16384),
    Case("area, away", AWAY, lambda p: (0.0, 0.0, 0.0)),
    Case("directional", SUN, lambda p: tuple(e * SUN_COSINE for e in SUN["irradiance"])),
    Case("phong, point", POINT, lambda p: glossy_point(POINT, p), ("mitsuba",), PHONG, 65536),
    Case("phong, area", AREA, lambda p: glossy_area(AREA, p), ("mitsuba",), PHONG, 65536),
]


class Sphere:
    """Light and camera in the middle of a closed sphere: irradiance Φ/(A·(1 − ρ)) after any number of bounces."""

    name = "sphere, all bounces"
    peers = ("mitsuba", "cycles")
    samples = 4096
    repeats = 4
    albedo = (0.2, 0.5, 0.8)
    light = {"kind": "point", "position": (0.0, 0.0, 0.0), "intensity": (1.0, 1.0, 1.0)}

    def write(self, folder):
        points, faces = icosphere(4)
        lines = ["usemtl wall"] + [f"v {x!r} {y!r} {z!r}" for x, y, z in points]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        (Path(folder) / "sphere.obj").write_text("\n".join(lines) + "\n")
        camera = {"position": (0.0, 0.0, 0.0), "target": (0.3, 1.0, 0.2), "up": (0.0, 0.0, 1.0), "fov_y": 90.0}
        file = Path(folder) / f"{self.name}.toml"
        file.write_text(toml("sphere.obj", camera, self.light, {"name": "wall", "diffuse": self.albedo}))
        return file

    def picture(self):
        points, faces = icosphere(4)
        area = 0.0
        for a, b, c in faces:
            across = scenes.cross(scenes.sub(points[b], points[a]), scenes.sub(points[c], points[a]))
            area += math.sqrt(scenes.dot(across, across)) / 2.0
        flux = 4.0 * math.pi
        return [tuple(rho / math.pi * flux / (area * (1.0 - rho)) for rho in self.albedo)] * SIZE**2


def icosphere(levels):
    """Points and faces of an icosahedron of radius 1, each face split into four `levels` times."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    points = [scenes.unit(p) for s in (-1.0, 1.0) for t in (-g, g) for p in ((s, t, 0.0), (0.0, s, t), (t, 0.0, s))]
    edge = min(math.dist(points[0], p) for p in points[1:]) * 1.001

    def near(a, b):
        return math.dist(points[a], points[b]) < edge

    faces = [
        (a, b, c) for a in range(12) for b in range(a) for c in range(b) if near(a, b) and near(b, c) and near(a, c)
    ]
    for _ in range(levels):
        faces = split(points, faces)
    return points, faces


def split(points, faces):
    """Four faces for each, their new corners on the sphere, appended to `points`."""
    middles = {}

    def middle(a, b):
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(points)
            points.append(scenes.unit(add(points[a], points[b])))
        return middles[key]

    parts = []
    for a, b, c in faces:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        parts += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return parts


CASES = [*FLOORS, Sphere()]

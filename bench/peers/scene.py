"""Reads lightpaths scene files: TOML, OBJ and MTL. Needs Python 3.11 and nothing else.

Follows src/scene: fans for polygons, slivers and repeated triangles dropped, normals kept on the front side. Files are
taken to be good: `lightpaths info SCENE` says better what is wrong with one.
"""

import math
import struct
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

BUILT_IN = Path(__file__).resolve().parents[2] / "assets"
"""Built-in scenes are named, not pathed."""

SLIVER = 1e-8
"""Triangles whose doubled area is below this share of their longest edge squared are dropped."""


PANE = 0.5
"""Opacity of an MTL file below which a surface is a pane."""

COLOURS = {"Kd": "diffuse", "Ks": "specular", "Ke": "emission"}


class SceneError(Exception):
    """The scene cannot be read or holds what the peers do not know."""


@dataclass
class Material:
    """Lambert plus an energy-normalised modified Phong lobe, specular·(exponent + 2)/(2π)·cosⁿα."""

    name: str
    diffuse: tuple = (0.7, 0.7, 0.7)
    specular: tuple = (0.0, 0.0, 0.0)
    exponent: float = 1.0
    image: str = ""
    """What map_Kd says; the peers know no images."""
    emission: tuple = (0.0, 0.0, 0.0)
    """Radiance, W/m²/sr."""
    sides: str = ""
    """Sides that emit: front, back or both."""
    emission_image: str = ""
    """What map_Ke says; the peers know none."""
    opacity_map: Path | None = None
    """Image of map_d, holes below one half."""
    passes: tuple | None = None
    """Fraction of light of each colour that a pane lets pass; None: no pane."""
    hidden: bool = False

    def is_diffuse(self):
        return max(self.specular) == 0.0

    def emits(self):
        return max(self.emission) > 0.0 and self.passes is None


@dataclass
class Mesh:
    """Triangles of one material: three corners each, nothing shared."""

    material: Material
    flat: bool
    """Every corner's normal is the face's own."""
    positions: list = field(default_factory=list)
    normals: list = field(default_factory=list)
    coordinates: list = field(default_factory=list)
    """Texture coordinates, v from below; (0, 0) where the model has none."""


@dataclass
class Camera:
    """A pinhole; fov_y in degrees, vertical."""

    position: tuple
    target: tuple
    up: tuple = (0.0, 1.0, 0.0)
    fov_y: float = 40.0
    size: tuple = (512, 512)

    def frame(self):
        """Right, up and forward unit vectors."""
        forward = unit(sub(self.target, self.position))
        right = unit(cross(forward, self.up))
        return right, cross(right, forward), forward


@dataclass
class Sky:
    """A constant sky, or a panorama whose middle shows -Z and whose upper edge shows +Y."""

    radiance: tuple = (1.0, 1.0, 1.0)
    image: Path | None = None
    rotate: float = 0.0
    """About +Y, degrees: a quarter turn shows the middle at -X."""


@dataclass
class Scene:
    name: str
    camera: Camera
    lights: list
    """Tables of the scene file as they stand, defaults filled in, directions unit."""
    meshes: list
    bounds: tuple
    """Lowest and highest corner, metres."""
    sky: Sky | None = None

    def extent(self):
        return max(high - low for low, high in zip(*self.bounds))

    def materials(self):
        return [mesh.material for mesh in self.meshes]


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def scaled(a, factor):
    return tuple(x * factor for x in a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    if length == 0.0 or not math.isfinite(length):
        raise SceneError(f"{a} has no direction")
    return scaled(a, 1.0 / length)


def find(spec):
    """The file that SCENE means: a path, or the name of a built-in scene."""
    path = Path(spec)
    if path.suffix != ".toml" and (BUILT_IN / f"{spec}.toml").is_file():
        return BUILT_IN / f"{spec}.toml"
    if path.suffix != ".toml":
        raise SceneError(f"{spec}: a .toml scene file or a built-in scene was expected")
    if not path.is_file():
        raise SceneError(f"{spec}: no such file")
    return path


def load(spec, size=None, flat=False):
    """Reads a scene. `size` replaces the camera's; `flat` forgets the models' normals."""
    path = find(spec)
    root = tomllib.loads(path.read_text(encoding="utf-8"))
    materials, triangles = {}, []
    for number, model in enumerate(root.get("model", [])):
        place = transform(model)
        if model.get("built_in") == "box":
            model_path = BUILT_IN / "box.obj"
        elif "built_in" in model:
            raise SceneError(
                f"{path}: model {model['built_in']!r} is made by lightpaths: write it out first "
                "(cargo run --release --example built_in_model) and name the .obj in a scene file"
            )
        else:
            model_path = path.parent / model["file"]
        library, faces = read_obj(model_path)
        materials |= {(number, name): material for name, material in library.items()}
        triangles += [((number, name), *place(*face)) for name, *face in faces]
    for override in root.get("material", []):
        found = [material for (_, name), material in materials.items() if name == override["name"]]
        if not found:
            raise SceneError(f"{path}: material {override['name']!r} is in no model")
        for material in found:
            replace(material, override)
    triangles = [triangle for triangle in triangles if not materials[triangle[0]].hidden]
    for key in {key for key, *_ in triangles}:
        check(materials[key], path)
    for material in materials.values():
        conserve_energy(material)
    meshes, bounds = assemble(triangles, materials, flat)
    cameras = root.get("camera")
    if not cameras:
        raise SceneError(f"{path}: the peers need a [camera]")
    camera = Camera(
        **{key: value for key, value in (cameras[0] if isinstance(cameras, list) else cameras).items() if key != "name"}
    )
    if size:
        camera.size = tuple(size)
    lights = [read_light(light) for light in root.get("light", []) if light.get("on", True)]
    return Scene(path.stem, camera, lights, meshes, bounds, read_sky(root, path))


def replace(material, override):
    """Applies a [[material]] of the scene file."""
    for key in {"diffuse", "specular", "exponent", "emission", "hidden"} & override.keys():
        value = override[key]
        setattr(material, key, tuple(value) if isinstance(value, list) else type(getattr(material, key))(value))
    material.sides = override.get("emitting_sides", material.sides)
    if "diffuse" in override:
        material.image = ""
    if "emission" in override:
        material.emission_image = ""
    if "tint" in override:
        raise SceneError(f"material {material.name!r}: the peers know no tint: state its diffuse")
    thin, opacity = override.get("thin"), override.get("opacity")
    passes = 1.0 - (opacity if opacity is not None else 0.0 if thin else 1.0)
    if thin:
        material.passes = scaled(material.diffuse, passes)
    elif thin is None and passes > 0.0:
        material.passes = (passes,) * 3
    elif thin is not None or opacity is not None:
        material.passes = None


def check(material, path):
    """Refuses materials that no peer can show as the program does."""
    name = f"material {material.name!r}"
    if material.image:
        raise SceneError(f"{name} has an image, the peers take none: give it a diffuse in {path}")
    if material.emission_image:
        raise SceneError(f"{name} has an image of emission, the peers take none: give it an emission in {path}")
    if material.emits() and material.opacity_map:
        raise SceneError(f"{name} emits and has holes, the peers take one of them")
    if material.emits() and material.sides not in ("front", "back", "both"):
        raise SceneError(f"{name} emits: the program finds its sides by rays; state its emitting_sides in {path}")


def read_sky(root, path):
    """The [environment], None if there is none."""
    if "environment" not in root:
        return None
    table = root["environment"]
    image = path.parent / table["image"] if "image" in table else None
    return Sky(tuple(table.get("radiance", (1.0, 1.0, 1.0))), image, float(table.get("rotate", 0.0)))


def read_light(table):
    """A light with its defaults and unit directions."""
    kinds = {
        "point": ("position", "intensity"),
        "spot": ("position", "intensity", "direction", "angle"),
        "area": ("corner", "edge_u", "edge_v", "radiance"),
        "directional": ("direction", "irradiance"),
    }
    light = {"penumbra": 0.0} | table
    if light.get("kind") not in kinds:
        raise SceneError(f"light {light.get('name')!r}: unknown kind {light.get('kind')!r}")
    missing = [key for key in kinds[light["kind"]] if key not in light]
    if missing:
        raise SceneError(f"light {light.get('name')!r} lacks {', '.join(missing)}")
    if light.get("visible"):
        raise SceneError(f"light {light.get('name')!r} is a surface that is seen: give a model an emission instead")
    if "direction" in light:
        light["direction"] = unit(light["direction"])
    return light


def conserve_energy(material):
    """Scales what would reflect more than it receives, as the program does."""
    albedo = max(d + s for d, s in zip(material.diffuse, material.specular))
    if albedo > 1.0:
        material.diffuse = scaled(material.diffuse, 1.0 / albedo)
        material.specular = scaled(material.specular, 1.0 / albedo)


def transform(model):
    """What [[model]] says: scale, then rotate about x, y, z, then translate."""
    scale = model.get("scale", 1.0)
    scale = tuple(scale) if isinstance(scale, list) else (scale,) * 3
    translate = model.get("translate", (0.0, 0.0, 0.0))
    angles = [math.radians(angle) for angle in model.get("rotate", (0.0, 0.0, 0.0))]
    mirrored = scale[0] * scale[1] * scale[2] < 0.0

    def rotated(point):
        for axis, angle in enumerate(angles):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            p, (s, c) = list(point), (math.sin(angle), math.cos(angle))
            p[a], p[b] = c * point[a] - s * point[b], s * point[a] + c * point[b]
            point = tuple(p)
        return point

    def place(corners, normals, coordinates):
        corners = [sum_of(rotated(tuple(x * s for x, s in zip(p, scale))), translate) for p in corners]
        normals = normals and [rotated(tuple(x / s for x, s in zip(n, scale))) for n in normals]
        if mirrored:
            corners = [corners[0], corners[2], corners[1]]
            normals = normals and [normals[0], normals[2], normals[1]]
            coordinates = [coordinates[0], coordinates[2], coordinates[1]]
        return corners, normals, coordinates

    return place


def sum_of(a, b):
    return tuple(x + y for x, y in zip(a, b))


def read_obj(path):
    """Materials by name, and triangles as (material name, corners, normals or None, coordinates)."""
    materials, triangles, used = {}, [], "default"
    points = {"v": [], "vt": [], "vn": []}
    faces = []
    for line in path.read_text(encoding="utf-8-sig").splitlines():
        keyword, rest = statement(line)
        if keyword in points:
            points[keyword].append(tuple(float(word) for word in rest.split()[:3]))
        elif keyword == "f":
            words = rest.split("#")[0].split()
            faces.append((used, [corner(word, points) for word in words]))
        elif keyword == "usemtl":
            used = rest
        elif keyword == "mtllib":
            materials |= read_mtl(path.parent / rest)
    for name, corners in faces:
        materials.setdefault(name, Material(name))
        has_normals = all(normal is not None for *_, normal in corners)
        has_coordinates = all(place is not None and place < len(points["vt"]) for _, place, _ in corners)
        for k in range(1, len(corners) - 1):
            fan = (corners[0], corners[k], corners[k + 1])
            normals = [points["vn"][normal] for *_, normal in fan] if has_normals else None
            coordinates = [points["vt"][place][:2] if has_coordinates else (0.0, 0.0) for _, place, _ in fan]
            triangles.append((name, [points["v"][position] for position, *_ in fan], normals, coordinates))
    if not triangles:
        raise SceneError(f"{path} holds no face")
    return materials, triangles


def statement(line):
    """Keyword and the rest of a line of an OBJ or MTL file."""
    keyword, *rest = line.split(None, 1) or [""]
    return keyword, rest[0].strip() if rest else ""


def corner(word, points):
    """Indices from 0 of position, texture coordinates and normal (or None) of v, v/vt, v//vn or v/vt/vn."""
    parts = (word + "//").split("/")

    def index(text, kind):
        return int(text) - 1 if int(text) > 0 else int(text) + len(points[kind])

    return tuple(index(text, kind) if text else None for text, kind in zip(parts, ("v", "vt", "vn")))


def read_mtl(path):
    materials, transparencies = {}, {}
    material = None
    for line in path.read_text(encoding="utf-8-sig").splitlines():
        keyword, rest = statement(line)
        if keyword == "newmtl":
            material = materials[rest] = Material(rest)
            stated = transparencies[rest] = {}
        elif keyword in COLOURS:
            setattr(material, COLOURS[keyword], tuple(float(word) for word in rest.split()[:3]))
        elif keyword == "map_Kd":
            material.image = rest
        elif keyword == "map_Ke":
            material.emission_image = rest
        elif keyword == "map_d":
            if rest.startswith("-"):
                raise SceneError(f"{path}: map_d {rest}: the peers know none of its options")
            material.opacity_map = path.parent / rest
        elif keyword == "Ns":
            material.exponent = max(float(rest.split()[0]), 1.0)
        elif keyword in ("d", "Tr", "Tf"):
            stated[keyword] = tuple(float(word) for word in rest.split()[:3])
    for name, material in materials.items():
        apply_transparency(material, transparencies[name])
    return materials


def apply_transparency(material, stated):
    """Makes a material a pane if its opacity is below one half, and hides it if that is 0. A map comes first."""
    opacity = stated["d"][0] if "d" in stated else 1.0 - stated.get("Tr", (0.0,))[0]
    if material.opacity_map:
        return
    if "d" in stated and opacity == 0.0:
        material.hidden = True
    elif 0.0 < opacity < PANE:
        colour = stated.get("Tf", (1.0,) * 3)
        material.passes = scaled(colour if max(colour) > 0.0 else (1.0,) * 3, 1.0 - opacity)


def assemble(triangles, materials, flat):
    """Meshes, one for each material and kind of normal, and the bounding box."""
    corners = [point for _, points, *_ in triangles for point in points]
    bounds = tuple(tuple(pick(axis) for axis in zip(*corners)) for pick in (min, max))
    origin = tuple(0.5 * (low + high) for low, high in zip(*bounds))
    meshes, seen = {}, set()
    for key, points, normals, coordinates in triangles:
        # Repeats are told by what f32 coordinates about the middle of the scene can tell apart.
        identity = tuple(sorted(struct.pack("3f", *(x + 0.0 for x in sub(p, origin))) for p in points))
        across = cross(sub(points[1], points[0]), sub(points[2], points[0]))
        longest = max(dot(edge, edge) for edge in (sub(points[i], points[i - 1]) for i in range(3)))
        if math.sqrt(dot(across, across)) <= SLIVER * longest or identity in seen:
            continue
        seen.add(identity)
        front = unit(across)
        normals = shading_normals(front, None if flat else normals)
        is_flat = all(dot(normal, front) > 1.0 - 1e-9 for normal in normals)
        mesh = meshes.setdefault((key, is_flat), Mesh(materials[key], is_flat))
        mesh.positions += points
        mesh.normals += normals
        mesh.coordinates += coordinates
    return list(meshes.values()), bounds


def shading_normals(front, normals):
    """Unit, and on the front side; the face's own where a stated one is of no use."""
    if normals is None:
        return [front] * 3
    usable = [unit(n) if math.isfinite(dot(n, n)) and dot(n, n) > 0.0 else None for n in normals]
    side = -1.0 if sum(dot(n, front) for n in usable if n) < 0.0 else 1.0
    return [scaled(n, side) if n and side * dot(n, front) > 0.0 else front for n in usable]

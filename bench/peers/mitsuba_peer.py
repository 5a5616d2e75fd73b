"""Mitsuba 3's path tracer on our scenes. Runs in the environment that install.py makes.

mitsuba_peer.py JOB.json      renders what the job lists (see job.py)
mitsuba_peer.py --probe NAME  exit 0 if the variant NAME works here
"""

import math
import sys
import time

import drjit as dr
import job
import mitsuba as mi
import numpy as np
import scene as scenes

SAMPLES_PER_PASS = 1 << 24
"""Samples in flight; more only costs memory. Passes have seeds of their own and are averaged."""
FEWEST_PASSES = 256
"""Where a variance is asked for: it is that of the passes."""
APART = 1e-4
"""Distance between the two surfaces of one that emits on both sides, in units of the scene's extent."""
FINER = 4
"""Parts of a texel of an opacity map, along each side."""


def build(scene, channel=0):
    """The scene in Mitsuba's terms; panes let all light pass as they do that of one channel."""
    camera, extent = scene.camera, scene.extent()
    description = {
        "type": "scene",
        "integrator": {"type": integrator(scene), "max_depth": -1},
        "sensor": {
            "type": "perspective",
            "fov": camera.fov_y,
            "fov_axis": "y",
            "near_clip": 1e-4 * extent,
            "far_clip": 1e4 * extent,
            "to_world": mi.ScalarTransform4f.look_at(camera.position, camera.target, camera.up),
            "sampler": {"type": "independent"},
            "film": {
                "type": "hdrfilm",
                "width": camera.size[0],
                "height": camera.size[1],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
        },
    }
    check(scene)
    for index, mesh in enumerate(scene.meshes):
        for side, shape in enumerate(shapes(mesh, extent, channel)):
            description[f"mesh{index}-{side}"] = shape
    for index, light in enumerate(scene.lights):
        description[f"light{index}"] = emitter(light)
    if scene.sky:
        description["sky"] = sky(scene.sky)
    return mi.load_dict(description)


def check(scene):
    """Refuses scenes in which camera rays would have to pass some emitters and meet others."""
    if any(light["kind"] == "area" for light in scene.lights) and any(m.emits() for m in scene.materials()):
        raise scenes.SceneError("area lights are invisible, emitting surfaces are not: Mitsuba takes one of them")


def integrator(scene):
    """Shadow rays of Mitsuba's `path` stop at surfaces through which light passes; those of `volpath` do not."""
    return "volpath" if any(m.passes or m.opacity_map for m in scene.materials()) else "path"


def channels(scene):
    """Channels to render apart: Mitsuba's masks let all colours pass alike."""
    return range(3) if any(m.passes and len(set(m.passes)) > 1 for m in scene.materials()) else range(1)


def shapes(mesh, extent, channel):
    """The meshes that stand for one of ours: two where both sides emit, since Mitsuba's emit to the front."""
    ours = mesh.material
    children = {"bsdf": material(ours, channel)}
    positions, normals = np.array(mesh.positions), np.array(mesh.normals)
    coordinates = np.array(mesh.coordinates)
    if not ours.emits():
        return [triangles(positions, normals, children, coordinates if ours.opacity_map else None)]
    found = []
    for side in ("front", "back") if ours.sides == "both" else (ours.sides,):
        corners, towards = (positions, normals) if side == "front" else (flipped(positions), -flipped(normals))
        if ours.sides == "both":
            corners = corners + 0.5 * APART * extent * across(corners)
        area = mi.load_dict({"type": "area", "radiance": colour(ours.emission)})
        found.append(triangles(corners, towards, children | {"emitter": area}))
    return found


def flipped(corners):
    """The list with two corners of each triangle exchanged."""
    return corners.reshape(-1, 3, 3)[:, [0, 2, 1]].reshape(-1, 3)


def across(positions):
    """The unit normal of its face at every corner."""
    a, b, c = np.swapaxes(positions.reshape(-1, 3, 3), 0, 1)
    normal = np.cross(b - a, c - a)
    return np.repeat(normal / np.linalg.norm(normal, axis=1, keepdims=True), 3, axis=0)


def colour(value):
    return {"type": "rgb", "value": [float(x) for x in value]}


def material(ours, channel):
    if ours.passes:
        black = {"type": "diffuse", "reflectance": colour((0.0,) * 3)}
        return mi.load_dict({"type": "mask", "opacity": 1.0 - float(ours.passes[channel]), "nested": black})
    if ours.is_diffuse():
        bsdf = mi.load_dict({"type": "twosided", "material": {"type": "diffuse", "reflectance": colour(ours.diffuse)}})
    else:
        import mitsuba_phong

        bsdf = mitsuba_phong.load(ours)
    if ours.opacity_map:
        bsdf = mi.load_dict({"type": "mask", "opacity": holes(ours.opacity_map), "nested": bsdf})
    return bsdf


def holes(file):
    """An opacity map as a texture of zeros and ones: bilinear between texels, then cut at one half."""
    codes = np.array(mi.Bitmap(str(file)), np.float64)
    if codes.ndim == 2 or codes.shape[2] == 1:
        alpha = codes.reshape(codes.shape[:2])
    elif codes.shape[2] in (2, 4):
        alpha = codes[..., -1]
    else:
        alpha = codes @ [0.2126, 0.7152, 0.0722]
    solid = (finer(alpha, FINER) >= 127.5).astype(np.float32)
    bitmap = mi.Bitmap(solid[..., np.newaxis])
    return mi.load_dict({"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": "nearest"})


def finer(texels, factor):
    """A repeated image at the middles of `factor`² parts of each texel, bilinear."""
    for axis in (0, 1):
        places = (np.arange(texels.shape[axis] * factor) + 0.5) / factor - 0.5
        low = np.floor(places).astype(int)
        weight = np.expand_dims(places - low, 1 - axis)
        low, high = (texels.take(index, axis, mode="wrap") for index in (low, low + 1))
        texels = low * (1.0 - weight) + high * weight
    return texels


def sky(ours):
    if not ours.image:
        return {"type": "constant", "radiance": colour(ours.radiance)}
    bitmap = mi.Bitmap(str(ours.image)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    texels = rows_from_pole_to_pole(np.array(bitmap)) * np.array(ours.radiance, np.float32)
    # Its left edge shows -Z, ours +Z.
    turn = mi.ScalarTransform4f.rotate([0.0, 1.0, 0.0], 180.0 + ours.rotate)
    return {"type": "envmap", "bitmap": mi.Bitmap(texels.astype(np.float32)), "to_world": turn}


def rows_from_pole_to_pole(texels):
    """Twice the rows and one: Mitsuba's first and last rows are the poles, ours half a texel off them."""
    inner = np.repeat(texels, 2, axis=0)
    middles = 0.5 * (inner[1:-1:2] + inner[2::2])
    rows = np.empty((2 * len(texels) + 1, *texels.shape[1:]), texels.dtype)
    rows[0], rows[-1] = texels[0], texels[-1]
    rows[1::2], rows[2:-1:2] = texels, middles
    return rows


def triangles(positions, normals, children, coordinates=None):
    """A mesh without shared vertices; `children` are its BSDF and emitter."""
    properties = mi.Properties()
    for name, child in children.items():
        properties[name] = child
    count = len(positions)
    mesh = mi.Mesh(
        "mesh",
        count,
        count // 3,
        props=properties,
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=coordinates is not None,
    )
    fields = mi.traverse(mesh)
    fields["vertex_positions"] = np.ravel(np.array(positions, np.float32))
    if normals is not None:
        fields["vertex_normals"] = np.ravel(np.array(normals, np.float32))
    if coordinates is not None:
        # v from above.
        fields["vertex_texcoords"] = np.ravel(np.array(coordinates * [1.0, -1.0] + [0.0, 1.0], np.float32))
    fields["faces"] = np.arange(count, dtype=np.uint32)
    fields.update()
    return mesh


def emitter(light):
    def rgb(key):
        return colour(light[key])

    if light["kind"] == "point":
        return {"type": "point", "position": light["position"], "intensity": rgb("intensity")}
    if light["kind"] == "directional":
        return {"type": "directional", "direction": list(light["direction"]), "irradiance": rgb("irradiance")}
    if light["kind"] == "spot":
        direction = np.array(light["direction"])
        up = np.eye(3)[np.argmin(np.abs(direction))]
        return {
            "type": "spot",
            "to_world": mi.ScalarTransform4f.look_at(light["position"], list(light["position"] + direction), list(up)),
            "intensity": rgb("intensity"),
            "cutoff_angle": float(light["angle"]),
            "beam_width": float(light["angle"]) * (1.0 - float(light["penumbra"])),
        }
    # A quad that paths cross as if it were not there, and that the camera does not see.
    corner, u, v = (np.array(light[key], float) for key in ("corner", "edge_u", "edge_v"))
    quad = [corner, corner + u, corner + u + v, corner, corner + u + v, corner + v]
    area = mi.load_dict({"type": "area", "radiance": rgb("radiance")})
    return triangles(quad, None, {"bsdf": mi.load_dict({"type": "null"}), "emitter": area})


def pass_size(spp, pixels, fewest):
    """The largest divisor of spp that keeps a pass within SAMPLES_PER_PASS and the passes many enough."""
    limit = max(1, min(SAMPLES_PER_PASS // pixels, spp // fewest))
    return next(size for size in range(min(spp, limit), 0, -1) if spp % size == 0)


def shows_a_light(scene, lights):
    """Whether the camera meets the quad of an area light; ours are invisible to it."""
    if not any(light["kind"] == "area" for light in lights):
        return False
    if not mi.variant().startswith(("llvm", "cuda")):
        raise scenes.SceneError(f"area lights need Mitsuba's llvm variant, {mi.variant()} is in use")
    side = 512
    index = dr.arange(mi.UInt32, side * side)
    film = mi.Point2f(mi.Float(index % side) + 0.5, mi.Float(index // side) + 0.5) / side
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    return bool(dr.any(dr.neq(scene.ray_intersect(ray).emitter(scene), None)))


def beyond_lights(tracer, count):
    """A path tracer, its camera rays moved past up to `count` quads of area lights."""

    class Beyond(mi.SamplingIntegrator):
        def __init__(self, properties):
            super().__init__(properties)
            self.path = mi.load_dict(tracer)

        def sample(self, scene, sampler, ray, medium=None, active=True):
            ray = mi.Ray3f(ray)
            for _ in range(count):
                si = scene.ray_intersect(ray, active)
                is_light = active & si.is_valid() & dr.neq(si.emitter(scene), None)
                ray = dr.select(is_light, si.spawn_ray(ray.d), ray)
            return self.path.sample(scene, sampler, mi.RayDifferential3f(ray), medium, active)

    return Beyond(mi.Properties())


def render(built, scene, request):
    """Mean of every pixel, with its variance where that is asked for, and the seconds that took.

    `built` holds the scene for each of its channels()."""
    camera, lights = scene.camera, scene.lights
    each = pass_size(request["spp"], camera.size[0] * camera.size[1], FEWEST_PASSES if request["variance"] else 1)
    count = request["spp"] // each
    areas = sum(light["kind"] == "area" for light in lights)
    tracer = {"type": integrator(scene), "max_depth": request["depth"]}
    tracer = beyond_lights(tracer, areas) if shows_a_light(built[0], lights) else mi.load_dict(tracer)

    def once(number):
        seed = request["seed"] * 65537 + number
        images = [np.array(mi.render(one, spp=each, seed=seed, integrator=tracer), np.float64) for one in built]
        return np.stack([images[min(k, len(images) - 1)][..., k] for k in range(3)], -1)

    once(count)  # Compiles the kernels: not timed, not used.
    start = time.perf_counter()
    total = square = 0.0
    for number in range(count):
        image = once(number)
        total = total + image
        square = square + image * image if request["variance"] else 0.0
    seconds = time.perf_counter() - start
    mean = total / count
    planes = {name: mean[..., k] for k, name in enumerate("RGB")}
    if request["variance"]:
        # Of the mean of independent passes.
        variance = np.maximum(square / count - mean * mean, 0.0) / (count - 1)
        planes |= {f"variance.{name}": variance[..., k] for k, name in enumerate("RGB")}
    return planes, seconds


def main(path):
    work = job.load(path)
    mi.set_variant(work.variant)
    if work.variant.startswith("llvm"):
        dr.set_thread_count(work.threads)
    results = []
    try:
        built = [build(work.scene, channel) for channel in channels(work.scene)]
        rendered = [render(built, work.scene, request) for request in work.renders]
    except scenes.SceneError as reason:
        return work.refuse(str(reason))
    for request, (planes, seconds) in zip(work.renders, rendered):
        job.write_picture(request["out"], work.scene.camera.size, planes)
        results.append(request | {"seconds": seconds, "renderer": f"Mitsuba {mi.__version__} ({work.variant})"})
    work.finish(results)


def probe(variant):
    mi.set_variant(variant)
    scene = mi.load_dict(mi.cornell_box() | {"integrator": {"type": "path"}})
    mean = float(np.mean(np.array(mi.render(scene, spp=1))))
    sys.exit(0 if math.isfinite(mean) and mean > 0.0 else 1)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--probe"]:
        probe(sys.argv[2])
    main(sys.argv[1])

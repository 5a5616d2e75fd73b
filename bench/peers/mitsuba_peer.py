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


def build(scene):
    """The scene in Mitsuba's terms."""
    camera, extent = scene.camera, scene.extent()
    description = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1},
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
    for index, mesh in enumerate(scene.meshes):
        description[f"mesh{index}"] = triangles(mesh.positions, mesh.normals, {"bsdf": material(mesh.material)})
    for index, light in enumerate(scene.lights):
        description[f"light{index}"] = emitter(light)
    return mi.load_dict(description)


def material(ours):
    rgb = {"type": "rgb", "value": list(ours.diffuse)}
    if ours.is_diffuse():
        return mi.load_dict({"type": "twosided", "material": {"type": "diffuse", "reflectance": rgb}})
    import mitsuba_phong

    return mitsuba_phong.load(ours)


def triangles(positions, normals, children):
    """A mesh without shared vertices; `children` are its BSDF and emitter."""
    properties = mi.Properties()
    for name, child in children.items():
        properties[name] = child
    count = len(positions)
    mesh = mi.Mesh("mesh", count, count // 3, props=properties, has_vertex_normals=normals is not None)
    fields = mi.traverse(mesh)
    fields["vertex_positions"] = np.ravel(np.array(positions, np.float32))
    if normals is not None:
        fields["vertex_normals"] = np.ravel(np.array(normals, np.float32))
    fields["faces"] = np.arange(count, dtype=np.uint32)
    fields.update()
    return mesh


def emitter(light):
    def rgb(key):
        return {"type": "rgb", "value": [float(x) for x in light[key]]}

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


def beyond_lights(count):
    """The path tracer, its camera rays moved past up to `count` quads of area lights."""

    class Beyond(mi.SamplingIntegrator):
        def __init__(self, properties):
            super().__init__(properties)
            self.path = mi.load_dict({"type": "path", "max_depth": -1})

        def sample(self, scene, sampler, ray, medium=None, active=True):
            ray = mi.Ray3f(ray)
            for _ in range(count):
                si = scene.ray_intersect(ray, active)
                is_light = active & si.is_valid() & dr.neq(si.emitter(scene), None)
                ray = dr.select(is_light, si.spawn_ray(ray.d), ray)
            return self.path.sample(scene, sampler, mi.RayDifferential3f(ray), medium, active)

    return Beyond(mi.Properties())


def render(scene, camera, lights, request):
    """Mean of every pixel, with its variance where that is asked for, and the seconds that took."""
    each = pass_size(request["spp"], camera.size[0] * camera.size[1], FEWEST_PASSES if request["variance"] else 1)
    count = request["spp"] // each
    areas = sum(light["kind"] == "area" for light in lights)
    integrator = beyond_lights(areas) if shows_a_light(scene, lights) else None

    def once(number):
        seed = request["seed"] * 65537 + number
        return np.array(mi.render(scene, spp=each, seed=seed, integrator=integrator), np.float64)

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
        scene = build(work.scene)
        rendered = [render(scene, work.scene.camera, work.scene.lights, request) for request in work.renders]
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

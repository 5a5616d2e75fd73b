"""Cycles, plain or with Open Image Denoise, on our scenes. Runs in the environment that install.py makes.

cycles_peer.py JOB.json    renders what the job lists (see job.py)
"""

import math
import sys
import tempfile
import time
from pathlib import Path

import exr
import job
import scene as scenes

import bpy
from mathutils import Matrix, Vector

BOUNCES = 1024
"""As many as Cycles allows; Russian roulette ends paths long before."""


def build(ours, threads):
    """Replaces whatever Blender starts with by the scene in its terms."""
    if ours.sky or any(m.emits() or m.passes or m.opacity_map for m in ours.materials()):
        raise scenes.SceneError("emission, skies, holes and panes go to Mitsuba alone")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    settle(scene, threads)
    scene.world = bpy.data.worlds.new("nothing")
    black(scene.world)
    for index, mesh in enumerate(ours.meshes):
        add_mesh(scene, f"mesh{index}", mesh)
    for index, light in enumerate(ours.lights):
        add_light(scene, f"light{index}", light)
    add_camera(scene, ours)
    return scene


def settle(scene, threads):
    """Nothing that trades truth for speed: no clamps, limits, thresholds or colour management."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.threads_mode, render.threads = "FIXED", threads
    render.use_persistent_data = True
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = False
    render.film_transparent = False
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = BOUNCES
    cycles.transmission_bounces = cycles.transparent_max_bounces = BOUNCES
    cycles.pixel_filter_type = "BOX"
    cycles.film_exposure = 1.0
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.denoising_use_gpu = False
    scene.display_settings.display_device = "sRGB"
    scene.view_settings.view_transform = "Raw"
    scene.view_settings.look = "None"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0
    image = render.image_settings
    image.file_format, image.color_depth, image.color_mode, image.exr_codec = "OPEN_EXR", "32", "RGB", "NONE"


def nodes_of(owner):
    """Node tree of a material, world or light, emptied but for its output."""
    if owner.node_tree is None:
        owner.use_nodes = True
    tree = owner.node_tree
    outputs = [node for node in tree.nodes if node.bl_idname.startswith("ShaderNodeOutput")]
    for node in [node for node in tree.nodes if node not in outputs]:
        tree.nodes.remove(node)
    return tree, outputs[0]


def black(world):
    tree, output = nodes_of(world)
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Strength"].default_value = 0.0
    tree.links.new(background.outputs[0], output.inputs["Surface"])


def add_mesh(scene, name, ours):
    mesh = bpy.data.meshes.new(name)
    count = len(ours.positions)
    mesh.from_pydata(ours.positions, [], [(i, i + 1, i + 2) for i in range(0, count, 3)])
    mesh.polygons.foreach_set("use_smooth", [not ours.flat] * (count // 3))
    if not ours.flat:
        mesh.normals_split_custom_set(ours.normals)
    mesh.materials.append(diffuse(ours.material))
    thing = bpy.data.objects.new(name, mesh)
    # Light that would be blurred at the terminator of smooth surfaces is left where geometry puts it.
    thing.shadow_terminator_geometry_offset = thing.shadow_terminator_shading_offset = 0.0
    scene.collection.objects.link(thing)


def diffuse(ours):
    if not ours.is_diffuse():
        raise scenes.SceneError(f"material {ours.name!r}: Cycles has no Phong lobe")
    material = bpy.data.materials.new(ours.name)
    tree, output = nodes_of(material)
    bsdf = tree.nodes.new("ShaderNodeBsdfDiffuse")
    bsdf.inputs["Color"].default_value = (*ours.diffuse, 1.0)
    bsdf.inputs["Roughness"].default_value = 0.0
    tree.links.new(bsdf.outputs[0], output.inputs["Surface"])
    return material


def add_light(scene, name, light):
    """A lamp whose power stands for one W/sr, W/m²/sr or W/m², times what its nodes emit: no limit to colours there."""
    kinds = {"point": "POINT", "spot": "POINT", "area": "AREA", "directional": "SUN"}
    lamp = bpy.data.lights.new(name, kinds[light["kind"]])
    tree, output = nodes_of(lamp)
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    lamp.color, lamp.energy = (1.0, 1.0, 1.0), 1.0
    thing = bpy.data.objects.new(name, lamp)
    thing.visible_camera = False
    if light["kind"] == "directional":
        lamp.angle = 0.0
        value = light["irradiance"]
        thing.matrix_world = Matrix(facing(light["direction"])).transposed().to_4x4()
    elif light["kind"] == "area":
        value = light["radiance"]
        place_quad(lamp, thing, light)
    else:
        value = light["intensity"]
        lamp.shadow_soft_size, lamp.use_soft_falloff = 0.0, False
        lamp.energy = 4.0 * math.pi
        thing.location = light["position"]
    strength = max(value)
    emission.inputs["Color"].default_value = (*(v / strength if strength else 0.0 for v in value), 1.0)
    emission.inputs["Strength"].default_value = strength
    if light["kind"] == "spot":
        add_cone(tree, emission, light, strength)
    scene.collection.objects.link(thing)


def place_quad(lamp, thing, light):
    """A rectangle of the light's radiance; Blender's shines along its local −z."""
    u, v = Vector(light["edge_u"]), Vector(light["edge_v"])
    if abs(u.dot(v)) > 1e-6 * u.length * v.length:
        raise scenes.SceneError(f"light {light.get('name')!r}: Cycles has no slanted area lights")
    lamp.shape, lamp.size, lamp.size_y, lamp.spread = "RECTANGLE", u.length, v.length, math.pi
    lamp.energy = math.pi * u.length * v.length
    x, y = u.normalized(), -v.normalized()
    axes = Matrix((x, y, x.cross(y))).transposed().to_4x4()
    thing.matrix_world = Matrix.Translation(Vector(light["corner"]) + 0.5 * (u + v)) @ axes


def facing(direction):
    """Rows x, y, z of a frame whose −z is `direction`."""
    z = -Vector(direction)
    x = z.orthogonal().normalized()
    return x, z.cross(x), z


def add_cone(tree, emission, light, strength):
    """Full strength up to angle·(1 − penumbra) from the axis, then linear in the angle; Blender's spot is not."""

    def node(kind, *inputs, **settings):
        made = tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(made, key, value)
        for index, value in enumerate(inputs):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, made.inputs[index])
            else:
                made.inputs[index].default_value = value
        return made

    outer = math.radians(light["angle"])
    inner = min(outer * (1.0 - light["penumbra"]), outer * (1.0 - 1e-6))
    incoming = node("ShaderNodeNewGeometry").outputs["Incoming"]
    cosine = node("ShaderNodeVectorMath", incoming, tuple(light["direction"]), operation="DOT_PRODUCT")
    angle = node("ShaderNodeMath", cosine.outputs["Value"], operation="ARCCOSINE")
    fall = node("ShaderNodeMapRange", angle.outputs[0], inner, outer, strength, 0.0, clamp=True)
    tree.links.new(fall.outputs[0], emission.inputs["Strength"])


def add_camera(scene, ours):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = math.radians(ours.camera.fov_y)
    camera.clip_start, camera.clip_end = 1e-4 * ours.extent(), 1e4 * ours.extent()
    right, up, forward = ours.camera.frame()
    thing = bpy.data.objects.new("camera", camera)
    axes = Matrix((right, up, scenes.scaled(forward, -1.0))).transposed().to_4x4()
    thing.matrix_world = Matrix.Translation(ours.camera.position) @ axes
    scene.collection.objects.link(thing)
    scene.camera = thing
    scene.render.resolution_x, scene.render.resolution_y = ours.camera.size
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0


def render(scene, request):
    """Seconds of one picture, which lands in request["out"]."""
    scene.cycles.samples, scene.cycles.seed = request["spp"], request["seed"]
    scene.cycles.use_denoising = request["denoise"]
    start = time.perf_counter()
    bpy.ops.render.render()
    seconds = time.perf_counter() - start
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "picture.exr"
        bpy.data.images["Render Result"].save_render(str(file), scene=scene)
        size, planes = exr.read(file)
    exr.write(request["out"], size, {name: planes[name] for name in "RGB"})
    return seconds


def main(path):
    work = job.load(path)
    try:
        scene = build(work.scene, work.threads)
    except scenes.SceneError as reason:
        return work.refuse(str(reason))
    results = []
    with tempfile.TemporaryDirectory() as folder:
        for denoise in sorted({request["denoise"] for request in work.renders}):
            # Loads kernels, builds the BVH, wakes the denoiser: neither timed nor used.
            render(scene, {"spp": 1, "seed": 0, "denoise": denoise, "out": Path(folder) / "warm-up.exr"})
            for request in (r for r in work.renders if r["denoise"] == denoise):
                seconds = render(scene, request)
                results.append(request | {"seconds": seconds, "renderer": f"Cycles {bpy.app.version_string}"})
    work.finish(results)


if __name__ == "__main__":
    main(sys.argv[1])

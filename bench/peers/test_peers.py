"""What can be tested without a renderer. Run by `make peers`: python -m unittest discover bench/peers."""

import argparse
import math
import random
import struct
import tempfile
import unittest
import zlib
from pathlib import Path

import closed_forms
import exr
import features
import flat
import report
import run
import scene as scenes
import truth
from peers import PeerError

try:
    import mitsuba as mi
    import mitsuba_peer
    import numpy as np
except ImportError:
    mitsuba_peer = None

OBJ = """mtllib m.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vn 0 0 2
vn 0 0.5 1
vn 0 0 -1
usemtl a
f 1 2 3 4
usemtl	b
f -4//1 -3//2 -2//3
f 1/7/3 3/7/3 2/7/3 # a repeat, the other way round
f 1 2 2
usemtl nowhere
v 0 0 1
f 1 2 5
"""
MTL = "newmtl a\nKd 0.1 0.2 0.3\nnewmtl b\nKd 0.9 0.9 0.9\nKs 0.3 0.3 0.3\nNs 0\n"
TOML = """[[model]]
file = "m.obj"
{model}
[camera]
position = [0, 0, 5]
target = [0, 0, 0]
fov_y = 30.0
size = [8, 4]
[[light]]
kind = "spot"
position = [0, 0, 1]
direction = [0, 0, -2]
angle = 20.0
intensity = [1, 1, 1]
[[material]]
name = "nowhere"
diffuse = [0.5, 0.5, 0.5]
{more}
"""


class Sample(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = Path(self.temporary.name)
        (self.folder / "m.obj").write_text(OBJ)
        (self.folder / "m.mtl").write_text(MTL)

    def file(self, model="", more=""):
        file = self.folder / "s.toml"
        file.write_text(TOML.format(model=model, more=more))
        return file

    def load(self, model="", more="", **options):
        return scenes.load(self.file(model, more), **options)


class Scenes(Sample):
    def test_faces_become_fans_without_repeats_and_slivers(self):
        by_name = {mesh.material.name: mesh for mesh in self.load().meshes}
        self.assertEqual({name: len(mesh.positions) // 3 for name, mesh in by_name.items()}, {"a": 2, "nowhere": 1})
        self.assertEqual(by_name["a"].positions[3:], [(0, 0, 0), (1, 1, 0), (0, 1, 0)])

    def test_materials_come_from_the_library_and_the_scene(self):
        by_name = {
            m.name: m
            for m in self.load(more='[[material]]\nname = "a"\nspecular = [0.3, 0.3, 0.3]\nexponent = 9').materials()
        }
        self.assertEqual(by_name["a"], scenes.Material("a", (0.1, 0.2, 0.3), (0.3, 0.3, 0.3), 9.0))
        self.assertEqual(by_name["nowhere"].diffuse, (0.5, 0.5, 0.5))
        with self.assertRaisesRegex(scenes.SceneError, "'c' is in no model"):
            self.load(more='[[material]]\nname = "c"')

    def test_images_are_refused_unless_the_scene_replaces_them(self):
        (self.folder / "m.mtl").write_text(MTL + "newmtl c\nmap_Kd unused.png\n")
        self.load()
        (self.folder / "m.mtl").write_text(MTL.replace("newmtl b", "map_Kd -s 2 a.png\nnewmtl b"))
        with self.assertRaisesRegex(scenes.SceneError, "'a' has an image, the peers take none: give it a diffuse"):
            self.load()
        self.load(more='[[material]]\nname = "a"\ndiffuse = [0.3, 0.3, 0.3]')

    def test_energy_is_conserved_as_the_program_does_it(self):
        material = scenes.read_mtl(self.folder / "m.mtl")["b"]
        scenes.conserve_energy(material)
        self.assertAlmostEqual(material.diffuse[0], 0.75)
        self.assertAlmostEqual(material.specular[0], 0.25)
        self.assertEqual(material.exponent, 1.0)

    def test_normals_stay_in_front(self):
        front = (0.0, 0.0, 1.0)
        leaning = scenes.unit((0.0, 0.5, 1.0))
        self.assertEqual(scenes.shading_normals(front, [(0, 0, 2), (0, 0.5, 1), (0, 0, -1)]), [front, leaning, front])
        turned = scenes.shading_normals(front, [(0, 0, -2)] * 3)
        self.assertEqual(turned, [front] * 3)
        self.assertEqual(scenes.shading_normals(front, [(0, 0, 0)] * 3), [front] * 3)

    def test_models_are_scaled_then_turned_then_moved(self):
        place = scenes.transform({"scale": [2.0, 1.0, -1.0], "rotate": [90.0, 0.0, 90.0], "translate": [0.0, 0.0, 5.0]})
        points = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        corners, normals, coordinates = place(points, [(1.0, 0.0, 0.0)] * 3, [(0, 0), (1, 0), (0, 1)])
        # A mirror image keeps its front: two corners change places.
        for found, expected in zip(corners, [(0, 2, 5), (-1, 0, 5), (0, 0, 6)]):
            for a, b in zip(found, expected):
                self.assertAlmostEqual(a, b)
        self.assertAlmostEqual(normals[0][1], 0.5)
        self.assertEqual(coordinates, [(0, 0), (0, 1), (1, 0)])

    def test_camera_and_lights(self):
        scene = self.load(size=(16, 16))
        self.assertEqual((scene.camera.size, scene.camera.fov_y), ((16, 16), 30.0))
        self.assertEqual(scene.camera.frame(), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)))
        self.assertEqual((scene.lights[0]["direction"], scene.lights[0]["penumbra"]), ((0.0, 0.0, -1.0), 0.0))
        with self.assertRaisesRegex(scenes.SceneError, "lacks edge_v, radiance"):
            scenes.read_light({"kind": "area", "corner": [0, 0, 0], "edge_u": [1, 0, 0]})

    def test_built_in_scenes_and_witnesses_load(self):
        here = Path(__file__).parent
        for spec in ["box", here / "scenes" / "box-spot.toml", here / "scenes" / "box-area.toml"]:
            scene = scenes.load(spec)
            self.assertEqual(sum(len(mesh.positions) for mesh in scene.meshes), 3 * 2914)
            self.assertEqual([mesh.material.name for mesh in scene.meshes if not mesh.flat], ["teapot"])

    def test_flat_copies_have_the_same_triangles(self):
        (self.folder / "m.obj").write_text(OBJ.replace("usemtl a\nf 1 2 3 4\n", ""))
        original = self.load()
        copy = scenes.load(flat.write(self.file(), self.folder / "flat"))
        self.assertFalse(all(mesh.flat for mesh in original.meshes))
        self.assertTrue(all(mesh.flat for mesh in copy.meshes))
        corners = [sorted(p for mesh in s.meshes for p in mesh.positions) for s in (original, copy)]
        self.assertEqual(*corners)


class Lit(Sample):
    """Emission, skies, holes and panes as the scene file states them."""

    def material(self, mtl="", more="", name="a"):
        (self.folder / "m.mtl").write_text(MTL.replace("newmtl b", f"{mtl}\nnewmtl b"))
        found = {material.name: material for material in self.load(more=more).materials()}
        return found.get(name)

    def test_surfaces_emit_as_the_library_and_the_scene_state(self):
        sides = '[[material]]\nname = "a"\nemitting_sides = "back"\n'
        lamp = self.material("Ke 3 2 1", sides)
        self.assertEqual((lamp.emission, lamp.sides, lamp.emits()), ((3.0, 2.0, 1.0), "back", True))
        self.assertEqual(self.material("Ke 3 2 1", sides + "emission = [4, 5, 6]").emission, (4, 5, 6))
        self.assertFalse(self.material().emits())
        for mtl, more, words in (
            ("Ke 3 2 1", "", "state its emitting_sides"),
            ("map_Ke a.png", "", "has an image of emission"),
            ("Ke 3 2 1\nmap_d a.png", sides, "emits and has holes"),
        ):
            with self.assertRaisesRegex(scenes.SceneError, words):
                self.material(mtl, more)
        with self.assertRaisesRegex(scenes.SceneError, "is a surface that is seen"):
            scenes.read_light(closed_forms.AREA | {"visible": True})

    def test_panes_let_the_fraction_of_their_library_pass(self):
        for mtl, passes in (
            ("d 0.25", (0.75, 0.75, 0.75)),
            ("Tr 0.75", (0.75, 0.75, 0.75)),
            ("d 0.25\nTr 1\nTf 0.2 0.4 1", (0.15, 0.3, 0.75)),
            ("Tr 0.75\nTf 0 0 0", (0.75, 0.75, 0.75)),
            ("d 0.5", None),
            ("Tf 0.2 0.4 1", None),
            ("Ke 3 2 1\nd 0.25", (0.75, 0.75, 0.75)),
        ):
            found = self.material(mtl)
            self.assertEqual(found.passes and tuple(round(x, 9) for x in found.passes), passes, mtl)
            self.assertFalse(found.emits())
        self.assertIsNone(self.material("d 0"))
        self.assertIsNotNone(self.material("d 0", '[[material]]\nname = "a"\nhidden = false'))

    def test_panes_let_the_fraction_of_the_scene_file_pass(self):
        head = '[[material]]\nname = "a"\n'
        for keys, passes in (
            ("thin = true", (0.1, 0.2, 0.3)),
            ("thin = true\nopacity = 0.5", (0.05, 0.1, 0.15)),
            ("thin = true\ndiffuse = [0.5, 0.5, 1.0]", (0.5, 0.5, 1.0)),
            ("opacity = 0.25", (0.75, 0.75, 0.75)),
            ("opacity = 1.0", None),
            ("thin = false", None),
        ):
            self.assertEqual(self.material("d 0.25" if passes is None else "", head + keys).passes, passes, keys)

    def test_holes_have_an_image_and_coordinates(self):
        leaf = self.material("map_d leaf.png\nd 0.1")
        self.assertEqual((leaf.opacity_map, leaf.passes, leaf.hidden), (self.folder / "leaf.png", None, False))
        obj = OBJ.replace("usemtl a", "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 2\nusemtl a")
        obj = obj.replace("f 1 2 3 4", "f 1/1 2/2 3/3 4/4")
        (self.folder / "m.obj").write_text(obj)
        mesh = next(mesh for mesh in self.load().meshes if mesh.material.name == "a")
        self.assertEqual(mesh.coordinates, [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0.5, 2)])
        with self.assertRaisesRegex(scenes.SceneError, "none of its options"):
            self.material("map_d -s 2 2 leaf.png")

    def test_skies(self):
        self.assertIsNone(self.load().sky)
        self.assertEqual(self.load(more="[environment]").sky, scenes.Sky())
        found = self.load(more='[environment]\nimage = "a.exr"\nradiance = [1, 2, 3]\nrotate = 30').sky
        self.assertEqual(found, scenes.Sky((1, 2, 3), self.folder / "a.exr", 30.0))

    def test_the_scenes_that_are_measured_load(self):
        features.generate.main()
        found = [scenes.load(spec) for spec in features.SCENES[1:]]
        lamps = [sum(len(mesh.positions) // 3 for mesh in s.meshes if mesh.material.emits()) for s in found]
        self.assertEqual(lamps, [2, 1280, 0, 0, 2, 2, 2, 0])
        self.assertEqual([k for k, s in enumerate(found) if s.sky], [2, 3, 7])
        ball = next(mesh for mesh in found[1].meshes if mesh.material.emits())
        centre = (0.25, 1.3, 0.1)
        self.assertTrue(all(scenes.dot(n, scenes.sub(p, centre)) > 0.0 for p, n in zip(ball.positions, ball.normals)))

    def test_pixels_that_show_emitters_count_for_no_energy(self):
        file = self.folder / "a.exr"
        exr.write(file, (3, 1), {"R": [1.0, 2.0, 4.0], "G": [0.5, 0.0, 0.5], "B": [0.0, 8.0, 0.0]})
        self.assertEqual(features.sums(file, [True, False, True]), [5.0, 1.0, 0.0])

    def test_bars(self):
        row = {"energy": 1.0, "channels": [1.0, 0.994, 1.0], "relmse": 2e-3}
        self.assertEqual(features.missed(row, 1e-3), ["energy", "relMSE"])
        self.assertEqual(features.missed(row | {"channels": [1.004] * 3}, 3e-3), [])


@unittest.skipIf(mitsuba_peer is None, "Mitsuba is not installed")
class Mitsuba(Sample):
    """What Mitsuba is given, seen by single rays."""

    def setUp(self):
        super().setUp()
        mi.set_variant("scalar_rgb")

    def square(self, more="", mtl=""):
        """A scene of the unit square, its front towards +z."""
        corners = ("0 0", "1 0", "1 1", "0 1")
        lines = ["mtllib m.mtl"] + [f"v {corner} 0\nvt {corner}" for corner in corners]
        (self.folder / "m.obj").write_text("\n".join([*lines, "usemtl a", "f 1/1 2/2 3/3 4/4", ""]))
        (self.folder / "m.mtl").write_text(f"newmtl a\nKd 0.5 0.5 0.5\n{mtl}\n")
        text = TOML.format(model="", more=more)
        text = text.replace('[[material]]\nname = "nowhere"\ndiffuse = [0.5, 0.5, 0.5]\n', "")
        (self.folder / "s.toml").write_text(text)
        return scenes.load(self.folder / "s.toml")

    def hit(self, built, towards, origin):
        return built.ray_intersect(mi.Ray3f(origin, towards))

    def test_surfaces_emit_on_the_stated_sides(self):
        for sides, expected in (("front", (3.0, 0.0)), ("back", (0.0, 3.0)), ("both", (3.0, 3.0))):
            scene = self.square(f'[[material]]\nname = "a"\nemission = [3, 2, 1]\nemitting_sides = "{sides}"')
            built = mitsuba_peer.build(scene)
            found = []
            for z in (1.0, -1.0):
                si = self.hit(built, [0.0, 0.0, -z], [0.4, 0.3, z])
                found.append(0.0 if si.emitter(built) is None else si.emitter(built).eval(si)[0])
            self.assertEqual(tuple(found), expected, sides)

    def test_panes_let_light_of_each_channel_pass(self):
        scene = self.square('[[material]]\nname = "a"\nthin = true\ndiffuse = [0.2, 0.4, 0.9]')
        self.assertEqual((len(mitsuba_peer.channels(scene)), mitsuba_peer.integrator(scene)), (3, "volpath"))
        for channel, passes in enumerate((0.2, 0.4, 0.9)):
            # The interaction does not keep the scene alive.
            built = mitsuba_peer.build(scene, channel)
            si = self.hit(built, [0.0, 0.6, -0.8], [0.4, 0.1, 0.5])
            self.assertAlmostEqual(si.bsdf().eval_null_transmission(si)[0], passes, 6)
            self.assertEqual(max(si.bsdf().eval(mi.BSDFContext(), si, [0.0, 0.0, 1.0])), 0.0)
        grey = self.square('[[material]]\nname = "a"\nopacity = 0.4')
        self.assertEqual(len(mitsuba_peer.channels(grey)), 1)

    def test_holes_lie_where_the_image_has_them(self):
        features.generate.write_png(self.folder / "leaf.png", [[255, 0, 0], [255, 255, 0]])
        built = mitsuba_peer.build(self.square(mtl="map_d leaf.png"))
        for x, y, is_hole in ((1, 5, False), (3, 5, True), (5, 5, True), (1, 1, False), (3, 1, False), (5, 1, True)):
            si = self.hit(built, [0.0, 0.0, -1.0], [x / 6.0, (y + 1.0) / 8.0, 1.0])
            self.assertEqual(si.bsdf().eval_null_transmission(si)[0], float(is_hole), (x, y))

    def test_alpha_is_bilinear_before_it_is_cut(self):
        parts = mitsuba_peer.finer(np.array([[0.0, 8.0], [0.0, 8.0]]), 4)
        self.assertEqual(parts.shape, (8, 8))
        # The image repeats: both edges of the left texel are half way to the right one.
        for found, expected in zip(parts[3], (3.0, 1.0, 1.0, 3.0, 5.0, 7.0, 7.0, 5.0)):
            self.assertAlmostEqual(found, expected)

    def test_panoramas_show_what_ours_show(self):
        width, height = 8, 4
        for texel, rotate, towards in (
            ((3, 1), 0.0, None),
            ((6, 2), 0.0, None),
            ((2, 0), 50.0, None),
            ((4, 1), 90.0, (-1.0, 0.3, 0.0)),
        ):
            planes = {name: [0.0] * (width * height) for name in "RGB"}
            for k, name in enumerate("RGB"):
                planes[name][texel[1] * width + texel[0]] = 1.0 + k
            exr.write(self.folder / "sky.exr", (width, height), planes)
            scene = self.square(f'[environment]\nimage = "sky.exr"\nradiance = [1, 2, 1]\nrotate = {rotate}')
            sky = mitsuba_peer.build(scene).environment()
            if towards:
                self.assertGreater(self.along(sky, towards)[0], 0.3)
            seen = 0
            for k in range(400):
                direction = scenes.unit([random.gauss(0.0, 1.0) for _ in range(3)])
                expected = bilinear(planes["R"], (width, height), direction, math.radians(rotate))
                found = self.along(sky, direction)
                seen += expected > 0.0
                for channel, factor in enumerate((1.0, 4.0, 3.0)):
                    self.assertAlmostEqual(found[channel], factor * expected, 3)
            self.assertGreater(seen, 10)

    def along(self, sky, direction):
        si = mi.SurfaceInteraction3f()
        si.wi = [-x for x in direction]
        return sky.eval(si)


def bilinear(texels, size, direction, turn):
    """A panorama's texels along a direction, as glsl/include/sky.glsl reads them."""
    width, height = size
    azimuth = math.atan2(direction[0], -direction[2]) + turn
    column = ((azimuth / math.tau + 0.5) % 1.0) * width - 0.5
    row = math.acos(max(-1.0, min(1.0, direction[1]))) / math.pi * height - 0.5
    left, top = math.floor(column), math.floor(row)

    def texel(x, y):
        return texels[min(max(y, 0), height - 1) * width + x % width]

    def along(y):
        return texel(left, y) + (texel(left + 1, y) - texel(left, y)) * (column - left)

    return along(top) + (along(top + 1) - along(top)) * (row - top)


class Files(Sample):
    def test_pictures_come_back_bit_by_bit(self):
        planes = {name: [random.random() for _ in range(15)] for name in ("R", "G", "B", "variance.R")}
        exr.write(self.folder / "a.exr", (5, 3), planes)
        size, found = exr.read(self.folder / "a.exr")
        self.assertEqual((size, sorted(found)), ((5, 3), sorted(planes)))
        for name, values in planes.items():
            self.assertEqual(list(found[name]), [exr.as_array([v])[0] for v in values])

    def test_zip_is_undone(self):
        width, height = 3, 18
        planes = {name: [random.random() for _ in range(width * height)] for name in "RGB"}
        exr.write(self.folder / "a.exr", (width, height), planes)
        whole = (self.folder / "a.exr").read_bytes()
        (first,) = struct.unpack_from("<Q", whole, whole.index(b"screenWindowWidth\0float\0") + 33)
        lines = [whole[first + 8 + y * (8 + 36) :][:36] for y in range(height)]
        blocks = []
        for y in (0, 16):
            raw = b"".join(lines[y : y + 16])
            parted = raw[0::2] + raw[1::2]
            steps = bytes([parted[0], *((b - a + 128) & 255 for a, b in zip(parted, parted[1:]))])
            packed = zlib.compress(steps)
            # A block that does not shrink is stored as it is.
            blocks.append((y, packed if len(packed) < len(raw) else raw))
        compression = b"compression\0compression\0\1\0\0\0"
        head = whole[: first - 8 * height].replace(compression + b"\0", compression + b"\3")
        offsets, body = b"", b""
        for y, block in blocks:
            offsets += struct.pack("<Q", len(head) + 16 + len(body))
            body += struct.pack("<ii", y, len(block)) + block
        (self.folder / "b.exr").write_bytes(head + offsets + body)
        self.assertEqual(exr.read(self.folder / "b.exr"), exr.read(self.folder / "a.exr"))

    def test_wrong_files_are_refused(self):
        with self.assertRaisesRegex(ValueError, "14 values, 15 expected"):
            exr.write(self.folder / "a.exr", (5, 3), {"R": [0.0] * 14})
        (self.folder / "b.exr").write_bytes(b"\0" * 16)
        with self.assertRaisesRegex(ValueError, "not a one-part"):
            exr.read(self.folder / "b.exr")


class ClosedForms(unittest.TestCase):
    def test_polygon_formula_agrees_with_a_sum_over_the_light(self):
        light, point, count = closed_forms.SLANTED, (0.1, 0.0, -0.3), 200
        area = scenes.cross(light["edge_u"], light["edge_v"])
        total = 0.0
        for k in range(count * count):
            u, v = (k % count + 0.5) / count, (k // count + 0.5) / count
            offset = closed_forms.add(scenes.scaled(light["edge_u"], u), scenes.scaled(light["edge_v"], v))
            to_light = scenes.sub(closed_forms.add(light["corner"], offset), point)
            total += to_light[1] ** 2 / scenes.dot(to_light, to_light) ** 2 * abs(area[1]) / count**2
        self.assertAlmostEqual(
            closed_forms.polygon_irradiance(light, point)[0] / (light["radiance"][0] * total), 1.0, 5
        )

    def test_a_spot_fades_linearly_in_the_angle(self):
        light = {"kind": "spot", "position": (0, 1, 0), "direction": (0, -1, 0), "angle": 40.0, "penumbra": 0.5}
        light["intensity"] = (1.0, 1.0, 1.0)

        def share(degrees):
            x = math.tan(math.radians(degrees))
            return closed_forms.point_irradiance(light, (x, 0.0, 0.0))[0] / math.cos(math.radians(degrees)) ** 3

        for degrees, expected in ((0, 1.0), (19.9, 1.0), (25, 0.75), (30, 0.5), (39, 0.05), (41, 0.0)):
            self.assertAlmostEqual(share(degrees), expected, 9)

    def test_the_sphere_is_closed(self):
        points, faces = closed_forms.icosphere(2)
        self.assertEqual((len(points), len(faces)), (162, 320))
        sides = [tuple(sorted((face[i - 1], face[i]))) for face in faces for i in range(3)]
        self.assertTrue(all(sides.count(side) == 2 for side in set(sides)))


class Judge:
    """Compares as the program does."""

    def compare(self, image, reference, *_):
        (_, v), (_, r) = exr.read(image), exr.read(reference)
        pairs = [(v[name][k], r[name][k]) for name in "RGB" for k in range(len(r[name]))]
        return {"relmse": sum(((a - b) / (b + 0.01)) ** 2 for a, b in pairs) / len(pairs), "flip": 0.1}


class Truths(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def picture(self, name, value, size=(40, 50), channels="RGB"):
        file = self.folder / f"{name}.exr"
        exr.write(file, size, {c: [value() for _ in range(size[0] * size[1])] for c in channels})
        return file

    def test_the_noise_of_the_halves_is_taken_out(self):
        noisy = random.Random(1)
        halves = [self.picture(half, lambda: 0.99 + noisy.gauss(0.0, 0.02)) for half in "ab"]
        judge, mean = Judge(), self.folder / "mean.exr"
        found = truth.of_halves(halves, "two halves", judge, mean)
        self.assertAlmostEqual(found.noise, 2e-4, delta=1e-5)
        self.assertAlmostEqual(found.scatter, found.noise * math.sqrt(2 / 6000))
        for value, error in ((1.01, 4e-4), (0.99, 0.0)):
            errors = found.errors(judge.compare(self.picture("v", lambda: value), mean))
            self.assertAlmostEqual(errors["relmse"], error + 2e-4, delta=3e-5)
            self.assertAlmostEqual(errors["relmse_debiased"], error, delta=2e-5)
        # The definition: the mean of (v - a)(v - b)/(r + 0.01)².
        (_, a), (_, b), (_, r) = (exr.read(file) for file in (*halves, mean))
        terms = [(0.99 - a[c][k]) * (0.99 - b[c][k]) / (r[c][k] + 0.01) ** 2 for c in "RGB" for k in range(2000)]
        self.assertAlmostEqual(errors["relmse_debiased"], sum(terms) / len(terms), 8)

    def test_one_picture_takes_nothing_out(self):
        single = truth.Truth(Path("r.exr"), "r.exr")
        self.assertEqual(single.errors({"relmse": 1.0}), {"relmse": 1.0})
        self.assertIsNone(single.errors(None))

    def test_halves_that_do_not_match_are_refused(self):
        a, mean = self.picture("a", lambda: 1.0, (4, 4)), self.folder / "mean.exr"
        for b, words in (
            (self.picture("b", lambda: 1.0, (4, 5)), "4×5"),
            (self.picture("c", lambda: 1.0, (4, 4), "RG"), "no channel B"),
        ):
            with self.assertRaisesRegex(PeerError, words):
                truth.of_halves([a, b], "", Judge(), mean)

    def test_references_on_the_command_line(self):
        self.assertEqual(run.pictures("a.exr"), [Path("a.exr")])
        self.assertEqual(run.pictures("a.exr,b.exr"), [Path("a.exr"), Path("b.exr")])
        for wrong in ("", "a.exr,b.exr,c.exr"):
            with self.assertRaisesRegex(argparse.ArgumentTypeError, "two halves"):
                run.pictures(wrong)


class Reports(unittest.TestCase):
    def test_path_tracers_follow_their_law_from_the_most_samples(self):
        falls = [(64, 10.0, 1.2e-2), (16, 2.0, 6e-2)]
        seconds, how = report.by_samples(falls, 1e-3, 0.0)
        self.assertAlmostEqual(seconds, 120.0)
        self.assertIn("768 spp", how)
        self.assertAlmostEqual(report.by_samples(falls, 2.4e-2, 0.0)[0], 5.0)
        # What the noise of the reference hides decides nothing.
        self.assertAlmostEqual(report.by_samples([*falls, (256, 40.0, -1e-5)], 1e-3, 1e-4)[0], 120.0)
        self.assertIsNone(report.by_samples(falls, 1e-3, 0.1)[0])

    def test_denoised_pictures_follow_none(self):
        falls = [(1, 1.0, 1e-1), (4, 10.0, 1e-2)]
        self.assertEqual(report.between(falls, 0.2), (1.0, "better already at 1 spp"))
        seconds, how = report.between(falls, 10**-1.5)
        self.assertAlmostEqual(seconds, 10**0.5)
        self.assertEqual(how, "between 1 and 4 spp")
        self.assertEqual(report.between(falls, 1e-3), (None, "not reached at 4 spp"))
        self.assertEqual(report.between([*falls, (16, 30.0, -1e-5)], 1e-3)[0], 30.0)

    def table(self, **errors):
        error = {"relmse": 1.1e-3, "relmse_debiased": 1e-3, "flip": 0.02, "energy_ratio": 1.0} | errors
        worse = error | {"relmse": 1.01e-2, "relmse_debiased": 1e-2}
        if "relmse_debiased" in errors:
            del error["relmse_debiased"], worse["relmse_debiased"]
        peer = {"setting": "16 spp", "spp": 16, "seconds": 2.0, "error": worse, "version": "3"}
        ours = {"renderer": "lightpaths", "spp": None, "error": error, "version": "a GPU"}
        rows = [
            peer | {"renderer": "Mitsuba, path"},
            {"renderer": "Cycles, path", "setting": "no Phong", "spp": None, "seconds": None, "error": None},
            peer | {"renderer": "Cycles + Open Image Denoise"},
            ours | {"setting": "paper: first frame", "seconds": 5.0},
            ours | {"setting": "paper: light moved", "seconds": 0.1},
        ]
        common = {"scene": "box", "size": [4, 4], "threads": 1, "processor": "x", "reference": "r"}
        return common | {"reference_noise": 1e-4, "reference_scatter": 1e-6, "rows": rows}

    def write(self, table):
        with tempfile.TemporaryDirectory() as folder:
            return report.write(table, Path(folder))

    def test_a_table_holds_every_row_and_says_what_is_missing(self):
        table = self.table()
        text = self.write(table)
        self.assertIn("| Mitsuba, path | 16 spp | 2 | 0.0101 | 0.01 | 0.02 | 1 |", text)
        self.assertIn("| Cycles, path | no Phong | NaN | NaN | NaN | NaN | NaN |", text)
        self.assertIn("Its noise is 0.0001 relMSE", text)
        self.assertIn("| Mitsuba, path | relMSE | 20 | 200× | 4× | 160 spp, by error · spp = 0.16", text)
        self.assertIn("| Mitsuba, path | FLIP | 2 | 20× | 0.4× | better already at 16 spp |", text)
        self.assertIn("| Cycles + Open Image Denoise | relMSE | NaN | NaN | NaN | not reached at 16 spp |", text)
        self.assertAlmostEqual(table["equal_error"]["Mitsuba, path"]["relMSE"]["frames"], 200.0)
        self.assertAlmostEqual(table["equal_error"]["Mitsuba, path"]["relMSE"]["firsts"], 4.0)

    def test_one_reference_leaves_its_noise_in_and_says_so(self):
        table = self.table(relmse_debiased=None) | {"reference_noise": None, "reference_scatter": 0.0}
        text = self.write(table)
        self.assertIn("The noise of that one picture is in every relMSE.", text)
        self.assertIn("| Mitsuba, path | 16 spp | 2 | 0.0101 | NaN | 0.02 | 1 |", text)
        self.assertAlmostEqual(table["equal_error"]["Mitsuba, path"]["relMSE"]["seconds"], 2.0 * 1.01e-2 / 1.1e-3)

    def test_an_error_below_the_noise_is_compared_with_nothing(self):
        table = self.table() | {"reference_scatter": 1e-3}
        self.write(table)
        found = table["equal_error"]["Mitsuba, path"]["relMSE"]
        self.assertEqual(found, {"seconds": None, "how": "ours is not told from the reference's noise"})


if __name__ == "__main__":
    unittest.main()

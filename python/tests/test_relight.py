"""Pictures, edits, layers and readings."""

import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np
from scenes import SIZE, load, renderer, write

import lightpaths

WIDTH, HEIGHT = SIZE
LAYERS = ["beauty", "direct", "indirect", "irradiance", "albedo", "normal", "position", "depth"]


class Folder(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.renderer = renderer()

    def test_layers_are_arrays_of_floats(self):
        for name in LAYERS:
            layer = self.renderer.render(name)
            self.assertEqual(layer.dtype, np.float32, name)
            self.assertEqual(layer.shape, (HEIGHT, WIDTH) if name == "depth" else (HEIGHT, WIDTH, 3), name)
            self.assertTrue(np.isfinite(layer).all() or name == "depth", name)
            self.assertTrue(layer.flags["C_CONTIGUOUS"] and layer.flags["WRITEABLE"], name)
            self.assertTrue(layer.any(), name)

    def test_direct_and_indirect_light_add_up(self):
        whole, direct, indirect = (self.renderer.render(name) for name in LAYERS[:3])
        self.assertTrue(indirect.any() and direct.any())
        # An edge pixel is a sum of up to 16 samples, each rounded by 2⁻²⁴.
        np.testing.assert_allclose(direct + indirect, whole, rtol=1e-6, atol=1e-12)

    def test_an_array_stays_as_it_was_when_the_scene_changes(self):
        before = self.renderer.render()
        kept = before.copy()
        self.renderer.lights["lamp"].emission = (3.0, 0.0, 0.0)
        after = self.renderer.render()
        self.renderer.lights["lamp"].emission = 1.5
        np.testing.assert_array_equal(before, kept)
        self.assertTrue((after[..., 1] == 0.0).all() and after[..., 0].any())

    def test_a_picture_is_linear_in_the_light(self):
        lamp = self.renderer.lights["lamp"]
        one = self.renderer.render()
        lamp.emission = np.array([3.0, 3.0, 3.0])
        two = self.renderer.render()
        lamp.emission = 1.5
        # A factor of two is exact.
        np.testing.assert_array_equal(two, 2.0 * one)

    def test_a_light_that_is_off_gives_none(self):
        lamp = self.renderer.lights["lamp"]
        before = self.renderer.render()
        lamp.on = False
        self.assertFalse(lamp.on)
        self.assertFalse(self.renderer.render().any())
        lamp.on = True
        np.testing.assert_array_equal(self.renderer.render(), before)

    def test_a_frame_is_computed_only_after_a_change(self):
        self.renderer.lights["lamp"].position = (0.1, 1.6, 0.2)
        self.renderer.render()
        first = self.renderer.frame_ms
        self.renderer.render("indirect")
        self.assertEqual(self.renderer.frame_ms, first)
        self.renderer.lights["lamp"].position = (0.0, 1.75, 0.2)
        self.renderer.render()
        self.assertNotEqual(self.renderer.frame_ms, first)

    def test_codes_get_brighter_with_the_exposure(self):
        dark, bright = self.renderer.display(), self.renderer.display(exposure=1.0)
        self.assertEqual(dark.dtype, np.uint8)
        self.assertEqual(dark.shape, (HEIGHT, WIDTH, 3))
        self.assertTrue((bright >= dark).all() and (bright > dark).any())
        np.testing.assert_array_equal(self.renderer.display(), dark)

    def test_codes_follow_tone_curve_and_white_balance(self):
        plain = self.renderer.display(exposure=2.0)
        seen = [plain]
        for arguments in [
            {"tone": "none"},
            {"tone": "filmic"},
            {"tone": "aces"},
            {"tone": "agx"},
            {"white_balance": 3000.0},
            {"tint": 20.0},
        ]:
            codes = self.renderer.display(exposure=2.0, **arguments)
            self.assertFalse(any((codes == other).all() for other in seen), arguments)
            seen.append(codes)
        cool = self.renderer.display(exposure=2.0, white_balance=3000.0).mean(axis=(0, 1))
        self.assertGreater(cool[2] / cool[0], plain.mean(axis=(0, 1))[2] / plain.mean(axis=(0, 1))[0])
        neutral = self.renderer.display(exposure=2.0, tone="standard", white_balance=6504.0, tint=0.0)
        np.testing.assert_array_equal(neutral, plain)
        np.testing.assert_array_equal(self.renderer.display(exposure=2.0), plain)

    def test_codes_are_those_of_the_scene_file_unless_stated(self):
        own = renderer(changes=["picture.exposure=1.0", "picture.tone=agx"])
        codes = own.display()
        np.testing.assert_array_equal(codes, own.display(exposure=1.0, tone="agx"))
        self.assertFalse((codes == own.display(tone="standard")).all())
        self.assertFalse((codes == own.display(exposure=0.0)).all())

    def test_many_lighting_conditions(self):
        lamp = self.renderer.lights["lamp"]

        def pictures():
            for number in range(20):
                lamp.position = (0.04 * number - 0.4, 1.6, 0.2)
                yield self.renderer.render()

        first, again = list(pictures()), list(pictures())
        lamp.position = (0.0, 1.75, 0.2)
        for number, (one, other) in enumerate(zip(first, again)):
            np.testing.assert_array_equal(one, other)
            self.assertTrue((one != first[number - 1]).any(), number)

    def test_the_size_changes(self):
        self.assertEqual(self.renderer.size, SIZE)
        before = self.renderer.render()
        self.renderer.size = (10, 12)
        self.assertEqual(self.renderer.render().shape, (12, 10, 3))
        self.renderer.size = SIZE
        np.testing.assert_array_equal(self.renderer.render(), before)

    def test_threads_take_turns(self):
        lamp = self.renderer.lights["lamp"]
        found, threads = [], []

        def work():
            for number in range(10):
                lamp.power = 100.0 + number
                found.append(self.renderer.render().shape)

        threads = [threading.Thread(target=work, daemon=True) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=120.0)
        lamp.emission = 1.5
        self.assertEqual(found, 30 * [(HEIGHT, WIDTH, 3)])


class Edits(Folder):
    """An edit gives the bits of a renderer that has never seen anything else."""

    OFFSET = (1000.0, -20.0, 300.0)

    def test_edits_equal_a_cold_start(self):
        scene = write(self.folder, self.OFFSET)
        x, y, z = self.OFFSET
        edited = renderer(scene)
        before = edited.render()
        edited.lights["lamp"].position = (x - 0.3, y + 1.5, z + 0.1)
        edited.lights["spot"].emission = (1.0, 2.0, 3.0)
        edited.lights["spot"].direction = (0.0, -2.0, 0.0)
        edited.lights["sun"].on = False
        edited.materials["red"].diffuse = (0.2, 0.3, 0.6)
        edited.camera.look((x + 0.2, y + 1.1, z + 3.5), (x, y + 0.9, z))
        edited.camera.fov_y = 45.0
        cold = renderer(
            scene,
            changes=[
                f"light.lamp.position=[{x - 0.3}, {y + 1.5}, {z + 0.1}]",
                "light.spot.intensity=[1.0, 2.0, 3.0]",
                "light.spot.direction=[0.0, -2.0, 0.0]",
                "light.sun.on=false",
                "material.red.diffuse=[0.2, 0.3, 0.6]",
                f"camera.position=[{x + 0.2}, {y + 1.1}, {z + 3.5}]",
                f"camera.target=[{x}, {y + 0.9}, {z}]",
                "camera.fov_y=45",
            ],
        )
        self.assertTrue((edited.render() != before).any())
        for layer in LAYERS:
            np.testing.assert_array_equal(edited.render(layer), cold.render(layer), layer)

    def test_a_moved_model_equals_a_cold_start(self):
        corners = "".join(f"v {x} {y} {z}\n" for x in (0, 0.3) for y in (0, 0.4) for z in (0, 0.3))
        faces = "".join(f"f {face}\n" for face in ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"))
        (self.folder / "stool.obj").write_text(corners + faces)
        scene = write(self.folder)
        stool = '[[model]]\nfile = "stool.obj"\nname = "stool"\nmovable = true\ntranslate = [0.3, 0.01, 0.5]\n'
        scene.write_text(scene.read_text() + stool)
        moved = ["model.stool.translate=[-0.6, 0.01, 0.4]"]
        edited, cold = renderer(scene), renderer(scene, changes=moved)
        before = edited.render()
        lamp, red = edited.lights["lamp"], edited.materials["red"]
        stages = []
        edited.set_scene(load(scene, changes=moved), progress=lambda stage, done, total: stages.append(stage))
        self.assertTrue(stages)
        self.assertTrue((edited.render() != before).any())
        for layer in LAYERS:
            np.testing.assert_array_equal(edited.render(layer), cold.render(layer), layer)
        # Lights and materials are found by name in the new scene.
        lamp.on, cold.lights["lamp"].on = False, False
        red.diffuse = cold.materials["red"].diffuse = (0.2, 0.3, 0.6)
        np.testing.assert_array_equal(edited.render(), cold.render())
        edited.set_scene(load("box"))
        np.testing.assert_array_equal(edited.render(), renderer("box").render())
        self.assertRaises(KeyError, lambda: edited.lights["sun"])

    def test_a_scene_that_cannot_be_traced_leaves_the_one_before(self):
        edited = renderer(write(self.folder))
        before = edited.render()

        def refuse(stage, done, total):
            raise ZeroDivisionError

        self.assertRaises(ZeroDivisionError, edited.set_scene, load("box"), progress=refuse)
        np.testing.assert_array_equal(edited.render(), before)
        self.assertEqual(len(edited.lights), 4)

    def test_positions_are_those_of_the_file(self):
        scene = load(write(self.folder, self.OFFSET))
        low, high = np.array(scene.bounds)
        np.testing.assert_allclose(low, np.array(load().bounds[0]) + self.OFFSET, atol=1e-5)
        relit = lightpaths.Renderer(scene)
        found = relit.render("position")
        is_surface = np.isfinite(relit.render("depth"))
        self.assertTrue(is_surface.any())
        # Positions are 32-bit floats: at 1000 m a step is 6e-5 m.
        self.assertTrue((found[is_surface] >= low - 1e-4).all() and (found[is_surface] <= high + 1e-4).all())
        lamp, target = relit.lights["lamp"], np.array(self.OFFSET) + (0.25, 1.5, -0.125)
        lamp.position = target
        np.testing.assert_allclose(lamp.position, target, atol=1e-6)
        np.testing.assert_allclose(relit.camera.target, np.array(self.OFFSET) + (0, 1, 0), atol=1e-5)

    def test_lights_come_and_go(self):
        relit = renderer()
        before = relit.render()
        added = relit.lights.add("fill", "spot", position=(0.5, 1.5, 0.5), direction=(0, -1, 0), angle=40, emission=2)
        self.assertEqual((added.kind, list(relit.lights)), ("spot", ["lamp", "fill"]))
        self.assertTrue((relit.render() > before).any())
        relit.lights.remove("fill")
        np.testing.assert_array_equal(relit.render(), before)
        with self.assertRaises(lightpaths.UsageError):
            added.on = False
        with self.assertRaises(lightpaths.UsageError):
            relit.lights.add("lamp", "point", position=(0, 1, 0), emission=1)
        with self.assertRaisesRegex(lightpaths.UsageError, "direction"):
            relit.lights.add("new", "spot", position=(0, 1, 0), emission=1, angle=40)

    def test_kept_light_paths_give_the_same_bits(self):
        first = renderer(cache=self.folder / "paths").render()
        self.assertEqual(len(list((self.folder / "paths").iterdir())), 1)
        stages = []
        again = renderer(cache=self.folder / "paths", progress=lambda stage, *_: stages.append(stage))
        np.testing.assert_array_equal(again.render(), first)
        self.assertNotIn("light paths", stages)


class Properties(Folder):
    """What lights, materials and cameras have."""

    def test_properties_are_read_back(self):
        relit = renderer(write(self.folder))
        lights = relit.lights
        self.assertEqual(lights.keys(), ["lamp", "spot", "panel", "sun"])
        self.assertEqual([light.kind for light in lights.values()], ["point", "spot", "area", "directional"])
        for light in lights.values():
            light.power = 500.0
            light.kelvin = 3000.0
            self.assertAlmostEqual(light.power, 500.0, places=2)
            self.assertAlmostEqual(light.kelvin, 3000.0, places=0)
            light.emission = (1.0, 0.5, 0.25)
            self.assertEqual(light.emission, (1.0, 0.5, 0.25))
        spot = lights["spot"]
        spot.angle, spot.penumbra, spot.direction = 30.0, 0.25, (0.0, 0.0, -3.0)
        self.assertAlmostEqual(spot.angle, 30.0, places=4)
        self.assertEqual((spot.penumbra, spot.direction), (0.25, (0.0, 0.0, -1.0)))
        panel = lights["panel"]
        panel.area = ((0.0, 1.75, 0.0), (0.0, 0.0, 0.5), (-0.5, 0.0, 0.0))
        np.testing.assert_allclose(panel.position, (-0.25, 1.75, 0.25), atol=1e-6)
        np.testing.assert_allclose(panel.area[1:], ((0.0, 0.0, 0.5), (-0.5, 0.0, 0.0)))
        wall = relit.materials["red"]
        self.assertTrue(wall.editable)
        wall.diffuse, wall.specular, wall.exponent = 0.25, (0.5, 0.25, 0.125), 20.0
        self.assertEqual((wall.diffuse, wall.specular, wall.exponent), (3 * (0.25,), (0.5, 0.25, 0.125), 20.0))
        self.assertTrue(np.isfinite(relit.render()).all())

    def test_layers_of_lights_add_up_to_the_picture(self):
        relit = renderer(write(self.folder))
        relit.lights["spot"].on = False
        whole = relit.render()
        layers = relit.layers()
        self.assertEqual(list(layers), ["lamp", "panel", "sun"])
        total = np.zeros(whole.shape)
        for name, light in layers.items():
            self.assertEqual(sorted(light), ["direct", "indirect"])
            for layer in light.values():
                self.assertEqual((layer.dtype, layer.shape), (np.float32, whole.shape))
                total += layer
            self.assertTrue(light["direct"].any() and light["indirect"].any(), name)
        np.testing.assert_allclose(total, whole, rtol=1e-6, atol=1e-9)
        # The lights are as before, and so is the picture.
        self.assertEqual([light.on for light in relit.lights.values()], [True, False, True, True])
        np.testing.assert_array_equal(relit.render(), whole)

    def test_meters_measure(self):
        relit = renderer(write(self.folder))
        floor = relit.measure()["floor"]
        self.assertEqual((floor.lux.shape, floor.lux.dtype), ((2, 3), np.float64))
        self.assertEqual((floor.irradiance.shape, floor.direct.shape), ((2, 3, 3), (2, 3, 3)))
        np.testing.assert_allclose(floor.lux, 683.0 * floor.irradiance @ [0.2126, 0.7152, 0.0722], rtol=1e-5)
        self.assertTrue((floor.irradiance > floor.direct).all())
        self.assertAlmostEqual(floor.mean, floor.lux.mean(), places=3)
        self.assertAlmostEqual(floor.uniformity, floor.lux.min() / floor.lux.mean(), places=6)
        for light in relit.lights.values():
            light.emission = 0.0
        self.assertFalse(relit.measure()["floor"].lux.any())
        self.assertEqual(renderer().measure(), {})

    def test_a_scene_describes_itself(self):
        scene = load(write(self.folder))
        self.assertEqual((scene.name, scene.size), ("scene", SIZE))
        self.assertEqual((scene.lights, scene.meters), (["lamp", "spot", "panel", "sun"], ["floor"]))
        self.assertIn("red", scene.materials)
        self.assertGreater(scene.triangle_count, 100)
        self.assertEqual(scene.warnings, [])


class Interpreter(unittest.TestCase):
    def test_other_threads_run_meanwhile(self):
        ticks, ends = [], threading.Event()

        def tick():
            while not ends.is_set():
                ticks.append(time.monotonic())
                time.sleep(0.001)

        thread = threading.Thread(target=tick, daemon=True)
        thread.start()
        start = time.monotonic()
        renderer(changes=["quality.entry_points=60000"])
        end = time.monotonic()
        ends.set()
        thread.join()
        # Not between the calls, but in the middle of one.
        middle = [tick for tick in ticks if 0.25 < (tick - start) / (end - start) < 0.75]
        self.assertGreater(len(middle), 2)

    def test_the_example_runs(self):
        example = Path(__file__).parents[1] / "examples" / "relight.py"
        command = [sys.executable, example, "--count", "3", "--size", "16x16", "--preset", "draft"]
        done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"3 pictures of 16×16 pixels, preset draft, .* pictures a minute")


if __name__ == "__main__":
    unittest.main()

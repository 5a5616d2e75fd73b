"""Errors are exceptions with the line that the program prints."""

import math
import signal
import tempfile
import unittest
from pathlib import Path

from scenes import load, renderer, write

import lightpaths


class Refusals(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.renderer = renderer(write(Path(cls.folder.name)))

    def refused(self, kinds, words, call):
        with self.assertRaises(lightpaths.Error) as found:
            call()
        for kind in kinds:
            self.assertIsInstance(found.exception, kind)
        line = str(found.exception)
        self.assertIn(words, line)
        self.assertNotIn("\n", line)

    def test_names(self):
        name = [lightpaths.UnknownNameError, lightpaths.UsageError, KeyError, ValueError]
        self.refused(name, "did you mean `lamp`?", lambda: self.renderer.lights["lump"])
        self.refused(name, "did you mean `red`?", lambda: self.renderer.materials["rad"])
        self.refused([ValueError], "did you mean `indirect`?", lambda: self.renderer.render("indirct"))
        self.refused([ValueError], "lump", lambda: self.renderer.lights.remove("lump"))
        self.assertNotIn("lump", self.renderer.lights)

    def test_values(self):
        lamp, spot, panel = (self.renderer.lights[name] for name in ("lamp", "spot", "panel"))
        camera, wall = self.renderer.camera, self.renderer.materials["red"]
        before = self.renderer.render().tobytes()
        for thing, name, value, words in [
            (lamp, "position", (math.nan, 0.0, 0.0), "position"),
            (lamp, "position", (1e300, 0.0, 0.0), "position"),
            (lamp, "emission", -1.0, "intensity"),
            (lamp, "power", math.inf, "intensity"),
            (spot, "direction", (0.0, 0.0, 0.0), "direction"),
            (spot, "angle", 91.0, "angle"),
            (spot, "penumbra", 1.5, "penumbra"),
            (panel, "area", ((0, 1, 0), (1, 0, 0), (2, 0, 0)), "parallel"),
            (camera, "target", camera.position, "target"),
            (camera, "up", (0.0, 0.0, 1.0), "up"),
            (camera, "fov_y", 180.0, "fov_y"),
            (wall, "diffuse", 1.5, "diffuse"),
            (wall, "exponent", 0.5, "exponent"),
            (self.renderer, "size", (0, 4), "pixels"),
        ]:
            with self.subTest(name=name, value=value):
                self.refused([lightpaths.UsageError, ValueError], words, lambda: setattr(thing, name, value))
        for word, arguments in [
            ("exposure", {"exposure": math.nan}),
            ("tone", {"tone": "reinhard"}),
            ("white_balance", {"white_balance": 100.0}),
            ("tint", {"tint": math.inf}),
        ]:
            with self.subTest(arguments=arguments):
                self.refused([ValueError], word, lambda: self.renderer.display(**arguments))
        self.assertEqual(self.renderer.render().tobytes(), before)

    def test_properties_that_a_light_lacks(self):
        lamp, sun = self.renderer.lights["lamp"], self.renderer.lights["sun"]
        with self.assertRaisesRegex(AttributeError, "point has no direction"):
            lamp.direction = (0.0, -1.0, 0.0)
        self.assertFalse(hasattr(sun, "position") or hasattr(lamp, "angle") or hasattr(lamp, "area"))
        with self.assertRaises(AttributeError):
            lamp.postion = (0.0, 1.0, 0.0)
        for value in ("high", (0.0, 1.0), None, 3.0):
            with self.assertRaises((TypeError, ValueError)):
                lamp.position = value

    def test_scenes(self):
        self.refused([lightpaths.FileError, OSError], "nothing.toml", lambda: load("nothing.toml"))
        self.refused([lightpaths.Error], "drift", lambda: lightpaths.Scene("box", preset="drift"))
        self.refused([lightpaths.Error], "camera.fov", lambda: load(changes=["camera.fov=3"]))
        self.refused([ValueError], "sideways", lambda: lightpaths.Scene("box", place="sideways"))
        self.refused([lightpaths.Error], "back", lambda: lightpaths.Scene("box", camera="back"))
        broken = Path(self.folder.name) / "broken.toml"
        broken.write_text("[camera\n")
        self.refused([lightpaths.FileError, OSError], "broken.toml:1", lambda: load(broken))

    def test_devices(self):
        self.refused(
            [lightpaths.DeviceError, RuntimeError], "no-such-device", lambda: renderer(device="no-such-device")
        )

    def test_a_material_that_cannot_become_glossy(self):
        other = self.renderer.materials["green"]
        self.assertFalse(other.editable)
        self.refused([ValueError], "editable = true", lambda: setattr(other, "specular", 0.5))


class Interruptions(unittest.TestCase):
    def test_an_exception_of_the_progress_ends_the_work(self):
        stages = []

        def progress(stage, done, total):
            stages.append(stage)
            self.assertLessEqual(done, total)
            if stage == "light paths":
                raise ZeroDivisionError

        with self.assertRaises(ZeroDivisionError):
            renderer(progress=progress)
        self.assertIn("entry points", stages)
        self.assertEqual(stages[-1], "light paths")
        # The device is as good as new.
        self.assertTrue(renderer().render().any())

    @unittest.skipUnless(hasattr(signal, "setitimer"), "the system has no such timer")
    def test_a_signal_ends_the_work(self):
        stages = []

        def handler(*_):
            raise KeyboardInterrupt

        def progress(stage, *_):
            stages.append(stage)
            if stage == "entry points":
                signal.setitimer(signal.ITIMER_REAL, 1e-6)

        before = signal.signal(signal.SIGALRM, handler)
        self.addCleanup(signal.signal, signal.SIGALRM, before)
        with self.assertRaises(KeyboardInterrupt):
            renderer(progress=progress)
        self.assertNotIn("gather rays", stages)


if __name__ == "__main__":
    unittest.main()

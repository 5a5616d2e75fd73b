"""Scenes that the tests write, small enough to be traced in a second."""

import lightpaths

SMALL = [
    "quality.entry_points=6000",
    "quality.cache_points=600",
    "quality.gather_rays=64",
    "quality.cells=16",
]
SIZE = (24, 16)

LIGHTS = """
[[light]]
name = "lamp"
kind = "point"
position = [{x}, {y}, {z}]
intensity = [1.5, 1.5, 1.5]
[[light]]
name = "spot"
kind = "spot"
position = [{x}, {y}, {z}]
direction = [0.3, -1.0, 0.1]
angle = 35.0
penumbra = 0.5
intensity = [2.0, 1.0, 0.5]
[[light]]
name = "panel"
kind = "area"
corner = [{x}, {y}, {z}]
edge_u = [0.0, 0.0, 0.3]
edge_v = [-0.3, 0.0, 0.0]
radiance = [4.0, 5.0, 6.0]
[[light]]
name = "sun"
kind = "directional"
direction = [0.1, -0.3, -1.0]
irradiance = [0.5, 0.6, 0.7]
[[meter]]
name = "floor"
kind = "plane"
corner = [{low}, {floor}, {near}]
edge_u = [0.0, 0.0, 0.8]
edge_v = [0.8, 0.0, 0.0]
grid = [3, 2]
"""


def write(folder, offset=(0.0, 0.0, 0.0)):
    """A scene file: the Box at some offset, with a light of each kind, and a meter on its floor."""
    x, y, z = offset
    text = f"""
[[model]]
built_in = "box"
translate = [{x}, {y}, {z}]
[camera]
position = [{x}, {y + 1.0}, {z + 3.95}]
target = [{x}, {y + 1.0}, {z}]
fov_y = 39.0
[[material]]
name = "red"
editable = true
""" + LIGHTS.format(x=x + 0.2, y=y + 1.7, z=z + 0.2, low=x - 0.9, floor=y + 0.01, near=z + 0.1)
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def load(source="box", size=SIZE, changes=(), **options):
    return lightpaths.Scene(source, size=size, set=[*SMALL, *changes], **options)


def renderer(source="box", size=SIZE, changes=(), **options):
    return lightpaths.Renderer(load(source, size, changes), **options)

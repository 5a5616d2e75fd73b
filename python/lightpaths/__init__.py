"""Relights scenes with full global illumination: scene in, numpy arrays out.

    import lightpaths

    scene = lightpaths.Scene("box", preset="draft", size=(256, 256))
    renderer = lightpaths.Renderer(scene)
    renderer.lights["lamp"].position = (0.3, 1.7, 0.2)
    image = renderer.render()

See docs/python.md.
"""

from ._lightpaths import Camera, Light, Lights, Material, Materials, Reading, Renderer, Scene, __version__
from .errors import DeviceError, Error, FileError, UnknownNameError, UsageError

__all__ = [
    "Camera",
    "DeviceError",
    "Error",
    "FileError",
    "Light",
    "Lights",
    "Material",
    "Materials",
    "Reading",
    "Renderer",
    "Scene",
    "UnknownNameError",
    "UsageError",
    "__version__",
]

"""Scenes, and renderers whose pictures are numpy arrays.

Positions are in the coordinates of the scene file, metres. Colours are linear Rec.709. A colour
may be one number: it then holds for all channels.
"""

from collections.abc import Callable, Iterator, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict, final

import numpy as np
from numpy.typing import NDArray

_Triple = tuple[float, float, float]
_Vector = Sequence[float] | NDArray[Any]
_Colour = float | _Vector
_Tone = Literal["standard", "none", "filmic", "aces", "agx"]
_Layer = Literal["beauty", "direct", "indirect", "irradiance", "albedo", "normal", "position", "depth"]

class _DirectAndIndirect(TypedDict):
    direct: NDArray[np.float32]
    indirect: NDArray[np.float32]

__all__ = [
    "Camera",
    "Light",
    "Lights",
    "Material",
    "Materials",
    "Reading",
    "Renderer",
    "Scene",
    "__version__",
]
__version__: str

@final
class Scene:
    """A scene file, a model, or a built-in scene: box, atrium, room."""

    def __new__(
        cls,
        source: str | PathLike[str],
        *,
        preset: Literal["draft", "paper", "high"] | str | None = None,
        size: Sequence[int] | None = None,
        camera: str | None = None,
        set: Sequence[str] = ...,
        place: Literal["inside", "outside"] | None = None,
        up: Literal["y", "z"] | None = None,
        allow_outside: bool = False,
    ) -> Scene:
        """Loads a scene. The arguments are those of `lightpaths render`.

        `set` overrides keys of the scene file, as in ["camera.fov_y=45"]. `size` is width, height.
        """
    @property
    def name(self) -> str: ...
    @property
    def lights(self) -> list[str]: ...
    @property
    def materials(self) -> list[str]: ...
    @property
    def cameras(self) -> list[str]: ...
    @property
    def meters(self) -> list[str]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def bounds(self) -> tuple[_Triple, _Triple]:
        """Smallest and largest corner."""
    @property
    def warnings(self) -> list[str]:
        """Repairs and chosen defaults, one sentence each."""

@final
class Renderer:
    """A scene with traced light paths. Every picture is converged."""

    def __new__(
        cls,
        scene: Scene,
        *,
        device: str | None = None,
        cache: str | PathLike[str] | None = None,
        progress: Callable[[str, int, int], object] | None = None,
    ) -> Renderer:
        """Traces light paths once, or reads them from the folder `cache`.

        `device` is an index or part of a name, as `lightpaths info` lists them. `progress` gets the
        stage, and the steps that are done and all. An exception that it raises ends the work, and so
        does Ctrl+C.
        """
    def set_scene(self, scene: Scene, *, progress: Callable[[str, int, int], object] | None = None) -> None:
        """Shows another scene from now on, or the same one with a model elsewhere.

        If only models that are `movable` have moved since, less is traced than by a new renderer. The
        bits are the same. Edits of the scene before are gone. If it fails, that scene stays.
        """
    @property
    def lights(self) -> Lights: ...
    @property
    def materials(self) -> Materials: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def device(self) -> str: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
    @size.setter
    def size(self, size: Sequence[int]) -> None: ...
    @property
    def precompute_s(self) -> float:
        """Wall-clock time of the precomputation, seconds."""
    @property
    def frame_ms(self) -> float | None:
        """Wall-clock time of the last frame, milliseconds. None before the first."""
    def render(self, layer: _Layer = "beauty") -> NDArray[np.float32]:
        """The picture: rows from the top, columns, red-green-blue; radiance in W/m²/sr.

        Other layers have the same shape, but `depth` has no channels. A frame is computed only if
        something has changed.
        """
    def display(
        self,
        exposure: float | None = None,
        *,
        tone: _Tone | None = None,
        white_balance: float | None = None,
        tint: float | None = None,
    ) -> NDArray[np.uint8]:
        """The picture as sRGB codes: stops of exposure, tone curve, and what is shown as white.

        `white_balance` is in kelvin, `tint` in thousandths of CIE 1960 uv. Arguments that are left
        out are those of the scene file's `[picture]`.
        """
    def layers(self) -> dict[str, _DirectAndIndirect]:
        """Light of each light that is on. All layers together add up to the picture."""
    def measure(self) -> dict[str, Reading]:
        """What the light meters of the scene show."""

@final
class Lights:
    """The lights of a renderer, by name."""

    def __getitem__(self, name: str, /) -> Light: ...
    def __len__(self) -> int: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def keys(self) -> list[str]: ...
    def values(self) -> list[Light]: ...
    def items(self) -> list[tuple[str, Light]]: ...
    def add(
        self,
        name: str,
        kind: Literal["point", "spot", "area", "directional"] | str,
        *,
        emission: _Colour,
        position: _Vector | None = None,
        direction: _Vector | None = None,
        angle: float | None = None,
        penumbra: float = 0.0,
        corner: _Vector | None = None,
        edge_u: _Vector | None = None,
        edge_v: _Vector | None = None,
        samples: int = 10,
    ) -> Light:
        """Adds a light. The arguments are the keys of a scene file."""
    def remove(self, name: str) -> None: ...

@final
class Light:
    """A light. A property that its kind does not have raises AttributeError."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str:
        """point, spot, area, directional, surface or sky"""
    @property
    def on(self) -> bool: ...
    @on.setter
    def on(self, is_on: bool) -> None: ...
    @property
    def position(self) -> _Triple:
        """Of a point, a spot, and the middle of an area."""
    @position.setter
    def position(self, to: _Vector) -> None: ...
    @property
    def emission(self) -> _Triple:
        """Intensity (W/sr) of a point and a spot, irradiance (W/m²) of a directional light, radiance
        (W/m²/sr) of all others."""
    @emission.setter
    def emission(self, emission: _Colour) -> None: ...
    @property
    def power(self) -> float:
        """Luminous flux, lm; of a directional light the illuminance of a facing surface, lx."""
    @power.setter
    def power(self, amount: float) -> None: ...
    @property
    def kelvin(self) -> float:
        """Colour temperature. It is clamped to 1667 to 25000 K."""
    @kelvin.setter
    def kelvin(self, kelvin: float) -> None: ...
    @property
    def direction(self) -> _Triple:
        """Of a spot and of a directional light."""
    @direction.setter
    def direction(self, to: _Vector) -> None: ...
    @property
    def angle(self) -> float:
        """Half-angle of a spot, degrees."""
    @angle.setter
    def angle(self, degrees: float) -> None: ...
    @property
    def penumbra(self) -> float:
        """Fraction of a spot's angle over which it fades."""
    @penumbra.setter
    def penumbra(self, fraction: float) -> None: ...
    @property
    def area(self) -> tuple[_Triple, _Triple, _Triple]:
        """Corner and both edges of an area light."""
    @area.setter
    def area(self, area: Sequence[_Vector]) -> None: ...
    @property
    def rotate(self) -> float:
        """Rotation of a sky about the y axis, degrees."""
    @rotate.setter
    def rotate(self, degrees: float) -> None: ...

@final
class Materials:
    """The materials of a renderer, by name."""

    def __getitem__(self, name: str, /) -> Material: ...
    def __len__(self) -> int: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def keys(self) -> list[str]: ...
    def values(self) -> list[Material]: ...
    def items(self) -> list[tuple[str, Material]]: ...

@final
class Material:
    """A material. If it is not `editable`, its light paths were sampled for its old albedo."""

    @property
    def name(self) -> str: ...
    @property
    def editable(self) -> bool: ...
    @property
    def diffuse(self) -> _Triple:
        """Diffuse albedo. It and the specular albedo are lowered if they reflect too much."""
    @diffuse.setter
    def diffuse(self, albedo: _Colour) -> None: ...
    @property
    def specular(self) -> _Triple: ...
    @specular.setter
    def specular(self, albedo: _Colour) -> None: ...
    @property
    def exponent(self) -> float: ...
    @exponent.setter
    def exponent(self, exponent: float) -> None: ...

@final
class Camera:
    """The camera of a renderer."""

    @property
    def name(self) -> str: ...
    @property
    def position(self) -> _Triple: ...
    @position.setter
    def position(self, to: _Vector) -> None: ...
    @property
    def target(self) -> _Triple: ...
    @target.setter
    def target(self, to: _Vector) -> None: ...
    @property
    def up(self) -> _Triple: ...
    @up.setter
    def up(self, up: _Vector) -> None: ...
    @property
    def fov_y(self) -> float:
        """Vertical field of view, degrees."""
    @fov_y.setter
    def fov_y(self, degrees: float) -> None: ...
    def look(self, position: _Vector, target: _Vector) -> None:
        """Sets position and target at once."""

@final
class Reading:
    """What a light meter shows. Arrays have a row for each step along the meter's second edge."""

    @property
    def lux(self) -> NDArray[np.float64]:
        """Illuminance of each point; NaN in solids."""
    @property
    def irradiance(self) -> NDArray[np.float32]:
        """Irradiance of each point, W/m²."""
    @property
    def direct(self) -> NDArray[np.float32]:
        """The part of it that comes straight from lights."""
    @property
    def mean(self) -> float:
        """Mean illuminance outside of solids, lx."""
    @property
    def min(self) -> float: ...
    @property
    def max(self) -> float: ...
    @property
    def uniformity(self) -> float:
        """Minimum over mean."""

"""The coloured overlay: points, trails, a soft hull and a number for each object, a legend."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import OverlayConfig
from ifsvideo.output import hull
from ifsvideo.output.alpha import alone
from ifsvideo.output.dots import draw_dots
from ifsvideo.output.legend import Box, draw_legend, draw_number
from ifsvideo.output.palette import (
    BACKGROUND_COLOUR,
    BACKGROUND_TRAIL,
    UNDECIDED_COLOUR,
    Colour,
    object_colour,
)
from ifsvideo.output.styles import Look, look_of
from ifsvideo.output.trails import TrailStyle, draw_trails
from ifsvideo.types import BACKGROUND, Image, Scene

_LUMA = np.array([0.299, 0.587, 0.114])
_DISCREET = 0.75
_RIM: Colour = (16, 18, 20)


@dataclass(frozen=True)
class _Sizes:
    """What is drawn how large, pixels; all follow the picture's diagonal."""

    dot: float
    rim: float
    small_dot: float
    trail: int
    small_trail: int
    outline: int
    margin: float
    reach: float
    capital: int

    @classmethod
    def of(cls, image: Image) -> _Sizes:
        diagonal = float(np.hypot(*image.shape[:2]))
        # Radii of dots. The polygons in which they used to be drawn were wider by 0.6 than they said: the
        # look was kept.
        return cls(
            dot=max(1.8, 0.6 + 0.0024 * diagonal),
            rim=max(0.5, 0.0007 * diagonal),
            small_dot=max(1.1, 0.6 + 0.001 * diagonal),
            trail=max(1, round(0.0016 * diagonal)),
            small_trail=max(1, round(0.0007 * diagonal)),
            outline=max(1, round(0.0014 * diagonal)),
            margin=max(4.0, 0.014 * diagonal),
            reach=0.045 * diagonal,
            capital=max(8, round(0.011 * diagonal)),
        )


@dataclass(frozen=True)
class _Object:
    """One object in one frame: its points and the outlines round them, largest first."""

    label: int
    points: NDArray[np.intp]
    polygons: list[NDArray[np.float32]]

    @property
    def extent(self) -> float:
        """Area of the largest outline, pixels."""
        return float(cv2.contourArea(self.polygons[0]))


class OverlayRenderer:
    """Draws what was found over the picture (a `Renderer`).

    Holds no state: a frame's drawing depends on its scene only.
    """

    def __init__(self, config: OverlayConfig | None = None) -> None:
        self.config = config or OverlayConfig()
        self._look = look_of(self.config)

    def draw(self, image: Image, scene: Scene) -> Image:
        """Return the picture with the overlay; ``image`` (H, W, 3) uint8 RGB is not changed.

        Where the configuration asks for transparency, the drawing alone is returned, (H, W, 4) uint8 RGBA.
        """
        if not self.config.transparent:
            return self._paint(self._subdued(image), image, scene)
        lit = self.config.style == "spotlight"
        return alone(lambda ground: self._paint(ground.copy(), image if lit else ground, scene), image.shape)

    def _paint(self, canvas: Image, image: Image, scene: Scene) -> Image:
        """Draw on ``canvas``; ``image`` is what shows inside an object's outline."""
        look, sizes = self._look, _Sizes.of(image)
        shown = _drawable(scene.xy, image)
        objects = _objects(scene, shown, sizes)
        for item in objects if look.area else []:
            hull.fill(canvas, image, item.polygons, object_colour(item.label), look.hull_opacity)
        still = np.flatnonzero(shown & (scene.labels == BACKGROUND))
        if look.trails:
            styles = [TrailStyle(still, BACKGROUND_TRAIL, sizes.small_trail)] if look.ground else []
            styles += [TrailStyle(item.points, object_colour(item.label), sizes.trail) for item in objects]
            draw_trails(canvas, scene.trails, styles, look.bands)
        if look.ground:
            undecided = shown & (scene.labels < BACKGROUND)
            draw_dots(canvas, scene.xy[undecided], sizes.small_dot, UNDECIDED_COLOUR, _DISCREET)
            draw_dots(canvas, scene.xy[still], sizes.small_dot, BACKGROUND_COLOUR, _DISCREET)
        for item in objects:
            _draw_object(canvas, scene, item, sizes, look)
        self._write(canvas, scene, objects, sizes)
        return canvas

    def _write(self, canvas: Image, scene: Scene, objects: list[_Object], sizes: _Sizes) -> None:
        """Legend and numbers, above all that is drawn."""
        taken: list[Box] = []
        # The line that sweeps over the picture would cut through it.
        if self.config.legend and self.config.layout != "before-after":
            taken += draw_legend(canvas, scene.time_s, scene.frame, len(objects), sizes.capital)
        for item in objects if self._look.numbers else []:
            largest = item.polygons[0]
            middle = float(largest[:, 0].min() + largest[:, 0].max()) / 2
            anchor = (middle, float(largest[:, 1].min()) - sizes.outline)
            colour = object_colour(item.label)
            taken.append(draw_number(canvas, item.label, anchor, colour, sizes.capital, taken))

    def _subdued(self, image: Image) -> Image:
        """The picture darker and paler, so that the colours stand out."""
        grey = np.tile(_LUMA, (3, 1))
        colour = self._look.picture_colour
        mix = self._look.picture_brightness * (colour * np.eye(3) + (1.0 - colour) * grey)
        return np.asarray(cv2.transform(image, mix.astype(np.float32)), dtype=np.uint8)


def _drawable(xy: NDArray[np.float32], image: Image) -> NDArray[np.bool_]:
    """Which points are on the picture."""
    height, width = image.shape[:2]
    inside = np.isfinite(xy) & (xy > -0.5) & (xy < (width - 0.5, height - 0.5))
    return np.asarray(inside.all(axis=1), dtype=bool)


def _objects(scene: Scene, shown: NDArray[np.bool_], sizes: _Sizes) -> list[_Object]:
    """The objects in sight, the largest first, so that small ones are drawn over it."""
    found = []
    for label in np.unique(scene.labels[shown & (scene.labels > BACKGROUND)]).tolist():
        points = np.flatnonzero(shown & (scene.labels == label))
        found.append(_Object(label, points, hull.outlines(scene.xy[points], sizes.reach, sizes.margin)))
    return sorted(found, key=lambda item: -item.extent)


def _draw_object(canvas: Image, scene: Scene, item: _Object, sizes: _Sizes, look: Look) -> None:
    """Outline and dots of one object."""
    colour = object_colour(item.label)
    if look.outline:
        edges = [hull.fixed_point(polygon) for polygon in item.polygons]
        cv2.polylines(canvas, edges, True, colour, sizes.outline, cv2.LINE_AA, hull.SUBPIXEL_BITS)
    if look.dots:
        draw_dots(canvas, scene.xy[item.points], sizes.dot + sizes.rim, _RIM)
        draw_dots(canvas, scene.xy[item.points], sizes.dot, colour)

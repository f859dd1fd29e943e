"""Layouts: the drawn picture alone, beside or below the plain one, or parted from it by a moving line."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import cv2
import numpy as np

from ifsvideo.config import OverlayConfig
from ifsvideo.errors import UsageError
from ifsvideo.output.title import Title
from ifsvideo.types import Image, Renderer, Scene, VideoInfo

_GUTTER = 0.006
"""Space between two pictures, share of the diagonal."""
_SWEEP_S = 5.0
"""Time of the line from one side to the other and back, seconds of the output."""
_SWEEP_REACH = 0.94
"""How far it goes: at the very edge one of the pictures would be gone."""
_WHITE = (250, 250, 250)


class Composition:
    """The pictures of a video as it is shown: drawn, laid out, with a title (a `Renderer`).

    Parameters
    ----------
    renderer : Renderer
        Draws on one picture.
    config : OverlayConfig
    info : VideoInfo
        Of the input.

    Attributes
    ----------
    info : VideoInfo
        Size and rate of what is written.
    """

    def __init__(self, renderer: Renderer, config: OverlayConfig, info: VideoInfo) -> None:
        self._renderer = renderer
        self._config = config
        diagonal = float(np.hypot(info.width, info.height))
        self._gutter = _even(_GUTTER * diagonal)
        width, height = info.width, info.height
        if config.layout == "side-by-side":
            width = 2 * width + self._gutter
        elif config.layout == "stacked":
            height = 2 * height + self._gutter
        slowed = info.fps / Fraction(config.slow).limit_denominator(1000)
        self.info = replace(info, width=width, height=height, fps=slowed)
        size = (width, height)
        self._title = Title(config.title, config.title_s, size, diagonal) if config.title else None

    def draw(self, image: Image, scene: Scene) -> Image:
        """The picture to be written: (H, W, 3) uint8 RGB, or (H, W, 4) RGBA where it is transparent."""
        drawn = self._renderer.draw(image, scene)
        channels = 4 if self._config.transparent else 3
        if drawn.shape != (*image.shape[:2], channels):
            raise UsageError(
                f"the renderer returned {drawn.shape} for a picture of {image.shape}; "
                f"{(*image.shape[:2], channels)} is asked for"
            )
        time_s = scene.frame / float(self.info.fps)
        canvas = self._laid_out(image, drawn, time_s)
        if self._title is not None:
            canvas = canvas.copy() if canvas is drawn else canvas
            self._title.draw(canvas, time_s)
        return canvas

    def _laid_out(self, image: Image, drawn: Image, time_s: float) -> Image:
        layout = self._config.layout
        if layout == "overlay":
            return drawn
        if layout == "before-after":
            return _parted(image, drawn, time_s)
        axis = 1 if layout == "side-by-side" else 0
        shape = list(image.shape)
        shape[axis] = self._gutter
        return np.concatenate([image, np.zeros(shape, np.uint8), drawn], axis=axis)


def _parted(image: Image, drawn: Image, time_s: float) -> Image:
    """Plain on the left of an upright line, drawn on its right; the line sweeps to and fro."""
    height, width = image.shape[:2]
    swing = np.cos(2.0 * np.pi * time_s / _SWEEP_S)
    middle = round(0.5 * width * (1.0 + _SWEEP_REACH * float(swing)))
    canvas = np.concatenate([image[:, :middle], drawn[:, middle:]], axis=1)
    diagonal = float(np.hypot(width, height))
    thick = max(1, round(0.0025 * diagonal))
    radius = max(4, round(0.018 * diagonal))
    knob = (middle, height // 2)
    cv2.line(canvas, (middle, 0), (middle, height - 1), _WHITE, thick, cv2.LINE_AA)
    cv2.circle(canvas, knob, radius, _WHITE, -1, cv2.LINE_AA)
    for side in (-1, 1):
        tip, wing = knob[0] + side * 0.62 * radius, knob[0] + side * 0.25 * radius
        arrow = np.array([[wing, knob[1] - 0.34 * radius], [tip, knob[1]], [wing, knob[1] + 0.34 * radius]])
        cv2.fillPoly(canvas, [np.round(16 * arrow).astype(np.int32)], (40, 44, 50), cv2.LINE_AA, 4)
    return canvas


def _even(length: float) -> int:
    return 2 * max(1, round(length / 2))

"""Where the points were a moment ago: lines that fade into the past."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.hull import SUBPIXEL_BITS, fixed_point
from ifsvideo.output.palette import Colour
from ifsvideo.types import Floats, Image

_FADE = (0.25, 0.85)
"""Opacity of a trail's oldest part and of its newest."""
_PIECES_PER_BAND = 2
_SHADES = 32
"""Grey levels within which what lies below two lines is taken for the same."""


@dataclass(frozen=True)
class TrailStyle:
    """The points drawn alike: their columns in the trails, colour, and thickness in pixels."""

    points: NDArray[np.intp]
    colour: Colour
    thickness: int


def draw_trails(canvas: Image, trails: Floats, styles: Sequence[TrailStyle], bands: int = 3) -> None:
    """Draw fading trails on ``canvas`` (H, W, 3) uint8.

    A part of a trail is a line of one colour, mixed from its own and what lies below its middle: to blend
    whole pictures, once for every band, would take more time than all else that is drawn.

    Parameters
    ----------
    trails : (T, N, 2) float
        Positions in pixels, oldest first, NaN where a point was not seen; what is older is not drawn.
    styles : sequence of TrailStyle
        Drawn in this order.
    bands : int
        Parts of a trail that differ in opacity.
    """
    if len(trails) < 2 or not styles:
        return
    # A few pieces show the same curve as one per frame, and cost the same at any frame rate.
    pieces = min(len(trails) - 1, bands * _PIECES_PER_BAND)
    position = _back_to_a_gap(trails[np.linspace(0, len(trails) - 1, pieces + 1).round().astype(int)])
    first = np.maximum(pieces - _PIECES_PER_BAND * np.arange(bands, -1, -1), 0)
    lines = [
        _lines(canvas, position[begin : end + 1, style.points], style, opacity)
        for begin, end, opacity in zip(first[:-1], first[1:], np.geomspace(*_FADE, bands), strict=True)
        for style in styles
        if end > begin
    ]
    for corners, ink, thickness in chain.from_iterable(lines):
        cv2.polylines(canvas, corners, False, ink, thickness, cv2.LINE_AA, SUBPIXEL_BITS)


def _back_to_a_gap(position: Floats) -> Floats:
    """Positions (T, N, 2), where a point was not seen and before that its next one: a line without length."""
    seen = np.logical_and.accumulate(np.isfinite(position[::-1]).all(axis=2))[::-1]
    oldest = np.argmax(seen, axis=0)
    return np.asarray(position[np.maximum(np.arange(len(position))[:, None], oldest), np.arange(len(oldest))])


def _lines(
    canvas: Image, path: Floats, style: TrailStyle, opacity: float
) -> list[tuple[list[NDArray[np.int32]], tuple[float, ...], int]]:
    """One band of the trails of one style, path (K, N, 2): lines, their colour and thickness."""
    path = path[:, np.isfinite(path).all(axis=(0, 2)) & (path != path[-1]).any(axis=(0, 2))]
    height, width = canvas.shape[:2]
    column, row = np.rint(path[len(path) // 2]).astype(np.intp).T
    below = canvas[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    corners = fixed_point(path.transpose(1, 0, 2))
    shade = (below // _SHADES).astype(np.intp) @ (256 * 256, 256, 1)
    order = np.argsort(shade, kind="stable")
    starts = np.flatnonzero(np.diff(shade[order], prepend=-1))
    if not len(starts):
        return []
    groups = np.split(order, starts[1:])
    mean = np.add.reduceat(below[order].astype(float), starts) / np.array([[len(group)] for group in groups])
    inks = opacity * np.array(style.colour) + (1 - opacity) * mean
    return [
        (list(corners[group]), tuple(ink), style.thickness)
        for group, ink in zip(groups, inks.tolist(), strict=True)
    ]

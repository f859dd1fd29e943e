"""Where the points were a moment ago: lines that fade into the past."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.hull import SUBPIXEL_BITS, fixed_point
from ifsvideo.output.palette import Colour
from ifsvideo.types import Floats, Image

_FADE = (0.25, 0.85)
"""Opacity of a trail's oldest part and of its newest."""
_PIECES_PER_BAND = 2
_SHADES = 24
"""Grey levels within which the colours of two lines are taken for the same."""
_SHORTEST = 0.5
"""Pixels that a trail reaches from its point at least: a shorter one lies below the dot."""


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
    taken = trails[np.linspace(0, len(trails) - 1, pieces + 1).round().astype(int)]
    style = np.repeat(np.arange(len(styles)), [len(each.points) for each in styles])
    path = _back_to_a_gap(taken[:, np.concatenate([each.points for each in styles])])
    long = (np.abs(path - path[-1]) >= _SHORTEST).any(axis=(0, 2))
    path, style = path[:, long], style[long]
    edges = np.unique(np.maximum(pieces - _PIECES_PER_BAND * np.arange(bands, -1, -1), 0))
    opacity = np.geomspace(*_FADE, bands)[1 - len(edges) :, None, None]
    # All colours first: a line lies over the picture, not over other lines.
    below = _picture_at(canvas, path[(edges[:-1] + edges[1:] + 1) // 2])
    inks = opacity * np.array([each.colour for each in styles])[style] + (1 - opacity) * below
    corners = np.ascontiguousarray(fixed_point(path).transpose(1, 0, 2))
    moves = (corners[:, 1:] != corners[:, :-1]).any(axis=2)
    band, trail = np.nonzero(np.logical_or.reduceat(moves, edges[:-1], axis=1).T)
    for group, ink in _alike(len(styles) * band + style[trail], inks[band, trail]):
        part, drawn = band[group[0]], trail[group]
        lines = list(corners[drawn, edges[part] : edges[part + 1] + 1])
        cv2.polylines(
            canvas, lines, False, ink, styles[style[drawn[0]]].thickness, cv2.LINE_AA, SUBPIXEL_BITS
        )


def _back_to_a_gap(position: Floats) -> Floats:
    """Positions (T, N, 2), where a point was not seen and before that its next one: a line without length."""
    finite = np.isfinite(position)
    seen = np.logical_and.accumulate((finite[..., 0] & finite[..., 1])[::-1])[::-1]
    oldest = np.argmax(seen, axis=0)
    return np.asarray(position[np.maximum(np.arange(len(position))[:, None], oldest), np.arange(len(oldest))])


def _picture_at(canvas: Image, position: Floats) -> Image:
    """The picture's colours (..., 3) at positions (..., 2), outside of it those of its border."""
    height, width = canvas.shape[:2]
    column, row = np.moveaxis(np.clip(np.rint(position), 0, (width - 1, height - 1)).astype(np.intp), -1, 0)
    return np.asarray(canvas[row, column])


def _alike(layer: NDArray[np.intp], inks: Floats) -> Iterator[tuple[NDArray[np.intp], list[float]]]:
    """Which of the lines of one layer (N,) are nearly of one colour (N, 3), and which; lower layers first."""
    levels = 256 // _SHADES + 1
    red, green, blue = (inks // _SHADES).astype(np.intp).T
    shade = ((layer * levels + red) * levels + green) * levels + blue
    order = np.argsort(shade, kind="stable")
    starts = np.flatnonzero(np.diff(shade[order], prepend=-1))
    if not len(starts):
        return
    ends = np.append(starts[1:], len(order))
    means = np.add.reduceat(inks[order], starts) / (ends - starts)[:, None]
    for begin, end, mean in zip(starts.tolist(), ends.tolist(), means.tolist(), strict=True):
        yield order[begin:end], mean

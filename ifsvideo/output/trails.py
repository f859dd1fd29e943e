"""Where the points were a moment ago: lines that fade into the past."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.hull import SUBPIXEL_BITS, fixed_point
from ifsvideo.output.palette import Colour
from ifsvideo.types import Floats, Image

# Opacity of a trail's oldest part and of its newest.
_FADE = (0.25, 0.85)
_PIECES_PER_BAND = 2


@dataclass(frozen=True)
class TrailStyle:
    """The points drawn alike: their columns in the trails, colour, and thickness in pixels."""

    points: NDArray[np.intp]
    colour: Colour
    thickness: int


def draw_trails(canvas: Image, trails: Floats, styles: Sequence[TrailStyle], bands: int = 3) -> None:
    """Draw fading trails on ``canvas`` (H, W, 3) uint8.

    Parameters
    ----------
    trails : (T, N, 2) float
        Positions in pixels, oldest first, NaN where a point was not seen.
    styles : sequence of TrailStyle
        Drawn in this order.
    bands : int
        Parts of a trail that differ in opacity.
    """
    if len(trails) < 2 or not styles:
        return
    # A few pieces show the same curve as one per frame, and cost the same at any frame rate.
    pieces = min(len(trails) - 1, bands * _PIECES_PER_BAND)
    knots = np.round(np.linspace(0, len(trails) - 1, pieces + 1)).astype(int)
    position = trails[knots]
    band_of = (np.arange(pieces) - pieces) * bands // max(pieces, bands) + bands
    for band, opacity in enumerate(np.geomspace(*_FADE, bands).tolist()):
        chosen = np.flatnonzero(band_of == band)
        layer = canvas.copy()
        drawn = [_draw_pieces(layer, position, chosen, style) for style in styles]
        if any(drawn):
            cv2.addWeighted(layer, opacity, canvas, 1.0 - opacity, 0.0, dst=canvas)


def _draw_pieces(layer: Image, position: Floats, chosen: NDArray[np.intp], style: TrailStyle) -> bool:
    """Draw some pieces of the trails of one style; whether there were any."""
    start = position[chosen][:, style.points].reshape(-1, 2)
    stop = position[chosen + 1][:, style.points].reshape(-1, 2)
    seen = np.isfinite(start).all(axis=1) & np.isfinite(stop).all(axis=1)
    if not seen.any():
        return False
    lines = fixed_point(np.stack([start[seen], stop[seen]], axis=1))
    cv2.polylines(layer, list(lines), False, style.colour, style.thickness, cv2.LINE_AA, SUBPIXEL_BITS)
    return True

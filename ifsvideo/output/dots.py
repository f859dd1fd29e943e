"""Round dots at points, all of a colour at once."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.palette import Colour
from ifsvideo.types import Floats, Image

_PIXEL = np.dtype("V3")
"""Three bytes as one: numpy fetches and places pixels so in half the time."""
_STEPS = 16
"""Steps of a pixel in which the distance from a dot's middle is told when pixels are ordered."""


def draw_dots(canvas: Image, xy: Floats, radius: float, colour: Colour, opacity: float = 1.0) -> None:
    """Draw a dot at each point on ``canvas``, with smooth edges; where dots overlap, they are one area.

    Parameters
    ----------
    canvas : (H, W, 3) uint8, contiguous
    xy : (N, 2) float
        Middle of each dot, pixels; finite, and within or near the picture.
    radius : float
        Pixels.
    colour : Colour
    opacity : float
        Of the dots, 0 to 1.
    """
    pixel, distance = _touched(canvas.shape[1], canvas.shape[0], xy, radius)
    if not len(pixel):
        return
    share = (opacity * np.minimum(radius + 0.5 - distance, 1.0)).astype(np.float32)[None]
    pixels = canvas.reshape(-1).view(_PIXEL)
    below = pixels[pixel].view(np.uint8).reshape(1, -1, 3)
    ink = np.empty_like(below)
    cv2.rectangle(ink, (0, 0), (len(pixel), 1), colour, cv2.FILLED)
    pixels[pixel] = cv2.blendLinear(ink, below, share, 1.0 - share).reshape(-1).view(_PIXEL)


def _touched(
    width: int, height: int, xy: Floats, radius: float
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Pixels (K,) of the flat picture that dots touch, and how far off the dot's middle is (K,), pixels.

    A pixel that several dots touch is told once of each, the nearest last: what is assigned last stays.
    """
    reach = radius + 0.5
    middle = xy.T[..., None]
    window = np.ceil(middle - reach).astype(np.intp) + np.arange(int(2 * reach) + 1)
    # What lies outside becomes a pixel of the border, and is measured from there.
    window = np.clip(window, 0, np.reshape((width - 1, height - 1), (2, 1, 1)))
    column, row = window
    across, down = np.square(window - middle, dtype=np.float32)
    squared = (down[:, :, None] + across[:, None, :]).ravel()
    pixel = (width * row[:, :, None] + column[:, None, :]).ravel()
    near = np.flatnonzero(squared < reach**2)
    distance = np.sqrt(squared[near])
    order = np.argsort((_STEPS * distance).astype(np.uint16), kind="stable")[::-1]
    return pixel[near[order]], distance[order]

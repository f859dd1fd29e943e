"""Round dots at points, all of a colour at once."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.palette import Colour
from ifsvideo.types import Floats, Image

_PIXEL = np.dtype("V3")
"""Three bytes as one: numpy fetches and places pixels so in half the time."""


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
    edge, cover, inside = _touched(canvas.shape[1], canvas.shape[0], xy, radius)
    pixels = canvas.reshape(-1).view(_PIXEL)
    if opacity < 1.0:  # what lies below shows inside too
        edge, cover = np.append(edge, inside), opacity * np.append(cover, np.ones(len(inside), np.float32))
    if len(edge):
        share = cover.astype(np.float32)[None]
        below = pixels[edge].view(np.uint8).reshape(1, -1, 3)
        ink = np.empty_like(below)
        cv2.rectangle(ink, (0, 0), (len(edge), 1), colour, cv2.FILLED)
        pixels[edge] = cv2.blendLinear(ink, below, share, 1.0 - share).reshape(-1).view(_PIXEL)
    if opacity == 1.0:  # last: a dot's edge may lie inside another dot
        pixels[inside] = np.array(colour, np.uint8).view(_PIXEL)


def _touched(
    width: int, height: int, xy: Floats, radius: float
) -> tuple[NDArray[np.intp], NDArray[np.float32], NDArray[np.intp]]:
    """Pixels of the flat picture that dots cover in part (K,), to which share (K,), and entirely (L,).

    A pixel that several dots touch is told once of each, where it is covered most last: what is assigned last
    stays.
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
    whole = squared <= max(radius - 0.5, 0.0) ** 2
    inside = np.flatnonzero(whole)
    edge = np.flatnonzero(~whole & (squared < reach**2))
    cover = reach - np.sqrt(squared[edge])
    order = np.argsort((255 * cover).astype(np.uint8), kind="stable")
    return pixel[edge[order]], cover[order], pixel[inside]

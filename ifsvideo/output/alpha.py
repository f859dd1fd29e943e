"""Drawings without the picture below them: RGBA with straight (not premultiplied) alpha."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ifsvideo.types import Image


def alone(paint: Callable[[Image], Image], shape: tuple[int, ...]) -> Image:
    """What is drawn, without what it is drawn on.

    A drawing that covers a picture to the share alpha with the colour c leaves alpha c of a black one and
    alpha c + (1 - alpha) of a white one (Smith and Blinn, Blue Screen Matting, SIGGRAPH 1996): both tell
    alpha and c.

    Parameters
    ----------
    paint : callable
        Returns a picture (H, W, 3) uint8 drawn upon, and leaves the one given as it was.
    shape : tuple
        (H, W, 3) of the picture.

    Returns
    -------
    (H, W, 4) uint8
    """
    on_black = paint(np.zeros(shape, np.uint8)).astype(np.float32)
    on_white = paint(np.full(shape, 255, np.uint8)).astype(np.float32)
    cover = np.clip(255.0 - (on_white - on_black).mean(axis=2), 0.0, 255.0)
    # Below half a step nothing was drawn: it is the rounding of two pictures.
    cover[cover < 1.0] = 0.0
    share = np.maximum(cover, 1.0)[..., None] / 255.0
    colour = np.where(cover[..., None] > 0, on_black / share, 0.0)
    return np.asarray(np.round(np.clip(np.dstack([colour, cover]), 0, 255)), np.uint8)


def blend(canvas: Image, left: int, top: int, plate: Image, opacity: float = 1.0) -> None:
    """Lay a plate (h, w, 4) over ``canvas`` (H, W, 3 or 4), which it must lie on; the canvas is changed."""
    region = canvas[top : top + plate.shape[0], left : left + plate.shape[1]]
    share = plate[..., 3:].astype(np.float32) * (opacity / 255.0)
    if canvas.shape[2] == 3:
        mixed = region + share * (plate[..., :3].astype(np.float32) - region)
    else:
        below = region[..., 3:].astype(np.float32) / 255.0 * (1.0 - share)
        cover = share + below
        colour = (share * plate[..., :3] + below * region[..., :3]) / np.maximum(cover, 1e-6)
        mixed = np.dstack([colour, 255.0 * cover])
    region[:] = np.round(mixed).astype(np.uint8)

"""One decoded frame, kept small until someone wants its colours."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ifsvideo.types import Image

_FULL_RANGE = np.clip(np.round((np.arange(256) - 16) * 255 / 219), 0, 255).astype(np.uint8)
"""Luma of video, 16 to 235, as grey levels (Rec. ITU-R BT.601)."""

_BLOCK = 16
_CHANGED_BLOCK = 6
"""Mean change of a block, grey levels, that is seen."""
_CHANGED_PIXEL = 64
"""Change of a pixel, grey levels, that no encoder makes."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A frame as RGB, or as the planes that the decoder gives: half the bytes, and grey for nothing.

    Attributes
    ----------
    pixels : uint8
        (H, W, 3) RGB; or (3 H / 2, W), the planes Y, U and V of BT.601, 16 to 235, U and V of half size, one
        after the other (I420); then both sides are even.
    """

    pixels: Image

    @property
    def rgb(self) -> Image:
        """(H, W, 3) uint8, made anew from planes."""
        if self.pixels.ndim == 3:
            return self.pixels
        return np.asarray(cv2.cvtColor(self.pixels, cv2.COLOR_YUV2RGB_I420), np.uint8)

    @property
    def grey(self) -> Image:
        """(H, W) uint8, the full range of grey levels."""
        if self.pixels.ndim == 3:
            return np.asarray(cv2.cvtColor(self.pixels, cv2.COLOR_RGB2GRAY), np.uint8)
        return np.asarray(cv2.LUT(self.pixels[: len(self.pixels) * 2 // 3], _FULL_RANGE), np.uint8)

    def repeats(self, other: Picture) -> bool:
        """Whether the other picture is the same, but for what an encoder makes of a repetition.

        Nowhere may a block have changed: a repetition that was encoded anew differs by up to 4 grey levels in
        a block of 16 x 16, the least motion in a clip from a standing camera by 20.
        """
        # A few rows first: pictures that differ at all nearly always differ there.
        if cv2.absdiff(self.pixels[::64], other.pixels[::64]).max() > _CHANGED_PIXEL:
            return False
        changed = cv2.absdiff(self.pixels, other.pixels)
        size = tuple(max(1, side // _BLOCK) for side in changed.shape[1::-1])
        return bool(cv2.resize(changed, size, interpolation=cv2.INTER_AREA).max() < _CHANGED_BLOCK)

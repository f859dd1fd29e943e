"""One decoded frame, kept small until someone wants its colours."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Image

_FULL_RANGE = np.clip(np.round((np.arange(256) - 16) * 255 / 219), 0, 255).astype(np.uint8)
"""Luma of video, 16 to 235, as grey levels (Rec. ITU-R BT.601, BT.709)."""

_BLOCK = 16
_CHANGED_BLOCK = 6
"""Mean change of a block, grey levels, that is seen."""
_CHANGED_PIXEL = 64
"""Change of a pixel, grey levels, that no encoder makes."""


LARGEST_KEPT = 6_000_000
"""Bytes of a frame that waits in memory as it is. Some ninety wait for their labels at 30 a second: up to
2560x1440 they take half a gigabyte."""
_QUALITY = (
    cv2.IMWRITE_JPEG_QUALITY,
    95,
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
)
"""Of larger ones: an error of about a grey level, less than the encoder makes of it later."""


class Picture:
    """A frame as RGB, or as the planes that the decoder gives: half the bytes, and grey for nothing.

    Parameters
    ----------
    pixels : uint8
        (H, W, 3) RGB; or (3 H / 2, W), the planes Y, U and V of BT.601, 16 to 235, U and V of half size, one
        after the other (I420); then both sides are even.
    bt709 : bool
        Whether the planes are those of BT.709 instead, as in most high definition.
    """

    def __init__(self, pixels: Image, bt709: bool = False) -> None:
        self._kept: Image = pixels
        self._bt709 = bt709
        self._shape = pixels.shape
        self._is_packed = False

    @property
    def pixels(self) -> Image:
        """See the parameter."""
        if not self._is_packed:
            return self._kept
        return np.asarray(cv2.imdecode(self._kept, cv2.IMREAD_UNCHANGED), np.uint8)

    def to_wait(self) -> Picture:
        """The same picture in the form in which it waits: a large one as JPEG, a fifth of the bytes."""
        if self._is_packed or self._kept.nbytes <= LARGEST_KEPT:
            return self
        packed = Picture(np.asarray(cv2.imencode(".jpg", self._kept, _QUALITY)[1], np.uint8), self._bt709)
        packed._shape, packed._is_packed = self._shape, True
        return packed

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), pixels."""
        height, width = self._shape[:2]
        return width, height if len(self._shape) == 3 else height * 2 // 3

    @property
    def rgb(self) -> Image:
        """(H, W, 3) uint8, made anew from planes."""
        pixels = self.pixels
        return pixels if pixels.ndim == 3 else self._coloured(pixels)

    def rgb_of(self, left: int, top: int, width: int, height: int) -> Image:
        """(height, width, 3) uint8 the same colours of a box inside the picture: only these are made.

        Parameters
        ----------
        left, top, width, height : int
            Pixels; at least one each way.
        """
        pixels = self.pixels
        if pixels.ndim == 3:
            return pixels[top : top + height, left : left + width]
        # Four pixels share a U and a V: the box is cut from the planes with even sides.
        column, row = left // 2, top // 2
        columns, rows = (left + width + 1) // 2 - column, (top + height + 1) // 2 - row
        whole = len(pixels) * 2 // 3
        luma = pixels[2 * row : 2 * (row + rows), 2 * column : 2 * (column + columns)]
        both = pixels[whole:].reshape(2, whole // 2, -1)[:, row : row + rows, column : column + columns]
        rgb = self._coloured(np.concatenate([luma, both.reshape(rows, 2 * columns)]))
        return rgb[top - 2 * row :, left - 2 * column :][:height, :width]

    def _coloured(self, planes: Image) -> Image:
        planes = _as_bt601(planes) if self._bt709 else planes
        return np.asarray(cv2.cvtColor(planes, cv2.COLOR_YUV2RGB_I420), np.uint8)

    @property
    def grey(self) -> Image:
        """(H, W) uint8, the full range of grey levels; of planes their own luma."""
        pixels = self.pixels
        if pixels.ndim == 3:
            return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY), np.uint8)
        return np.asarray(cv2.LUT(pixels[: len(pixels) * 2 // 3], _FULL_RANGE), np.uint8)

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


_BT601, _BT709 = np.array([0.299, 0.587, 0.114]), np.array([0.2126, 0.7152, 0.0722])
"""Shares of red, green and blue in the luma."""
_MIDDLE = 128
"""U and V of grey."""


def _to_video(luma: NDArray[np.float64]) -> NDArray[np.float64]:
    """RGB to Y, U and V, 16 to 235 and 16 to 240, by the shares (3,) of luma: (3, 3), without the offsets."""
    blue, red = np.array([0, 0, 1]) - luma, np.array([1, 0, 0]) - luma
    rows = [luma * 219, blue / (2 * (1 - luma[2])) * 224, red / (2 * (1 - luma[0])) * 224]
    return np.array(rows) / 255


_TO_VIDEO = np.column_stack([_to_video(_BT709), [16, _MIDDLE, _MIDDLE]]).astype(np.float32)
_TO_BT601 = _to_video(_BT601) @ np.linalg.inv(_to_video(_BT709))
"""Y, U and V of BT.709 to those of BT.601: luma takes a little of the colours."""
_STRIP = 1 << 18
"""Pixels that are made planes of at a time: what lies between then stays in the processor's cache."""


def _as_bt601(planes: Image) -> Image:
    """Planes (3 H / 2, W) of BT.709 as those of BT.601: OpenCV knows the colours of no others."""
    height, width = len(planes) * 2 // 3, planes.shape[1]
    u, v = planes[height:].reshape(2, height // 2, width // 2)
    lighter, *colours = (cv2.addWeighted(u, a, v, b, _MIDDLE * (1 - a - b)) for a, b in _TO_BT601[:, 1:])
    # Each once more to its right, as two channels, and once more below: a resize takes twice the time.
    lighter = cv2.merge([lighter, lighter]).reshape(height // 2, width)
    result = np.empty_like(planes)
    for row in (0, 1):
        cv2.addWeighted(planes[row:height:2], 1, lighter, 1, -_MIDDLE, dst=result[row:height:2])
    result[height:] = np.reshape(colours, (height // 2, width))
    return result


def planes_of(image: Image) -> Image:
    """A picture as an encoder wants it: planes Y, U and V of BT.709, 16 to 235, as `Picture` has them.

    Half the bytes on their way to ffmpeg, whose own way there takes three times as long.

    Parameters
    ----------
    image : (H, W, 3) uint8
        RGB; both sides even.

    Returns
    -------
    (3 H / 2, W) uint8
        Each U and V is that of the mean colour of its four pixels.
    """
    height, width = image.shape[:2]
    planes = np.empty((height * 3 // 2, width), np.uint8)
    luma, halves = planes[:height], planes[height:].reshape(2, height // 2, width // 2)
    rows = max(2, _STRIP // width // 2 * 2)
    for top in range(0, height, rows):
        strip = cv2.transform(image[top : top + rows], _TO_VIDEO)
        colours = np.empty((2, *strip.shape[:2]), np.uint8)
        cv2.split(strip, [luma[top : top + rows], *colours])
        for colour, half in zip(colours, halves[:, top // 2 : (top + rows) // 2], strict=True):
            cv2.resize(colour, half.shape[::-1], dst=half, interpolation=cv2.INTER_AREA)
    return planes

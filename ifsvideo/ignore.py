"""Parts of the picture that are not looked at: bonnet, watermark, burnt-in time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import imageio.v3 as iio
import numpy as np

from ifsvideo.errors import InputError, UsageError
from ifsvideo.types import Bools, VideoInfo

Area = tuple[int, int, int, int] | Path | Bools
"""Rectangle (x, y, width, height), mask image (black is not looked at), or (H, W) bool (True is not)."""

_BLACK = 0.25
"""Share of the mask's greatest value below which it counts as black: a JPEG's black is not exactly 0."""


def parse_area(text: str) -> Area:
    """An area from ``x,y,w,h`` in pixels, or from the name of a mask image.

    Raises
    ------
    UsageError
        If the text is four numbers that are no rectangle, or neither numbers nor a file.
    """
    try:
        numbers = [int(part) for part in text.split(",")]
    except ValueError:
        if Path(text).is_file():
            return Path(text)
        raise UsageError(f"{text!r} is neither x,y,w,h in pixels nor a mask image that exists") from None
    if len(numbers) != 4 or numbers[2] < 1 or numbers[3] < 1:
        raise UsageError(f"{text!r} is no rectangle; write x,y,w,h in pixels, width and height at least 1")
    return numbers[0], numbers[1], numbers[2], numbers[3]


def ignore_mask(areas: Sequence[Area], info: VideoInfo) -> Bools | None:
    """All areas as one mask (H, W), True where the picture is not looked at; None where there is no area.

    Raises
    ------
    UsageError
        If a mask has another size than the picture, or a rectangle lies outside it.
    InputError
        If a mask image cannot be read.
    """
    if not areas:
        return None
    mask = np.zeros((info.height, info.width), dtype=np.bool_)
    for area in areas:
        if isinstance(area, tuple):
            _cover(mask, area)
        else:
            found, name = (_read(area), str(area)) if isinstance(area, Path) else (area, "ignore")
            mask |= _fitting(found, mask.shape, name)
    return mask


def _cover(mask: Bools, rectangle: tuple[int, int, int, int]) -> None:
    x, y, width, height = rectangle
    region = mask[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)]
    if region.size == 0:
        size = f"{mask.shape[1]}x{mask.shape[0]}"
        raise UsageError(f"rectangle {x},{y},{width},{height} lies outside the picture of {size}; correct it")
    region[:] = True


def _read(path: Path) -> Bools:
    try:
        image = np.asarray(iio.imread(path))
    except (OSError, ValueError, SyntaxError):
        raise InputError(f"{path}: is not an image that can be read as a mask; use a PNG") from None
    if image.ndim == 3:
        image = image[..., :3].max(axis=2)
    highest = 1 if image.dtype == np.bool_ else np.iinfo(image.dtype).max
    return np.asarray(image < _BLACK * highest, dtype=np.bool_)


def _fitting(mask: Bools, shape: tuple[int, ...], name: str) -> Bools:
    if mask.shape != shape:
        got, wanted = ("x".join(str(side) for side in size[::-1]) for size in (mask.shape, shape))
        raise UsageError(f"{name}: the mask is {got}, the picture {wanted}; make them the same size")
    return np.asarray(mask, dtype=np.bool_)

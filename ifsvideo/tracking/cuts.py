"""Scene cuts: the tracks end, and the picture is another; a jump of exposure may do the first, not both."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ifsvideo.tracking.klt import flatten
from ifsvideo.types import Image, Ints

_GOING_ON = 0.35
"""Share of the tracks that go on above which there is no cut. Across one, 2 of 100 go on by chance between
real pictures, 28 between smooth blobs; within the scenes of real clips 37 and more do."""
_ALIKE = 0.3
"""Correlation of two pictures above which they show one scene, shifted at most. Neighbours in a drive out of
a tunnel, where the exposure jumps, reach 0.38 and more, 99 of 100 pairs of different drives below 0.29."""
_DIAGONAL = 160.0
"""Size in which they are compared, pixels: larger, and a shift that turns or grows parts them, smaller, and
any two streets are alike."""
_SHIFT = 0.12
"""How far they may be shifted, share of each side."""
_PLAIN = 3.0
"""Standard deviation, grey levels, below which a picture shows nothing to compare: a fade to black."""


def tracks_end(before: Ints, after: Ints) -> bool:
    """Whether so few of the tracks (N,) of a frame go on in the next that there may be a cut."""
    going_on = np.isin(before, after, assume_unique=True)
    return not len(going_on) or going_on.mean() <= _GOING_ON


def alike(before: Image, after: Image) -> bool:
    """Whether two grey pictures show one scene, or nothing that could be compared."""
    one, other = (_small(image) for image in (before, after))
    if min(one.std(), other.std()) < _PLAIN:
        return True
    height, width = one.shape
    rows, columns = math.ceil(_SHIFT * height), math.ceil(_SHIFT * width)
    middle = flatten(one)[rows : height - rows, columns : width - columns]
    return bool(cv2.matchTemplate(flatten(other), middle, cv2.TM_CCOEFF_NORMED).max() > _ALIKE)


def _small(image: Image) -> Image:
    height, width = image.shape
    scale = min(1.0, _DIAGONAL / math.hypot(height, width))
    size = (max(8, round(width * scale)), max(8, round(height * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)

"""The silhouette of an object: which pixels near it move as it does, and which with the ground behind it.

A pixel of the object looks in another frame like the place to which the object has carried it, a pixel of the
ground like the place to which the ground has gone. What is covered or uncovered meanwhile looks like neither;
but an outline covers on one side only of the time at which it is looked at, so frames before and after are
asked and the better side counts. Where object and ground are plain both fit; there colours decide, and where
the picture has edges (`cut.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.cut import cut
from ifsvideo.types import Bools, Image

_PIXELS = 12000
"""Most pixels of a view; a larger box is looked at in fewer. With 7500 outlines are less exact, with 20000
no more exact, and slower (`ifsvideo/benchmark/TRIED.md`)."""
_BLUR = 0.7
"""Standard deviation of the smoothing, pixels of the view: takes out noise and the error of sampling between
pixels."""
_SHADE = 0.5
"""Share of the view over which brightness may differ smoothly without counting: a shadow that goes along with
the object is ground that has become darker."""
_NOISE = 2.0
"""Misfit, grey levels, that noise alone leaves; added to both, so that two small ones count as equal."""
_SURE = 0.9
"""Logarithm of the ratio of misfits from which on a pixel is told: one fits 2.5 times better."""
_BESIDE = np.ones((3, 3), np.uint8)
"""Pixels over which misfits are averaged. One that is told must have all of these told alike: next to an
outline they lie on both sides of it."""

Flow = NDArray[np.float32]
"""(R, C, 2) how far nodes of a view go, evenly spaced over it as the pixels of a small picture, pixels."""


@dataclass(frozen=True)
class View:
    """A box of the picture, and the pixels in which it is looked at.

    Attributes
    ----------
    left, top, width, height : int
        Pixels of the picture.
    columns, rows : int
        Pixels of the view.
    """

    left: int
    top: int
    width: int
    height: int
    columns: int
    rows: int

    @classmethod
    def around(cls, xy: NDArray[np.float32], growth: float, margin: float, size: tuple[int, int]) -> View:
        """The box of points (N, 2), larger on every side by ``growth`` times its size and by a margin, as far
        as the picture of ``size`` (width, height) goes."""
        low, high = xy.min(axis=0), xy.max(axis=0)
        grown = growth * (high - low) + margin
        return cls._of(low - grown, high + grown, size)

    @classmethod
    def _of(
        cls, low: NDArray[np.floating[Any]], high: NDArray[np.floating[Any]], size: tuple[int, int]
    ) -> View:
        """The box from one corner (2,) to the other, as far as the picture goes."""
        left, top = np.clip(np.floor(low), 0, np.array(size) - 1).astype(int).tolist()
        right, bottom = np.clip(np.ceil(high), 0, np.array(size) - 1).astype(int).tolist()
        width, height = right + 1 - left, bottom + 1 - top
        scale = min(1.0, (_PIXELS / (width * height)) ** 0.5)
        return cls(left, top, width, height, max(1, round(width * scale)), max(1, round(height * scale)))

    def grown_beyond(self, silhouette: Bools, share: float, growth: float, size: tuple[int, int]) -> View:
        """The view, larger by ``growth`` times its size on the sides of which a silhouette (rows, columns) in
        it covers more than a ``share``: there the object may go on."""
        edges = (silhouette[:, 0], silhouette[0], silhouette[:, -1], silhouette[-1])
        left, top, right, bottom = (growth * bool(edge.mean() > share) for edge in edges)
        low, extent = np.array([self.left, self.top], float), np.array([self.width, self.height])
        high = low + extent - 1
        return View._of(low - extent * [left, top], high + extent * [right, bottom], size)

    def nodes(self, columns: int, rows: int) -> NDArray[np.float32]:
        """Places (rows * columns, 2) in the picture, spaced as the pixels of a view of this size."""
        x = self.left + (np.arange(columns) + 0.5) * self.width / columns - 0.5
        y = self.top + (np.arange(rows) + 0.5) * self.height / rows - 0.5
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2).astype(np.float32)

    def contains(self, xy: NDArray[np.float32], beyond: float = 0.0) -> Bools:
        """Whether points (N, 2) of the picture lie in the box, or no farther ``beyond`` it on any side than
        so many times its size."""
        extent = np.array([self.width, self.height])
        place = np.rint(xy) - [self.left, self.top]
        return np.asarray(((place >= -beyond * extent) & (place < (1 + beyond) * extent)).all(axis=1), bool)

    def places(self, xy: NDArray[np.float32], columns: int, rows: int) -> NDArray[np.float32]:
        """Points (N, 2) of the picture in pixels of a view of this size."""
        scale = np.array([columns / self.width, rows / self.height])
        return np.asarray((xy - [self.left, self.top] + 0.5) * scale - 0.5, np.float32)

    def cut(self, picture: Image, margin: int = 0) -> tuple[Image, NDArray[np.float32]]:
        """The box of a picture, larger by a margin, in pixels of the view, and where (2,) the view's first
        pixel lies in it."""
        height, width = picture.shape[:2]
        left, top = max(0, self.left - margin), max(0, self.top - margin)
        right = min(width, self.left + self.width + margin)
        bottom = min(height, self.top + self.height + margin)
        along_x, along_y = self.columns / self.width, self.rows / self.height
        columns = max(1, round((right - left) * along_x))
        rows = max(1, round((bottom - top) * along_y))
        piece = _in_pixels(picture[top:bottom, left:right], columns, rows)
        # The piece has whole pixels: its own scale is not exactly the view's.
        x = (self.left - left + 0.5 / along_x) * (columns / (right - left)) - 0.5
        y = (self.top - top + 0.5 / along_y) * (rows / (bottom - top)) - 0.5
        return piece, np.array([x, y], np.float32)

    def box(self, picture: Image) -> Image:
        """The box of a picture, in the picture's own pixels."""
        return picture[self.top : self.top + self.height, self.left : self.left + self.width]


@dataclass(frozen=True)
class Parted:
    """Another frame, in which object and ground have parted.

    Attributes
    ----------
    grey : (H, W) uint8
        The whole picture.
    with_object, with_ground : Flow
        To there from the frame that is looked at.
    """

    grey: Image
    with_object: Flow
    with_ground: Flow


def find_silhouette(view: View, grey: Image, colours: Image, sides: Sequence[Sequence[Parted]]) -> Bools:
    """Whether each pixel of a view (rows, columns) belongs to the object.

    Parameters
    ----------
    view : View
    grey : (H, W) uint8
        The picture that is looked at.
    colours : (height, width, 3) uint8
        RGB of the view's box of it.
    sides : sequence of sequences of Parted
        Frames before, and frames after; one of them may have none.
    """
    log_ratio = _log_ratio(view, grey, sides)
    likely = log_ratio > 0
    if likely.all() or not likely.any():
        return np.asarray(likely, bool)
    border = np.ones(likely.shape, bool)
    border[1:-1, 1:-1] = False
    sure = -(border & ~likely).astype(np.int8)
    sure[cv2.erode((log_ratio > _SURE).astype(np.uint8), _BESIDE) > 0] = 1
    sure[cv2.erode((log_ratio < -_SURE).astype(np.uint8), _BESIDE) > 0] = -1
    # Where the picture is all edges the outline may lie beside them: what is told stands.
    return cut(_in_pixels(colours, view.columns, view.rows), likely, sure) & (log_ratio > -_SURE)


def _log_ratio(view: View, grey: Image, sides: Sequence[Sequence[Parted]]) -> NDArray[np.float32]:
    """Logarithm (rows, columns) of the misfit to the ground over that to the object; 0 where none is seen."""
    here = _smooth(view.cut(grey)[0])
    least = np.full((2, view.rows, view.columns), np.inf, np.float32)
    for side in sides:
        if side:
            misfits = [_misfits(view, here, other) for other in side]
            np.minimum(least, sum(misfits[1:], misfits[0]) / len(side), out=least)
    least[np.isinf(least)] = 0
    to_object, to_ground = least + _NOISE
    return np.asarray(np.log(to_ground / to_object), np.float32)


def _in_pixels(piece: Image, columns: int, rows: int) -> Image:
    """A piece of a picture in so many pixels, by the mean over each."""
    if (rows, columns) == piece.shape[:2]:
        return np.ascontiguousarray(piece)
    return np.asarray(cv2.resize(piece, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)


def _smooth(grey: Image) -> Image:
    return np.asarray(cv2.GaussianBlur(grey, (0, 0), _BLUR), np.uint8)


def _misfits(view: View, here: Image, other: Parted) -> NDArray[np.float32]:
    """Misfit (2, rows, columns), grey levels, of each pixel to what another frame shows where the object, and
    where the ground would have carried it, but for a smooth change of brightness; infinite where one of these
    is outside the picture."""
    height, width = other.grey.shape
    farthest = max(float(np.abs(flow).max()) for flow in (other.with_object, other.with_ground))
    there, first = view.cut(other.grey, int(min(farthest, max(height, width))) + 2)
    there = _smooth(there)
    scale = np.array([view.columns / view.width, view.rows / view.height], np.float32)
    corner = (np.array([view.left, view.top], np.float32) + 0.5) * scale - 0.5
    last = (np.array([width, height], np.float32) - 0.5) * scale - 0.5
    column, row = np.arange(view.columns, dtype=np.float32), np.arange(view.rows, dtype=np.float32)[:, None]
    shade = (max(1, round(_SHADE * view.columns)), max(1, round(_SHADE * view.rows)))
    outside = np.zeros(here.shape, bool)
    misfits = np.empty((2, *here.shape), np.float32)
    for flow, misfit in zip((other.with_object, other.with_ground), misfits, strict=True):
        dx, dy = cv2.split(cv2.resize(flow * scale, (view.columns, view.rows)))
        x, y = dx + column, dy + row
        for place, begin, end in ((x, corner[0], last[0]), (y, corner[1], last[1])):
            if place.min() + begin < -0.5 or place.max() + begin > end:
                outside |= (place + begin < -0.5) | (place + begin > end)
        shown = cv2.remap(
            there, x + first[0], y + first[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        difference = cv2.subtract(shown, here, dtype=cv2.CV_32F)
        cv2.absdiff(difference, cv2.blur(difference, shade), dst=difference)
        cv2.blur(difference, _BESIDE.shape, dst=misfit)
    if outside.any():
        misfits[:, outside] = np.inf
    return misfits

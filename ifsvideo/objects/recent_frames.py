"""The frames of late: their pictures, their points and what is known of these."""

from __future__ import annotations

from collections import deque
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.silhouette import View
from ifsvideo.tracking.tracker import shrunk, tracked_size
from ifsvideo.types import Bools, FramePoints, Image, Ints
from ifsvideo.video.picture import Picture


class RecentFrame:
    """A frame among the last: its points, in pixels of the picture as it is tracked, and what they are.

    Parameters
    ----------
    picture : Picture, in the size of the coordinates.
    points : FramePoints, ordered by id.
    labels : (N,) int
        0 background, 1, 2, ... moving, -1 undecided.
    ground : (N,) bool
        Which tracks show how the ground moves.
    guessed : (N,) bool
        Which labels are but guesses.
    scale : float
        Share of the picture's size in which it was tracked.
    """

    def __init__(
        self, picture: Picture, points: FramePoints, labels: Ints, ground: Bools, guessed: Bools, scale: float
    ) -> None:
        self.points = points
        self.labels, self.ground, self.guessed = labels, ground, guessed
        self._picture = picture
        self._scale = scale

    # Made when first asked for: where nothing moves, nobody does.
    @cached_property
    def grey(self) -> Image:
        """(H, W) the picture in the size in which it is tracked."""
        return shrunk(self._picture.grey, *self.size)

    @cached_property
    def size(self) -> tuple[int, int]:
        """(W, H) in which it is tracked."""
        return tracked_size(*self._picture.size, self._scale)

    @cached_property
    def _per_pixel(self) -> NDArray[np.float64]:
        """Pixels of this size per pixel of the coordinates, along x and y."""
        return np.array(self.size) / self._picture.size

    def colours_of(self, view: View) -> Image:
        """(height, width, 3) the colours of a view's box, in that size."""
        if self.size == self._picture.size:
            return self._picture.rgb_of(view.left, view.top, view.width, view.height)
        return view.box(np.asarray(cv2.resize(self._picture.rgb, self.size), np.uint8))

    @cached_property
    def xy(self) -> NDArray[np.float32]:
        """(N, 2) the points."""
        return self._scaled(self.points.xy)

    def of(self, ids: NDArray[np.int64]) -> NDArray[np.float32]:
        """Where tracks are (M, 2); NaN where one is not seen."""
        return self._scaled(self.points.positions(ids))

    def _scaled(self, xy: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.asarray((xy + 0.5) * self._per_pixel - 0.5, np.float32)


class RecentFrames:
    """The last so many frames, by how many came before each.

    Parameters
    ----------
    most : int
        Frames that are kept.
    """

    def __init__(self, most: int) -> None:
        self._kept: deque[RecentFrame] = deque(maxlen=most)
        self.count = 0
        """Frames that came."""

    def add(self, frame: RecentFrame) -> None:
        """Take the next frame."""
        self._kept.append(frame)
        self.count += 1

    def __getitem__(self, place: int) -> RecentFrame:
        """The frame before which so many came; `IndexError` where it is kept no longer, or has not come."""
        frame = self.get(place)
        if frame is None:
            raise IndexError(place)
        return frame

    def get(self, place: int) -> RecentFrame | None:
        """The same; None where it is kept no longer, or has not come."""
        back = self.count - place
        return self._kept[-back] if 0 < back <= len(self._kept) else None

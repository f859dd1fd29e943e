"""From frames to points that keep their number: a track's birth, life and death."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.config import TrackerConfig
from ifsvideo.errors import UsageError
from ifsvideo.tracking.appearance import Patches, correlation, cut
from ifsvideo.tracking.corners import find_corners, most_crowded
from ifsvideo.tracking.drift import References
from ifsvideo.tracking.klt import Search, flatten, follow
from ifsvideo.types import Bools, FramePoints, Image, Ints

SMALLEST = 16
"""Least side of a picture that is searched, pixels; smaller ones hold no window and have no points."""
LARGEST = 2300.0
"""Greatest diagonal that is tracked in full resolution, pixels (1920x1080 is); larger pictures are halved.
KLT's window stays the same, and what it sees of a 4K picture is then what it sees of a 1080-line one."""
SUDDEN_LOSS = 0.3
"""Share of the tracks whose loss in one frame points to a jump of exposure (or a cut): worth a second try."""
CUT = 0.2
"""Share of the tracks below which those that seem to go on, do so by chance: another picture has begun."""
COLLAPSED = 0.4
"""Share of the least distance of corners below which two tracks follow the same thing."""


def tracked_size(width: int, height: int, scale: float = 1.0) -> tuple[int, int]:
    """Width and height in which a picture is tracked: ``scale`` times its own, halved while that is large."""
    while math.hypot(width, height) * scale > LARGEST:
        scale /= 2
    return max(1, int(width * scale)), max(1, int(height * scale))


def shrunk(grey: Image, width: int, height: int) -> Image:
    """A grey picture in another size; itself where it has that."""
    if grey.shape == (height, width):
        return grey
    return np.asarray(cv2.resize(grey, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


class KltTracker:
    """Shi-Tomasi corners followed by pyramidal KLT; a `ifsvideo.types.Tracker`.

    Parameters
    ----------
    config : TrackerConfig, optional
    fps : float, optional
        Frames a second; 30 where nobody told.
    """

    def __init__(self, config: TrackerConfig | None = None, fps: float | None = None) -> None:
        self.config = config or TrackerConfig()
        self.birth_interval = min(
            self.config.birth_interval, max(1, int(self.config.birth_interval_s * (fps or 30.0) + 0.5))
        )
        """Frames between two searches for new corners."""

    def track(self, frames: Iterable[Image], ignore: Bools | None = None) -> Iterator[FramePoints]:
        """Yield the points of every frame, ordered by id: exactly one item per frame.

        Parameters
        ----------
        frames : iterable of (H, W, 3) uint8, RGB, all of one size
        ignore : (H, W) bool, optional
            True where no point is born and where living ones end.

        Raises
        ------
        UsageError
            If ``ignore`` has another size than the frames.
        """
        return self.track_grey((_grey(frame) for frame in frames), ignore)

    def track_grey(self, frames: Iterable[Image], ignore: Bools | None = None) -> Iterator[FramePoints]:
        """As `track`, of frames (H, W) uint8 that are grey already."""
        life: _Life | None = None
        for frame in frames:
            if life is None:
                life = _Life(frame.shape[1], frame.shape[0], ignore, self.config, self.birth_interval)
            yield life.advance(frame)


class _Life:
    """The living tracks of one clip, and the frame in which they were last seen."""

    def __init__(
        self, width: int, height: int, ignore: Bools | None, config: TrackerConfig, birth_interval: int
    ) -> None:
        if ignore is not None and ignore.shape != (height, width):
            raise UsageError(
                f"the ignore mask is {ignore.shape[1]}x{ignore.shape[0]}, the frames are {width}x{height}; "
                "give a mask of the frames' size"
            )
        self.config = config
        self.birth_interval = birth_interval
        self.width, self.height = tracked_size(width, height, config.scale)
        self.full_size = (width, height)
        self.diagonal = math.hypot(self.width, self.height)
        self.search = Search.for_picture(self.width, self.height, config.window)
        self.allowed = self._allowed(ignore)
        self.ids = np.empty(0, np.int64)
        self.xy = np.empty((0, 2), np.float32)
        self.references = References.none(self.search.window // 3)
        self.looks = self.references.patches
        """What each track sees in the frame before."""
        self.previous: Image | None = None
        self.next_id = 0
        self.frame = 0
        self.after_birth = 0

    def advance(self, frame: Image) -> FramePoints:
        """Take the next frame, grey; return the points seen in it."""
        grey = self._as_tracked(frame)
        if min(grey.shape) >= SMALLEST:
            if self.previous is not None:
                self._live(self.previous, grey)
            few = len(self.ids) < (1 - SUDDEN_LOSS) * self.after_birth
            if few or self.frame % self.birth_interval == 0:
                self._bear(grey)
        self.previous = grey
        self.frame += 1
        return FramePoints(self.ids, self._in_full_size(self.xy))

    def _live(self, before: Image, after: Image) -> None:
        """Follow every track to the next frame; those that fail a check end."""
        moved, alive, self.looks = self._step(before, after, self.xy, self.looks)
        if len(alive) and np.mean(~alive) > SUDDEN_LOSS:
            lost = np.flatnonzero(~alive)
            found = self._again(before, after, lost, moved)
            self.looks[found] = cut(after, moved[found], self.references.radius)
            alive[found] = True
            if np.mean(alive) < CUT:
                alive[:] = False
        alive &= self._inside(moved)
        self.xy = moved
        self._keep(alive)
        self._keep(self._distinct(self.xy))
        self._keep(self._faithful(after))

    def _keep(self, which: Bools) -> None:
        """End all other tracks."""
        self.ids, self.xy, self.looks = self.ids[which], self.xy[which], self.looks[which]
        self.references.keep(which)

    def _faithful(self, grey: Image) -> Bools:
        """Whether each track still sees what it saw at birth; those whose turn it is are checked."""
        turn = np.flatnonzero((self.ids + self.frame) % self.config.check_interval == 0)
        verdict = self.references.check(grey, self.xy[turn], turn)
        faithful = np.ones(len(self.ids), bool)
        faithful[turn] = verdict.similarity >= self.config.min_resemblance
        faithful[turn] &= verdict.offset <= max(1.0, self.config.max_drift * self.diagonal)
        return faithful

    def _again(
        self, before: Image, after: Image, lost: Ints, moved: NDArray[np.float32]
    ) -> NDArray[np.int64]:
        """Look for lost tracks once more, without brightness and contrast; which were found, in ``moved``."""
        flat, xy = flatten(before), self.xy[lost]
        looks = cut(flat, xy, self.references.radius)
        again, believed, _ = self._step(flat, flatten(after), xy, looks)
        moved[lost[believed]] = again[believed]
        return np.asarray(lost[believed], np.int64)

    def _step(
        self, before: Image, after: Image, xy: NDArray[np.float32], looks: Patches
    ) -> tuple[NDArray[np.float32], Bools, Patches]:
        """Points in the next frame, which of them can be believed, and what they see there."""
        config = self.config
        moved, return_error = follow(before, after, xy, self.search)
        believed = return_error <= max(0.5, config.max_return_error * self.diagonal)
        believed &= np.hypot(*(moved - xy).T) <= config.max_step * self.diagonal
        seen = cut(after, moved, self.references.radius)
        return moved, believed & (correlation(looks, seen) >= config.min_similarity), seen

    def _bear(self, grey: Image) -> None:
        """Let new tracks begin where the picture has room."""
        born = find_corners(grey, self.xy, self.allowed, self.config)
        surplus = len(self.ids) + len(born) - self.config.max_points
        if surplus > 0:
            keep = np.ones(len(self.ids), bool)
            keep[most_crowded(self.xy, self.width, self.height, surplus, self.config.cells)] = False
            self._keep(keep)
        self.ids = np.concatenate([self.ids, self.next_id + np.arange(len(born), dtype=np.int64)])
        self.xy = np.concatenate([self.xy, born])
        self.references.add(grey, born)
        self.looks = np.concatenate([self.looks, self.references.patches[len(self.looks) :]])
        self.next_id += len(born)
        self.after_birth = len(self.ids)

    def _inside(self, xy: NDArray[np.float32]) -> Bools:
        """Whether each point lies where the picture is looked at."""
        column, row = np.rint(np.nan_to_num(xy, nan=-1)).astype(np.int64).T
        within = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        within[within] = self.allowed[row[within], column[within]]
        return np.asarray(within, bool)

    def _distinct(self, xy: NDArray[np.float32]) -> Bools:
        """Whether each track, in the order of age, has its place for itself; of two, the younger has not."""
        keep = np.ones(len(xy), bool)
        if len(xy) > 1:
            distance = COLLAPSED * max(2.0, self.config.min_distance * self.diagonal)
            keep[cKDTree(xy).query_pairs(distance, output_type="ndarray").max(axis=1)] = False
        return keep

    def _allowed(self, ignore: Bools | None) -> Bools:
        """Where points may be: off the margin and off the mask (H, W), in the size that is tracked."""
        allowed = np.zeros((self.height, self.width), bool)
        edge = max(2, round(self.config.margin * self.diagonal))
        allowed[edge : self.height - edge, edge : self.width - edge] = True
        if ignore is not None:
            masked = cv2.resize(
                ignore.astype(np.float32), (self.width, self.height), interpolation=cv2.INTER_AREA
            )
            allowed &= masked == 0
        return allowed

    def _as_tracked(self, grey: Image) -> Image:
        width, height = self.full_size
        if grey.shape != (height, width):
            raise ValueError(f"expected frames of {width}x{height} pixels, got {grey.shape}")
        return shrunk(grey, self.width, self.height)

    def _in_full_size(self, xy: NDArray[np.float32]) -> NDArray[np.float32]:
        """Pixels of the frame as it came: the centre of the top-left pixel is (0, 0) in both sizes."""
        scale = np.array(self.full_size, np.float64) / (self.width, self.height)
        return np.asarray((xy + 0.5) * scale - 0.5, np.float32)


def _grey(frame: Image) -> Image:
    if frame.ndim != 3 or frame.shape[2] != 3:
        raise ValueError(f"expected frames of shape (H, W, 3), got {frame.shape}")
    return np.asarray(cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY), np.uint8)

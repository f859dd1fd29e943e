"""The points of every frame of a clip, and what else is told of it while it is tracked."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ifsvideo.tracking.cuts import alike, tracks_end
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import Bools, FramePoints, GreyTracker, Image, Tracker
from ifsvideo.video.picture import Picture


@dataclass(frozen=True, eq=False)
class Step:
    """One frame.

    Attributes
    ----------
    points : FramePoints
        Ordered by id.
    picture : Picture or None
        None where the input is tracks.
    repeats : bool
        Whether it shows the frame before once more, pixel by pixel.
    cut : bool
        Whether another scene begins.
    """

    points: FramePoints
    picture: Picture | None = None
    repeats: bool = False
    cut: bool = False


def follow(
    tracker: Tracker,
    pictures: Generator[Picture, None, None],
    ignore: Bools | None = None,
    shot_frames: int | None = None,
) -> Generator[Step, None, None]:
    """Track the frames of a clip; those that repeat the one before are not shown to the tracker.

    The pictures come out in the form in which they wait.

    Parameters
    ----------
    tracker : Tracker
        A `GreyTracker` is given grey frames.
    pictures : generator of Picture
        It is closed in the end.
    ignore : (H, W) bool, optional
        True where the picture is not looked at.
    shot_frames : int, optional
        Where the frames do not follow each other: after so many of them another shot begins.

    Raises
    ------
    ValueError
        If the tracker does not give points for every frame, or two points of one track.
    """
    shown: deque[_Shown] = deque()
    given = taken = 0
    last: Step | None = None

    def distinct() -> Iterator[Picture]:
        nonlocal given
        before: Picture | None = None
        for place, picture in enumerate(pictures):
            begins = shot_frames is not None and place % shot_frames == 0
            if before is not None and not begins and picture.repeats(before):
                shown.append(_Shown(before, repeats=True))
                continue
            before = picture
            given += 1
            shown.append(_Shown(picture, begins=begins))
            yield picture

    def repetitions() -> Iterator[Step]:
        while last is not None and shown and shown[0].repeats:
            yield Step(last.points, shown.popleft().picture.to_wait(), repeats=True)

    with closing(pictures):
        for points in _points(tracker, distinct(), ignore):
            yield from repetitions()
            taken += 1
            if not shown:
                break
            shown_now = shown.popleft()
            last = _step(last, ordered(points), shown_now)
            yield replace(last, picture=shown_now.picture.to_wait())
        if taken != given:
            raise ValueError(f"the tracker gave points for {taken} of {given} frames")
        yield from repetitions()


@dataclass(frozen=True)
class _Shown:
    """A frame that was read and has no points yet."""

    picture: Picture
    repeats: bool = False
    begins: bool = False


def _step(before: Step | None, points: FramePoints, shown: _Shown) -> Step:
    cut = shown.begins or (
        before is not None
        and before.picture is not None
        and tracks_end(before.points.ids, points.ids)
        and not alike(before.picture.grey, shown.picture.grey)
    )
    return Step(points, shown.picture, cut=cut)


def steps_of(trajectories: Trajectories) -> Iterator[Step]:
    """The steps of tracks that are there already."""
    bounds = np.searchsorted(trajectories.frame, np.arange(trajectories.frames + 1))
    for start, stop in pairwise(bounds.tolist()):
        yield Step(ordered(FramePoints(trajectories.ids[start:stop], trajectories.xy[start:stop])))


def ordered(points: FramePoints) -> FramePoints:
    """The same points by id.

    Raises
    ------
    ValueError
        If a track has two points.
    """
    if (np.diff(points.ids) > 0).all():
        return points
    order = np.argsort(points.ids, kind="stable")
    ids = points.ids[order]
    twice = np.flatnonzero(np.diff(ids) == 0)
    if len(twice):
        raise ValueError(f"track {ids[twice[0]]} has two points in one frame")
    return FramePoints(ids, points.xy[order])


def _points(tracker: Tracker, pictures: Iterator[Picture], ignore: Bools | None) -> Iterable[FramePoints]:
    if isinstance(tracker, GreyTracker):
        return tracker.track_grey(_greys(pictures), ignore)
    return tracker.track((picture.rgb for picture in pictures), ignore)


def _greys(pictures: Iterator[Picture]) -> Iterator[Image]:
    return (picture.grey for picture in pictures)

"""An object in one frame: its silhouette, by the nearest frames in which it and the ground have parted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from ifsvideo.objects.parting import NODES, PARTED, Motions, how_far_parted, lengths
from ifsvideo.objects.recent_frames import RecentFrame, RecentFrames
from ifsvideo.objects.silhouette import Flow, Parted, View, find_silhouette
from ifsvideo.types import Bools

_COMPARED = 2
"""Frames that are compared, on each side."""
_ACCELERATION = 0.7
"""Share of the time that two motions need to part, told by a shorter one, before which it is not tried."""
_GROWTH, _MARGIN = 0.1, 10.0
"""How far beyond its tracks an object may reach, share of their box and pixels. With half of the box false
objects spread over what moves nearly alike."""
_SMALLEST = 8
"""Least side of a view, pixels: in a smaller one there is no outline."""
_TOUCHED, _GROWN = 0.1, 0.4
"""Share of a side of its view that a silhouette covers where the object goes on beyond it, and how much
farther is looked then, share of the view."""


@dataclass(frozen=True)
class Sighting:
    """A silhouette (rows, columns) in its view, and the frames that told it, with the tracks (N, 2) there."""

    view: View
    silhouette: Bools
    others: list[tuple[Parted, NDArray[np.float32]]]

    def lies_on(self, xy: NDArray[np.float32]) -> Bools:
        """Whether points (N, 2) in the view lie on the silhouette."""
        rows, columns = self.silhouette.shape
        column, row = np.rint(self.view.places(xy, columns, rows)).astype(int).T
        return np.asarray(self.silhouette[row.clip(0, rows - 1), column.clip(0, columns - 1)], bool)

    def goes_along(self, xy: NDArray[np.float32], tracks: NDArray[np.intp]) -> Bools:
        """Whether some of the frame's tracks at ``xy`` (N, 2) move rather as the object than as the ground
        (T,); so those do that are seen once."""
        lead = np.zeros(len(tracks))
        if not len(tracks):
            return lead >= 0
        place = self.view.places(xy[tracks], NODES, NODES)
        for parted, there in self.others:
            step = there[tracks] - xy[tracks]
            to_object, to_ground = (
                lengths(step - _at(flow, place)) for flow in (parted.with_object, parted.with_ground)
            )
            lead += np.nan_to_num(to_ground - to_object)
        return np.asarray(lead >= 0, bool)


def around(frame: RecentFrame, own: Bools) -> View:
    """The view in which an object lies, by its own tracks (N,)."""
    return View.around(frame.xy[own], _GROWTH, _MARGIN, frame.size)


def look_for(frames: RecentFrames, place: int, own: Bools, lags: Sequence[int]) -> Sighting | None:
    """Find the silhouette of an object in a frame.

    Parameters
    ----------
    frames : RecentFrames
    place : int
        The frame that is looked at, one of those.
    own : (N,) bool
        Which of its points are the object's.
    lags : sequence of int
        Frames between two that may be compared, ascending.

    Returns
    -------
    Sighting or None
        None where the motion of the object or the ground is not known, or where they have not parted.
    """
    here = frames[place]
    seen = _sight(frames, place, own, around(here, own), lags)
    if seen is None:
        return None
    wider = seen.view.grown_beyond(seen.silhouette, _TOUCHED, _GROWN, here.size)
    return seen if wider == seen.view else _sight(frames, place, own, wider, lags) or seen


def _sight(frames: RecentFrames, place: int, own: Bools, view: View, lags: Sequence[int]) -> Sighting | None:
    """The silhouette in a view."""
    here = frames[place]
    motions = Motions(view, here.xy, own, here.ground & ~own, here.guessed, math.hypot(*here.size) / 800)
    if not motions.known or min(view.width, view.height) < _SMALLEST:
        return None
    sides = [
        _parted(motions, here.points.ids, [(lag, frames.get(place + way * lag)) for lag in lags])
        for way in (-1, 1)
    ]
    if not any(sides):
        return None
    parted = [[one for one, _ in side] for side in sides]
    silhouette = find_silhouette(view, here.grey, here.colours_of(view), parted)
    return Sighting(view, silhouette, [pair for side in sides for pair in side])


def _parted(
    motions: Motions, ids: NDArray[np.int64], others: Sequence[tuple[int, RecentFrame | None]]
) -> list[tuple[Parted, NDArray[np.float32]]]:
    """The nearest of the frames on one side in which object and ground have parted, and where the tracks
    (N, 2) are there."""
    found: list[tuple[Parted, NDArray[np.float32]]] = []
    least = 0.0
    for lag, other in others:
        if other is None or len(found) == _COMPARED:
            break
        if lag < least:
            continue
        there = other.of(ids)
        flows = motions.to(there)
        if flows is None:
            break
        parts = how_far_parted(*flows)
        if parts >= PARTED:
            found.append((Parted(other.grey, *flows), there))
        else:
            # No fit for times in which they cannot have parted yet.
            least = _ACCELERATION * lag * PARTED / max(parts, 1e-6)
    return found


def _at(flow: Flow, place: NDArray[np.float32]) -> NDArray[np.float32]:
    """The flow (N, 2) at places (N, 2) in pixels of its nodes, bilinear between them."""
    # Not cv2.remap: it takes 32766 points at most, and a tracker of one's own may give more.
    x, y = place.T
    return np.stack(
        [
            map_coordinates(one, [y, x], np.float32, order=1, mode="nearest")
            for one in np.moveaxis(flow, 2, 0)
        ],
        axis=1,
    )

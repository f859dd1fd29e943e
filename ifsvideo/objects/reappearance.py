"""Objects that were lost for a moment, behind a pole or a wiper, are known again by place and motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ifsvideo.types import Bools, Tracks

_NEVER = 1e9
"""Cost of a pair that cannot be one object."""


@dataclass(frozen=True)
class Sight:
    """Where an object was and how it moved in a window.

    Attributes
    ----------
    first, last : float
        Frames of the clip in which it was first and last seen there.
    middle : float
        Mean of the frames in which its points were seen.
    place : (2,) float, where it was then, pixels.
    velocity : (2,) float, pixels a frame.
    extent : float, distance from the middle that holds most of its points, pixels.
    """

    first: float
    last: float
    middle: float
    place: NDArray[np.float64]
    velocity: NDArray[np.float64]
    extent: float

    @classmethod
    def of(cls, tracks: Tracks, members: Bools, start: int, stride: int) -> Sight:
        """Of some tracks of a window that begins with frame ``start`` and looks at every ``stride``-th."""
        xy, visible = tracks.xy[:, members], tracks.visible[:, members]
        frame = start + stride * np.arange(len(xy), dtype=np.float64)
        seen = np.flatnonzero(visible.any(axis=1))
        middle = float(np.average(frame, weights=visible.sum(axis=1)))
        steps = (xy[1:] - xy[:-1])[visible[1:] & visible[:-1]]
        velocity = np.median(steps, axis=0) / stride if len(steps) else np.zeros(2)
        # Every observation is carried to one time, since few tracks are seen all along.
        row, column = np.nonzero(visible)
        at_middle = xy[row, column] + (middle - frame[row])[:, None] * velocity
        place = np.median(at_middle, axis=0)
        extent = float(np.quantile(np.linalg.norm(at_middle - place, axis=1), 0.8))
        return cls(float(frame[seen[0]]), float(frame[seen[-1]]), middle, place, velocity, extent)


def match(
    lost: Mapping[int, Sight], found: Mapping[int, Sight], longest: float, unit: float
) -> dict[int, int]:
    """Which objects without a number are lost ones come back; most pairs first, then the nearest.

    A pair agrees if the lost object, going on as it went, would be where the other is, within half their
    extent and a quarter of the way; if both move alike, and are of about one size.

    Parameters
    ----------
    lost, found : mapping of a name to a Sight
    longest : float
        Frames for which an object may have been lost.
    unit : float
        Pixels per pixel of a 640x480 picture.

    Returns
    -------
    dict
        Name of the found object to that of the lost one.
    """
    before, after = list(lost), list(found)
    cost = np.array(
        [[_distance(lost[a], found[b], longest, unit) for b in after] for a in before], np.float64
    ).reshape(len(before), len(after))
    pairs = zip(*linear_sum_assignment(cost), strict=True)
    return {after[column]: before[row] for row, column in pairs if cost[row, column] < _NEVER}


def _distance(lost: Sight, found: Sight, longest: float, unit: float) -> float:
    """How far the one is from where the other should be, pixels."""
    gone = found.middle - lost.middle
    if found.middle <= lost.last or found.first - lost.last > longest:
        return _NEVER
    velocity = (lost.velocity + found.velocity) / 2
    distance = float(np.linalg.norm(lost.place + gone * velocity - found.place))
    way = float(np.linalg.norm(gone * velocity))
    speed = max(float(np.linalg.norm(lost.velocity)), float(np.linalg.norm(found.velocity)))
    small, large = sorted((lost.extent, found.extent))
    agrees = (
        distance <= 0.5 * large + 0.25 * way + 10 * unit
        and float(np.linalg.norm(lost.velocity - found.velocity)) <= 0.5 * unit + 0.4 * speed
        and large <= 2.5 * small + 10 * unit
    )
    return distance if agrees else _NEVER

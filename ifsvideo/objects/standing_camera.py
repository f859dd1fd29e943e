"""Before a camera that stays where it is, each track tells by itself whether it moves.

Where the camera stands, or only turns, the static world has no parallax: from one frame to the next all of it
follows one homography, and a track that departs from that moves, be it short or alone. Where the camera goes
somewhere, near things depart from any homography, too, and nothing can be told this way.

Where it stands, what is static does not even change its looks: a corner that is lost in the frame after its
birth, beside a moving thing, lies on that or is a trace of it. Before a camera that turns it may as well be
one of the world, smeared by the motion.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ifsvideo.types import BACKGROUND, UNDECIDED, Bools, Tracks

Array = NDArray[np.float64]

_LEAST_GROUND = 40
"""Fewest tracks of the background that two frames must share."""
_LEAST_FITTING = 0.95
"""Share of the background's tracks that must follow the homographies."""
_FITTING = 1.0
"""How far these may depart, pixels of a 640x480 picture."""
_DRAWS = 50
"""Samples of RANSAC: where nineteen points in twenty fit, a few do; more only cost time where there is
parallax."""
_DEPARTED = 1.5
"""How far a track must depart to move, pixels of a 640x480 picture: KLT's jitter over a second is less."""
_TO_NOISE = 4.0
"""How many times as far as the background's middle track."""
_NEAR, _SLIP, _ALIKE = 35.0, 0.5, 0.5
"""What is one thing: no farther apart than this, pixels of a 640x480 picture; no more different in velocity,
pixels a frame and share of the faster: limbs of one who walks."""
_LEAST_TRACKS = 2
"""Fewest tracks of a thing that no window told of."""
_SLIPPED = 0.05
"""How often a track that departs is none of a thing that moves."""


def add_movers(
    tracks: Tracks, decided: NDArray[np.int64], labels: NDArray[np.int64], unit: float
) -> NDArray[np.int64]:
    """Labels of a window, with the tracks that move by their own evidence.

    Parameters
    ----------
    tracks : Tracks
    decided : (D,) int
        Indices of the tracks that were segmented.
    labels : (P,) int
        0 background, 1, 2, ... moving, -1 undecided.
    unit : float
        Pixels per pixel of a 640x480 picture.

    Returns
    -------
    (P,) int
        Unchanged where the camera went somewhere. Else a track that departs from the background and had no
        label above 0 joins the moving thing that is near and goes alike, or becomes one with others.
    """
    ground = decided[labels[decided] == BACKGROUND]
    left = _departures(tracks, ground, unit)
    if left is None:
        return labels
    least = max(_DEPARTED * unit, _TO_NOISE * float(np.median(left[ground])))
    new = np.flatnonzero((left > least) & (labels <= BACKGROUND))
    known = np.flatnonzero(labels > BACKGROUND)
    if not len(new):
        return labels
    place, velocity = _courses(tracks)
    result = labels.copy()
    if len(known):
        distance = _distances(place, velocity, new, known, unit)
        joins = np.isfinite(distance).any(axis=1)
        result[new[joins]] = labels[known[distance[joins].argmin(axis=1)]]
        new = new[~joins]
    if len(new):
        together = np.isfinite(_distances(place, velocity, new, new, unit))
        _, thing = connected_components(together, directed=False)
        counts = np.bincount(thing) >= _LEAST_TRACKS
        number = max(BACKGROUND, int(labels.max())) + np.cumsum(counts)
        result[new[counts[thing]]] = number[thing][counts[thing]]
    return result


def add_vanished(
    tracks: Tracks, decided: NDArray[np.int64], labels: NDArray[np.int64], unit: float
) -> NDArray[np.int64]:
    """Labels of a window, with the undecided tracks that are lost at once where something moves.

    Parameters
    ----------
    tracks, decided, labels, unit : as of `add_movers`

    Returns
    -------
    (P,) int
        Unchanged unless the camera stands. Then an undecided track that is seen in one frame, neither the
        window's first nor its last, has the label of the nearest moving track, if one is near.
    """
    seen = tracks.visible
    once = (seen.sum(axis=0) == 1) & ~seen[0] & ~seen[-1] & (labels == UNDECIDED)
    ground = decided[labels[decided] == BACKGROUND]
    if not once.any() or not _stands(tracks, ground, unit):
        return labels
    result = labels.copy()
    for frame in np.flatnonzero(seen[:, once].any(axis=1)).tolist():
        asked, moving = (np.flatnonzero(seen[frame] & some) for some in (once, labels > BACKGROUND))
        if not len(moving):
            continue
        distance, nearest = cKDTree(tracks.xy[frame, moving]).query(tracks.xy[frame, asked])
        near = np.asarray(distance) <= _NEAR * unit
        result[asked[near]] = labels[moving[np.asarray(nearest)[near]]]
    return result


def sure_of_added(labels: NDArray[np.int64], added: Bools) -> Array:
    """How sure `add_movers` is of the labels (P,) of the tracks that it added (P,), 0 for all others.

    Each may have slipped along an outline or an edge, but they do so one by one.
    """
    sure = np.zeros(len(labels))
    _, thing, count = np.unique(labels[added], return_inverse=True, return_counts=True)
    sure[added] = (1 - _SLIPPED**count)[thing]
    return sure


def _stands(tracks: Tracks, ground: NDArray[np.int64], unit: float) -> bool:
    """Whether the background stays where it is; not where it is too small to tell."""
    if len(ground) < _LEAST_GROUND:
        return False
    xy = tracks.xy[:, ground]
    first = xy[np.argmax(tracks.visible[:, ground], axis=0), np.arange(len(ground))]
    farthest = np.nanmax(np.linalg.norm(xy - first, axis=2), axis=0)
    return bool(np.mean(farthest <= _FITTING * unit) >= _LEAST_FITTING)


def _departures(tracks: Tracks, ground: NDArray[np.int64], unit: float) -> Array | None:
    """How far each track (P,) ever is from where a static point would be, pixels; None where parallax shows,
    or the background is too small to tell."""
    static = np.zeros((tracks.points, 2))
    left = np.zeros(tracks.points)
    first = np.argmax(tracks.visible, axis=0)
    for frame, seen in enumerate(tracks.visible):
        if frame:
            step = _homography(tracks, ground, frame, unit)
            if step is None:
                return None
            static = cv2.perspectiveTransform(static[None], step)[0]
        begins = first == frame
        static[begins] = tracks.xy[frame, begins]
        off = np.linalg.norm(tracks.xy[frame] - static, axis=1)
        left[seen] = np.maximum(left[seen], off[seen])
        if np.count_nonzero(left[ground] <= _FITTING * unit) < _LEAST_FITTING * len(ground):
            return None  # what has left does not come back
    return left


def _homography(tracks: Tracks, ground: NDArray[np.int64], frame: int, unit: float) -> Array | None:
    """From the frame before to this one, what the background does; None where it is too small."""
    both = ground[tracks.visible[frame - 1 : frame + 1, ground].all(axis=0)]
    if len(both) < _LEAST_GROUND:
        return None
    here, there = tracks.xy[frame - 1 : frame + 1, both]
    step, _ = cv2.findHomography(here, there, cv2.RANSAC, _FITTING * unit, maxIters=_DRAWS)
    return None if step is None else np.asarray(step, np.float64)


def _courses(tracks: Tracks) -> tuple[Array, Array]:
    """Place (P, 2) of each track, carried to the window's middle, and its velocity (P, 2), pixels a frame."""
    frame = np.arange(tracks.frames)
    first = np.argmax(tracks.visible, axis=0)
    last = tracks.frames - 1 - np.argmax(tracks.visible[::-1], axis=0)
    column = np.arange(tracks.points)
    way = tracks.xy[last, column] - tracks.xy[first, column]
    velocity = way / np.maximum(last - first, 1)[:, None]
    middle = (first + last) / 2
    xy = (tracks.xy[last, column] + tracks.xy[first, column]) / 2
    return xy + (frame[-1] / 2 - middle)[:, None] * velocity, velocity


def _distances(
    place: Array, velocity: Array, a: NDArray[np.int64], b: NDArray[np.int64], unit: float
) -> Array:
    """Distance (A, B) of tracks, infinite where they are not parts of one thing."""
    distance = cdist(place[a], place[b])
    speed = np.linalg.norm(velocity, axis=1)
    slip = cdist(velocity[a], velocity[b])
    alike = slip <= _SLIP * unit + _ALIKE * np.maximum(speed[a][:, None], speed[b])
    distance[~alike | (distance > _NEAR * unit)] = np.inf
    return np.asarray(distance, np.float64)

"""When an object and the ground behind it have parted: their motions from frame to frame, over a view."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifsvideo.objects.silhouette import Flow, View
from ifsvideo.types import Bools

NODES = 5
"""Nodes of a flow along each side of a view."""
PARTED = 2.0
"""How far the typical node must have parted, pixels: so far the middle of an edge is clear of its blur."""
_LEAST_POINTS = 3
"""Fewest tracks of the object that two frames must share."""
_LEAST_GROUND = 8
"""Fewest tracks of the ground that two frames must share."""
_NEIGHBOURS = 6
"""Tracks of the ground whose median motion is that of a node; even."""
_REACH = 44.0
"""Farthest that the ground's nearest track may be from the typical node on the view's rim, pixels of a
640x480 picture: farther off the ground may move otherwise."""
_ROUND = 1.0
"""How far beyond a view, on every side, guessed tracks of the ground are asked whether they go along with
the object, share of its size."""
_MOST = 0.5
"""Share of these that must not go along; where most do, what was taken for the object is the ground."""
_FEW = 6
"""Fewest tracks to which more than one common step is fitted."""
_FITS = 3
"""Weighted least squares in a row, each with weights by the misfits of the one before."""
_NO_MISFIT = 0.3
"""Misfit of a track, pixels, that is as good as none: KLT's own error."""
_HELD_BACK = np.diag([0.5, 0.5, 1e-6])
"""Weight, tracks, with which a motion is drawn to one without a part that is linear in the place."""

Array = NDArray[np.float64]


class Motions:
    """The motions of an object and of the ground round it, from one frame to any other.

    Parameters
    ----------
    view : View
    xy : (N, 2) float
        Tracks in the frame that is looked at, pixels.
    own, ground : (N,) bool
        Which are the object's, and which the ground's.
    guessed : (N,) bool
        Which of the ground's are only guessed to be: they do not count where they go along with the object.
    unit : float
        Pixels per pixel of a 640x480 picture.
    """

    def __init__(
        self, view: View, xy: NDArray[np.float32], own: Bools, ground: Bools, guessed: Bools, unit: float
    ) -> None:
        self._xy = xy
        self._nodes = view.nodes(NODES, NODES)
        self._own, self._ground = np.flatnonzero(own), np.flatnonzero(ground)
        self.known = len(self._own) >= _LEAST_POINTS and len(self._ground) >= _LEAST_GROUND
        """Whether there are tracks enough, near enough."""
        if self.known:
            asked = min(2 * _NEIGHBOURS, len(self._ground))
            # A tree for so few questions is not worth balancing.
            tree = cKDTree(xy[self._ground], compact_nodes=False, balanced_tree=False)
            distance, near = tree.query(self._nodes, k=asked)
            self._near = np.asarray(near, np.int64)
            rim = np.ones((NODES, NODES), bool)
            rim[1:-1, 1:-1] = False
            self.known = bool(np.median(np.asarray(distance)[rim.ravel(), 0]) <= _REACH * unit)
            self._asked, self._sure_near = self._guesses(view, guessed[self._ground])

    def _guesses(self, view: View, guessed: Bools) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Those of the ground's tracks (K,) that are guessed and near the view, and the surely known (K, 6)
        near each; none where these are too few."""
        xy = self._xy[self._ground]
        asked, sure = np.flatnonzero(guessed & view.contains(xy, _ROUND)), np.flatnonzero(~guessed)
        if not len(asked) or len(sure) < _NEIGHBOURS:
            return asked[:0], sure[:0, None]
        tree = cKDTree(xy[sure], compact_nodes=False, balanced_tree=False)
        return asked, sure[np.asarray(tree.query(xy[asked], k=_NEIGHBOURS)[1])]

    def to(self, there: NDArray[np.float32]) -> tuple[Flow, Flow] | None:
        """Flows of object and ground to the frame in which the tracks are at ``there`` (N, 2), NaN where one
        is not seen; None where too few are seen in both."""
        step = np.asarray(there - self._xy, np.float64)
        own, ground = step[self._own], step[self._ground]
        seen, seen_ground = np.isfinite(own[:, 0]), np.isfinite(ground[:, 0])
        if np.count_nonzero(seen) < _LEAST_POINTS or np.count_nonzero(seen_ground) < _LEAST_GROUND:
            return None
        asked = self._xy[self._ground[self._asked]]
        flow = affine(self._xy[self._own[seen]], own[seen], np.concatenate([self._nodes, asked]))
        with_object, as_object = np.split(flow, [len(self._nodes)])
        if len(asked):
            guess, as_ground = ground[self._asked], _median(ground[self._sure_near], _NEIGHBOURS)
            along = lengths(guess - as_object) < lengths(guess - as_ground)
            if np.count_nonzero(along) < _MOST * len(along):
                ground[self._asked[along]] = np.nan
        with_ground = _median(ground[self._near], _NEIGHBOURS)
        none_near = np.isnan(with_ground[:, 0])
        if none_near.any():
            with_ground[none_near] = middle(ground[seen_ground])
        shape = (NODES, NODES, 2)
        return with_object.reshape(shape).astype(np.float32), with_ground.reshape(shape).astype(np.float32)


def how_far_parted(with_object: Flow, with_ground: Flow) -> float:
    """Distance of two motions at the typical node, pixels; from `PARTED` on a pixel can tell them."""
    return float(middle(lengths((with_object - with_ground).reshape(-1, 2))))


def lags(rate: float, seconds: Iterable[float]) -> tuple[int, ...]:
    """Times in frames, shortest first, each at least one frame and none twice."""
    return tuple(sorted({max(1, round(one * rate)) for one in seconds}))


def affine(xy: NDArray[np.float32], step: Array, nodes: NDArray[np.float32]) -> Array:
    """Steps (M, 2) of nodes by the affine motion of most of the tracks (N, 2), that which is linear in their
    place held back a little; by the median step where there are few tracks."""
    usual = middle(step)
    if len(xy) < _FEW:
        return np.broadcast_to(usual, nodes.shape).copy()
    centre, spread = xy.mean(axis=0), max(float(xy.std(axis=0).max()), 1.0)
    place, there = (_with_one((some - centre) / spread) for some in (xy, nodes))
    odd = step - usual
    misfit = lengths(odd)
    for k in range(_FITS):
        typical = max(_NO_MISFIT, 1.5 * float(middle(misfit)))
        weighted = (place / (1 + (misfit / typical) ** 2)[:, None]).T
        motion = np.linalg.solve(weighted @ place + _HELD_BACK, weighted @ odd)
        if k + 1 < _FITS:
            misfit = lengths(odd - place @ motion)
    return np.asarray(usual + there @ motion)


def _with_one(place: NDArray[np.floating[Any]]) -> Array:
    """Places (N, 2) and a one beside each (N, 3)."""
    beside = np.ones((len(place), 3))
    beside[:, :2] = place
    return beside


def lengths(steps: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Lengths (N,) of steps (N, 2)."""
    x, y = steps.T
    return np.asarray(np.sqrt(x * x + y * y))


def middle(of: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Median along the first axis; of some tens of numbers NumPy's own takes ten times as long."""
    ordered = np.sort(of, axis=0)
    return np.asarray((ordered[(len(of) - 1) // 2] + ordered[len(of) // 2]) / 2)


def _median(steps: Array, first: int) -> Array:
    """Median (M, 2) of the first so many of the steps (M, K, 2) that are not NaN; NaN where there is none."""
    seen = np.isfinite(steps[..., 0])
    seen &= np.cumsum(seen, axis=1) <= first
    count = np.count_nonzero(seen, axis=1)
    ordered = np.sort(np.where(seen[..., None], steps, np.inf), axis=1)
    row = np.arange(len(steps))
    middle = (ordered[row, np.maximum(count - 1, 0) // 2] + ordered[row, count // 2]) / 2
    return np.where(count[:, None] > 0, middle, np.nan)

"""The road's plane, below which nothing is: the facts of the road that a point's own way does not tell.

A car that keeps its distance ahead stands still in the picture, as what is infinitely far does, and its
points fit a static world there. But they lie below the horizon, where the line of sight meets the road: what
is static there is as near as the road, or nearer.

A plane ``n X = h`` (n the unit normal, down; h the camera's height) is linear in inverse depth: the road's is
``m (a, b, 1)`` with ``m = n / h`` at the bearing (a, b), and vanishes at the horizon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Bools

Array = NDArray[np.float64]

_TRIALS = 300
"""Planes through three points that are tried; with a third of them on the road, ten hold three."""
_APART = 1e-4
"""Least volume of three rays: points side by side hold no plane."""
_FITS = 3
"""Least-squares fits, each to the points on the plane of the one before."""
_UPRIGHT = np.cos(np.deg2rad(15))
"""A camera that drives is held level, to so much."""
_PARALLEL = 0.15
"""It goes along the road, not towards it: share of its way across."""
_HIGHEST = 2.0
"""Height of the camera over the road, in units of its way in the window: of what a hand-held camera passes,
tables have a floor below."""
_KNOWN = 4.0
"""Inverse depth of a point that can hold the plane, in units of how far it may be off."""
_WITHIN = 0.08
"""Share of its inverse depth by which a point of the road is off the plane."""
_LEAST_POINTS, _LEAST_CELLS, _CELLS = 12, 6, 12
"""A road is seen where so many points lie on it, in so many cells of the picture, of so many to its longer
side at a usual lens."""
_LEAST_REACH = 1.5
"""And where its near parts are so many times nearer than its far parts."""
_MOST_BELOW = 0.5
"""Points that seem static below it, for each on it: more, and it is no road; cars that keep their distance
ahead are some."""
_FALL = 0.05
"""Slope by which a road falls away, and what is beside it."""
_DITCH = 0.7
"""What lies beside it is at least so many times as near as the plane is in its direction: a ditch of half a
metre before a camera at 1.3 m."""


@dataclass(frozen=True)
class Road:
    """A plane below the camera.

    Attributes
    ----------
    m : (3,) float
        Unit normal, down, over the camera's height.
    """

    m: Array

    def least_nearness(self, bearing: Array) -> Array:
        """Least inverse depth (P,) of what is not below the road at bearings (P, 2); 0 above the horizon."""
        height = float(np.linalg.norm(self.m))
        return np.asarray(_DITCH * np.maximum(bearing @ self.m[:2] + self.m[2] - _FALL * height, 0.0))


def find_road(X: Array, spread: Array, sure: Bools, centres: Array) -> Road | None:
    """The plane under a camera that drives, None where too little of it is seen.

    It cannot tell a road from anything else that is level, seen in many places and parallel to the camera's
    way, with hardly anything below it: a lake will do, a row of tables may.

    Parameters
    ----------
    X : (P, 3) float
        Points: bearing and inverse depth.
    spread : (P,) float
        How far each inverse depth may be off.
    sure : (P,) bool
        Points that seem static.
    centres : (K, 3) float
        Where the camera was.
    """
    points = _Seen(np.column_stack([X[:, :2], np.ones(len(X))])[sure], X[sure, 2], spread[sure])
    known = points.select(points.nearness > _KNOWN * points.spread)
    if len(known.nearness) < _LEAST_POINTS:
        return None
    m = _planes(known)
    m = m[_under(m, centres)]
    if not len(m):
        return None
    best = m[np.argmax(points.on(m).sum(axis=1) - points.below(m).sum(axis=1))]
    for _ in range(_FITS):
        road = known.select(known.on(best[None])[0])
        if not _widely_seen(road):
            return None
        weight = 1 / (road.rays @ best)  # shares of nearness count, as in _WITHIN
        best = np.linalg.lstsq(road.rays * weight[:, None], road.nearness * weight, rcond=None)[0]
    too_many_below = points.below(best[None]).sum() > _MOST_BELOW * len(road.nearness)
    return None if too_many_below or not _under(best[None], centres)[0] else Road(best)


@dataclass(frozen=True)
class _Seen:
    """Points: rays (P, 3) = (a, b, 1), inverse depths (P,) and how far these may be off."""

    rays: Array
    nearness: Array
    spread: Array

    def select(self, which: Bools) -> _Seen:
        return _Seen(self.rays[which], self.nearness[which], self.spread[which])

    def on(self, m: Array) -> Bools:
        """Which points lie on each of the planes (N, 3), near enough to the camera to tell: (N, P)."""
        there, fall = self._there(m)
        return (there > fall) & (np.abs(self.nearness - there) < _WITHIN * there)

    def below(self, m: Array) -> Bools:
        """Which points surely lie below each of the planes: (N, P)."""
        there, fall = self._there(m)
        return self.nearness + 2 * self.spread < _DITCH * (there - fall)

    def _there(self, m: Array) -> tuple[Array, Array]:
        """Inverse depth of the planes in each point's direction, and what a fall takes from it."""
        return m @ self.rays.T, _FALL * np.linalg.norm(m, axis=1)[:, None]


def _planes(points: _Seen) -> Array:
    """Planes (N, 3) through three points each, at random but always the same."""
    triples = np.random.default_rng(0).choice(len(points.nearness), (_TRIALS, 3))
    A = points.rays[triples]
    apart = np.abs(np.linalg.det(A)) > _APART
    return np.asarray(np.linalg.solve(A[apart], points.nearness[triples[apart], None])[..., 0])


def _under(m: Array, centres: Array) -> Bools:
    """Which planes (N, 3) lie below a camera that goes along them, and not far."""
    height = 1 / np.maximum(np.linalg.norm(m, axis=1), 1e-12)
    n = m * height[:, None]
    way = centres - centres.mean(axis=0)
    across = np.sqrt(((way @ n.T) ** 2).sum(axis=0) / max(float((way**2).sum()), 1e-12))
    return np.asarray((n[:, 1] > _UPRIGHT) & (across < _PARALLEL) & (height < _HIGHEST))


def _widely_seen(road: _Seen) -> bool:
    """Whether points are enough of a road to know its plane."""
    if len(road.nearness) < _LEAST_POINTS:
        return False
    cells = np.unique(np.floor(road.rays[:, :2] * _CELLS).astype(int), axis=0)
    far, near = np.percentile(road.nearness, [5, 95])
    return len(cells) >= _LEAST_CELLS and near > _LEAST_REACH * far

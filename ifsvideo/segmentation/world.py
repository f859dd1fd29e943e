"""Stage 1, better than epipolar lines: one static perspective world for all frames of a window at once.

A static point has one place in space, in front of the camera, seen from a camera that moves as one.
Fundamental matrices of frame pairs test less: they do not see a point that slides along its epipolar line
(the degenerate case of thesis 2.2), which a common depth over many frames does, nor one behind the camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.bundle import Bundle, Estimate, Freed
from ifsvideo.segmentation.key_frames import key_frames
from ifsvideo.segmentation.road import find_road
from ifsvideo.types import Bools, Tracks

Array = NDArray[np.float64]

LEAST_USUAL = 0.25
"""Least usual error, in tolerances: a tenth of a pixel; below it KLT's own errors differ from surface to
surface."""
KEY_FRAMES = 9
"""Frames of a window that are fitted; more cost time and tell little, a camera moves smoothly."""
NOISE = 0.4
"""Error that a static point is granted, pixels of a 640x480 picture: KLT is better, but not on every
surface."""
NOISE_OF_FLOW = 0.005
"""Error that a static point is granted, share of its way: rolling shutter and lens are not modelled to the
pixel."""
LENS_PRIOR = np.array([np.log(0.8), 0.0])
"""Focal length in longer sides (dashcams 0.6 to 0.8, phones 0.8 to 1), no distortion."""
LENS_SPREAD = np.array([0.3, 0.15])
"""How far the lens is off, each worth one badly fitting point per standard deviation."""
STARTS = ((0, 0, -1), (1, 0, 0), (0.7, 0, -0.7), (-0.7, 0, -0.7), (0, 1, 0))
"""Directions of the camera's motion from which the fit starts: ahead, aside, half of each, up; their
negatives come out of the sign of the first depths."""
START_POINTS = 120
"""Points of the starts, thinned so that no corner of the picture has its way."""
PARALLAX_CELLS, PARALLAX_SHARE = 12, 0.12
"""A camera has moved, not only turned, if points need it to have moved in at least this share of the cells in
which there are points, of so many along the longer side: depth shows in many places, a thing that moves in
one. More finds larger things before a standing camera, and takes more of a scene with little parallax for
movers."""
KEEPS_ITS_PLACE, LITTLE, FOOT = 2.0, 0.25, 0.25
"""Pixels of a 640x480 picture within which a point stays that keeps its place in it; the share of those cells
from which on the camera rests if that many of them do; and how far below the middle of the picture, in
heights of it, what is fixed to the camera is looked for: higher up what is far away keeps its place, too."""
FINALISTS, FINAL_STEPS = 3, 8
"""Starts that are followed to their end, and the steps of each: of two, both are sometimes wrong."""
LAST_STEPS = 3
"""Steps with all points, from what the few of the starts found."""
PARALLAX_GAIN = 0.6
"""A camera has moved, too, if points that are surely static then fit so many times better: nothing that moves
can feign it there. A point's further unknown alone gains a thirtieth."""
SEEMS_STATIC = 2.5
"""Error up to which a point may be part of the road, over what is usual."""
NEAREST = 3.0
"""Nothing is so many times nearer than nearly all that is static, where the camera's way is slight: at a
hundred times their nearness whatever crosses the view would stand still."""
SLIGHT = 0.003
"""Nearness from which that fit starts: what is nearer has shown that the camera moved."""
REFIT = [2.0, 1.0, 1.0, 1.0, 1.0, 1.0]
"""Widths of the steps by which a world is fitted to a part of the points."""
SET_OFF = [4.0, 2.0, 2.0, 1.0, 1.0, 1.0]
"""The same where the camera is to move for the first time."""
REFIT_POINTS = 250
"""Points by which the cameras are fitted then, at most; more tell nothing new."""
LEAST_POINTS = 8
"""Points that a world needs: a fundamental matrix has seven unknowns."""
FALLING = [16.0, 8.0, 4.0, 2.0, 1.4, 1.0]
"""Widths of the robust cost during a start: first everything counts, at last only what fits."""


@dataclass(frozen=True)
class World:
    """The static world of a window.

    Attributes
    ----------
    frames : (K,) int
        The frames that were fitted.
    bundle : Bundle
        What was seen in them; its ``reference`` frame defines bearing and depth.
    estimate : Estimate
        Cameras and points.
    side : float
        Longer side of the picture, pixels: the unit of the bundle.
    has_moved : bool
        Whether the camera changed its place, not only its direction.
    """

    frames: NDArray[np.int64]
    bundle: Bundle
    estimate: Estimate
    side: float
    has_moved: bool

    @cached_property
    def rms(self) -> Array:
        """Distance (P,) of each track from what a static point would do, pixels; NaN where it is seen in
        fewer than two key frames."""
        error = self.bundle.rms(self.bundle.residual(self.estimate)) * self.side
        return np.where(self.bundle.seen.sum(axis=0) >= 2, error, np.nan)

    @property
    def tolerance(self) -> Array:
        """What a static point is granted (P,), pixels."""
        return self.bundle.tolerance * self.side

    @property
    def nearness(self) -> Array:
        """The camera's way over the distance of each point (P,): how much it would have to show of its sides.

        A number without unit, 0 for far points, and for all where the camera only turned.
        """
        way = self.estimate.t - self.estimate.t.mean(axis=0)
        return np.asarray(self.estimate.X[:, 2] * np.linalg.norm(way, axis=1).max())

    def evidence(self, threshold: float) -> Array:
        """How far each track (P,) is from a static point's way, in units of ``threshold`` times what is usual
        in the window.

        The usual error is the median over the points that the world explains at all: footage from a rolling
        shutter behind a wide lens is granted more than a benchmark's, and so are places that lie far from
        the points to which the world was fitted. Above 1 speaks for motion; 0 where nothing can be said.
        """
        return np.nan_to_num(self.rms / self.tolerance) / (threshold * self.usual)

    @cached_property
    def usual(self) -> float:
        """The usual error of a point that the world explains, in tolerances."""
        error = np.nan_to_num(self.rms / self.tolerance)
        explained = error[(error > 0) & (error < 2)]
        return max(float(np.median(explained)) if len(explained) else 0.0, LEAST_USUAL)

    def without_places(self) -> Freed:
        """Residuals, normalised, and their derivatives by cameras and lens, what each point's own place can
        make up for taken off."""
        return self.bundle.without_places(self.estimate, self.has_moved)

    def fitted_to(self, points: NDArray[np.int64]) -> World:
        """The world of some points that are surely static, and where all others are in it.

        A world that is fitted to everything explains some of what moves, too: with a few movers at depths of
        its own choice a camera path is found on which halves of two of them stand still.
        """
        if len(points) < LEAST_POINTS:
            return self
        few = points[:: 1 + (len(points) - 1) // REFIT_POINTS]
        free = self.bundle.no_farther(0.0)
        before, bundle = self.estimate.X, free.subset(few)
        own = bundle.solve(replace(self.estimate, X=before[few]), REFIT, translate=self.has_moved)
        X, has_moved, nearest = before.copy(), self.has_moved, np.inf
        if has_moved:
            # Only the product of depth and the camera's way is known; the others take the few's new scale.
            X[:, 2] *= (own.X[:, 2] @ before[few, 2]) / max(float(before[few, 2] @ before[few, 2]), 1e-12)
        else:
            moving = _set_off(bundle, own, self.frames)
            has_moved = _typical(bundle, moving) < PARALLAX_GAIN * _typical(bundle, own)
            if has_moved:
                own = moving
                X[:, 2] = np.median(own.X[:, 2])
                nearest = NEAREST * float(np.percentile(own.X[:, 2], 95))
        X[few] = own.X
        estimate = free.solve_points(replace(own, X=X), 6, nearest)
        return World(self.frames, free, estimate, self.side, has_moved).above_road(points)

    def above_road(self, points: NDArray[np.int64] | None = None) -> World:
        """The world in which nothing lies below the road, where that is seen.

        Parameters
        ----------
        points : (n,) int, optional
            Those that are surely static; without, all that the world explains.
        """
        if not self.has_moved:
            return self
        fits = self.rms < SEEMS_STATIC * self.usual * self.tolerance
        if points is not None:
            fits &= np.isin(np.arange(len(fits)), points)
        e = self.estimate
        centres = -np.einsum("kij,ki->kj", e.R, e.t)
        # Errors of a track seldom all go one way: half of what that would make.
        spread = self.usual * self.bundle.spread_of_nearness(e) / 2
        road = find_road(e.X, spread, fits, centres)
        if road is None:
            return self
        bundle = self.bundle.no_farther(road.least_nearness(e.X[:, :2]))
        below = np.flatnonzero(e.X[:, 2] < bundle.farthest)
        if not len(below):
            return self
        X = e.X.copy()
        X[below, 2] = bundle.farthest[below]
        X[below] = bundle.subset(below).solve_points(replace(e, X=X[below]), 6).X
        return replace(self, bundle=bundle, estimate=replace(e, X=X))


def fit_world(tracks: Tracks, size: tuple[int, int], rng: np.random.Generator) -> World | None:
    """Fit the static world, several starts, robustly.

    Returns
    -------
    World or None
        None where fewer than `LEAST_POINTS` points are seen in two key frames: nothing can be said.
    """
    frames = key_frames(tracks.frames, KEY_FRAMES)
    seen = tracks.visible[frames]
    good = seen.sum(axis=0) >= 2
    if good.sum() < LEAST_POINTS:
        return None
    side = float(max(size))
    observed = (tracks.xy[frames] - (np.array(size) - 1) / 2) / side
    unit = float(np.hypot(*size)) / 800 / side
    columns = np.arange(tracks.points)
    first = np.argmax(seen, axis=0)
    last = len(frames) - 1 - np.argmax(seen[::-1], axis=0)
    way = np.nan_to_num(np.linalg.norm(observed[last, columns] - observed[first, columns], axis=1))
    tolerance = np.hypot(NOISE * unit, NOISE_OF_FLOW * way)
    reference = int(np.argmax(seen.sum(axis=1) - 0.01 * np.abs(np.arange(len(frames)) - len(frames) / 2)))
    nearest = np.argmin(np.where(seen, np.abs(np.arange(len(frames)) - reference)[:, None], 999), axis=0)
    place = np.nan_to_num(observed[nearest, columns])
    cell = np.floor((place + 0.5) * 16).astype(int) @ [1, 1000]
    _, inverse, count = np.unique(cell, return_inverse=True, return_counts=True)
    at_the_foot = place[:, 1] > FOOT * size[1] / side
    told = good & ~(_keeps_its_place(observed, seen & good, place, unit) & at_the_foot)
    if told.sum() < LEAST_POINTS:
        told = good
    weight = np.where(told, 1 / np.sqrt(count[inverse]), 0.0)  # dense texture does not outvote the rest
    bundle = Bundle(
        observed.transpose(0, 2, 1), seen & good, weight, tolerance, reference, LENS_PRIOR, LENS_SPREAD
    )

    picked = _thin(seen, cell, told, rng)
    time = (frames - frames[reference]) / max(frames[-1] - frames[0], 1)
    X = np.column_stack([place / np.exp(LENS_PRIOR[0]), np.zeros(tracks.points)])
    few = bundle.subset(picked)
    turned = _turned(few, X[picked], len(frames))
    estimate = bundle.solve_points(_with_all(_all_far(few, turned, X[picked]), X, picked), 3)
    far_away = bundle.rms(bundle.residual(estimate)) < 2 * bundle.tolerance
    has_moved = False
    # The starts take most of the time: without them where too few points could need them.
    if _in_many_places(bundle, ~far_away):
        moved = bundle.solve_points(_with_all(_best_start(few, turned, time), X, picked), 6)
        near = bundle.rms(bundle.residual(moved)) < bundle.tolerance
        has_moved = _in_many_places(bundle, near & ~far_away)
        estimate = moved if has_moved else estimate
    estimate = bundle.solve(estimate, [1.0] * LAST_STEPS, translate=has_moved)
    return World(frames, bundle, bundle.solve_points(estimate, 3), side, has_moved).above_road()


def _keeps_its_place(observed: Array, seen: Bools, place: Array, unit: float) -> Bools:
    """Points (P,) that rest in a picture that moves.

    At its foot, where the ground is near, they are fixed to the camera: on the bonnet, or in a burnt-in time.
    They would tell of a camera that stands, before which all else moves by itself, and few of a window's
    tracks last as long as they do.
    """
    low, high = (
        least(np.where(seen[..., None], observed, none), axis=0)
        for least, none in ((np.min, np.inf), (np.max, -np.inf))
    )
    known = np.asarray(seen.any(axis=0), bool)
    keep = known & (
        np.linalg.norm(np.where(known[:, None], high - low, 0.0), axis=1) <= KEEPS_ITS_PLACE * unit
    )
    cell = _cells(place)
    few = len(np.unique(cell[keep])) < LITTLE * len(np.unique(cell[known]))
    return np.asarray(keep & few, bool)


def _cells(place: Array) -> NDArray[np.int64]:
    """Which of the cells of the picture (P,) points (P, 2) lie in."""
    return np.asarray(np.floor((place + 0.5) * PARALLAX_CELLS).astype(np.int64) @ [1, 100])


def _thin(seen: Bools, cell: NDArray[np.int64], told: Bools, rng: np.random.Generator) -> NDArray[np.int64]:
    """Long-lived points of those that are told, at most three a cell of the picture."""
    order = np.argsort(-seen.sum(axis=0) - rng.random(seen.shape[1]) / 2)
    order = order[told[order]]
    rank = np.zeros(len(order), dtype=int)
    taken: dict[int, int] = {}
    for k, point in enumerate(order):
        rank[k] = taken[int(cell[point])] = taken.get(int(cell[point]), 0) + 1
    return np.sort(order[np.argsort(rank, kind="stable")[: min(START_POINTS, np.count_nonzero(rank <= 3))]])


def _all_far(bundle: Bundle, turned: Estimate, X: Array) -> Estimate:
    """All points at infinity, seen by a camera that only turns."""
    bearing = np.column_stack([X[:, :2] * np.exp(LENS_PRIOR[0] - turned.log_focal), np.zeros(len(X))])
    far = bundle.solve_points(replace(turned, X=bearing), 3)
    return bundle.solve_points(bundle.solve(far, [1.0] * 4, translate=False), 3)


def _with_all(found: Estimate, X: Array, picked: NDArray[np.int64]) -> Estimate:
    """What was found with some points, and the others where they are seen, as far as the typical one."""
    places = X.copy()
    places[:, :2] *= np.exp(LENS_PRIOR[0] - found.log_focal)
    places[:, 2] = np.median(found.X[:, 2])
    places[picked] = found.X
    return replace(found, X=places)


def _in_many_places(bundle: Bundle, parallax: Bools) -> bool:
    """Whether points with parallax (P,) lie in so many places that the camera must have moved.

    One thing that crosses the view of a standing camera fits a camera that moves past it while all else is
    far away; which of the two it is, only the number of places tells.
    """
    counted = bundle.weight > 0
    place = bundle.observed[..., counted].sum(axis=0) / bundle.seen[:, counted].sum(axis=0)
    cell = _cells(place.T)
    return len(np.unique(cell[parallax[counted]])) >= PARALLAX_SHARE * len(np.unique(cell))


def _set_off(bundle: Bundle, turned: Estimate, frames: NDArray[np.int64]) -> Estimate:
    """The best camera that moves, from one that only turns: with constant speed in one of some directions at
    first."""
    time = (frames - frames[bundle.reference]) / max(frames[-1] - frames[0], 1)
    X = np.column_stack([turned.X[:, :2], np.full(len(turned.X), SLIGHT)])
    starts = [
        replace(turned, t=2 * time[:, None] * np.array(direction, dtype=float), X=X) for direction in STARTS
    ]
    found = bundle.solve_each(starts, SET_OFF)
    return min(found, key=lambda estimate: _typical(bundle, estimate))


def _typical(bundle: Bundle, estimate: Estimate) -> float:
    """Median over the points of their error, in tolerances."""
    return float(np.median(bundle.rms(bundle.residual(estimate)) / bundle.tolerance))


def _turned(bundle: Bundle, X: Array, cameras: int) -> Estimate:
    """The camera that only turns."""
    rest = Estimate(
        np.repeat(np.eye(3)[None], cameras, axis=0), np.zeros((cameras, 3)), X, LENS_PRIOR[0], 0.0
    )
    return bundle.solve(rest, [32.0, 16.0, 8.0, 4.0, 2.0, 1.0], translate=False)


def _best_start(bundle: Bundle, turned: Estimate, time: Array) -> Estimate:
    """The best of several starts: a camera that turns, then moves with constant speed in one of some
    directions."""
    near = turned.X.copy()
    near[:, 2] = 0.03  # 30 times the camera's way: far enough for any first step
    starts = [
        replace(turned, t=2 * time[:, None] * np.array(direction, dtype=float), X=near)
        for direction in STARTS
    ]
    found = bundle.solve_each(starts, FALLING)
    best = np.sort(np.argsort(_costs(bundle, found), kind="stable")[:FINALISTS])
    finished = bundle.solve_each([found[k] for k in best], [2.0] + [1.0] * (FINAL_STEPS - 1))
    return finished[int(np.argmin(_costs(bundle, finished)))]


def _costs(bundle: Bundle, found: Sequence[Estimate]) -> Array:
    """How badly each of some estimates fits."""
    return np.array([bundle.cost(bundle.residual(estimate), 1.0) for estimate in found])

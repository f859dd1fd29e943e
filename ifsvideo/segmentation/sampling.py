"""Stage 2: a pool of affine motion models, sampled in small disks (thesis 3.0.2, Algorithm 1, eq. 3.1,
3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.types import Bools, Tracks

# Triples whose triangle is smaller than this share of a disk's area are taken for collinear: eq. 3.2 inverts
# them.
_SMALLEST_TRIANGLE = 0.01


@dataclass(frozen=True)
class AffineModels:
    """The tuples (I_in, C_pts, S) of thesis Algorithm 1 for M models.

    Attributes
    ----------
    inliers : (M, P) bool
    controls : (M, 3, 2) float
        The three control points in the base frame, pixels.
    foreground : (M,) bool
        Attribute S: whether the disk was centred on a foreground point.
    """

    inliers: Bools
    controls: NDArray[np.float64]
    foreground: Bools

    def __len__(self) -> int:
        return len(self.foreground)

    def select(self, models: NDArray[np.int64]) -> AffineModels:
        """Some of the models."""
        return AffineModels(self.inliers[models], self.controls[models], self.foreground[models])


def sample_models(
    tracks: Tracks,
    background: Bools,
    base: int,
    unit: float,
    config: SegmenterConfig,
    rng: np.random.Generator,
) -> AffineModels:
    """Sample ``config.models`` affine motion models.

    Parameters
    ----------
    tracks : Tracks
        Points not seen in the base frame take no part.
    background : (P,) bool
        Result of stage 1.
    base : int
        The frame in which disks lie and from which motion is counted.
    unit : float
        Pixels per configured pixel (the configuration speaks of a 640x480 picture).

    Returns
    -------
    AffineModels
        At most ``config.models``; fewer where no disk holds three points.
    """
    window = _Window.of(tracks, base)
    usable, (x, y) = window.usable, window.place
    radius = config.disk_radius * unit
    pools = [np.flatnonzero(usable & ~background), np.flatnonzero(usable & background)]

    def disk() -> _Disk | None:
        fg = bool(rng.random() < config.foreground_share)
        pool = pools[0] if (fg and len(pools[0])) or not len(pools[1]) else pools[1]
        centre = int(pool[rng.integers(len(pool))])
        # Not compared as squares: of tracks in whole pixels some lie on the edge.
        distance = np.sqrt((x - x[centre]) ** 2 + (y - y[centre]) ** 2)
        support = np.flatnonzero(usable & (distance < radius))  # eq. 3.1
        if len(support) < 3:
            return None
        triples = _triples(len(support), config.ransac_iterations, rng)
        if config.through_centre:
            own = int(np.searchsorted(support, centre))
            triples[~(triples == own).any(axis=1), 0] = own
        return _Disk(pool is pools[0], support, triples)

    # A disk may hold fewer than three points or only collinear ones; give up after as many failures as
    # models.
    found = [
        AffineModels(np.zeros((0, tracks.points), dtype=bool), np.zeros((0, 3, 2)), np.zeros(0, dtype=bool))
    ]
    tries = 2 * config.models if usable.any() else 0
    while tries and (missing := config.models - sum(map(len, found))):
        drawn = [disk() for _ in range(min(missing, tries))]
        tries -= len(drawn)
        if disks := [one for one in drawn if one is not None]:
            found.append(_best_triples(window, disks, unit, config))
    return AffineModels(
        np.concatenate([models.inliers for models in found]),
        np.concatenate([models.controls for models in found]),
        np.concatenate([models.foreground for models in found]),
    )


@dataclass(frozen=True)
class _Disk:
    """A disk's points (S,), whether its centre is foreground, and triples (T, 3) of the points, counted
    within the disk."""

    foreground: bool
    support: NDArray[np.int64]
    triples: NDArray[np.int64]


@dataclass(frozen=True)
class _Window:
    """The tracks with the points last.

    Attributes
    ----------
    place : (2, P) float
        In the base frame.
    usable : (P,) bool
        Whether they are seen there.
    path : (2 (F - 1), P) float
        In the other frames, all x first.
    seen : (F - 1, P) float
        One where they are seen there, else zero.
    """

    place: NDArray[np.float64]
    usable: Bools
    path: NDArray[np.float64]
    seen: NDArray[np.float64]

    @classmethod
    def of(cls, tracks: Tracks, base: int) -> _Window:
        other = np.arange(tracks.frames) != base  # the base frame maps to itself
        path = tracks.xy[other].transpose(2, 0, 1).reshape(2 * other.sum(), tracks.points)
        seen = tracks.visible[other].astype(np.float64)
        return cls(tracks.xy[base].T.copy(), tracks.visible[base], path, seen)


def _best_triples(window: _Window, disks: list[_Disk], unit: float, config: SegmenterConfig) -> AffineModels:
    """The model of each disk's triple that explains most of its points; none where all are too narrow.

    What takes a few numbers of each disk is done for all D of them at once: ``points`` are those of one disk
    after the other, (N,) in all.
    """
    points = np.concatenate([disk.support for disk in disks])
    sizes = np.array([len(disk.support) for disk in disks])
    disk_of, first = np.repeat(np.arange(len(disks)), sizes), np.cumsum(sizes) - sizes
    triples = np.stack([disk.triples for disk in disks], axis=1)  # (T, D, 3)
    corners = points[triples + first[:, None]]
    smallest = _SMALLEST_TRIANGLE * (config.disk_radius * unit) ** 2
    barycentric, wide = _barycentric(window.place[:, corners], window.place[:, points], disk_of, smallest)
    fits = np.empty((len(triples), len(points)), dtype=np.int64)
    counted = np.full(fits.shape, float(len(window.seen)))
    complete = bool(window.seen.all())
    for disk, start in zip(disks, first.tolist(), strict=True):
        own = slice(start, start + len(disk.support))
        path, seen = window.path[:, disk.support], window.seen[:, disk.support]
        # (T, 2 (F - 1), S), NaN where a corner is unseen
        error = path[:, disk.triples].transpose(1, 0, 2) @ barycentric[:, :, own]
        error -= path
        np.multiply(error, error, out=error)
        error[:, : len(seen)] += error[:, len(seen) :]
        (error[:, : len(seen)] < (config.inlier_error * unit) ** 2).sum(axis=1, out=fits[:, own])
        if not complete:
            counted[:, own] = seen[:, disk.triples].prod(axis=2).T @ seen
    inlier = (fits >= 0.5 * counted) & (counted > 0)
    explained = np.where(wide, np.add.reduceat(inlier.astype(np.int64), first, axis=1), -1)
    winner, every = explained.argmax(axis=0), np.arange(len(disks))
    held = inlier[winner[disk_of], np.arange(len(points))]
    chosen = corners[winner, every]  # (D, 3)
    inliers = np.zeros((len(disks), len(window.usable)), dtype=bool)
    inliers[disk_of[held], points[held]] = True
    inliers[every[:, None], chosen] = True
    models = AffineModels(
        inliers, window.place[:, chosen].transpose(1, 2, 0), np.array([disk.foreground for disk in disks])
    )
    return models.select(np.flatnonzero(wide.any(axis=0)))


def _barycentric(
    c: NDArray[np.float64], place: NDArray[np.float64], disk_of: NDArray[np.int64], smallest: float
) -> tuple[NDArray[np.float64], Bools]:
    """Where points lie in the triangles of their disk.

    eq. 3.2: A_{1->f} = [c_f; 1] [c_1; 1]^-1, so a point is transferred by its barycentric coordinates in c_1.

    Parameters
    ----------
    c : (2, T, D, 3) float
        Corners of the triangles in the base frame.
    place : (2, N) float
        Points there.
    disk_of : (N,) int
    smallest : float
        Area up to which three corners are taken for collinear.

    Returns
    -------
    barycentric : (T, 3, N) float
    wide : (T, D) bool
        Which triangles are large enough; of the others the coordinates mean nothing.
    """
    (x1, x2), (y1, y2) = (np.moveaxis(c[axis, ..., 1:] - c[axis, ..., :1], 2, 0) for axis in (0, 1))
    twice_area = x1 * y2 - y1 * x2
    wide = np.abs(twice_area) / 2 > smallest
    area = np.where(wide, twice_area, 1.0)[:, disk_of]
    x, y = place[:, None] - c[..., 0][..., disk_of]
    found = np.empty((len(area), 3, len(disk_of)))
    found[:, 1] = (x * y2[:, disk_of] - y * x2[:, disk_of]) / area
    found[:, 2] = (x1[:, disk_of] * y - y1[:, disk_of] * x) / area
    found[:, 0] = 1 - found[:, 1] - found[:, 2]
    return found, wide


_ORDERS = np.array([[[1, 2, 0], [2, 1, 0]], [[2, 0, 1], [0, 2, 1]], [[1, 0, 2], [0, 1, 2]]])
"""What becomes of three things when the last and then the middle one change places with one up to it."""


def _triples(points: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Three different ones of so many points, in any order, so many times (T, 3).

    By Floyd's algorithm, as numpy's `Generator.choice` has it for one triple: of numbers that are drawn from
    ever more, one that was drawn before stands for the last of them.
    """
    most = np.array([points - 3, points - 2, points - 1, 2, 1])
    drawn = rng.integers(0, np.broadcast_to(most, (count, 5)), endpoint=True)
    first, second, third = drawn[:, :3].T
    second[second == first] = points - 2
    third[(third == first) | (third == second)] = points - 1
    order: NDArray[np.int64] = _ORDERS[drawn[:, 3], drawn[:, 4]]
    return np.asarray(drawn[np.arange(count)[:, None], order])

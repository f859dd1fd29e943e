"""What a KLT tracker makes of true trajectories: noise, drift, and points that are no points."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter
from scipy.spatial import cKDTree

from ifsvideo.benchmark.simulation.geometry import Array
from ifsvideo.types import Bools, Ints

_NEAR_PX = 40.0
"""Two tracks farther apart do not make a T-junction."""


def measured(rng: np.random.Generator, exact: Array) -> Array:
    """Exact tracks (F, P, 2) as a tracker measures them: its noise has a white part, a slow part and a drift.

    The standard deviation is 0.05 to 0.4 px a track, about 1 px for a few; up to half of the variance is
    remembered from frame to frame; a third of the tracks drift by up to 0.02 px a frame.
    """
    frames, points, _ = exact.shape
    level = np.clip(np.exp(rng.normal(np.log(rng.uniform(0.08, 0.2)), 0.4, points)), 0.05, 0.4)
    level = np.where(rng.random(points) < 0.02, rng.uniform(0.6, 1.3, points), level)[:, None]
    slow, memory = rng.uniform(0, 0.5), 0.9
    white, pulse = rng.normal(size=exact.shape), rng.normal(size=exact.shape)
    pulse[1:] *= np.sqrt(1 - memory**2)
    remembered = np.asarray(lfilter([1.0], [1.0, -memory], pulse, axis=0))
    noise = level * (np.sqrt(1 - slow) * white + np.sqrt(slow) * remembered)
    angle, fastest = rng.uniform(0, 2 * np.pi, points), rng.uniform(0, 0.02, points)
    pace = np.where(rng.random(points) < 1 / 3, fastest, 0.0)
    drift = pace[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(exact + noise + np.arange(frames)[:, None, None] * drift)


def junk(
    rng: np.random.Generator, exact: Array, visible: Bools, group: Ints, share: float
) -> tuple[Array, Bools]:
    """Tracks that follow no point of the world: T-junctions, and corners that slide along an edge.

    A T-junction takes x from one track and y from a near one of another owner, where two outlines cross.

    Parameters
    ----------
    exact : (F, P, 2) float, pixels
    visible : (F, P) bool
    group : (P,) int
        Owner of each track.
    share : float
        Number of junk tracks over P.

    Returns
    -------
    xy : (F, J, 2), visible : (F, J)
    """
    frames, points = visible.shape
    wanted = int(np.ceil(share * points))
    one, other = _near_pairs(rng, exact[frames // 2], visible[frames // 2], group, wanted)
    crossing = np.stack([exact[:, one, 0], exact[:, other, 1]], axis=2)
    turned = rng.random(len(one)) < 0.5  # the moving outline may as well be the level one
    crossing[:, turned] = np.stack([exact[:, other[turned], 0], exact[:, one[turned], 1]], axis=2)
    sliding = rng.integers(points, size=max(wanted - len(one), 0))
    angle = rng.uniform(0, 2 * np.pi, len(sliding))
    pace = rng.normal(0, 0.5, (frames, len(sliding))) + rng.normal(0, 0.5, len(sliding))
    along = np.cumsum(pace, axis=0)[..., None] * np.column_stack([np.cos(angle), np.sin(angle)])
    xy = np.concatenate([crossing, exact[:, sliding] + along], axis=1)
    seen = np.concatenate([visible[:, one] & visible[:, other], visible[:, sliding]], axis=1)
    return xy, seen


def _near_pairs(
    rng: np.random.Generator, xy: Array, visible: Bools, group: Ints, wanted: int
) -> tuple[Ints, Ints]:
    """Up to two thirds of the wanted number of pairs of near tracks with different owners."""
    here = np.flatnonzero(visible)
    pairs = here[cKDTree(xy[here]).query_pairs(_NEAR_PX, output_type="ndarray")]
    pairs = pairs[group[pairs[:, 0]] != group[pairs[:, 1]]]
    pairs = rng.permutation(pairs)[: (2 * wanted) // 3]
    return pairs[:, 0], pairs[:, 1]

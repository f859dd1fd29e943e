"""Points fixed to the camera: bonnet, windscreen reflections, burnt-in time and logos."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import Bools

_SHAKE_TO_SPREAD = 6.0
"""How many times the track's own spread the world must have shaken meanwhile."""
_GRID = 8
"""Cells along a side of the picture; the world must be seen in many of them."""


def camera_fixed_tracks(trajectories: Trajectories, config: ObjectsConfig) -> NDArray[np.int64]:
    """Ids of the tracks that stay put while the world is seen both to move and to shake.

    A distant point straight ahead stays put too while the camera drives at it, but not when the camera
    pitches and yaws: so a track counts as fixed only if the common motion of all other points, summed over
    its life, left the place by several times what the track itself did. Where most of the picture stays put,
    the camera stands still and nothing is fixed to it.

    Returns
    -------
    (T,) int64, ordered
    """
    if not len(trajectories.ids):
        return np.empty(0, np.int64)
    order = np.lexsort((trajectories.frame, trajectories.ids))
    ids, frame, xy = (
        trajectories.ids[order],
        trajectories.frame[order],
        trajectories.xy[order].astype(np.float64),
    )
    names, first, count = np.unique(ids, return_index=True, return_counts=True)
    column = np.repeat(np.arange(len(names)), count)
    unit = _unit(trajectories)
    spread, gone = _spread_and_displacement(xy, first, count)
    still = (spread < config.fixed_spread * unit) & (count >= 3)
    moving = ~still & (gone > 4 * config.fixed_spread * unit)
    common, moves = _common_motion(frame, ids, xy, still[column], moving[column], trajectories, config)
    path = np.vstack([np.zeros((1, 2)), np.cumsum(common, axis=0)])
    travelled = np.concatenate([[0.0], np.cumsum(moves)])
    fixed = []
    for k in np.flatnonzero(still):
        begin, end = frame[first[k]], frame[first[k] + count[k] - 1]
        shake = np.linalg.norm(np.ptp(path[begin : end + 1], axis=0))
        enough = max(config.fixed_shake * unit, _SHAKE_TO_SPREAD * spread[k])
        if shake > enough and travelled[end] - travelled[begin] > config.fixed_travel * unit:
            fixed.append(names[k])
    return np.array(fixed, dtype=np.int64)


def _unit(trajectories: Trajectories) -> float:
    """Pixels per pixel of a 640x480 picture."""
    size = trajectories.size
    extent = np.hypot(*size) if size else np.hypot(*np.ptp(trajectories.xy, axis=0))
    return float(max(extent, 1.0)) / 800


def _spread_and_displacement(
    xy: NDArray[np.float64], first: NDArray[np.int64], count: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radius round a track's median position that holds nine tenths of its life, and distance from first to
    last."""
    spread = np.empty(len(first))
    gone = np.empty(len(first))
    for k, (begin, n) in enumerate(zip(first, count, strict=True)):
        own = xy[begin : begin + n]
        distance = np.linalg.norm(own - np.median(own, axis=0), axis=1)
        spread[k] = np.quantile(distance, 0.9)
        gone[k] = np.linalg.norm(own[-1] - own[0])
    return spread, gone


def _common_motion(
    frame: NDArray[np.int32],
    ids: NDArray[np.int64],
    xy: NDArray[np.float64],
    still: Bools,
    moving: Bools,
    trajectories: Trajectories,
    config: ObjectsConfig,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Median step of the moving points (F-1, 2), and median length of their steps (F-1,), frame by frame.

    Both are zero in frames in which such points own a small part of the picture only: they are movers then,
    before a camera that stands still.
    """
    rows = np.flatnonzero((np.diff(ids) == 0) & (np.diff(frame) == 1) & (still | moving)[:-1])
    rows = rows[np.argsort(frame[rows], kind="stable")]
    step = xy[rows + 1] - xy[rows]
    extent = np.asarray(trajectories.size or np.ptp(xy, axis=0).tolist(), dtype=np.float64) + 1
    cell = np.clip((xy[rows] / extent * _GRID).astype(int), 0, _GRID - 1) @ [1, _GRID]
    steps = max(trajectories.frames - 1, 0)
    common, length = np.zeros((steps, 2)), np.zeros(steps)
    bounds = np.searchsorted(frame[rows], np.arange(steps + 1))
    for f in range(steps):
        here = slice(bounds[f], bounds[f + 1])
        goes = moving[rows[here]]
        seen = np.bincount(cell[here], minlength=_GRID**2)
        going = np.bincount(cell[here][goes], minlength=_GRID**2)
        owned = np.count_nonzero(2 * going > seen) / max(int(np.count_nonzero(seen)), 1)
        if goes.any() and owned >= config.fixed_world_share:
            common[f] = np.median(step[here][goes], axis=0)
            length[f] = np.median(np.linalg.norm(step[here][goes], axis=1))
    return common, length

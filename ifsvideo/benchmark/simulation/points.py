"""Finds corners in a scene as a detector does, and says where each one is and for how long it is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark.simulation.geometry import Array, Scene
from ifsvideo.types import Bools, Ints

NOTHING, GROUND = -2, -1
"""Owners of a ray that meets no box."""
_BORDER = 6.0
"""Pixels at the picture's edge in which no track lives: the window of a tracker would hang over."""
_FARTHEST_GROUND_M = 80.0
_MOST_ON_MOVER = 150
_OCCLUSION_STRIDE = 3
"""Standing boxes hide little from frame to frame: looking at every third frame is a third of the work."""


@dataclass(frozen=True)
class Corners:
    """Points of the world that were found and followed.

    Attributes
    ----------
    places : (F, P, 3) float, metres
    owner : (P,) int
        Index of the box, -1 the ground.
    visible : (F, P) bool
        One unbroken run each.
    """

    places: Array
    owner: Ints
    visible: Bools

    def take(self, chosen: Bools | Ints) -> Corners:
        """Some of the points."""
        return Corners(self.places[:, chosen], self.owner[chosen], self.visible[:, chosen])

    def join(self, other: Corners) -> Corners:
        """These points and others."""
        return Corners(
            np.concatenate([self.places, other.places], axis=1),
            np.concatenate([self.owner, other.owner]),
            np.concatenate([self.visible, other.visible], axis=1),
        )


def find_corners(rng: np.random.Generator, scene: Scene, wanted: int) -> Corners:
    """Corners that last at least half of the window; detected in three frames, where no track is yet.

    Parameters
    ----------
    rng : numpy.random.Generator
    scene : Scene
    wanted : int
        About how many tracks the window has; sets the width of the detector's cells.
    """
    frames = len(scene.camera.centres)
    width, height = scene.camera.size
    cell = float(np.sqrt(width * height / (1.7 * wanted)))
    loss = rng.uniform(0.1, 0.6)
    kept = Corners(np.empty((frames, 0, 3)), np.empty(0, np.int64), np.empty((frames, 0), bool))
    for frame in (0, frames // 4, frames // 2):
        seen = scene.camera.project(kept.places)[frame][kept.visible[frame]]
        xy = _free_cells(rng, scene.camera.size, cell, seen)
        xy = np.concatenate([xy, _on_outlines(rng, scene, frame, cell, seen)])
        found = _cast(rng, scene, frame, xy)
        found = found.take(found.visible[frame])
        kept = kept.join(_follow(rng, scene, found, frame, loss))
    return _thin(rng, kept, scene)


def _free_cells(rng: np.random.Generator, size: tuple[int, int], cell: float, taken: Array) -> Array:
    """One pixel (N, 2) in each cell of the picture that holds no track."""
    columns, rows = int(size[0] // cell), int(size[1] // cell)
    step = np.array([size[0] / columns, size[1] / rows])
    free = np.ones((columns, rows), dtype=bool)
    at = np.clip((taken // step).astype(int), 0, [columns - 1, rows - 1])
    free[at[:, 0], at[:, 1]] = False
    cells = np.argwhere(free)
    return np.asarray((cells + rng.uniform(0.05, 0.95, cells.shape)) * step)


def _on_outlines(rng: np.random.Generator, scene: Scene, frame: int, cell: float, taken: Array) -> Array:
    """More pixels on each mover: a vehicle has more corners than the road, in cells of its own width."""
    chosen = [np.empty((0, 2))]
    for box in scene.boxes:
        if not box.moves:
            continue
        outline = scene.camera.project(box.to_world(_SIGNS * box.half))[frame]
        if not np.isfinite(outline).all():
            continue
        low = np.clip(outline.min(axis=0), 0, scene.camera.size)
        high = np.clip(outline.max(axis=0), 0, scene.camera.size)
        finer = max(float(np.sqrt(np.prod(high - low) / _MOST_ON_MOVER)), min(0.5 * cell, 9.0))
        if (high - low).min() < finer:
            continue
        extent = (int(np.ceil(high[0] - low[0])), int(np.ceil(high[1] - low[1])))
        chosen.append(_free_cells(rng, extent, finer, taken[_within(taken, low, high)] - low) + low)
    return np.concatenate(chosen)


_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def _within(xy: Array, low: Array, high: Array) -> Bools:
    return np.asarray(((xy >= low) & (xy < high)).all(axis=1), dtype=bool)


def _cast(rng: np.random.Generator, scene: Scene, frame: int, xy: Array) -> Corners:
    """What the pixels (N, 2) of a frame show, where it carries a corner; seen in this frame only as yet."""
    rays = scene.camera.rays(frame, xy)
    origin = scene.camera.centres[frame]
    reach, owner = nearest_surface(scene, frame, rays)
    texture = np.array([box.texture for box in scene.boxes] + [0.0, scene.ground_texture])
    corner = (owner != NOTHING) & (rng.random(len(xy)) < texture[owner])
    reach, owner, rays = reach[corner], owner[corner], rays[corner]
    depth = np.array([1.6 * box.half.min() * box.rough for box in scene.boxes] + [0.0, 0.0])[owner]
    reach = reach + depth * rng.random(len(reach)) / np.linalg.norm(rays, axis=1)
    start = origin + reach[:, None] * rays
    places = np.repeat(start[None], len(scene.camera.centres), axis=0)
    for index, box in enumerate(scene.boxes):
        mine = owner == index
        if box.moves and mine.any():
            places[:, mine] = box.to_world(box.to_own(start[mine] - box.centres[frame], frame))
    visible = np.zeros(places.shape[:2], dtype=bool)
    visible[frame] = True
    return Corners(places, owner, visible)


def nearest_surface(scene: Scene, frame: int, rays: Array) -> tuple[Array, NDArray[np.int64]]:
    """How many times its direction (N, 3) each ray of a frame goes, and the owner of what it meets."""
    origin = scene.camera.centres[frame]
    falls = np.where(rays[:, 1] > 1e-9, rays[:, 1], np.nan)
    reach = (scene.ground - origin[1]) / falls
    far = np.linalg.norm(rays, axis=1) * reach
    owner = np.where(far < _FARTHEST_GROUND_M, GROUND, NOTHING).astype(np.int64)
    reach = np.where(owner == GROUND, reach, np.inf)
    for index, box in enumerate(scene.boxes):
        entry = box.entry(origin[None], rays, frame)
        nearer = entry < reach
        reach, owner = np.where(nearer, entry, reach), np.where(nearer, index, owner)
    return reach, owner


def _follow(rng: np.random.Generator, scene: Scene, found: Corners, start: int, loss: float) -> Corners:
    """The corners that live for half of the window: from ``start`` until they leave, are hidden or lost."""
    frames, points = found.visible.shape
    xy = scene.camera.project(found.places)
    edge = np.array(scene.camera.size) - 1 - _BORDER
    lost = np.where(rng.random(points) < loss, rng.integers(start + frames // 2, frames + 1, points), frames)
    time = np.arange(frames)[:, None]
    alive = ((xy >= _BORDER) & (xy <= edge)).all(axis=2) & (time < lost)
    lasting = _run(alive, start).sum(axis=0) >= frames / 2
    found, alive = found.take(lasting), alive[:, lasting]
    alive &= ~_hidden(scene, found)
    alive = _run(alive, start)
    lasting = alive.sum(axis=0) >= frames / 2
    return Corners(found.places[:, lasting], found.owner[lasting], alive[:, lasting])


def _run(alive: Bools, start: int) -> Bools:
    """The unbroken run of each column (F, P) that begins in frame ``start``."""
    run = np.logical_and.accumulate(alive[start:], axis=0)
    return np.concatenate([np.zeros((start, alive.shape[1]), dtype=bool), run])


def _hidden(scene: Scene, corners: Corners) -> Bools:
    """Frames in which a box stands before a corner (F, P), or turned the corner away."""
    rays = corners.places - scene.camera.centres[:, None]
    origins = scene.camera.centres[:, None]
    hidden = np.zeros(corners.visible.shape, dtype=bool)
    for index, box in enumerate(scene.boxes):
        frames = slice(None, None, 1 if box.moves else _OCCLUSION_STRIDE)
        # The face on which a corner lies is met at 1, whatever rounding does; a rough box shows its inside.
        covers = box.entry(origins[frames], rays[frames], frames) < 1 - 1e-6
        hidden[frames] |= covers & ~((corners.owner == index) & box.rough)
    return hidden


def _thin(rng: np.random.Generator, corners: Corners, scene: Scene) -> Corners:
    """At most 150 tracks on a mover."""
    keep = np.ones(len(corners.owner), dtype=bool)
    for index, box in enumerate(scene.boxes):
        mine = np.flatnonzero(corners.owner == index)
        if box.moves and len(mine) > _MOST_ON_MOVER:
            keep[rng.permutation(mine)[_MOST_ON_MOVER:]] = False
    return corners.take(keep)

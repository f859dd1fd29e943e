"""One simulated window: a scene, its movers, their corners, and what a tracker makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.simulation.geometry import Array, Scene
from ifsvideo.benchmark.simulation.movers import LEAST_SHIFT, add_movers, shift_against_still
from ifsvideo.benchmark.simulation.points import Corners, find_corners
from ifsvideo.benchmark.simulation.scenes import draw_scene
from ifsvideo.benchmark.simulation.tracker import junk, measured
from ifsvideo.types import Bools, Ints, Tracks

STATIC = 1
"""True label of the static world; movers follow from 2."""
_MOVER_SHARES = (0.33, 0.27, 0.2, 0.12, 0.08)
"""How often a window has 0, 1, ... 4 movers."""
_LEAST_TRACKS, _MOST_TRACKS = 200, 1000
_LEAST_ON_MOVER = 5
_LEAST_STATIC = 30


@dataclass(frozen=True)
class Simulation:
    """A simulated window with what is known of it.

    Attributes
    ----------
    sequence : LabelledSequence
        What a segmenter would get, and the truth.
    scene : Scene
    places : (F, P, 3) float
        Where each track's point is in the world, metres; NaN for a false corner.
    exact : (F, P, 2) float
        Where the camera sees it without noise, pixels; NaN where it cannot, and for a false corner.
    """

    sequence: LabelledSequence
    scene: Scene
    places: Array
    exact: Array


def simulate(seed: int) -> LabelledSequence:
    """One window of labelled tracks: 20 to 30 frames at 25 to 30 a second, everything drawn from the seed.

    Parameters
    ----------
    seed : int
        Not negative. The same seed gives the same window.

    Returns
    -------
    LabelledSequence
        200 to 1000 tracks, each seen in at least half of the frames; truth 1 is the static world, 2, 3, ...
        are the movers without a gap, 0 is a false corner that belongs to neither. Its kind is that of the
        scene: road, rest, hand-held or sideways.
    """
    return simulate_window(seed).sequence


def simulate_window(seed: int) -> Simulation:
    """As `simulate`, with the scene, the places in the world and the tracks without noise."""
    rng = np.random.default_rng(seed)
    movers = int(rng.choice(len(_MOVER_SHARES), p=_MOVER_SHARES))
    while True:  # ends: any scene has a chance to be seen well enough
        drawn = _draw(rng, movers)
        if drawn is not None:
            return _finish(rng, seed, *drawn)


def _draw(rng: np.random.Generator, movers: int) -> tuple[Scene, Corners, Ints] | None:
    """A scene, its corners and their labels; None where too little is seen, or none of the movers."""
    scene = add_movers(rng, draw_scene(rng), movers)
    if movers and not any(box.moves for box in scene.boxes):
        return None
    wanted = int(np.exp(rng.uniform(np.log(1.3 * _LEAST_TRACKS), np.log(1.1 * _MOST_TRACKS))))
    corners = find_corners(rng, scene, wanted)
    corners, labels = _label(scene, corners)
    static = np.flatnonzero(labels == STATIC)
    surplus = max(len(labels) - int(0.95 * _MOST_TRACKS), 0)
    keep = np.ones(len(labels), dtype=bool)
    keep[rng.permutation(static)[:surplus]] = False
    enough = keep.sum() >= _LEAST_TRACKS and len(static) - surplus >= _LEAST_STATIC
    if not enough or (movers > 0) != bool((labels > STATIC).any()):
        return None
    return scene, corners.take(keep), labels[keep]


def _label(scene: Scene, corners: Corners) -> tuple[Corners, Ints]:
    """Labels without gaps; a mover with too few tracks, or that hardly moves, loses them all."""
    labels = np.full(len(corners.owner), STATIC)
    number = STATIC
    for index, box in enumerate(scene.boxes):
        mine = corners.owner == index
        if not (box.moves and mine.any()):
            continue
        shift = shift_against_still(scene, corners.places[:, mine], corners.visible[:, mine])
        if mine.sum() >= _LEAST_ON_MOVER and np.median(shift) >= LEAST_SHIFT:
            number += 1
            labels[mine] = number
        else:
            labels[mine] = 0
    return corners.take(labels > 0), labels[labels > 0]


def _finish(rng: np.random.Generator, seed: int, scene: Scene, corners: Corners, labels: Ints) -> Simulation:
    """Noise and false corners."""
    frames = len(corners.visible)
    exact = scene.camera.project(corners.places)
    false, seen = junk(rng, exact, corners.visible, corners.owner, rng.uniform(0.01, 0.04))
    xy = measured(rng, np.concatenate([exact, false], axis=1))
    visible = _inside(xy, np.concatenate([corners.visible, seen], axis=1), scene.camera.size)
    fake = np.arange(visible.shape[1]) >= len(labels)
    keep = ~fake | (visible.sum(axis=0) >= frames / 2)
    truth = np.concatenate([labels, np.zeros(len(fake) - len(labels), np.int64)])[keep].astype(np.int64)
    tracks = Tracks.from_array(xy[:, keep], visible[:, keep], size=scene.camera.size, fps=scene.fps)
    nowhere = np.full((frames, int((truth == 0).sum()), 3), np.nan)
    return Simulation(
        LabelledSequence(f"{scene.kind}-{seed}", scene.kind, tracks, truth),
        scene,
        np.concatenate([corners.places, nowhere], axis=1),
        np.concatenate([exact, nowhere[..., :2]], axis=1),
    )


def _inside(xy: Array, visible: Bools, size: tuple[int, int]) -> Bools:
    """Where a track is seen and in the picture."""
    return np.asarray(visible & ((xy >= 0) & (xy <= np.array(size) - 1)).all(axis=2), dtype=bool)

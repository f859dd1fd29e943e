"""An object that rests in the picture while the world goes and shakes is fixed to the camera."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.still_objects import still_objects
from ifsvideo.types import FramePoints

FRAMES, WORLD, OWN = 30, 60, 7


def told(object_steps: NDArray[np.float64], world_steps: NDArray[np.float64]) -> set[int]:
    """Object 4 has seven tracks, with steps (F, 7, 2); 60 of the world all go alike, by (F, 2)."""
    rng = np.random.default_rng(0)
    start = rng.uniform(0, 400, (WORLD + OWN, 2))
    steps = np.concatenate([np.repeat(world_steps[:, None], WORLD, axis=1), object_steps], axis=1)
    ids = np.arange(WORLD + OWN)
    points = [FramePoints(ids, xy.astype(np.float32)) for xy in start + np.cumsum(steps, axis=0)]
    labels = [np.repeat([0, 4], [WORLD, OWN])] * FRAMES
    return still_objects(points, labels, 1.0, ObjectsConfig())


def shaking(size: float = 2.0) -> NDArray[np.float64]:
    """A world that goes two pixels a frame, and is shaken."""
    return np.array([2.0, 0.0]) + size * np.random.default_rng(1).normal(0, 1, (FRAMES, 2))


def sliding(share: float) -> NDArray[np.float64]:
    """In every frame this share of the tracks slides by two pixels along an edge; the others rest."""
    slide = np.random.default_rng(2).uniform(0, 1, (FRAMES, OWN)) < share
    return np.stack([2.0 * slide, 0.1 * slide], axis=2)


@pytest.mark.parametrize(
    ("own", "world", "expected"),
    [
        (sliding(0.0), shaking(), {4}),
        (sliding(0.25), shaking(), {4}),
        (sliding(0.8), shaking(), set()),
        (np.repeat(shaking()[:, None] - (2.0, 0.0), OWN, axis=1), shaking(), set()),  # followed: pitches, too
        (sliding(0.0), np.zeros((FRAMES, 2)), set()),  # the camera stands
    ],
    ids=["rests", "slides now and then", "goes", "is followed", "the world rests"],
)
def test_what_rests_while_the_world_shakes_is_fixed_to_the_camera(
    own: NDArray[np.float64], world: NDArray[np.float64], expected: set[int]
) -> None:
    assert told(own, world) == expected


def test_a_few_frames_tell_nothing() -> None:
    points = [FramePoints(np.arange(3), np.zeros((3, 2), np.float32))] * 2
    assert still_objects(points, [np.array([0, 0, 1])] * 2, 1.0, ObjectsConfig()) == set()
    assert still_objects([], [], 1.0, ObjectsConfig()) == set()

"""Final numbers: in the order of appearance, without gaps, and only for what lives long enough."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.numbering import settle
from ifsvideo.tracking.trajectories import Trajectories


def trajectories(frames: list[int], fps: float | None = 10.0) -> Trajectories:
    rows = len(frames)
    ids = np.arange(rows, dtype=np.int64)
    return Trajectories(np.array(frames, np.int32), ids, np.zeros((rows, 2), np.float32), 20, (64, 48), fps)


def test_numbers_follow_the_first_sight() -> None:
    points = trajectories([0, 0, 1, 2, 9, 9, 9])
    labels = np.array([-1, 0, 7, 3, 3, 7, 0], np.int32)
    settled = settle(points, labels, ObjectsConfig())
    assert settled.tolist() == [-1, 0, 1, 2, 2, 1, 0]
    assert settled.dtype == np.int32


@pytest.mark.parametrize(("fps", "number"), [(10.0, 1), (11.0, 0), (None, 0)])
def test_what_lives_too_short_is_background(fps: float | None, number: int) -> None:
    """Five frames are half a second at 10 a second, and less at more; untold, the rate is 30."""
    labels = np.array([4, 4, -1], np.int32)
    settled = settle(trajectories([3, 7, 8], fps), labels, ObjectsConfig(least_seconds=0.5))
    assert settled.tolist() == [number, number, -1]


def test_nothing_to_number() -> None:
    assert settle(trajectories([]), np.empty(0, np.int32), ObjectsConfig()).shape == (0,)
    assert settle(trajectories([0, 1]), np.array([0, -1], np.int32), ObjectsConfig()).tolist() == [0, -1]

"""Fundamental matrices against the first frame: what they tell apart, and what they cannot."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.segmentation.bundle import skew
from ifsvideo.segmentation.epipolar import epipolar_split, epipolar_support, sampson_distance
from ifsvideo.types import Tracks
from tests.scenes import FOCAL, LEFT_CAR, SIZE, Camera, make_scene


def true_fundamental(camera: Camera, first: int, second: int) -> np.ndarray:
    """F with ``x'^T F x = 0`` of two cameras that are known."""
    K = np.diag([FOCAL, FOCAL, 1.0])
    K[:2, 2] = (np.array(SIZE) - 1) / 2
    R = camera.R[second] @ camera.R[first].T
    t = camera.R[second] @ (camera.centre[first] - camera.centre[second])
    inverse = np.linalg.inv(K)
    return np.asarray(inverse.T @ skew(t) @ R @ inverse)


def test_sampson_distance_is_zero_for_the_true_matrix_and_pixels_off_it() -> None:
    scene = make_scene(Camera.path(step=(0.3, 0, 0), shake=0.0), noise=0.0)
    first, second = scene.tracks.xy[0], scene.tracks.xy[10]
    F = true_fundamental(scene.camera, 0, 10)
    assert sampson_distance(F, first, second).max() < 1e-9
    # A camera that moves aside has level epipolar lines: one pixel off in one picture of the two is
    # sqrt(1/2) of a pixel from the nearest pair that agrees.
    assert sampson_distance(F, first, second + np.array([0, 1])) == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert sampson_distance(F, first, second + np.array([5, 0])).max() < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_split_tells_a_crossing_car_from_the_world(seed: int) -> None:
    scene = make_scene(movers=(LEFT_CAR,), seed=seed)
    background = epipolar_split(scene.tracks, 0.5, seed)
    assert background[scene.truth == 0].mean() > 0.9
    assert background[scene.truth == 1].mean() < 0.3


def test_split_of_broken_tracks() -> None:
    scene = make_scene(movers=(LEFT_CAR,)).with_gaps()
    support = epipolar_support(scene.tracks, 0.5, 0)
    assert support[scene.truth == 0].mean() > 0.85
    assert support[scene.truth == 0].mean() > support[scene.truth == 1].mean() + 0.3


def test_tracks_born_later_have_no_say_over_the_first() -> None:
    scene = make_scene(movers=(LEFT_CAR,), noise=0.3)
    xy = scene.tracks.xy.copy()
    late = np.arange(len(scene.truth)) % 2 == 1
    xy[:4, late] = np.nan
    support = epipolar_support(Tracks.from_array(xy), 0.5, 0)
    alone = epipolar_support(Tracks.from_array(xy[:, ~late]), 0.5, 0)
    assert np.array_equal(support[~late], alone)
    assert support[late & (scene.truth == 0)].mean() > 0.8


def test_a_point_never_seen_with_enough_others_has_no_support() -> None:
    xy = make_scene(static=30).tracks.xy.copy()
    xy[:-1, 0] = np.nan  # born in the last frame
    xy[:, 1] = np.nan  # never seen
    support = epipolar_support(Tracks.from_array(xy), 0.5, 0)
    assert support[0] == support[1] == 0
    assert support[2:].min() > 0.5
    assert not epipolar_support(Tracks.from_array(xy[:, :7]), 0.5, 0).any()


def test_points_that_all_share_a_place_are_no_error() -> None:
    support = epipolar_support(Tracks.from_array(np.full((5, 20, 2), 7.0)), 0.5, 0)
    assert support.shape == (20,)


def test_same_seed_same_support() -> None:
    tracks = make_scene(movers=(LEFT_CAR,)).tracks
    assert np.array_equal(epipolar_support(tracks, 0.5, 3), epipolar_support(tracks, 0.5, 3))

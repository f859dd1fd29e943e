"""Shear and stretch of known motions, and the pairs in which they are measured."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ifsvideo.segmentation.shear import between_edges, inside_edges, score, shear_and_stretch
from ifsvideo.types import Tracks
from tests.scenes import affine_tracks

FRAMES = 6


def points(count: int = 30, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(100, 300, (count, 2))


def maps(angle: float = 0.0, scale: float = 1.0) -> np.ndarray:
    """A turn by ``angle`` and a growth by ``scale`` between any two frames, and a shift."""
    time = np.arange(FRAMES)
    c, s = np.cos(angle * time), np.sin(angle * time)
    turn = np.stack([np.stack([c, -s], 1), np.stack([s, c], 1)], 1) * (scale**time)[:, None, None]
    return np.concatenate([turn, (time[:, None] * [7.0, -3.0])[:, :, None]], axis=2)


EDGES = np.array([[0, 1], [2, 3], [4, 9]])


def test_a_shift_has_neither() -> None:
    shear, stretch = shear_and_stretch(affine_tracks(points(), maps()), EDGES)
    assert shear.shape == stretch.shape == (FRAMES - 1, 3)
    assert_allclose(shear, 0, atol=1e-12)
    assert_allclose(stretch, 0, atol=1e-12)


@pytest.mark.parametrize("angle", [0.1, -0.1, 3.0])
def test_a_turn_is_shear_by_its_angle(angle: float) -> None:
    shear, stretch = shear_and_stretch(affine_tracks(points(), maps(angle)), EDGES)
    assert_allclose(shear, abs(angle))
    assert_allclose(stretch, 0, atol=1e-10)


def test_growth_is_stretch_in_pixels() -> None:
    tracks = affine_tracks(points(), maps(scale=1.02))
    shear, stretch = shear_and_stretch(tracks, EDGES)
    length = np.linalg.norm(np.diff(tracks.xy[:, EDGES], axis=2)[:, :, 0], axis=2)
    assert_allclose(shear, 0, atol=1e-12)
    assert_allclose(stretch, 0.02 * length[:-1])


def test_score_is_the_mean_over_edges_and_frames() -> None:
    tracks = affine_tracks(points(), maps(0.05, 1.02))
    shear, stretch = shear_and_stretch(tracks, EDGES)
    assert score(tracks, EDGES) == pytest.approx((shear.sum() + stretch.sum()) / ((FRAMES - 1) * 3))


def test_only_frames_in_which_both_ends_are_seen_twice_count() -> None:
    xy = affine_tracks(points(), maps(0.1)).xy.copy()
    xy[3:, 0] = np.nan
    xy[:, 4] = np.nan
    shear, stretch = shear_and_stretch(Tracks.from_array(xy), EDGES)
    assert np.isnan(shear[2:, 0]).all()
    assert np.isnan(stretch[:, 2]).all()
    assert score(Tracks.from_array(xy), EDGES) == pytest.approx(0.1)
    assert np.isnan(score(Tracks.from_array(xy), EDGES[2:]))


def test_no_edges_have_no_score() -> None:
    assert np.isnan(score(affine_tracks(points(), maps()), np.empty((0, 2), np.int64)))


def test_a_single_frame_has_no_score() -> None:
    assert np.isnan(score(Tracks.from_array(points()[None]), EDGES))


def test_edges_inside_name_the_segments_own_points() -> None:
    members = np.array([3, 8, 11, 20, 25])
    edges = inside_edges(points(), members)
    assert np.isin(edges, members).all()
    assert np.array_equal(np.unique(edges), members)
    assert inside_edges(points(), members[:1]).shape == (0, 2)


def test_edges_between_are_greedy_nearest_and_one_to_one() -> None:
    place = np.array([[0, 0], [10, 0], [50, 0], [1, 0], [3, 0], [30, 0], [99, 0]], dtype=float)
    first, second = np.array([0, 1, 2]), np.array([3, 4, 5, 6])
    # 0-3 is 1 apart; of the rest 1-4 is 7, then 2-5 20; 0-4 (3) and 1-3 (9) are taken already.
    assert between_edges(place, first, second, 10).tolist() == [[0, 3], [1, 4], [2, 5]]
    assert between_edges(place, first, second, 2).tolist() == [[0, 3], [1, 4]]
    assert between_edges(place, first[:1], second, 10).tolist() == [[0, 3]]

"""Rank 3 of one rigid body under an affine camera: exact, with gaps, and not for two bodies or a stranger."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.segmentation.lowrank import Subspace, along_mean_path, stacks, trajectory_matrix
from ifsvideo.types import Tracks

EXACT = 1e-3
"""Pixels; the small constant that keeps the solver's matrices regular leaves as much."""


def body(points: int = 40, frames: int = 15, seed: int = 0, rank: int = 3) -> np.ndarray:
    """A rigid (or flatter) body before an affine camera that turns slowly: (F, P, 2), exact."""
    rng = np.random.default_rng(seed)
    shape = rng.uniform(-40, 40, (points, 3)) * (np.arange(3) < rank)
    angle = np.linspace(0, 0.5, frames) * rng.choice([-1, 1])
    ones, zeros = np.ones(frames), np.zeros(frames)
    rows = np.stack([np.cos(angle), zeros, np.sin(angle), zeros, ones, 0.3 * angle], axis=1)
    path = np.arange(frames)[:, None, None] * rng.normal(0, 3, 2) + [320, 240]
    return np.asarray(np.einsum("fij,pj->fpi", rows.reshape(frames, 2, 3), shape) + path)


def holes(xy: np.ndarray, share: float = 0.3, seed: int = 1) -> Tracks:
    """Births and deaths: each third track misses its start, each third its end."""
    frames, points = xy.shape[:2]
    cut = np.random.default_rng(seed).integers(1, max(int(2 * share * frames), 2), points)
    time, kind = np.arange(frames)[:, None], np.arange(points) % 3
    visible = np.where(kind == 0, time >= cut, np.where(kind == 1, time < frames - cut, True))
    return Tracks.from_array(xy, visible)


def residual(tracks: Tracks, rank: int = 3, iterations: int = 5) -> np.ndarray:
    """Distance of each trajectory from the subspace that all of them together span best."""
    W, seen = trajectory_matrix(tracks, 99)
    return Subspace.fit(W, seen, rank, iterations).distance(W, seen)


def test_the_matrix_holds_x_and_y_in_turn_and_nothing_where_nothing_was_seen() -> None:
    tracks = holes(body(points=6, frames=5))
    W, seen = trajectory_matrix(tracks, 99)
    assert W.shape == seen.shape == (10, 6)
    for row in range(10):
        assert np.array_equal(seen[row] > 0, tracks.visible[row // 2])
    centre = np.nanmean(tracks.xy, axis=(0, 1))
    there = seen > 0
    expected = (tracks.xy - centre).transpose(0, 2, 1).reshape(10, 6)
    assert W[there] == pytest.approx(expected[there])
    assert not W[~there].any()


@pytest.mark.parametrize("seed", range(3))
def test_one_rigid_body_has_rank_three_exactly(seed: int) -> None:
    assert residual(Tracks.from_array(body(seed=seed))).max() < EXACT


@pytest.mark.parametrize("seed", range(3))
def test_gaps_are_filled_by_what_was_measured(seed: int) -> None:
    tracks = holes(body(seed=seed))
    assert not tracks.visible.all()
    assert residual(tracks, iterations=40).max() < 0.05
    assert np.median(residual(tracks)) < 0.2


def test_rank_two_is_a_plane_only() -> None:
    assert residual(Tracks.from_array(body(rank=2)), rank=2).max() < EXACT
    assert residual(Tracks.from_array(body(rank=3)), rank=2).max() > 0.1


@pytest.mark.parametrize("broken", [False, True])
def test_a_body_is_predicted_from_half_of_its_points(broken: bool) -> None:
    """What stage 5 asks: are these points on the subspace of those?"""
    rng = np.random.default_rng(0)
    xy = body(points=60)
    stranger = body(points=30, seed=3) + np.arange(15)[:, None, None] ** 2 * [0.5, 0]
    everything = np.concatenate([xy, stranger], axis=1) + rng.normal(0, 0.05, (15, 90, 2))
    W, seen = trajectory_matrix(holes(everything) if broken else Tracks.from_array(everything), 99)
    subspace = Subspace.fit(W[:, :30], seen[:, :30], 3)
    assert subspace.rank == 3
    distance = subspace.distance(W, seen)
    assert np.median(distance[60:]) > 10 * np.median(distance[30:60])
    assert np.median(distance[30:60]) < 0.3


@pytest.mark.parametrize("broken", [False, True])
def test_two_bodies_are_not_one(broken: bool) -> None:
    xy = np.concatenate([body(seed=0), body(seed=3) + np.arange(15)[:, None, None] ** 2 * [0.5, 0]], axis=1)
    alone, both = (holes(part) if broken else Tracks.from_array(part) for part in (xy[:, :40], xy))
    assert np.median(residual(both)) > max(1.0, 5 * np.median(residual(alone)))


@pytest.mark.parametrize("broken", [False, True])
def test_sets_of_any_size_are_fitted_together_as_by_themselves(broken: bool) -> None:
    xy = body(points=80) + np.random.default_rng(0).normal(0, 0.05, (15, 80, 2))
    W, seen = trajectory_matrix(holes(xy) if broken else Tracks.from_array(xy), 12)
    sets = [np.arange(start, start + size) for start, size in ((0, 30), (30, 1), (31, 3), (34, 12), (46, 2))]
    sets += [np.arange(48, 80, 4), np.arange(2, 80, 3)]  # every third one has no gaps
    found = []
    for which, own, there in stacks(W, seen, sets, 3):
        spaces = Subspace.fit(own, there, 3)
        for space in (spaces, spaces.main(own, there, 2)):
            for number, together in zip(which, space.distance(W, seen), strict=True):
                alone = Subspace.fit(W[:, sets[number]], seen[:, sets[number]], 3)
                if space is not spaces:
                    alone = alone.main(W[:, sets[number]], seen[:, sets[number]], 2)
                assert together == pytest.approx(alone.distance(W, seen), rel=1e-6, abs=1e-6)
        found += which.tolist()
    assert sorted(found) == list(range(len(sets)))


def test_a_point_that_goes_its_own_way_stands_out() -> None:
    xy = body()
    xy[:, 7, 1] += 8 * np.sin(np.arange(15))
    error = residual(Tracks.from_array(xy))
    assert int(error.argmax()) == 7
    assert error[7] > 5 * np.median(error)


def test_residual_is_the_noise_of_a_frame() -> None:
    xy = body(points=200, frames=10) + np.random.default_rng(0).normal(0, 0.5, (10, 200, 2))
    measured = np.sqrt((residual(Tracks.from_array(xy)) ** 2).mean())
    assert measured == pytest.approx(0.5 * np.sqrt(2), rel=0.04)  # two coordinates


@pytest.mark.parametrize("points", [1, 2, 3, 4])
def test_few_points_are_always_rigid(points: int) -> None:
    xy = np.random.default_rng(0).uniform(0, 100, (10, points, 2))
    assert residual(Tracks.from_array(xy)).max() < EXACT


def test_coincident_points_and_single_sights() -> None:
    assert not residual(Tracks.from_array(np.full((6, 10, 2), 50.0))).any()
    xy = body()
    xy[1:, 0] = np.nan
    error = residual(Tracks.from_array(xy))
    assert np.isfinite(error).all()


def test_the_mean_path_fills_gaps_and_only_gaps() -> None:
    shift = np.arange(6)[:, None] * [2.0, -1.0]
    start = np.random.default_rng(0).uniform(0, 100, (5, 2))
    W = (start[None] + shift[:, None]).transpose(0, 2, 1).reshape(12, 5)
    seen = np.ones_like(W)
    assert along_mean_path(W, seen) is W
    seen[4:8, 2] = 0
    seen[6:, 3] = 0
    holey = np.where(seen > 0, W, 0.0)
    assert along_mean_path(holey, seen) == pytest.approx(W)

"""Residuals to a model's subspace (eq. 3.3) against a direct computation, and the choice of a model."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ifsvideo.segmentation.assignment import assign, residuals
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.sampling import AffineModels, sample_models
from ifsvideo.types import Tracks
from tests.scenes import LEFT_CAR, affine_tracks, make_scene, some_maps

CONFIG = SegmenterConfig(models=12)


def sampled(tracks: Tracks, seed: int = 0) -> AffineModels:
    background = np.ones(tracks.points, bool)
    return sample_models(tracks, background, 0, 1.0, CONFIG, np.random.default_rng(seed))


def models_of(*members: list[int], tracks: Tracks) -> AffineModels:
    inliers = np.zeros((len(members), tracks.points), bool)
    for mask, own in zip(inliers, members, strict=True):
        mask[own] = True
    controls = np.array([tracks.xy[0, own[:3]] for own in members])
    return AffineModels(inliers, controls, np.zeros(len(members), bool))


@pytest.mark.parametrize("centred", [False, True])
def test_equation_3_3_to_the_letter(centred: bool) -> None:
    tracks = make_scene(movers=(LEFT_CAR,), static=80).tracks
    models = sampled(tracks)
    W = tracks.W
    found = residuals(tracks, models, centred)
    for m, inlier in enumerate(models.inliers):
        mean = W[:, inlier].mean(axis=1, keepdims=True) if centred else 0.0
        U = np.linalg.svd(W[:, inlier] - mean)[0][:, :2]
        w = W - mean
        r = np.linalg.norm(U @ U.T @ w - w, axis=0)
        assert_allclose(found[m], r / np.sqrt(tracks.frames), atol=1e-5)


@pytest.mark.parametrize("centred", [False, True])
def test_what_is_not_seen_does_not_count(centred: bool) -> None:
    """Gaps elsewhere change nothing for a complete track; a broken one is projected where it is seen."""
    whole = make_scene(movers=(LEFT_CAR,), static=80).tracks
    models = sampled(whole)
    held = models.inliers.any(axis=0)
    xy = whole.xy.copy()
    free = np.flatnonzero(~held)
    xy[5:9, free] = np.nan
    xy[:2, free[0]] = np.nan
    before, after = residuals(whole, models, centred), residuals(Tracks.from_array(xy), models, centred)
    assert_allclose(after[:, held], before[:, held], atol=1e-4)
    rows = np.repeat(np.isfinite(xy[:, :, 0]), 2, axis=0)
    offset = np.nanmean(xy, axis=(0, 1)) if centred else np.zeros(2)
    W = (whole.xy - offset).transpose(0, 2, 1).reshape(-1, whole.points)
    for m, inlier in enumerate(models.inliers):
        mean = W[:, inlier].mean(axis=1) if centred else np.zeros(len(W))
        U = np.linalg.svd(W[:, inlier] - mean[:, None])[0][:, :2]
        for p in free[:4]:
            r = rows[:, p]
            d = (W[:, p] - mean)[r]
            a = np.linalg.lstsq(U[r], d, rcond=None)[0]
            assert after[m, p] == pytest.approx(np.linalg.norm(d - U[r] @ a) / np.sqrt(r.sum() / 2), abs=1e-4)


def test_broken_inliers_still_span_their_affine_motion() -> None:
    first = np.random.default_rng(0).uniform(100, 300, (40, 2))
    maps = np.eye(2, 3) + np.arange(12)[:, None, None] * np.array([[0, 0, 3.0], [0, 0, -2.0]])
    xy = affine_tracks(first, maps).xy.copy()
    xy[:4, ::3] = np.nan
    xy[9:, 1::3] = np.nan
    tracks = Tracks.from_array(xy)
    found = residuals(tracks, models_of(list(range(30)), tracks=affine_tracks(first, maps)), centred=True)
    assert found.max() < 1e-3


@pytest.mark.parametrize("gaps", [False, True])
def test_each_model_has_the_residuals_that_it_has_alone(gaps: bool) -> None:
    """Whatever the numbers of inliers of the models beside it."""
    scene = make_scene(movers=(LEFT_CAR,), static=80)
    tracks = scene.with_gaps().tracks if gaps else scene.tracks
    rng = np.random.default_rng(0)
    members = [sorted(rng.choice(tracks.points, size, replace=False)) for size in range(3, 40, 3)]
    found = residuals(tracks, models_of(*members, tracks=tracks), True)
    alone = [residuals(tracks, models_of(own, tracks=tracks), True)[0] for own in members]
    assert_allclose(found, alone, rtol=1e-6, atol=1e-5)


def test_exact_affine_motion_has_no_residual_and_another_has() -> None:
    first = np.random.default_rng(0).uniform(100, 300, (60, 2))
    one, other = affine_tracks(first[:30], some_maps(10, 0)), affine_tracks(first[30:], some_maps(10, 1))
    tracks = Tracks.from_array(np.concatenate([one.xy, other.xy], axis=1))
    models = models_of(list(range(15)), list(range(30, 45)), tracks=tracks)
    found = residuals(tracks, models, centred=True)
    assert max(found[0, :30].max(), found[1, 30:].max()) < 1e-4
    assert min(found[0, 30:].min(), found[1, :30].min()) > 1


def test_two_frames_tell_affine_motions_apart() -> None:
    """Four measurements, of which a model of rank 2 explains two."""
    first = np.random.default_rng(0).uniform(100, 300, (60, 2))
    one, other = affine_tracks(first[:30], some_maps(2, 0)), affine_tracks(first[30:], some_maps(2, 1))
    tracks = Tracks.from_array(np.concatenate([one.xy, other.xy], axis=1))
    models = models_of(list(range(15)), list(range(30, 45)), tracks=tracks)
    found = residuals(tracks, models, centred=True)
    assert max(found[0, :30].max(), found[1, 30:].max()) < 1e-4
    assert min(np.median(found[0, 30:]), np.median(found[1, :30])) > 0.5


def test_a_point_seen_once_fits_every_model_and_so_none() -> None:
    xy = affine_tracks(np.random.default_rng(0).uniform(100, 300, (30, 2)), some_maps(8)).xy.copy()
    xy[1:, 0] = np.nan
    tracks = Tracks.from_array(xy)
    found = residuals(tracks, models_of([1, 2, 3, 4], tracks=tracks), centred=True)
    assert np.isinf(found[:, 0]).all()
    assert np.isfinite(found[:, 1:]).all()


def row_of_points() -> tuple[Tracks, AffineModels]:
    """Points left, in the middle and right, a model in each place; point 9 belongs to none."""
    first = np.array([[x, y] for x in (0.0, 100.0, 200.0) for y in (0.0, 5.0, 10.0)] + [[190.0, 5.0]])
    tracks = Tracks.from_array(np.repeat(first[None], 4, axis=0))
    return tracks, models_of([0, 1, 2], [3, 4, 5], [6, 7, 8], tracks=tracks)


@pytest.mark.parametrize(("nearest", "expected"), [(1, 0), (2, 1), (3, 2), (9, 2)])
def test_of_the_best_models_the_nearest_wins(nearest: int, expected: int) -> None:
    tracks, models = row_of_points()
    residual = np.zeros((3, 10))
    residual[:, 9] = [0.1, 0.2, 0.3]  # the best fits from afar, the worst from nearby
    assert assign(tracks, models, residual, 0, nearest)[9] == expected


def test_a_point_that_a_model_holds_stays_with_it() -> None:
    tracks, models = row_of_points()
    residual = np.where(models.inliers, 5.0, 0.0)  # others would fit better
    assert assign(tracks, models, residual, 0, 1)[:9].tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]


def test_a_point_without_residual_goes_to_the_nearest_model() -> None:
    tracks, models = row_of_points()
    residual = np.zeros((3, 10))
    residual[:, 9] = np.inf
    assert assign(tracks, models, residual, 0, 1)[9] == 2


def test_a_point_unseen_in_the_base_frame_is_placed_where_it_is_on_average() -> None:
    tracks, models = row_of_points()
    xy = tracks.xy.copy()
    xy[0, 9] = np.nan
    assert assign(Tracks.from_array(xy), models, np.zeros((3, 10)), 0, 3)[9] == 2

"""Affine models in small disks: attributes, supports, and eq. 3.2 on motion that is exactly affine."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.sampling import AffineModels, _triples, sample_models
from ifsvideo.types import Tracks
from tests.scenes import LEFT_CAR, affine_tracks, make_scene, some_maps

CONFIG = SegmenterConfig(models=25)
FRAMES = 8


def sample(tracks: Tracks, background: Any, config: SegmenterConfig = CONFIG, seed: int = 0) -> AffineModels:
    return sample_models(tracks, background, 0, 1.0, config, np.random.default_rng(seed))


def grid(points: int = 200, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform((100, 100), (300, 250), (points, 2))


@pytest.mark.parametrize("seed", range(3))
def test_exact_affine_motion_holds_the_whole_disk(seed: int) -> None:
    tracks = affine_tracks(grid(seed=seed), some_maps(FRAMES, seed))
    models = sample(tracks, np.ones(200, bool), seed=seed)
    assert len(models) == CONFIG.models
    first = tracks.xy[0]
    for inlier, control in zip(models.inliers, models.controls, strict=True):
        # Every point within r of some centre; the centre is a point of the support itself.
        distance = np.linalg.norm(first[:, None] - first[inlier][None], axis=2)
        centres = np.flatnonzero((distance < CONFIG.disk_radius).all(axis=1))
        disks = [np.linalg.norm(first - first[c], axis=1) < CONFIG.disk_radius for c in centres]
        assert any(np.array_equal(disk, inlier) for disk in disks)
        assert len(np.unique(control, axis=0)) == 3
        assert (np.linalg.norm(first[inlier][None] - control[:, None], axis=2).min(axis=1) == 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_inliers_are_those_of_equation_3_2(seed: int) -> None:
    """Transfer by ``A_{1->f} = [c_f; 1] [c_1; 1]^-1``, written out."""
    scene = make_scene(movers=(LEFT_CAR,), seed=seed).with_gaps(seed)
    tracks = scene.tracks
    models = sample(tracks, scene.truth == 0, seed=seed)
    assert len(models) > 5
    partial = 0
    for inlier, control in zip(models.inliers, models.controls, strict=True):
        c = [int(np.flatnonzero((tracks.xy[0] == x).all(axis=1))[0]) for x in control]
        fits, known = np.zeros(tracks.points), np.zeros(tracks.points)
        for f in range(1, tracks.frames):
            if not tracks.visible[f, c].all():
                continue
            A = np.vstack([tracks.xy[f, c].T, np.ones(3)]) @ np.linalg.inv(np.vstack([control.T, np.ones(3)]))
            moved = (A @ np.vstack([tracks.xy[0].T, np.ones(tracks.points)]))[:2].T
            both = tracks.visible[0] & tracks.visible[f]
            known += both
            error = np.linalg.norm(np.where(both[:, None], moved - tracks.xy[f], np.inf), axis=1)
            fits += error < CONFIG.inlier_error
        expected = (known > 0) & (fits >= 0.5 * known)
        assert expected[inlier].all()
        reach = np.linalg.norm(tracks.xy[0] - control[0], axis=1) < 2 * CONFIG.disk_radius
        partial += np.count_nonzero(expected & reach & ~inlier) == 0
        assert not (inlier & ~reach).any()
    assert partial < len(models)  # disks do leave points out


@pytest.mark.parametrize(("stays", "held"), [(4, False), (5, True), (6, True)])
def test_half_of_the_frames_make_an_inlier(stays: int, held: bool) -> None:
    """Of ten frames after the first, a point follows for some and then leaves."""
    first = np.random.default_rng(0).uniform(100, 120, (12, 2))  # every disk holds them all
    xy = affine_tracks(first, some_maps(11)).xy.copy()
    xy[1 + stays :, 0] += 500.0
    models = sample(Tracks.from_array(xy), np.ones(12, bool))
    others = (models.controls != xy[0, 0]).any(axis=2).all(axis=1)
    assert others.any()
    assert (models.inliers[others, 0] == held).all()
    assert models.inliers[others, 1:].all()


@pytest.mark.parametrize("seed", range(5))
def test_outliers_within_a_disk_are_left_out(seed: int) -> None:
    """Triples are free: one that must go through an outlier, as a fifth of the centres are, explains nothing
    else."""
    free = replace(CONFIG, through_centre=False)
    moved = affine_tracks(grid(), some_maps(FRAMES))
    xy = moved.xy.copy()
    odd = np.arange(200) % 5 == 0
    xy[1:, odd] += np.arange(1, FRAMES)[:, None, None] * [20.0, -15.0]
    models = sample(Tracks.from_array(xy), np.ones(200, bool), free, seed)
    pure = [not (odd[inlier].any() and (~odd)[inlier].any()) for inlier in models.inliers]
    assert np.mean(pure) > 0.9


def test_attribute_is_that_of_the_disks_centre() -> None:
    tracks = affine_tracks(grid(), some_maps(FRAMES))
    background = tracks.xy[0, :, 0] < 200
    for share, expected in ((1.0, True), (0.0, False)):
        config = replace(CONFIG, foreground_share=share)
        models = sample(tracks, background, config)
        assert (models.foreground == expected).all()
        for inlier in models.inliers:
            assert (background[inlier] != expected).any()


def test_attributes_are_drawn_in_the_share_asked_for() -> None:
    tracks = affine_tracks(grid(), some_maps(FRAMES))
    config = replace(CONFIG, models=200, foreground_share=0.7)
    assert sample(tracks, np.arange(200) < 100, config).foreground.mean() == pytest.approx(0.7, abs=0.1)


@pytest.mark.parametrize("everywhere", [True, False])
def test_without_points_of_an_attribute_the_other_serves(everywhere: bool) -> None:
    tracks = affine_tracks(grid(), some_maps(FRAMES))
    models = sample(tracks, np.full(200, everywhere))
    assert len(models) == CONFIG.models
    assert (models.foreground != everywhere).all()


def test_collinear_points_give_no_model() -> None:
    first = np.column_stack([np.linspace(100, 200, 50), np.linspace(100, 150, 50)])
    assert len(sample(affine_tracks(first, some_maps(FRAMES)), np.ones(50, bool))) == 0


@pytest.mark.parametrize("points", [0, 1, 2])
def test_fewer_than_three_points_give_no_model(points: int) -> None:
    models = sample(affine_tracks(grid(points), some_maps(FRAMES)), np.ones(points, bool))
    assert len(models) == 0
    assert models.inliers.shape == (0, points)
    assert models.controls.shape == (0, 3, 2)


def test_points_unseen_in_the_base_frame_take_no_part() -> None:
    xy = affine_tracks(grid(), some_maps(FRAMES)).xy.copy()
    hidden = np.arange(200) % 3 == 0
    xy[0, hidden] = np.nan
    models = sample(Tracks.from_array(xy), np.ones(200, bool))
    assert len(models) == CONFIG.models
    assert not models.inliers[:, hidden].any()
    assert np.isfinite(models.controls).all()


def test_lengths_follow_the_unit() -> None:
    tracks = affine_tracks(grid(), some_maps(FRAMES))
    large = Tracks.from_array(4 * tracks.xy)
    small = sample_models(tracks, np.ones(200, bool), 0, 1.0, CONFIG, np.random.default_rng(0))
    scaled = sample_models(large, np.ones(200, bool), 0, 4.0, CONFIG, np.random.default_rng(0))
    assert np.array_equal(small.inliers, scaled.inliers)


@pytest.mark.parametrize("points", [3, 4, 5])
def test_every_triple_is_as_likely_as_every_other(points: int) -> None:
    triples = _triples(points, 30_000, np.random.default_rng(0))
    kinds, count = np.unique(triples, axis=0, return_counts=True)
    assert all(len(set(kind)) == 3 for kind in kinds.tolist())
    expected = points * (points - 1) * (points - 2)
    assert len(kinds) == expected
    assert np.abs(count * expected / 30_000 - 1).max() < 0.15

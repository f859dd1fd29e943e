"""Smoothing: clean tracks stay as they are, noisy ones come nearer to the truth, and gaps stay gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ifsvideo.benchmark.perturb import Perturbation
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.segmentation.smoothing import filled, noise_of, noisy, smoothed, without_gaps
from ifsvideo.types import Tracks
from tests.scenes import LEFT_CAR, RIGHT_CAR, Camera, Scene, make_scene, share_wrong

STRENGTH = SegmenterConfig().smoothing


def scene_of(noise: float, shake: float = 0.005, seed: int = 0) -> Scene:
    camera = Camera.path(frames=30, step=(0.1, 0.0, 0.1), shake=shake)
    return make_scene(camera, (LEFT_CAR, RIGHT_CAR), noise=noise, seed=seed)


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("shake", [0.0, 0.005])
def test_noise_is_told_whatever_the_camera_does(noise: float, shake: float) -> None:
    assert noise_of(scene_of(noise, shake).tracks) == pytest.approx(noise, rel=0.25)


@pytest.mark.parametrize(
    ("noise", "strength", "unit"), [(0.1, STRENGTH, 1.0), (1.0, 0.0, 1.0), (1.0, 1e4, 8)]
)
def test_clean_tracks_stay_as_they_are(noise: float, strength: float, unit: float) -> None:
    tracks = scene_of(noise).tracks
    assert smoothed(tracks, strength, unit) is tracks


@pytest.mark.parametrize("noise", [0.5, 1.0, 2.0])
def test_noisy_tracks_come_nearer_to_the_truth(noise: float) -> None:
    true, noisy = scene_of(0.0).tracks.xy, scene_of(noise).tracks
    found = smoothed(noisy, STRENGTH, 1.0)
    before, after = (np.sqrt(np.mean((xy - true) ** 2)) for xy in (noisy.xy, found.xy))
    assert after < 0.6 * before


@pytest.mark.parametrize(("drop", "left"), [(0.0, 0.5), (0.2, 0.6)])
def test_what_no_other_track_shares_goes_however_it_changes(drop: float, left: float) -> None:
    """Before anything is made smooth in time: with next to no strength."""
    true = scene_of(0.0).tracks.xy
    given = Perturbation(drop=drop).apply(scene_of(1.0).tracks, 0)
    found = smoothed(given, 1e-9, 1.0)
    assert np.array_equal(found.visible, given.visible)
    before, after = (np.sqrt(np.nanmean((xy - true) ** 2)) for xy in (given.xy, found.xy))
    assert after < left * before


def test_noise_is_told_in_pixels_of_a_small_picture() -> None:
    tracks = scene_of(1.0).tracks
    assert noisy(tracks, 1.0)
    assert not noisy(tracks, 8.0)
    assert not noisy(scene_of(0.1).tracks, 1.0)


def test_gaps_stay_gaps_and_short_tracks_are_left() -> None:
    tracks = scene_of(1.0).with_gaps().tracks
    visible = tracks.visible.copy()
    short = int(np.argmax(visible[:2].all(axis=0)))
    visible[2:, short] = False  # a point that is seen twice
    xy = np.where(visible[..., None], tracks.xy, np.nan)
    found = smoothed(replace(tracks, xy=xy, visible=visible), STRENGTH, 1.0)
    assert np.array_equal(np.isfinite(found.xy).all(axis=2), visible)
    assert found.xy[:2, short] == pytest.approx(xy[:2, short], abs=1e-3)


def test_no_track_of_four_frames_has_no_noise() -> None:
    tracks = Tracks.from_array(np.random.default_rng(0).uniform(0, 600, (3, 20, 2)), size=(640, 480))
    assert noise_of(tracks) == 0
    assert smoothed(tracks, STRENGTH, 1.0) is tracks


def test_cars_are_found_among_noise_in_which_they_drown_otherwise() -> None:
    wrong = {}
    for strength in (0.0, STRENGTH):
        segmenter = IFSSegmenter(SegmenterConfig(smoothing=strength))
        scenes = [scene_of(1.5, seed=seed) for seed in range(4)]
        wrong[strength] = np.mean([share_wrong(segmenter.segment(s.tracks).labels, s.truth) for s in scenes])
    assert wrong[STRENGTH] < 0.5 * wrong[0.0]


@pytest.mark.parametrize(("shake", "most"), [(0.0, 0.02), (0.005, 0.5)])
def test_short_gaps_inside_a_life_are_filled_nearly_exactly(shake: float, most: float) -> None:
    tracks = scene_of(0.0, shake).tracks
    visible = tracks.visible.copy()
    visible[10:13, 4] = visible[5, 4] = False
    visible[:2, 5] = visible[-2:, 6] = visible[10:14, 7] = False  # ends, and a gap that is too long
    visible[4:, 8] = visible[1, 8] = False  # too few frames for a curve
    given = replace(tracks, visible=visible, xy=np.where(visible[..., None], tracks.xy, np.nan))
    found = filled(given)
    expected = visible.copy()
    expected[10:13, 4] = expected[5, 4] = True
    assert np.array_equal(found.visible, expected)
    assert np.array_equal(np.isfinite(found.xy).all(axis=2), expected)
    assert np.array_equal(found.xy[visible], tracks.xy[visible])
    straight = without_gaps(given).xy
    gap = np.flatnonzero(expected[:, 4] & ~visible[:, 4])
    error, other = (np.abs(xy[gap, 4] - tracks.xy[gap, 4]).max() for xy in (found.xy, straight))
    assert error < min(most, other)
    assert filled(tracks) is tracks


def test_gaps_are_filled_beside_the_common_path() -> None:
    tracks = scene_of(0.0, shake=0.02).tracks
    visible = tracks.visible.copy()
    visible[10:13, 4] = visible[:3, 5] = visible[-3:, 6] = False
    xy = np.where(visible[..., None], tracks.xy, np.nan)
    filled = without_gaps(replace(tracks, xy=xy, visible=visible))
    assert filled.visible.all()
    assert np.array_equal(filled.xy[visible], tracks.xy[visible])
    # The camera shakes by 10 pixels; a line through the gap alone would miss that.
    assert np.abs(filled.xy[10:13, 4] - tracks.xy[10:13, 4]).max() < 2
    # At the ends a point goes as most do, not as far as its own depth would have it.
    for frames, point, last in ((slice(3), 5, 3), (slice(-3, None), 6, -4)):
        missed = np.abs(tracks.xy[frames, point] - filled.xy[frames, point]).max()
        assert missed < 0.7 * np.abs(tracks.xy[frames, point] - tracks.xy[last, point]).max()


def test_tracks_without_gaps_stay_as_they_are() -> None:
    tracks = scene_of(0.1).tracks
    assert without_gaps(tracks) is tracks

"""The second opinion of a whole: cuts where they can be told, also of tracks with gaps, and what fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ifsvideo.benchmark import metrics
from ifsvideo.benchmark.perturb import Perturbation
from ifsvideo.segmentation.whole import Whole
from ifsvideo.types import Tracks
from tests.scenes import affine_motions


def smooth_motions(sizes: tuple[int, ...] = (60, 40), seed: int = 0) -> tuple[Tracks, np.ndarray]:
    """Many frames of steady motions, so that a gap can be filled from its ends."""
    tracks, truth = affine_motions(sizes, seed=seed, noise=0.0)
    time = np.linspace(0, tracks.frames - 1, 40)
    frame = np.minimum(time.astype(int), tracks.frames - 2)
    part = (time - frame)[:, None, None]
    xy = tracks.xy[frame] * (1 - part) + tracks.xy[frame + 1] * part
    return Tracks.from_array(xy, size=tracks.size), truth


@pytest.mark.parametrize("drop", [0.0, 0.1, 0.3])
def test_motions_are_cut_apart_whatever_is_missing(drop: float) -> None:
    tracks, truth = smooth_motions()
    cut = Whole(Perturbation(drop=drop).apply(tracks, 0)).cut(2)
    assert cut is not None
    assert cut.labels.shape == truth.shape
    assert metrics.error(cut.labels, truth + 1) <= 1


@pytest.mark.parametrize(
    ("points", "frames", "motions", "told"),
    [(100, 15, 2, True), (100, 15, 1, False), (100, 15, 21, False), (9, 15, 2, False), (100, 2, 2, False)],
)
def test_where_nothing_can_be_told_there_is_no_cut(
    points: int, frames: int, motions: int, told: bool
) -> None:
    tracks = affine_motions(frames=15)[0].select(np.arange(points))
    few = replace(tracks, xy=tracks.xy[:frames], visible=tracks.visible[:frames])
    assert (Whole(few).cut(motions) is not None) == told


def test_a_cut_is_made_once() -> None:
    whole = Whole(affine_motions()[0])
    assert whole.cut(2) is whole.cut(2)
    assert whole.cut(2) is not whole.cut(3)


def test_the_true_groups_fit_best() -> None:
    tracks, truth = affine_motions((50, 40, 30))
    whole, rng = Whole(tracks), np.random.default_rng(0)
    true = whole.misfit(truth)
    assert true < 0.1  # the noise
    for share in (0.05, 0.2, 1.0):
        other = np.where(rng.random(len(truth)) < share, rng.integers(0, 3, len(truth)), truth)
        assert whole.misfit(other) > true
    assert whole.misfit(np.zeros_like(truth)) > 10 * true


def test_what_was_not_seen_does_not_count_in_the_fit() -> None:
    tracks, truth = affine_motions()
    visible = np.random.default_rng(0).random(tracks.visible.shape) > 0.2
    wild = np.where(visible[..., None], tracks.xy, 1e5)
    gaps = Whole(Tracks.from_array(wild, visible, size=tracks.size))
    assert gaps.misfit(truth) == pytest.approx(Whole(tracks).misfit(truth), rel=0.3)

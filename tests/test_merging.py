"""Algorithms 2 and 3: the predicate, the order of visits, and what follows without a test."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ifsvideo.segmentation import shear
from ifsvideo.segmentation.merging import merge_by_shear
from ifsvideo.types import Tracks

FRAMES = 6


def clusters(centres: list[tuple[float, float]], drift: list[float]) -> tuple[Tracks, np.ndarray]:
    """Clusters of points that jitter alike, each drifting upwards at its own speed (pixels a frame)."""
    rng, count = np.random.default_rng(0), 8
    time = np.arange(FRAMES)[:, None, None]
    xy = [
        np.array(centre) + rng.uniform(-8, 8, (count, 2)) + time * [0.0, -speed]
        for centre, speed in zip(centres, drift, strict=True)
    ]
    everything = np.concatenate(xy, axis=1) + rng.normal(0, 0.1, (FRAMES, count * len(centres), 2))
    return Tracks.from_array(everything), np.repeat(np.arange(len(centres)), count)


def merge(tracks: Tracks, segments: np.ndarray, ratio: float = 3.0, unit: float = 1.0) -> Any:
    """Group of each segment (list), and the scores (dict)."""
    groups, scores = merge_by_shear(tracks, segments, tracks.xy[0], 10, ratio, unit)
    first = [int(np.flatnonzero(segments == s)[0]) for s in range(segments.max() + 1)]
    assert all((groups[segments == s] == groups[f]).all() for s, f in enumerate(first))
    return [int(groups[f]) for f in first], scores


def test_what_moves_alike_merges_and_what_does_not_stays_apart() -> None:
    tracks, segments = clusters([(0, 0), (30, 0), (60, 0)], [1.0, 1.0, 5.0])
    assert merge(tracks, segments)[0] == [0, 0, 1]


def test_the_predicate_is_between_over_the_mean_inside() -> None:
    tracks, segments = clusters([(0, 0), (30, 0)], [1.0, 1.4])
    members = [np.flatnonzero(segments == s) for s in (0, 1)]
    inside = [shear.score(tracks, shear.inside_edges(tracks.xy[0], m)) for m in members]
    between = shear.score(tracks, shear.between_edges(tracks.xy[0], *members, 10))
    expected = between / (sum(inside) / 2)
    assert merge(tracks, segments)[1] == {(0, 1): pytest.approx(expected)}
    assert merge(tracks, segments, ratio=expected * 1.01)[0] == [0, 0]
    assert merge(tracks, segments, ratio=expected * 0.99)[0] == [0, 1]


def test_stretch_is_counted_in_pixels_of_the_configured_picture() -> None:
    tracks, segments = clusters([(0, 0), (30, 0)], [1.0, 1.4])
    large = Tracks.from_array(tracks.xy * 3)
    assert merge(large, segments, unit=3.0)[1][0, 1] == pytest.approx(merge(tracks, segments)[1][0, 1])


def test_likeness_is_handed_on() -> None:
    """a ~ b and b ~ c leave a and c, however far, together, and nobody asks."""
    tracks, segments = clusters([(0, 0), (30, 0), (65, 0)], [1.0, 1.0, 1.0])
    groups, scores = merge(tracks, segments)
    assert groups == [0, 0, 0]
    assert list(scores) == [(0, 1), (1, 2)]


def test_difference_is_handed_on() -> None:
    """a ~ b and b !~ c part a and c untested, even with c's own followers."""
    tracks, segments = clusters([(0, 0), (30, 0), (65, 0), (102, 0)], [1.0, 1.0, 6.0, 6.0])
    groups, scores = merge(tracks, segments)
    assert groups == [0, 0, 1, 1]
    assert list(scores) == [(0, 1), (1, 2), (2, 3)]


def test_neighbours_come_before_nearer_strangers() -> None:
    """0 and 1 are nearest but a row of points (2) lies between them; the row is the neighbour of both."""
    rng = np.random.default_rng(0)
    row = np.column_stack([np.full(40, 20.0), np.linspace(-150, 250, 40)])
    place = np.concatenate([rng.uniform(-8, 8, (8, 2)), rng.uniform(-8, 8, (8, 2)) + np.array([40, 0]), row])
    segments = np.repeat([0, 1, 2], [8, 8, 40])
    tracks = Tracks.from_array(place + rng.normal(0, 0.1, (FRAMES, 56, 2)))
    scores = merge(tracks, segments, ratio=1e-9)[1]  # nothing merges, so every pair is tested
    assert list(scores)[-1] == (0, 1)


def test_nearest_neighbours_come_first() -> None:
    tracks, segments = clusters([(0, 0), (80, 0), (110, 0)], [1.0, 1.0, 1.0])
    assert next(iter(merge(tracks, segments)[1])) == (1, 2)


def test_segments_of_one_point() -> None:
    tracks, segments = clusters([(0, 0), (30, 0)], [1.0, 1.0])
    xy = np.concatenate([tracks.xy, tracks.xy[:, :1] + [4, 4], tracks.xy[:, :1] * [1, 9]], axis=1)
    groups, _ = merge(Tracks.from_array(xy), np.concatenate([segments, [2, 3]]))
    assert groups[:3] == [0, 0, 0]
    assert groups[3] != 0


def test_segments_never_seen_together_stay_apart() -> None:
    tracks, segments = clusters([(0, 0), (30, 0)], [1.0, 1.0])
    xy = tracks.xy.copy()
    xy[:3, segments == 0] = np.nan
    xy[3:, segments == 1] = np.nan
    groups, _ = merge_by_shear(Tracks.from_array(xy), segments, tracks.xy[0], 10, 3.0, 1.0)
    assert groups.tolist() == segments.tolist()


@pytest.mark.parametrize("count", [1, 5])
def test_all_in_one_segment(count: int) -> None:
    tracks = Tracks.from_array(np.random.default_rng(0).uniform(0, 50, (4, count, 2)))
    groups, scores = merge_by_shear(tracks, np.zeros(count, np.int64), tracks.xy[0], 10, 3.0, 1.0)
    assert not groups.any()
    assert scores == {}


def test_only_single_points_and_no_motion_at_all() -> None:
    tracks = Tracks.from_array(np.repeat(np.random.default_rng(0).uniform(0, 50, (1, 5, 2)), 4, axis=0))
    groups, _ = merge_by_shear(tracks, np.arange(5), tracks.xy[0], 10, 3.0, 1.0)
    assert not groups.any()

"""Windows over a clip, and labels of tracks too short for their window."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.windows import follow_all_round, follow_neighbours, window_bounds
from ifsvideo.types import Tracks

CONFIG = ObjectsConfig()


@pytest.mark.parametrize("frames", [1, 2, 11, 12, 29, 30, 31, 44, 45, 46, 100, 901])
@pytest.mark.parametrize("fps", [None, 1.0, 5.0, 12.5, 30.0, 240.0])
def test_windows_cover_the_clip_and_overlap(frames: int, fps: float | None) -> None:
    bounds = window_bounds(frames, fps, CONFIG)
    assert bounds[0][0] == 0
    assert bounds[-1][1] == frames
    lengths = {stop - start for start, stop in bounds}
    assert len(lengths) == 1  # all alike, also the last
    length = lengths.pop()
    assert length <= max(CONFIG.window_frames, CONFIG.window_s * (fps or 0))
    for (start, stop), (following, end) in pairwise(bounds):
        assert start < following < end
        assert stop - following >= length // 2 - 4  # a multiple of the stride
    assert sorted(set(bounds)) == bounds


def test_no_frames_no_windows() -> None:
    assert window_bounds(0, 30.0, CONFIG) == []


def test_length_follows_the_rate_within_its_limits() -> None:
    def length(fps: float | None) -> int:
        start, stop = window_bounds(1000, fps, CONFIG)[0]
        return stop - start

    assert length(20.0) == round(20 * CONFIG.window_s)
    assert length(1.0) == CONFIG.least_frames
    assert length(1000.0) == pytest.approx(1000 * CONFIG.window_s, rel=0.02)
    assert length(None) == CONFIG.window_frames


def two_crowds() -> tuple[Tracks, np.ndarray]:
    """Two mixed crowds of 20, one standing (0), one moving right (1); four of each are seen briefly."""
    rng = np.random.default_rng(0)
    kind = np.repeat([0, 1], 20)
    start = rng.uniform(0, 60, (40, 2))
    xy = start + np.arange(20)[:, None, None] * np.array([3.0, 0.0]) * kind[:, None]
    visible = np.ones((20, 40), bool)
    visible[5:, np.arange(40) % 20 < 4] = False
    return Tracks.from_array(xy, visible), kind


def test_short_tracks_take_the_label_of_those_they_move_with() -> None:
    tracks, kind = two_crowds()
    decided = np.flatnonzero(tracks.visible.all(axis=0))
    labels = follow_neighbours(tracks, decided, kind[decided], 1.0)
    assert labels.tolist() == kind.tolist()


def test_the_decided_keep_their_labels_whatever_their_neighbours() -> None:
    tracks, kind = two_crowds()
    decided = np.flatnonzero(tracks.visible.all(axis=0))
    odd = kind[decided].copy()
    odd[0], odd[1] = 7, -1
    assert follow_neighbours(tracks, decided, odd, 1.0)[decided].tolist() == odd.tolist()


def test_without_neighbours_there_is_no_decision() -> None:
    tracks, kind = two_crowds()
    decided = np.flatnonzero(tracks.visible.all(axis=0))
    short = np.setdiff1d(np.arange(40), decided)
    undecided = np.full(len(decided), -1)
    assert (follow_neighbours(tracks, decided, undecided, 1.0) == -1).all()
    assert (follow_neighbours(tracks, decided[:0], kind[:0], 1.0) == -1).all()
    xy = tracks.xy.copy()
    xy[:5, decided] = np.nan  # never seen together
    apart = Tracks.from_array(xy)
    assert (follow_neighbours(apart, decided, kind[decided], 1.0)[short] == -1).all()


def test_a_single_sight_has_no_motion_to_compare() -> None:
    tracks, kind = two_crowds()
    xy = tracks.xy.copy()
    xy[1:, 0] = np.nan
    decided = np.flatnonzero(tracks.visible.all(axis=0))
    assert follow_neighbours(Tracks.from_array(xy), decided, kind[decided], 1.0)[0] == -1


def seen_once(label_of_the_last: int, far: float = 0.0, label: int = 0) -> int:
    """Label of a point that is seen once, in the middle of four tracks, three of which have a label."""
    around = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [9.0, 9.0], [4.0 + far, 5.0]])
    xy = np.repeat(around[None], 10, axis=0)
    visible = np.ones((10, 5), bool)
    visible[:, 4] = np.arange(10) == 7
    labels = np.array([label] * 3 + [label_of_the_last, -1])
    return int(follow_all_round(Tracks.from_array(xy, visible), labels, 1.0)[4])


def test_a_single_sight_is_what_is_all_round_it() -> None:
    assert seen_once(0) == 0
    assert seen_once(1) == -1  # not all agree
    assert seen_once(-1) == -1  # not all know
    assert seen_once(0, far=40.0) == -1  # they are far away


def test_beside_an_object_a_single_sight_is_not_part_of_it() -> None:
    assert seen_once(3, label=3) == 3
    assert seen_once(3, far=16.0, label=3) == -1
    assert seen_once(0, far=16.0, label=0) == 0


def test_an_objects_label_is_not_carried_far() -> None:
    place = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0], [2.0, 2.0], [500.0, 0.0]])
    xy = place + np.arange(10)[:, None, None] * np.array([2.0, 0.0])
    visible = np.ones((10, 5), bool)
    visible[5:, 4] = False
    tracks, decided = Tracks.from_array(xy, visible), np.arange(4)
    for label, expected in ((3, -1), (0, 0)):
        assert follow_neighbours(tracks, decided, np.full(4, label), 1.0)[4] == expected


def test_lengths_follow_the_unit() -> None:
    tracks, kind = two_crowds()
    decided = np.flatnonzero(tracks.visible.all(axis=0))
    large = Tracks.from_array(5 * tracks.xy)
    one, other = (follow_neighbours(t, decided, kind[decided], u) for t, u in ((tracks, 1.0), (large, 5.0)))
    assert one.tolist() == other.tolist()


def test_no_tracks() -> None:
    none = np.empty(0, np.int64)
    assert follow_neighbours(Tracks.from_array(np.empty((5, 0, 2))), none, none, 1.0).shape == (0,)

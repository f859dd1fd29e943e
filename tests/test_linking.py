"""Labels of windows become numbers that objects keep."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.objects.linking import Linker
from ifsvideo.types import Tracks


def window(ids: np.ndarray) -> Tracks:
    """Tracks that stand still, each at its own place."""
    return Tracks.from_array(np.tile(np.stack([ids, ids], axis=1), (4, 1, 1)), ids=ids)


def link(linker: Linker, labels: dict[range, int]) -> dict[range, set[int]]:
    """Link one window given as label of each range of ids; the numbers of each range."""
    ids = np.array([i for block in labels for i in block], dtype=np.int64)
    own = np.array([label for block, label in labels.items() for _ in block], dtype=np.int64)
    linked = linker.link(window(ids), own)
    number = dict(zip(ids.tolist(), linked.tolist(), strict=True))
    return {block: {number[i] for i in block} for block in labels}


A, B, C = range(10), range(10, 20), range(20, 30)


def test_objects_keep_their_numbers_when_windows_name_them_otherwise() -> None:
    linker = Linker(3)
    assert link(linker, {A: 1, B: 2, C: 0}) == {A: {1}, B: {2}, C: {0}}
    assert link(linker, {A: 2, B: 1, C: 0}) == {A: {1}, B: {2}, C: {0}}
    assert link(linker, {A: 7, B: 4}) == {A: {1}, B: {2}}


def test_number_passes_on_from_track_to_track() -> None:
    """After three windows not one track of the first is left."""
    linker = Linker(3)
    link(linker, {range(10): 1})
    for start in (5, 10, 15, 20):
        block = range(start, start + 10)
        assert link(linker, {block: 3}) == {block: {1}}


def test_too_few_shared_tracks_make_a_new_object() -> None:
    linker = Linker(3)
    link(linker, {A: 1})
    assert link(linker, {range(8, 18): 1}) == {range(8, 18): {2}}
    linker = Linker(3)
    link(linker, {A: 1})
    assert link(linker, {range(7, 17): 1}) == {range(7, 17): {1}}


def test_of_a_split_the_larger_part_keeps_the_number() -> None:
    linker = Linker(3)
    link(linker, {A: 1})
    small, large = range(4), range(4, 10)
    assert link(linker, {small: 1, large: 2}) == {small: {2}, large: {1}}


def test_of_a_merger_the_larger_parts_number_stays() -> None:
    linker = Linker(3)
    few = range(4)
    link(linker, {few: 1, B: 2})
    both = range(20)
    assert link(linker, {both: 1}) == {both: {2}}


def test_most_tracks_in_all_keep_their_number() -> None:
    """One to one: the greedy choice for the first label would cost the second its only partner."""
    linker = Linker(3)
    link(linker, {range(9): 1, range(9, 17): 2})
    # The first label shares 5 with 1 and 4 with 2, the second 4 with 1 and none with 2.
    one = [*range(5), *range(9, 13)]
    ids = np.array([*one, 5, 6, 7, 8], dtype=np.int64)
    found = linker.link(window(ids), np.repeat([1, 2], [9, 4]))
    assert found.tolist() == [2] * 9 + [1] * 4


def test_a_number_is_never_used_again() -> None:
    linker = Linker(3)
    seen: set[int] = set()
    for window in range(5):
        block = range(100 * window, 100 * window + 10)
        (number,) = link(linker, {block: 1})[block]
        assert number not in seen
        seen.add(number)


def test_a_track_counts_for_the_object_that_most_windows_gave_it_to() -> None:
    linker = Linker(3)
    few = range(5)
    link(linker, {few: 1, range(5, 10): 1, B: 2})
    for _ in range(2):
        # Too few tracks for an object of their own to be kept apart in the other.
        link(linker, {range(2): 2, range(2, 10): 1, B: 2})
    assert linker.number_of(0) == 2
    assert linker.number_of(3) == 1


def test_two_objects_taken_for_one_in_a_window_get_their_numbers_back() -> None:
    linker = Linker(3)
    link(linker, {A: 1, B: 2})
    link(linker, {A: 1, B: 2})
    link(linker, {A: 1, B: 1})
    assert link(linker, {A: 1, B: 2}) == {A: {1}, B: {2}}


def test_an_object_that_rests_for_a_window_is_known_again() -> None:
    linker = Linker(3)
    link(linker, {A: 1})
    assert link(linker, {A: 0}) == {A: {0}}
    assert link(linker, {A: 1, B: 2}) == {A: {1}, B: {2}}


def test_background_and_no_decision_stay() -> None:
    linker = Linker(1)
    assert link(linker, {A: 0, B: -1}) == {A: {0}, B: {-1}}
    assert link(linker, {A: -1, B: 0}) == {A: {-1}, B: {0}}


@pytest.mark.parametrize("before", [False, True])
def test_an_empty_window(before: bool) -> None:
    linker = Linker(3)
    if before:
        link(linker, {A: 1})
    assert linker.link(window(np.empty(0, np.int64)), np.empty(0, np.int64)).shape == (0,)


def test_objects_known_apart_are_not_made_one_by_a_window_that_mixes_them() -> None:
    linker = Linker(3)
    for _ in range(2):
        link(linker, {A: 1, B: 2})
    both = link(linker, {A: 1, B: 1, range(30, 33): 1, C: 0})
    # New tracks take the number of the nearest that is known.
    assert both == {A: {1}, B: {2}, range(30, 33): {2}, C: {0}}


def test_what_fell_apart_in_a_single_window_grows_together_again() -> None:
    linker = Linker(3)
    link(linker, {range(20): 1})
    link(linker, {A: 1, B: 2})
    assert link(linker, {range(20): 1}) == {range(20): {1}}


def test_movers_are_what_windows_could_decide_of() -> None:
    linker = Linker(least_shared=3)
    tracks = window(range(6))
    linker.link(tracks, np.array([1, 1, 1, 1, 0, 0]), np.array([True, True, True, False, True, True]))
    assert sorted(linker.movers()) == [0, 1, 2]
    linker.forget(np.array([1]))
    assert sorted(linker.movers()) == [0, 2]


def test_what_follows_its_neighbours_is_no_evidence() -> None:
    """Tracks that a window could not decide of take the label of others, and do not pass their number on."""
    linker = Linker(3)
    link(linker, {A: 1, B: 2})
    ids = np.arange(30)
    decided = ids < 20
    both = np.where(ids < 10, 1, 2)
    assert linker.link(window(ids), both, decided)[20:].tolist() == [2] * 10
    assert linker.number_of(25) == 2
    # Now they are seen to be something else, and nothing of what was guessed is left.
    assert set(linker.link(window(ids), np.where(ids < 20, both, 3))[20:].tolist()) == {3}
    assert linker.number_of(25) == 3


def gone_and_back(frames_between: int, step: float, place: float = 0.0) -> set[int]:
    """Numbers of an object that moves on by a pixel a frame, is lost, and is found with new tracks."""
    linker = Linker(3, longest_loss=20)

    def seen(ids: range, begin: int, start: float, velocity: float) -> Tracks:
        first = np.array(ids)[:, None] % 10 * [3.0, 1.0] + [start, 50.0]
        xy = first + velocity * np.arange(12)[:, None, None] * [1.0, 0.0]
        return Tracks.from_array(xy, ids=np.array(ids), size=(640, 480))

    ones = np.ones(10, np.int64)
    assert set(linker.link(seen(A, 0, 100.0, 1.0), ones).tolist()) == {1}
    begin = 12 + frames_between
    tracks = seen(B, begin, 100.0 + begin + place, step)
    return set(linker.link(tracks, ones, start=begin).tolist())


def test_what_was_hidden_for_a_moment_is_the_same() -> None:
    assert gone_and_back(8, 1.0) == {1}


@pytest.mark.parametrize(
    ("frames_between", "step", "place"),
    [(30, 1.0, 0.0), (8, -2.0, 0.0), (8, 1.0, 80.0)],
    ids=["too long", "another motion", "another place"],
)
def test_what_comes_back_too_late_or_otherwise_is_another(
    frames_between: int, step: float, place: float
) -> None:
    assert gone_and_back(frames_between, step, place) == {2}


def test_an_object_in_sight_is_not_lost_though_a_window_misses_it() -> None:
    linker = Linker(3, longest_loss=20)
    ids = np.arange(20)
    tracks = window(ids)
    linker.link(tracks, np.where(ids < 10, 1, 0))
    found = linker.link(tracks, np.where(ids < 10, 0, 1), start=4)
    assert set(found[10:].tolist()) == {2}


def test_an_object_is_as_sure_as_its_surest_windows() -> None:
    linker = Linker(3)
    ids, ones = np.arange(5), np.ones(5, np.int64)
    linker.link(window(ids), ones, None, np.full(5, 0.7))
    assert linker.surest(1) == pytest.approx(0.7)
    assert linker.surest(1, 2) == 0.0
    for confidence in (0.9, 0.8):
        linker.link(window(ids), ones, None, np.full(5, confidence))
    assert linker.surest(1) == pytest.approx(0.9)
    # Odds of 9 and 4 are in the mean, of their logarithms, odds of 6.
    assert linker.surest(1, 2) == pytest.approx(6 / 7)
    assert linker.surest(2) == 0.0
    linker.link(window(ids), ones)
    assert linker.surest(1) == pytest.approx(1.0)
    linker.link(window(ids), ones, None, np.zeros(5))
    assert linker.surest(1) == pytest.approx(1.0)


def guessed_from(linker: Linker, ids: np.ndarray, labels: np.ndarray, decided: range) -> list[int]:
    """Numbers of a window's tracks, of which it could decide of some alone."""
    return linker.link(window(ids), labels, np.isin(ids, decided)).tolist()


def test_where_too_few_decided_tracks_are_shared_those_that_follow_tell() -> None:
    """Where the picture moves fast few tracks last for two windows; but two objects that meet have short ones
    in common, so that one at least must be sure."""
    for firm, number in ((1, 1), (0, 2)):
        linker = Linker(3)
        guessed_from(linker, np.arange(12), np.ones(12, int), range(6))
        second = np.arange(4, 16)
        assert guessed_from(linker, second, np.ones(12, int), range(6 - firm, 16)) == [number] * 12


def test_nor_do_they_tell_where_most_of_them_stand() -> None:
    """Of a car that a window takes for the world a few tracks ride along with the houses."""
    linker = Linker(3)
    car, both = np.arange(12), np.concatenate([np.arange(12), np.arange(20, 40)])
    guessed_from(linker, car, np.ones(12, int), range(12))
    labels = np.where(np.isin(both, range(4, 12)), 0, 1)
    assert guessed_from(linker, both, labels, range(3, 40))[-1] == 2


def test_nor_where_they_are_scattered() -> None:
    """Of an object that a window gives to three others alike none is the same."""
    linker = Linker(3)
    guessed_from(linker, np.arange(12), np.ones(12, int), range(12))
    labels = np.repeat([1, 2, 3], 4)
    firm = [0, 4, 8]
    assert 1 not in linker.link(window(np.arange(12)), labels, np.isin(np.arange(12), firm)).tolist()

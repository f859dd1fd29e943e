"""What linked windows say of points."""

from __future__ import annotations

import numpy as np

from ifsvideo.objects.linked import LinkedWindow

IDS = np.array([2, 3, 5, 8])


def window(labels: list[int], decided: list[bool] | None = None, ids: np.ndarray = IDS) -> LinkedWindow:
    sure = np.ones(len(labels), bool) if decided is None else np.array(decided)
    return LinkedWindow((0, 30), ids, np.array(labels), sure)


def test_points_have_the_labels_of_their_tracks_and_others_none() -> None:
    labels, guessed = window([0, 1, -1, 2], [True, False, True, True]).say_of(
        np.array([1, 2, 3, 8, 9]), None, None
    )
    assert labels.tolist() == [-1, 0, 1, 2, -1]
    assert guessed.tolist() == [True, False, True, False, True]


def test_what_moves_before_and_after_moves_in_between() -> None:
    before, between, after = window([1, 1, 1, 0]), window([0, -1, 2, 0]), window([1, 1, 1, 1])
    assert between.say_of(IDS, before, after)[0].tolist() == [1, 1, 2, 0]


def test_what_stands_before_and_after_stands_in_between() -> None:
    before, between, after = window([0, 0, -1, 0]), window([1, 2, 1, -1]), window([0, 1, -1, 0])
    assert between.say_of(IDS, before, after)[0].tolist() == [0, 2, 1, -1]
    guessed = window([0, 0, 0, 0], [False, True, True, True])
    assert between.say_of(IDS, before, guessed)[0].tolist() == [1, 0, 1, -1]


def test_neither_side_alone_nor_two_objects_nor_a_guess_is_enough() -> None:
    between, other = window([0, 0, 0, 0]), window([1, 2, 1, 1])
    one = window([1, 1, 1, 1], [True, True, False, True])
    less = window([1, 1, 1], ids=IDS[:3])
    assert between.say_of(IDS, one, None)[0].tolist() == [0, 0, 0, 0]
    assert between.say_of(IDS, None, one)[0].tolist() == [0, 0, 0, 0]
    assert between.say_of(IDS, one, other)[0].tolist() == [1, 0, 0, 1]
    assert between.say_of(IDS, less, other)[0].tolist() == [1, 0, 1, 0]


def test_a_window_that_took_an_object_for_the_world_is_denied() -> None:
    """Where those before and after agree of enough tracks, and it says otherwise of most."""
    ids = np.arange(40)
    world, turned = [0] * 25 + [1] * 15, [2] * 25 + [0] * 15
    right, wrong = window(world, ids=ids), window(turned, ids=ids)
    assert wrong.is_denied_by(right, right)
    assert not right.is_denied_by(right, right)
    assert not right.is_denied_by(right, wrong)
    a_part = window([0] * 25 + [0] * 15, ids=ids)
    assert not a_part.is_denied_by(right, right)
    few = window(world[:19], ids=ids[:19])
    assert not wrong.is_denied_by(few, few)
    guessed = window(world, [False] * 40, ids=ids)
    assert not wrong.is_denied_by(guessed, right)
    assert not window(turned, [False] * 40, ids=ids).is_denied_by(right, right)


def test_an_object_most_of_whose_tracks_stood_before_and_after_is_none() -> None:
    """Nor are those of its tracks which only one of the two has seen, or neither."""
    ids = np.arange(30)
    between = window([1] * 28 + [2, 0], ids=ids)
    # Decided before: that 22 moves, 23 stands; guessed: 24. After: that 24, 25 stand; guessed: 26.
    before = window([0] * 20 + [0, 0, 3, 0, 3], [True] * 24 + [False], ids=ids[:25])
    after = window([0] * 20 + [0, 0, 0], [True] * 22 + [False], ids=np.array([*range(20), 24, 25, 26]))
    labels, guessed = between.say_of(ids, before, after)
    assert labels.tolist() == [0] * 20 + [0, 0, 3, 0, 0, 0, 0, -1, 2, 0]
    assert np.flatnonzero(guessed).tolist() == [26, 27]

    few = window([0] * 19, ids=ids[:19])
    assert between.say_of(ids, few, few)[0].tolist() == [0] * 19 + [1] * 9 + [2, 0]
    half = window([0] * 13 + [1] * 13, ids=ids[:26])
    assert between.say_of(ids, half, half)[0].tolist() == [0] * 13 + [1] * 15 + [2, 0]

"""Final numbers: in the order of appearance, without gaps, and only for what lives long enough."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest

from ifsvideo.objects.numbering import Numbers


def settled(numbers: Numbers, labels: list[list[int]], final: int, start: int = 0) -> list[list[int]]:
    arrays = [np.array(own, np.int64) for own in labels]
    return [own.tolist() for own in numbers.settle(arrays, range(start, start + len(labels)), final)]


def test_numbers_follow_the_first_sight() -> None:
    labels = [[-1, 0, 7, 9], [3, 7], [3, 7], [9, 0]]
    assert settled(Numbers(count(1), 2), labels, 4) == [[-1, 0, 1, 2], [3, 1], [3, 1], [2, 0]]


@pytest.mark.parametrize(("least", "number"), [(5.0, 1), (5.5, 0)])
def test_what_lives_too_short_is_background(least: float, number: int) -> None:
    labels = [[4], [-1], [0], [0], [4]]
    assert settled(Numbers(count(1), least), labels, 5) == [[number], [-1], [0], [0], [number]]


def test_what_comes_later_counts_but_is_not_numbered_yet() -> None:
    numbers = Numbers(count(1), 3)
    assert settled(numbers, [[5], [5, 8], [5, 8], [8]], 1) == [[1]]
    # Known by now, the first object keeps its number, however little of it is to come.
    assert settled(numbers, [[5, 8], [8], [8], [6], [6], [6]], 4, start=1) == [[1, 2], [2], [2], [3]]


def test_parts_of_a_clip_share_the_numbers() -> None:
    following = count(1)
    assert settled(Numbers(following, 1), [[4]], 1) == [[1]]
    assert settled(Numbers(following, 1), [[4]], 1) == [[2]]


def test_nothing_to_number() -> None:
    assert settled(Numbers(count(1), 1), [], 0) == []
    assert settled(Numbers(count(1), 1), [[], [0, -1]], 2) == [[], [0, -1]]

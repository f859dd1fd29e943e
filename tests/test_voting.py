"""Segmentations that are sure, or found twice, and what is taken where none is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ifsvideo.segmentation.voting import difference, voted
from ifsvideo.types import Segmentation

ONE, TWO = [0] * 10, [0] * 5 + [1] * 5
ODD = [0] * 9 + [1]


def segmentation(labels: list[int], doubt: float | None) -> Segmentation:
    array = np.array(labels, dtype=np.int64)
    details = {} if doubt is None else {"doubt": doubt}
    return Segmentation(array, array == 0, array, np.ones(len(array)), details)


def runs(*labels: list[int], doubt: float | None = 0.4) -> Callable[[], Segmentation]:
    """One of them with each call; it fails if there are more."""
    left = iter([segmentation(each, doubt) for each in labels])
    return lambda: next(left)


@pytest.mark.parametrize("doubt", [None, 0.0, 0.05])
def test_what_is_sure_stands(doubt: float | None) -> None:
    assert voted(runs(TWO, doubt=doubt), 5).labels.tolist() == TWO


def test_what_is_the_same_twice_stands() -> None:
    assert voted(runs(TWO, [1 - label for label in TWO]), 5).labels.tolist() == TWO


def test_one_vote_is_one_run() -> None:
    assert voted(runs(TWO), 1).labels.tolist() == TWO


def test_what_is_found_again_is_taken() -> None:
    assert voted(runs(ONE, TWO, TWO), 5).labels.tolist() == TWO
    assert voted(runs(TWO, ONE, [0] * 7 + [1] * 3, TWO), 5).labels.tolist() == TWO


def test_where_none_is_that_between_all_is_taken() -> None:
    middle = [0] * 7 + [1] * 3
    assert voted(runs(TWO, middle, ODD), 3).labels.tolist() == middle
    assert voted(runs(ODD, TWO, middle), 3).labels.tolist() == middle


def test_a_point_in_sixty_makes_no_difference_and_one_in_ten_does() -> None:
    one = 6 * TWO
    assert voted(runs(one, [1, *one[1:]]), 5).labels.tolist() == one
    assert voted(runs([1, *TWO[1:]], TWO, TWO), 5).labels.tolist() == TWO


def test_no_more_runs_are_made_than_asked_for() -> None:
    made: list[list[int]] = []

    def segment() -> Segmentation:
        made.append([0] * (9 - 2 * len(made)) + [1] * (1 + 2 * len(made)))
        return segmentation(made[-1], 0.5)

    voted(segment, 4)
    assert len(made) == 4


@pytest.mark.parametrize(
    ("one", "other", "share"),
    [
        (TWO, TWO, 0.0),
        (TWO, [3 - label for label in TWO], 0.0),
        (ONE, TWO, 0.5),
        (TWO, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 0.8),
        (TWO, [-1] * 5 + [1] * 4 + [0], 0.1),
        ([], [], 0.0),
    ],
)
def test_difference_is_the_share_that_no_renaming_makes_alike(
    one: list[int], other: list[int], share: float
) -> None:
    arrays = np.array(one, dtype=np.int64), np.array(other, dtype=np.int64)
    assert difference(*arrays) == pytest.approx(share)
    assert difference(*arrays[::-1]) == pytest.approx(share)

"""Segmentations that a cut of all points confirms, corrects or replaces, and what is taken where none is."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ifsvideo.segmentation.shape_interaction import Cut
from ifsvideo.segmentation.voting import difference, voted
from ifsvideo.segmentation.whole import Whole
from ifsvideo.types import Segmentation

ONE = [0] * 60
TWO, OTHER = [0] * 30 + [1] * 30, [0] * 20 + [1] * 40
THREE = [0] * 30 + [1] * 20 + [2] * 10


class Cuts:
    """The whole as a test has it: its cuts by number, their uncertainty, and what fits badly."""

    def __init__(self, *cuts: list[int], uncertainty: dict[int, float] | None = None) -> None:
        self.cuts = {len(set(labels)): np.array(labels, dtype=np.int64) for labels in cuts}
        self.uncertainty = uncertainty or {}
        self.affine: list[int] | None = None
        self.noisy = False
        self.asked: list[int] = []

    def cut(self, motions: int) -> Cut | None:
        self.asked.append(motions)
        if motions not in self.cuts:
            return None
        return Cut(self.cuts[motions], self.uncertainty.get(motions, 1.0))

    def misfit(self, labels: np.ndarray) -> float:
        """How far it is from what fits an affine camera."""
        return 0.0 if self.affine is None else difference(labels, np.array(self.affine))


class Rigid:
    """Where the world of some points explains them if all are of one of the groups of a labelling."""

    def __init__(self, true: list[int]) -> None:
        self.true = np.array(true)

    def fitted_to(self, points: np.ndarray) -> SimpleNamespace:
        most = np.bincount(self.true[points]).argmax()
        error = np.where(self.true == most, 0.1, 50.0)
        return SimpleNamespace(rms=3 * error, tolerance=np.full(len(error), 3.0))


def segmentation(
    labels: list[int], doubt: float | None, apart: float = 0.999, world: Rigid | None = None
) -> Segmentation:
    array, groups = np.array(labels, dtype=np.int64), max(labels, default=0) + 1
    details = {"doubt": doubt, "apart": np.full((groups, groups), apart), "world": world}
    return Segmentation(array, array == 0, array, 0.1 * (5 + array), {} if doubt is None else details)


def runs(
    *labels: list[int], doubt: float | None = 0.4, apart: float = 0.999, true: list[int] | None = None
) -> Callable[[], Segmentation]:
    """One of them with each call; it fails if there are more."""
    world = None if true is None else Rigid(true)
    left = iter([segmentation(each, doubt, apart, world) for each in labels])
    return lambda: next(left)


def chosen(
    segment: Callable[[], Segmentation], votes: int, whole: Cuts | None = None, motions: int | None = None
) -> list[int]:
    found = voted(segment, votes, cast(Whole, whole or Cuts()), motions)
    return cast(list[int], found.labels.tolist())


@pytest.mark.parametrize("doubt", [None, 0.0, 0.05])
def test_what_is_sure_stands(doubt: float | None) -> None:
    assert chosen(runs(TWO, doubt=doubt), 5) == TWO


@pytest.mark.parametrize("cut", [TWO, [1 - label for label in TWO], [1, *TWO[1:]]])
def test_what_is_confirmed_stands(cut: list[int]) -> None:
    assert chosen(runs(TWO), 5, Cuts(cut)) == TWO


@pytest.mark.parametrize("votes", [0, 1])
def test_one_vote_is_one_run_and_asks_nothing(votes: int) -> None:
    whole = Cuts(OTHER)
    assert chosen(runs(TWO), votes, whole) == TWO
    assert not whole.asked


def test_without_a_doubt_nothing_is_asked() -> None:
    whole = Cuts(OTHER)
    assert chosen(runs(TWO, doubt=None, true=OTHER), 5, whole) == TWO
    assert not whole.asked


def test_the_first_that_is_confirmed_is_taken() -> None:
    assert chosen(runs(ONE, THREE, OTHER, TWO), 5, Cuts(TWO)) == TWO


def test_what_is_found_again_is_taken() -> None:
    assert chosen(runs(ONE, OTHER, THREE, [1 - label for label in OTHER]), 5, Cuts(TWO)) == OTHER


def test_where_none_is_that_between_all_is_taken() -> None:
    middle = [0] * 25 + [1] * 35
    assert chosen(runs(OTHER, TWO, middle), 3) == middle


def test_a_point_or_one_in_fifty_makes_no_difference_and_one_in_twenty_does() -> None:
    assert chosen(runs(TWO), 5, Cuts([1, *TWO[1:]])) == TWO
    small, other = [0] * 10 + [1] * 10, [0] * 9 + [1] * 11
    assert chosen(runs(small), 5, Cuts(other)) == small
    assert chosen(runs(5 * small, 5 * other), 5, Cuts(5 * other)) == 5 * other
    large = 10 * TWO
    assert chosen(runs(large), 5, Cuts([1] * 12 + large[12:])) == large
    thirteenth = [1] * 13 + large[13:]
    assert chosen(runs(large, thirteenth), 5, Cuts(thirteenth)) == thirteenth


@pytest.mark.parametrize(
    ("doubt", "made"),
    [(0.05, [TWO]), (0.4, [TWO, ONE, TWO]), (0.4, [TWO, [0] * 40 + [1] * 20, [0] * 10 + [1] * 50])],
)
def test_where_the_cut_into_as_many_motions_fits_better_it_is_taken(
    doubt: float, made: list[list[int]]
) -> None:
    """Instead of what is sure, found again, or in the middle."""
    whole = Cuts([1 - label for label in OTHER])
    for affine, perspective in ((None, OTHER), (TWO, OTHER), (OTHER, TWO), (OTHER, None)):
        whole.affine = affine
        assert chosen(runs(*made, doubt=doubt, true=perspective), 3, whole) == TWO
    whole.affine = OTHER
    found = voted(runs(*made, doubt=doubt, true=OTHER), 3, cast(Whole, whole))
    assert found.labels.tolist() == OTHER
    assert chosen(runs(*made, doubt=doubt, true=OTHER), 3, whole, motions=2) == TWO
    # As sure as the group that they go to.
    assert found.confidence == pytest.approx(0.1 * (5 + np.array(OTHER)))


@pytest.mark.parametrize(
    ("apart", "fewer", "joined"),
    [
        (0.6, 1.0, True),
        (0.96, 1.0, False),
        # How certain the cuts are weighs as much.
        (0.96, 0.5, True),
        (0.6, 100.0, False),
    ],
)
def test_two_parts_that_a_cut_has_as_one_are_one_unless_surely_apart(
    apart: float, fewer: float, joined: bool
) -> None:
    whole = Cuts(TWO, THREE, uncertainty={2: fewer})
    assert chosen(runs(THREE, apart=apart), 5, whole) == (TWO if joined else THREE)


@pytest.mark.parametrize(
    ("apart", "fewer", "joined"), [(0.4, 1.0, True), (0.6, 1.0, False), (0.6, 0.5, True), (0.4, 2.0, False)]
)
def test_in_noise_two_parts_are_one_only_where_that_is_likelier(
    apart: float, fewer: float, joined: bool
) -> None:
    whole = Cuts(TWO, THREE, uncertainty={2: fewer})
    whole.noisy = True
    assert chosen(runs(THREE, apart=apart), 5, whole) == (TWO if joined else THREE)


def test_parts_are_joined_though_the_cut_into_as_many_is_another() -> None:
    whole = Cuts(TWO, [0] * 10 + [1] * 20 + [2] * 30)
    assert chosen(runs(THREE, apart=0.6), 5, whole) == TWO


def test_what_is_joined_is_the_ground_s_or_a_mover_numbered_by_size() -> None:
    four = [0] * 20 + [1] * 18 + [2] * 12 + [3] * 10
    second = [0] * 20 + [2] * 18 + [1] * 22
    ground = [0] * 20 + [1] * 18 + [0] * 12 + [2] * 10
    for cut, expected in ((ground, ground), ([0] * 20 + [1] * 18 + [2] * 22, second)):
        found = voted(runs(four, apart=0.6), 5, cast(Whole, Cuts(cut, four)))
        assert found.labels.tolist() == expected
        assert found.details["apart"].shape == (3, 3)


def test_more_than_one_part_may_be_joined() -> None:
    four = [0] * 20 + [1] * 10 + [2] * 20 + [3] * 10
    three = [0] * 30 + [1] * 20 + [2] * 10
    assert chosen(runs(four, apart=0.6), 5, Cuts(four, three, TWO)) == TWO


def test_none_are_joined_where_the_number_is_known_or_sure() -> None:
    whole = Cuts(TWO, THREE)
    assert chosen(runs(THREE, apart=0.6), 5, whole, motions=3) == THREE
    assert chosen(runs(THREE, doubt=0.01, apart=0.6), 5, whole) == THREE


def test_no_more_runs_are_made_than_asked_for() -> None:
    made: list[list[int]] = []

    def segment() -> Segmentation:
        made.append([0] * (50 - 10 * len(made)) + [1] * (10 + 10 * len(made)))
        return segmentation(made[-1], 0.5)

    voted(segment, 4, cast(Whole, Cuts([0, 1] * 30)))
    assert len(made) == 4


@pytest.mark.parametrize(
    ("one", "other", "share"),
    [
        (TWO, TWO, 0.0),
        (TWO, [3 - label for label in TWO], 0.0),
        (ONE, TWO, 0.5),
        ([0] * 5 + [1] * 5, list(range(10)), 0.8),
        ([0] * 5 + [1] * 5, [-1] * 5 + [1] * 4 + [0], 0.1),
        ([0] * 6 + [1] * 4, [-1] * 10, 0.4),
        ([], [], 0.0),
    ],
)
def test_difference_is_the_share_that_no_renaming_makes_alike(
    one: list[int], other: list[int], share: float
) -> None:
    arrays = np.array(one, dtype=np.int64), np.array(other, dtype=np.int64)
    assert difference(*arrays) == pytest.approx(share)
    assert difference(*arrays[::-1]) == pytest.approx(share)

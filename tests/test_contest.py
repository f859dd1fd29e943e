"""Parts that the static world keeps though a mover predicts them better."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ifsvideo.segmentation.agglomeration import Window
from ifsvideo.segmentation.contest import contested
from ifsvideo.segmentation.cues import Cues
from ifsvideo.segmentation.world import World, fit_world
from tests.scenes import SIZE, Camera, Mover, Scene, make_scene

SLOW = Mover((-1.0, 0.3, 12.0), (0.06, 0.0, 0.02), extent=(5.0, 3.0, 3.0), points=80)
OTHER = Mover((3.5, 0.3, 12.0), (-0.3, 0.0, 0.4), points=40)
REACH = 50.0


class Case:
    """A scene, its worlds and its segments: the ground in four quarters, each mover in two halves."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.truth, place = scene, scene.truth, scene.tracks.xy[0]
        world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
        assert world is not None
        self.world: World = world
        quarter = (place > np.array(SIZE) / 2) @ [1, 2]
        centre = np.array([np.median(place[scene.truth == t, 0]) for t in scene.truth])
        self.right = (scene.truth > 0) & (place[:, 0] > centre)
        segments = np.where(scene.truth > 0, 2 + 2 * scene.truth + self.right, quarter)
        explained = np.ones(len(segments), dtype=bool)
        self.window = Window(np.unique(segments, return_inverse=True)[1], explained, SIZE)
        self.cues = Cues(scene.tracks, place, world.evidence(5.0), world.nearness, 1.0, 10)
        self.cues.groups(self.window.parts())

    def settled(self, labels: np.ndarray, reach: float = REACH) -> np.ndarray:
        return self.scored(labels, reach)[0]

    def scored(self, labels: np.ndarray, reach: float = REACH) -> tuple[np.ndarray, np.ndarray]:
        sure = np.where(labels > 0, 0.7, 1.0)
        return contested(labels, sure, self.window, self.world, self.cues, reach)


@pytest.fixture(scope="module")
def case() -> Case:
    return Case(make_scene(Camera.path(step=(0.25, 0.0, 0.1)), (SLOW, OTHER), seed=3))


@pytest.mark.parametrize("mover", [1, 2])
def test_the_half_of_a_mover_that_the_ground_keeps_goes_back_to_it(case: Case, mover: int) -> None:
    labels = np.where((case.truth == mover) & case.right, 0, case.truth)
    before = labels.copy()
    settled, confidence = case.scored(labels)
    assert np.array_equal(settled, case.truth)
    assert np.array_equal(labels, before)
    assert (confidence[case.truth == mover] == 0.7).all()
    assert (confidence[case.truth == 0] == 1).all()


def test_what_is_right_stays_as_it_is(case: Case) -> None:
    assert np.array_equal(case.settled(case.truth), case.truth)


def test_a_mover_does_not_take_what_moves_otherwise(case: Case) -> None:
    labels = np.where(case.truth == 2, 0, case.truth)
    assert np.array_equal(case.settled(labels), labels)


def test_out_of_reach_nothing_is_taken(case: Case) -> None:
    labels = np.where((case.truth == 1) & case.right, 0, case.truth)
    assert np.array_equal(case.settled(labels, reach=0.0), labels)


def test_a_few_points_predict_nothing(case: Case) -> None:
    """Nine points of a half: their world follows their noise."""
    left = (case.truth == 1) & ~case.right
    few = left & (np.cumsum(left) <= 9)
    labels = np.where((case.truth == 1) & ~few, 0, case.truth)
    settled = case.settled(labels)
    assert not settled[(case.truth == 1) & ~few].any()


def test_what_was_won_helps_to_win_the_next_part() -> None:
    """A chain of segments, each within reach of the one before alone."""
    scene = make_scene(Camera.path(step=(0.25, 0.0, 0.1)), (SLOW,), seed=4)
    case = Case(scene)
    place = scene.tracks.xy[0][:, 0]
    third = np.digitize(place, np.quantile(place[scene.truth == 1], [1 / 3, 2 / 3]))
    # The far end comes first, and has to wait for the middle.
    segments = np.where(scene.truth == 1, 2 - third, 3)
    case.window = Window(segments, np.ones(len(segments), dtype=bool), SIZE)
    labels = np.where((scene.truth == 1) & (third == 0), 1, 0)
    ends = [place[(scene.truth == 1) & (third == t)] for t in range(3)]
    reach = 0.9 * (ends[2].min() - ends[0].max())
    assert ends[1].min() - ends[0].max() < reach
    assert np.array_equal(case.settled(labels, reach=reach), scene.truth)


def test_without_movers_there_is_no_contest(case: Case) -> None:
    labels = np.zeros_like(case.truth)
    assert not case.settled(labels).any()


GROUND, FIRST, SECOND, MOVER = (np.arange(start, start + 10) for start in (0, 10, 20, 30))


@dataclass(frozen=True)
class Told:
    """Worlds whose errors are told: of the first part and the second in the mover's world, once it has the
    first of the second, of the first in the ground's that it is fitted to, and in the ground's without it."""

    first: float = 0.3
    second: float = 9.0
    later: float = 9.0
    kept: float = 0.3
    without: float = 0.4

    def fitted_to(self, points: np.ndarray) -> SimpleNamespace:
        error = np.full(40, 0.2)
        has_first = FIRST[0] in points
        if MOVER[0] in points:
            error[FIRST], error[SECOND] = self.first, self.later if has_first else self.second
        else:
            error[FIRST] = self.kept if has_first else self.without
            error[SECOND] = 0.3 if SECOND[0] in points else 0.4
        return SimpleNamespace(rms=error, tolerance=np.ones(40))


def settled_as_told(told: Told) -> np.ndarray:
    near = SimpleNamespace(anchor=np.zeros((40, 2)), noise=0.1)
    near.group = lambda *_: SimpleNamespace(rigid=np.full(40, 0.1))
    window = Window(np.repeat([0, 1, 2, 3], 10), np.ones(40, dtype=bool), SIZE)
    labels = np.repeat([0, 0, 0, 1], 10)
    return contested(labels, np.ones(40), window, cast(World, told), cast(Cues, near), REACH)[0]


@pytest.mark.parametrize(
    ("told", "taken"),
    [
        (Told(), [FIRST]),
        (Told(without=0.25), []),  # the ground that was not fitted to it predicts it better
        (Told(first=0.6, without=0.7), []),  # worse than a part of the mover can be
        (Told(kept=0.09), []),  # the ground fits it too well to be in doubt
        (Told(later=0.3), [FIRST, SECOND]),  # the first part helps to win the second
    ],
)
def test_a_part_goes_where_it_is_predicted_better(told: Told, taken: list[np.ndarray]) -> None:
    won = np.flatnonzero(settled_as_told(told)[:30])
    assert won.tolist() == [point for part in taken for point in part]

"""Parts that the static world keeps though a mover predicts them better."""

from __future__ import annotations

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

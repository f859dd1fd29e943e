"""Between the passes: what a world that is fitted to what is surely static makes of one that was not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ifsvideo.segmentation.agglomeration import Window
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues
from ifsvideo.segmentation.similarity import Rules, Similarity, learnt
from ifsvideo.segmentation.static_core import in_static_core
from ifsvideo.segmentation.world import fit_world
from tests.scenes import LEFT_CAR, RIGHT_CAR, SIZE, Camera, make_scene

CONFIG = SegmenterConfig()
DOUBTS = CONFIG.core_doubts(alone=True)


def test_a_world_that_stands_on_a_car_is_put_right() -> None:
    """The world at first is the one in which a car stands still and all else moves a little."""
    scene = make_scene(Camera.path(step=(0.1, 0, 0.2)), (LEFT_CAR, RIGHT_CAR), seed=1)
    tracks, truth = scene.tracks, scene.truth
    right = fit_world(tracks, SIZE, np.random.default_rng(0))
    assert right is not None
    wrong = right.fitted_to(np.flatnonzero(truth == 1))
    first = Cues(tracks, tracks.xy[0], np.full(tracks.points, 0.8), wrong.nearness, 1.0, CONFIG.pairs)
    window = Window(truth, np.ones(len(truth), dtype=bool), SIZE)
    cues, _ = in_static_core(first, window, wrong, learnt(), DOUBTS, 5.0)
    assert np.median(wrong.evidence(5.0)[truth == 0]) > 1
    assert np.median(cues.evidence[truth == 0]) < 0.5
    for car in (1, 2):
        assert np.median(cues.evidence[truth == car]) > 1


def test_without_a_world_or_a_second_pass_nothing_changes() -> None:
    scene = make_scene(movers=(LEFT_CAR,))
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    cues = Cues(scene.tracks, scene.tracks.xy[0], np.ones(scene.tracks.points), np.zeros(1), 1.0, 10)
    window = Window(scene.truth, np.ones(len(scene.truth), dtype=bool), SIZE)
    assert in_static_core(cues, window, None, learnt(), DOUBTS, 5.0) == (cues, window)
    assert in_static_core(cues, window, world, learnt(), (), 5.0) == (cues, window)


def test_segments_of_the_static_core_that_fit_its_world_are_one_from_then_on() -> None:
    scene = make_scene(Camera.path(step=(0, 0, 0.3)), (LEFT_CAR, RIGHT_CAR), seed=2)
    truth, place = scene.truth, scene.tracks.xy[0]
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    # The street in four quarters, each car by itself.
    quarter = (place > np.array(SIZE) / 2) @ [1, 2]
    segments = np.where(truth > 0, 3 + truth, quarter).astype(np.int64)
    window = Window(segments, np.ones(len(truth), dtype=bool), SIZE)
    first = Cues(scene.tracks, place, world.evidence(5.0), world.nearness, 1.0, CONFIG.pairs)
    cues, joined = in_static_core(first, window, world, learnt(), DOUBTS, 5.0)
    assert len(np.unique(joined.segments)) == 3
    assert all(len(np.unique(joined.segments[truth == motion])) == 1 for motion in (0, 1, 2))
    assert np.array_equal(joined.explained, window.explained)
    # How noisy tracks are is told by what was a segment, not by all the street.
    noise = cues.noise
    cues.groups(joined.parts())
    assert cues.noise == noise == first.noise


def test_a_core_that_is_too_cautious_grows_in_its_own_world() -> None:
    """At first only the left half of the street is surely one; in its world the right half stands still."""
    scene = make_scene(Camera.path(step=(0, 0, 0.3)), (LEFT_CAR, RIGHT_CAR), seed=2)
    truth, place = scene.truth, scene.tracks.xy[0]
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    half = (place[:, 0] > SIZE[0] / 2).astype(np.int64)
    segments = np.where(truth > 0, 1 + truth, half)
    window = Window(segments, np.ones(len(truth), dtype=bool), SIZE)
    first = Cues(scene.tracks, place, world.evidence(5.0), world.nearness, 1.0, CONFIG.pairs)
    nothing = Similarity(np.where(np.arange(len(learnt().core.weights)) == 0, 9.0, 0.0))
    rules = Rules(nothing, learnt().final)
    _, narrow = in_static_core(first, window, world, rules, DOUBTS[:1], 5.0)
    cues, joined = in_static_core(first, window, world, rules, DOUBTS, 5.0)
    assert len(np.unique(narrow.segments)) == 4
    assert len(np.unique(joined.segments)) == 3
    assert len(np.unique(joined.segments[truth == 0])) == 1
    assert np.median(cues.evidence[truth == 0]) < 0.5


def test_joined_segments_are_numbered_without_gaps() -> None:
    window = Window(np.array([0, 1, 2, 3, 3]), np.ones(5, dtype=bool), SIZE)
    assert window.joined(np.array([1, 3])).segments.tolist() == [0, 1, 2, 1, 1]
    assert window.joined(np.array([2])) is window


def test_how_often_the_core_grows() -> None:
    assert CONFIG.core_doubts(alone=True) == (CONFIG.narrow_core_doubt, CONFIG.wider_core_doubt)
    assert CONFIG.core_doubts(alone=False) == (CONFIG.core_doubt,)
    assert replace(CONFIG, wider_core_doubt=0.0).core_doubts(alone=True) == (CONFIG.core_doubt,)
    assert replace(CONFIG, core_doubt=0.0).core_doubts(alone=True) == ()

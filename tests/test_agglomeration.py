"""Merging by likelihood: how many motions come out, in which order, and what is carried along."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.cues import CUES, Cues, Group
from ifsvideo.segmentation.similarity import Similarity, feature_names, learnt
from ifsvideo.segmentation.world import fit_world
from ifsvideo.types import Tracks
from tests.scenes import LEFT_CAR, RIGHT_CAR, SIZE, Camera, Mover, Scene, make_scene


def cut(scene: Scene, width: float = 80.0) -> np.ndarray:
    """Segments: stripes of the picture, each motion for itself."""
    stripe = (scene.tracks.xy[0, :, 0] // width).astype(int)
    return np.unique(100 * scene.truth + stripe, return_inverse=True)[1].astype(np.int64)


def start(scene: Scene, rule: Similarity | None = None) -> Agglomeration:
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    cues = Cues(scene.tracks, scene.tracks.xy[0], world.evidence(5.0), world.nearness, 1.0, 10)
    return Agglomeration(cues, rule or learnt().core)  # the rule for the world of stage 1


def rule(**weights: float) -> Similarity:
    """A rule of a few weights, by name; "_" stands for the dot."""
    names = [name.replace(".", "_") for name in feature_names()]
    return Similarity(np.array([weights.get(name, 0.0) for name in names]))


def window(segments: np.ndarray, explained: np.ndarray | None = None) -> Window:
    return Window(segments, np.ones(len(segments), dtype=bool) if explained is None else explained, SIZE)


@pytest.mark.parametrize("seed", range(3))
def test_one_rigid_scene_is_one_motion(seed: int) -> None:
    scene = make_scene(Camera.path(step=(0.1, 0, 0.2)), seed=seed)
    segments = cut(scene)
    assert len(np.unique(segments)) > 5
    (group,) = start(scene).run(window(segments))
    assert sorted(group.members) == list(range(scene.tracks.points))


@pytest.mark.parametrize("cars", [(LEFT_CAR,), (LEFT_CAR, RIGHT_CAR)], ids=["one car", "two cars"])
@pytest.mark.parametrize("seed", range(2))
def test_what_clearly_moves_stays_apart(cars: tuple[Mover, ...], seed: int) -> None:
    scene = make_scene(movers=cars, seed=seed)
    segments = cut(scene)
    groups = start(scene).run(window(segments))
    found = sorted((sorted(group.members) for group in groups), key=lambda members: members[0])
    assert found == [np.flatnonzero(scene.truth == k).tolist() for k in range(len(cars) + 1)]


@pytest.mark.parametrize("motions", [1, 2, 3, 5])
def test_a_known_number_of_motions_is_kept(motions: int) -> None:
    scene = make_scene(movers=(LEFT_CAR, RIGHT_CAR))
    segments = cut(scene)
    merging = start(scene)
    groups = merging.run(window(segments), motions)
    assert len(groups) == motions
    assert len(merging.merges) == len(np.unique(segments)) - motions
    assert sorted(np.concatenate([group.members for group in groups])) == list(range(len(segments)))


def test_fewer_segments_than_motions_stay_as_they_are() -> None:
    scene = make_scene(movers=(LEFT_CAR,))
    assert len(start(scene).run(window(scene.truth), 4)) == 2


def test_merging_starts_with_the_likeliest_and_stops_at_one_half() -> None:
    """A rule that knows the gap only: nearest first, and nothing over 60 pixels."""
    place = np.array([0.0, 100.0, 130.0, 240.0])
    x = (place[:, None] + [-5.0, 0.0, 5.0]).ravel()
    xy = np.stack([x, np.tile([0.0, 1.0, 0.0], 4)], axis=1)[None] + np.zeros((4, 1, 1))
    near = rule(gap_always=2.0, constant=-2 * np.log(60))
    cues = Cues(Tracks.from_array(xy), xy[0], np.ones(12), np.zeros(12), 1.0, 10)
    merging = Agglomeration(cues, near)
    groups = merging.run(window(np.repeat(np.arange(4), 3)))
    assert len(Agglomeration(cues, near).run(window(np.repeat(np.arange(4), 3)), stop=0.05)) == 4
    assert [merge[:2] for merge in merging.merges] == [(1, 2)]
    assert merging.merges[0][2] == pytest.approx(1 / (1 + (60 / 20) ** 2), rel=1e-6)
    assert [group.members.tolist() for group in groups] == [[0, 1, 2], [9, 10, 11], [3, 4, 5, 6, 7, 8]]
    # What it doubts most is that the first is another motion, 90 pixels off.
    assert merging.doubt == pytest.approx(1 / (1 + (90 / 60) ** 2), rel=1e-6)
    merging = Agglomeration(cues, near)
    merging.run(window(np.repeat(np.arange(4), 3)), 1)
    assert merging.doubt == max(merge[2] for merge in merging.merges) > 0.5
    # The pair becomes number 4; then what is nearest to it, and the result is number 5.
    assert [merge[:2] for merge in merging.merges] == [(1, 2), (0, 4), (3, 5)]


def test_what_is_surely_alike_merges_at_once() -> None:
    """A rule that knows the gap only, sure below 8.6 pixels: each of three is as near to both others, and of
    three in a row the ends are not."""
    place = np.array([[0.0, 0.0], [200.0, 0.0], [6.0, 0.0], [206.0, 0.0], [3.0, 5.0], [215.0, 0.0]])
    xy = (place[:, None] + [[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]).reshape(-1, 2)[None] + np.zeros((4, 1, 1))
    cues = Cues(Tracks.from_array(xy), xy[0], np.ones(18), np.zeros(18), 1.0, 10)
    measured: list[list[int]] = []

    class Counting(Cues):
        def merge_each(self, sets: Sequence[Sequence[Group]]) -> list[Group]:
            measured.append([len(groups) for groups in sets])
            return super().merge_each(sets)

    cues.__class__ = Counting
    merging = Agglomeration(cues, rule(gap_always=2.0, constant=-2 * np.log(60)))
    groups = merging.run(window(np.repeat(np.arange(6), 3)))
    assert measured == [[3, 2], [2]]
    assert [merge[:2] for merge in merging.merges] == [(0, 2), (4, 6), (1, 3), (5, 8)]
    assert [len(group.members) for group in groups] == [9, 9]
    assert merging.merges[1][2] == pytest.approx(max(merge[2] for merge in merging.merges[:2]))


def test_points_that_no_model_explains_are_carried_along() -> None:
    scene = make_scene(movers=(LEFT_CAR,))
    segments = cut(scene)
    explained = np.ones(len(segments), dtype=bool)
    explained[::4] = False
    xy = scene.tracks.xy.copy()
    xy[:, ::4] += np.random.default_rng(0).normal(0, 20, xy[:, ::4].shape)
    spoilt = Tracks.from_array(xy, size=SIZE)
    seen = start(scene).cues
    cues = Cues(spoilt, scene.tracks.xy[0], seen.evidence, seen.nearness, 1.0, 10)
    groups = Agglomeration(cues, learnt().core).run(window(segments, explained))
    assert len(groups) == 2
    assert sorted(np.concatenate([group.members for group in groups])) == list(range(len(segments)))
    assert all(explained[group.reliable].all() for group in groups)


def test_parts_are_measured_by_what_is_explained_unless_that_is_a_single_point() -> None:
    segments = np.array([0, 0, 0, 1, 1, 1])
    explained = np.array([True, False, True, False, True, False])
    found = [
        (members.tolist(), reliable.tolist()) for members, reliable in window(segments, explained).parts()
    ]
    assert found == [([0, 1, 2], [0, 2]), ([3, 4, 5], [3, 4, 5])]
    assert window(np.empty(0, np.int64)).parts() == []


def test_apart_is_the_rule_on_the_measured_pair() -> None:
    scene = make_scene(movers=(LEFT_CAR,))
    merging = start(scene, rule(smaller_always=1.0))
    groups = merging.cues.groups(window(scene.truth).parts())
    smaller = np.exp(merging.cues.between([(groups[0], groups[1])])[0, 4 + CUES.index("smaller")])
    assert merging.apart(groups[0], groups[1]) == pytest.approx(smaller / (1 + smaller))


def test_what_is_merged_from_groups_is_what_is_merged_from_their_segments() -> None:
    scene = make_scene(movers=(LEFT_CAR, RIGHT_CAR))
    segments = window(cut(scene))
    whole, parts = start(scene), start(scene)
    expected = [sorted(group.members) for group in whole.run(segments)]
    found = [sorted(group.members) for group in parts.merge(parts.cues.groups(segments.parts()))]
    assert found == expected

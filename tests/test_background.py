"""What the groups of stage 5 become: labels, and things that a gap cuts in two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.background import apart_from_each_other, merge_and_label
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues
from ifsvideo.segmentation.similarity import learnt
from ifsvideo.segmentation.world import fit_world
from tests.scenes import SIZE, Camera, Mover, Scene, make_scene

CONFIG = SegmenterConfig()
LORRY = Mover((-1.5, 0.5, 14.0), (0.5, 0.0, 0.0), points=40)
TRAILER = Mover((3.5, 0.5, 14.0), (0.5, 0.0, 0.0), points=40)


def labels_of(scene: Scene, config: SegmenterConfig, motions: int | None = None) -> np.ndarray:
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    cues = Cues(scene.tracks, scene.tracks.xy[0], world.evidence(5.0), world.nearness, 1.0, 10)
    window = Window(np.minimum(scene.truth, 1), np.ones(len(scene.truth), dtype=bool), SIZE)
    return merge_and_label(Agglomeration(cues, learnt().final), window, config, motions)[0]


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Two boxes that drive as one, in one segment, with more than 50 pixels between them."""
    scene = make_scene(Camera.path(step=(0.0, 0.0, 0.2)), (LORRY, TRAILER))
    first = scene.tracks.xy[0]
    gap = np.linalg.norm(first[scene.truth == 1][:, None] - first[scene.truth == 2][None], axis=2).min()
    assert gap > CONFIG.gap
    return scene


@pytest.mark.parametrize(("doubt", "things"), [(0.0, 2), (0.9, 1)])
def test_parts_across_a_gap_are_one_thing_as_far_as_the_rule_says(
    scene: Scene, doubt: float, things: int
) -> None:
    labels = labels_of(scene, replace(CONFIG, gap_doubt=doubt))
    assert len(np.unique(labels[scene.truth > 0])) == things
    assert not labels[scene.truth == 0].any()
    assert labels[scene.truth > 0].all()


def test_no_gap_cuts_where_the_number_of_motions_is_known(scene: Scene) -> None:
    labels = labels_of(scene, replace(CONFIG, gap_doubt=0.0), motions=2)
    assert np.array_equal(labels, np.minimum(scene.truth, 1))


def test_a_part_too_small_to_be_believed_goes_to_the_background_and_joins_nothing(scene: Scene) -> None:
    """Three points of the trailer: by themselves nothing, though they move as the lorry does."""
    kept = np.flatnonzero((scene.truth < 2) | (np.cumsum(scene.truth == 2) <= 3))
    few = replace(scene, tracks=scene.tracks.select(kept), truth=scene.truth[kept])
    labels = labels_of(few, replace(CONFIG, gap_doubt=0.9))
    assert not labels[few.truth == 2].any()
    assert (labels[few.truth == 1] == 1).all()


def test_how_likely_labels_are_two_motions(scene: Scene) -> None:
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    cues = Cues(scene.tracks, scene.tracks.xy[0], world.evidence(5.0), world.nearness, 1.0, 10)
    window = Window(scene.truth, np.ones(len(scene.truth), dtype=bool), SIZE)
    merging = Agglomeration(cues, learnt().final)
    merging.run(window)
    # The ground, its upper half apart from it, the lorry, and a number that no point has.
    upper = (scene.truth == 0) & (scene.tracks.xy[0, :, 1] < np.median(scene.tracks.xy[0, :, 1]))
    labels = np.where(upper, 2, np.where(scene.truth > 0, 4, 0))
    apart = apart_from_each_other(labels, window, merging)
    assert apart.shape == (5, 5)
    assert np.array_equal(apart, apart.T)
    assert apart[0, 2] < 0.1
    assert apart[0, 4] > 0.9
    assert apart[2, 4] > 0.9
    assert (apart[[1, 3]] == 1).all()

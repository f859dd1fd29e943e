"""Cuts of all trajectories at once: of motions made from a known model, and of graphs of blocks."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.benchmark import metrics
from ifsvideo.segmentation import shape_interaction
from ifsvideo.segmentation.shape_interaction import ShapeInteraction, coordinates, discretised_cut, normalised
from ifsvideo.types import Tracks
from tests.scenes import SIZE, affine_motions


@pytest.mark.parametrize("sizes", [(60, 40), (50, 40, 30), (40, 30, 30, 20)])
def test_motions_are_cut_apart(sizes: tuple[int, ...]) -> None:
    tracks, truth = affine_motions(sizes)
    cut = ShapeInteraction(coordinates(tracks)).cut(len(sizes))
    assert metrics.error(cut.labels, truth + 1) == 0


def test_the_right_number_is_less_uncertain_than_one_more() -> None:
    for seed in range(5):
        tracks, _ = affine_motions((50, 40, 30), seed=seed)
        interaction = ShapeInteraction(coordinates(tracks))
        assert interaction.cut(3).uncertainty < interaction.cut(4).uncertainty


def test_what_is_orthogonal_is_cut_without_uncertainty() -> None:
    cut = ShapeInteraction(np.kron(np.eye(2), np.ones((3, 10)))).cut(2)
    assert 0 < cut.uncertainty < 1e-6
    assert metrics.error(cut.labels, np.repeat([1, 2], 10)) == 0


def test_points_beyond_the_most_join_those_that_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    tracks, truth = affine_motions((90, 60))
    whole = ShapeInteraction(coordinates(tracks)).cut(2)
    monkeypatch.setattr(shape_interaction, "_MOST", 40)
    few = ShapeInteraction(coordinates(tracks)).cut(2)
    assert few.labels.shape == truth.shape
    assert metrics.error(few.labels, truth + 1) == 0
    assert few.uncertainty < whole.uncertainty  # less is severed


def test_the_same_trajectories_are_cut_alike() -> None:
    X = coordinates(affine_motions(noise=6.0)[0])
    one, other = (ShapeInteraction(X).cut(3) for _ in range(2))
    assert np.array_equal(one.labels, other.labels)
    assert one.uncertainty == other.uncertainty


@pytest.mark.parametrize("frames", [3, 60])
@pytest.mark.parametrize("spread", [0.0, 100.0])
def test_points_that_stand_still_are_cut_somehow(spread: float, frames: int) -> None:
    place = 200 + spread * np.random.default_rng(0).random((1, 30, 2))
    tracks = Tracks.from_array(np.repeat(place, frames, axis=0), size=SIZE)
    for motions in (2, 3, 5):
        labels = ShapeInteraction(coordinates(tracks)).cut(motions).labels
        assert set(labels.tolist()) <= set(range(motions))


@pytest.mark.parametrize("size", [SIZE, None])
def test_normalised(size: tuple[int, int] | None) -> None:
    corners = np.array([[[0.0, 0.0], [640.0, 480.0], [320.0, 240.0]]] * 2)
    tracks = Tracks.from_array(corners, size=size)
    assert normalised(tracks).tolist() == [[-1, 1, 0]] * 4
    assert coordinates(tracks).tolist() == [[-1, 1, 0]] * 4 + [[1, 1, 1]] * 2


def test_a_graph_of_blocks_is_cut_into_them() -> None:
    truth = np.random.default_rng(0).integers(0, 3, 40)
    affinity = np.where(truth[:, None] == truth, 1.0, 0.05)
    assert metrics.error(discretised_cut(affinity, 3)[0], truth + 1) == 0


def test_the_gap_is_that_between_the_last_block_and_what_is_inside() -> None:
    blocks = np.kron(np.eye(3), np.ones((20, 20)))
    assert discretised_cut(blocks, 3, offset=0.0)[1] == pytest.approx(1, abs=1e-3)
    assert discretised_cut(blocks, 2, offset=0.0)[1] == pytest.approx(0, abs=1e-3)


def test_a_stray_is_not_worth_a_group() -> None:
    truth = np.repeat([0, 1], 20)
    affinity = np.where(truth[:, None] == truth, 1.0, 0.05)
    affinity[0, 1:] = affinity[1:, 0] = 1e-3
    assert np.bincount(discretised_cut(affinity, 2)[0]).min() >= 19
    assert np.bincount(discretised_cut(affinity, 2, offset=0.0)[0]).min() == 1

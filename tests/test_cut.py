"""Cuts beside the best of all of a small grid, beside an exact one, and of shapes in noise."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_flow

from ifsvideo.objects.cut import cut, least


def grid(rows: int, columns: int, seed: int, strength: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Evidence and costs at random."""
    random = np.random.default_rng(seed)
    evidence = random.normal(0, strength, (rows, columns)).astype(np.float32)
    costs = random.uniform(0, 1, (2, rows, columns)).astype(np.float32) ** 2
    costs[0, :, -1] = costs[1, -1] = 0
    return evidence, costs


def energy(figure: np.ndarray, evidence: np.ndarray, costs: np.ndarray) -> float:
    parted = (costs[0, :, :-1] * (figure[:, 1:] != figure[:, :-1])).sum()
    parted += (costs[1, :-1] * (figure[1:] != figure[:-1])).sum()
    return float(parted - evidence[figure].sum())


def least_energy(evidence: np.ndarray, costs: np.ndarray) -> float:
    """By the maximum flow from what speaks for the object to what speaks for the ground."""
    count, unit = evidence.size, 1e4
    here = np.arange(count).reshape(evidence.shape)
    pairs = [(here[:, :-1], here[:, 1:], costs[0, :, :-1]), (here[:-1], here[1:], costs[1, :-1])]
    one, other, most = (
        np.concatenate([part.ravel() for part in parts]) for parts in zip(*pairs, strict=True)
    )
    told = evidence.ravel()
    source, sink = np.full(count, count), np.full(count, count + 1)
    begin = np.concatenate([one, other, source, here.ravel()])
    end = np.concatenate([other, one, here.ravel(), sink])
    most = np.concatenate([most, most, np.maximum(told, 0), np.maximum(-told, 0)])
    graph = csr_matrix(((most * unit).round().astype(np.int32), (begin, end)), (count + 2, count + 2))
    return maximum_flow(graph, count, count + 1).flow_value / unit - float(told[told > 0].sum())


@pytest.mark.parametrize("seed", range(5))
def test_least_of_all_cuts_of_a_small_grid(seed: int):
    evidence, costs = grid(4, 4, seed)
    every = (np.array(bits, bool).reshape(4, 4) for bits in product((0, 1), repeat=16))
    best = min(energy(figure, evidence, costs) for figure in every)
    assert energy(least(evidence, costs), evidence, costs) == pytest.approx(best, abs=0.01)
    assert least_energy(evidence, costs) == pytest.approx(best, abs=0.01)


@pytest.mark.parametrize(("rows", "columns"), [(60, 80), (120, 100), (2, 40)])
def test_nearly_the_least_energy(rows: int, columns: int):
    evidence, costs = grid(rows, columns, 0, 0.3)
    best, start = least_energy(evidence, costs), energy(evidence > 0, evidence, costs)
    reached = energy(least(evidence, costs), evidence, costs)
    assert best - 0.1 <= reached <= best + 0.02 * (start - best)


def scene(rows: int, columns: int, noise: float = 12.0) -> tuple[np.ndarray, np.ndarray]:
    """A reddish ellipse on bluish ground, and where it is."""
    y, x = np.mgrid[:rows, :columns]
    figure = ((x / columns - 0.5) / 0.3) ** 2 + ((y / rows - 0.5) / 0.25) ** 2 < 1
    colour = np.where(figure[..., None], (150, 100, 90), (90, 100, 150))
    random = np.random.default_rng(0).normal(0, noise, colour.shape)
    return np.clip(colour + random, 0, 255).astype(np.uint8), figure


@pytest.mark.parametrize(("rows", "columns"), [(109, 110), (60, 31)])
def test_outline_of_a_shape_guessed_badly(rows: int, columns: int):
    picture, figure = scene(rows, columns)
    wrong = np.random.default_rng(1).random(figure.shape) < 0.2
    found = cut(picture, figure ^ wrong, np.zeros(figure.shape, np.int8))
    assert found.dtype == bool
    assert found.shape == figure.shape
    assert (found != figure).mean() < 0.005


def test_what_is_told_stands_against_its_colour():
    picture, figure = scene(80, 90)
    sure = np.zeros(figure.shape, np.int8)
    sure[5:10, 5:10], sure[38:43, 40:46] = 1, -1
    found = cut(picture, figure, sure)
    assert found[sure == 1].all()
    assert not found[sure == -1].any()
    assert (found != figure)[sure == 0].mean() < 0.005


def test_grey_pictures_have_colours_on_a_line():
    picture, figure = scene(60, 60)
    grey = np.where(figure, 140, 90)[..., None] + picture[..., :1] // 32
    found = cut(np.repeat(grey.astype(np.uint8), 3, axis=2), figure, np.zeros(figure.shape, np.int8))
    assert (found != figure).mean() < 0.005


@pytest.mark.parametrize("shape", [(1, 2), (2, 1), (1, 30), (3, 3), (5, 2)])
def test_small_and_plain_pictures(shape: tuple[int, int]):
    likely = np.zeros(shape, bool)
    likely[0, 0] = True
    found = cut(np.full((*shape, 3), 90, np.uint8), likely, np.where(likely, 1, -1).astype(np.int8))
    np.testing.assert_array_equal(found, likely)

"""Which of the sampled models are kept: each must save more than it costs."""

from __future__ import annotations

from itertools import chain, combinations

import numpy as np
import pytest

from ifsvideo.segmentation.selection import needed_models


def energy(cost: np.ndarray, kept: tuple[int, ...], label_cost: float) -> float:
    """What points pay for the best of the models kept, and these themselves."""
    return float(cost[:, list(kept)].min(axis=1).sum() + label_cost * len(kept))


def test_every_surface_keeps_one_model_of_many_alike() -> None:
    rng = np.random.default_rng(0)
    owner = np.repeat([0, 1, 2], 40)
    cost = np.where(owner[:, None] == np.repeat([0, 1, 2], 10), 0.1, 2.0) + rng.uniform(0, 0.02, (120, 30))
    kept = needed_models(cost, 4.0)
    assert sorted(kept // 10) == [0, 1, 2]


def test_a_model_for_a_few_points_stays_if_they_need_it() -> None:
    cost = np.full((100, 2), 0.1)
    cost[97:, 0] = 3.0
    cost[:97, 1] = 3.0
    assert needed_models(cost, 4.0).tolist() == [0, 1]
    assert needed_models(cost, 9.0).tolist() == [0]


def test_nothing_costs_nothing_and_one_is_always_kept() -> None:
    cost = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert needed_models(cost, 0.0).tolist() == [0, 1]
    assert len(needed_models(cost, 1e9)) == 1


@pytest.mark.parametrize("seed", range(5))
def test_greedy_is_near_the_best_of_all_choices(seed: int) -> None:
    cost = np.random.default_rng(seed).gamma(1.0, 1.0, (30, 8))
    choices = chain.from_iterable(combinations(range(8), n) for n in range(1, 9))
    least = min(energy(cost, choice, 3.0) for choice in choices)
    found = energy(cost, tuple(needed_models(cost, 3.0)), 3.0)
    assert least <= found <= 1.1 * least

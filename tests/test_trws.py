"""TRW-S: bound and energy on random problems, exactness on trees, and the odd inputs."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.spatial import Delaunay

from ifsvideo.segmentation.trws import solve


def energy(labels: Any, unary: Any, edges: Any, w: Any, e: Any, kinds: Any) -> float:
    """The energy, written out as the definition says."""
    total = sum(unary[p, label] for p, label in enumerate(labels))
    for (p, q), strength, other in zip(edges, w, e, strict=True):
        total += strength * (labels[p] != labels[q]) + other * (kinds[labels[p]] != kinds[labels[q]])
    return float(total)


def optimum(*problem: Any) -> float:
    nodes, labels = problem[0].shape
    return min(energy(x, *problem) for x in itertools.product(range(labels), repeat=nodes))


def random_problem(seed: int, nodes: int, labels: int, edges: Any) -> tuple[Any, ...]:
    rng = np.random.default_rng(seed)
    return (
        rng.uniform(0, 1, (nodes, labels)),
        np.asarray(edges).reshape(-1, 2),
        rng.uniform(0, 0.5, len(edges)),
        rng.uniform(0, 0.3, len(edges)),
        rng.random(labels) < 0.5,
    )


def random_tree(seed: int, nodes: int) -> list[tuple[int, int]]:
    rng = np.random.default_rng(seed)
    return [(int(rng.integers(0, q)), q) for q in range(1, nodes)]


def delaunay(points: int, seed: int = 0) -> tuple[Any, Any]:
    xy = np.random.default_rng(seed).uniform(0, 1, (points, 2))
    corners = Delaunay(xy).simplices
    pairs = np.concatenate([corners[:, :2], corners[:, 1:], corners[:, [0, 2]]])
    return xy, np.unique(np.sort(pairs, axis=1), axis=0)


def assert_sound(solution: Any, problem: tuple[Any, ...]) -> None:
    slack = 1e-9 * max(1.0, abs(solution.energy))
    assert (np.diff(solution.bounds) >= -slack).all()
    assert solution.lower_bound <= solution.energy + slack
    assert (solution.energies >= solution.energy - slack).all()
    assert solution.energy == pytest.approx(energy(solution.labels, *problem))


@pytest.mark.parametrize("seed", range(12))
def test_finds_the_optimum_of_a_tree(seed: int) -> None:
    problem = random_problem(seed, 7, 3, random_tree(seed, 7))
    solution = solve(*problem, iterations=300, tolerance=1e-12)
    assert_sound(solution, problem)
    assert solution.energy == pytest.approx(optimum(*problem), abs=1e-9)
    assert solution.lower_bound == pytest.approx(solution.energy, abs=1e-3)


@pytest.mark.parametrize("seed", range(12))
def test_bounds_the_optimum_of_a_graph_with_loops(seed: int) -> None:
    every_pair = list(itertools.combinations(range(6), 2))
    chosen = np.random.default_rng(seed).permutation(len(every_pair))[:10]
    problem = random_problem(seed, 6, 4, [every_pair[k] for k in chosen])
    solution = solve(*problem, iterations=100, tolerance=0)
    best = optimum(*problem)
    assert_sound(solution, problem)
    assert solution.lower_bound <= best + 1e-9
    assert best <= solution.energy + 1e-9
    assert solution.energy - solution.lower_bound < 0.1 * best


def test_long_chain_agrees_with_dynamic_programming() -> None:
    nodes, labels = 60, 9
    problem = random_problem(5, nodes, labels, [(p, p + 1) for p in range(nodes - 1)])
    unary, _, w, e, kinds = problem
    names = np.arange(labels)
    cost = unary[0]
    for p in range(nodes - 1):
        step = w[p] * (names[:, None] != names) + e[p] * (kinds[:, None] != kinds)
        cost = (cost[:, None] + step).min(axis=0) + unary[p + 1]
    solution = solve(*problem, iterations=500, tolerance=1e-12)
    assert_sound(solution, problem)
    assert solution.energy == pytest.approx(cost.min(), rel=1e-6)


def test_large_delaunay_graph_closes_the_gap() -> None:
    xy, edges = delaunay(1000)
    rng = np.random.default_rng(1)
    region = (xy[:, 0] * 4).astype(int) * 4 + (xy[:, 1] * 4).astype(int)
    unary = rng.uniform(0.3, 1, (1000, 60))
    unary[np.arange(1000), region] -= 0.25
    kinds = np.arange(60) % 2 == 1
    problem = (unary, edges, np.full(len(edges), 0.1), np.full(len(edges), 0.05), kinds)
    solution = solve(*problem, iterations=20, tolerance=0)
    assert_sound(solution, problem)
    assert solution.energy - solution.lower_bound < 0.01 * solution.energy
    assert solution.energy < 0.9 * energy(unary.argmin(axis=1), *problem)
    assert np.mean(solution.labels == region) > 0.85


def test_order_of_nodes_and_edges_does_not_matter_to_the_result() -> None:
    _, edges = delaunay(80)
    problem = random_problem(3, 80, 5, edges)
    unary, _, w, e, kinds = problem
    rng = np.random.default_rng(9)
    place, turn = rng.permutation(80), rng.permutation(len(edges))
    moved = np.empty_like(unary)
    moved[place] = unary
    shuffled = (moved, place[edges][turn][:, ::-1], w[turn], e[turn], kinds)
    first, second = (solve(*p, iterations=300, tolerance=0) for p in (problem, shuffled))
    assert_sound(second, shuffled)
    assert second.energy == pytest.approx(first.energy, rel=0.01)
    assert second.lower_bound == pytest.approx(first.lower_bound, rel=0.01)


def test_same_input_same_labels() -> None:
    _, edges = delaunay(100)
    problem = random_problem(4, 100, 8, edges)
    assert (solve(*problem).labels == solve(*problem).labels).all()


def test_attributes_hold_labels_of_a_kind_together() -> None:
    # The middle node would rather be 2; that is another kind than its neighbours', 1 is not.
    unary = np.array([[0.0, 5, 5], [5, 1.0, 0.5], [0.0, 5, 5]])
    chain = [(0, 1), (1, 2)]
    kinds = [False, False, True]
    assert solve(unary, chain, 0.1, 0.0, kinds).labels.tolist() == [0, 2, 0]
    assert solve(unary, chain, 0.1, 0.5, kinds).labels.tolist() == [0, 1, 0]


def test_without_edges_each_node_takes_its_cheapest_label() -> None:
    unary = np.random.default_rng(0).uniform(0, 1, (20, 6))
    solution = solve(unary, np.empty((0, 2), int), np.empty(0))
    assert (solution.labels == unary.argmin(axis=1)).all()
    assert solution.lower_bound == pytest.approx(solution.energy)


@pytest.mark.parametrize(("nodes", "labels"), [(1, 1), (1, 4), (5, 1)])
def test_single_node_or_label(nodes: int, labels: int) -> None:
    problem = random_problem(1, nodes, labels, [(p, p + 1) for p in range(nodes - 1)])
    solution = solve(*problem)
    assert_sound(solution, problem)
    assert solution.energy == pytest.approx(optimum(*problem))


def test_no_nodes() -> None:
    solution = solve(np.empty((0, 3)), np.empty((0, 2), int), np.empty(0))
    assert len(solution.labels) == 0
    assert solution.energy == solution.lower_bound == 0


def test_parts_without_a_connection_are_solved_side_by_side() -> None:
    one, two = random_problem(1, 4, 3, random_tree(1, 4)), random_problem(2, 4, 3, random_tree(2, 4))
    both = (
        np.concatenate([one[0], two[0]]),
        np.concatenate([one[1], two[1] + 4]),
        np.concatenate([one[2], two[2]]),
        np.concatenate([one[3], two[3]]),
        one[4],
    )
    expected = optimum(*one) + optimum(*two[:4], one[4])
    assert solve(*both, iterations=300, tolerance=1e-12).energy == pytest.approx(expected)


def test_edge_named_twice_counts_twice() -> None:
    unary = np.random.default_rng(2).uniform(0, 1, (4, 3))
    once = solve(unary, [(0, 1), (1, 2), (2, 3)], [0.6, 0.1, 0.2], 0.0)
    twice = solve(unary, [(0, 1), (1, 0), (1, 2), (2, 3)], [0.25, 0.35, 0.1, 0.2], 0.0)
    assert twice.energy == pytest.approx(once.energy)
    assert twice.lower_bound == pytest.approx(once.lower_bound)


def test_initial_labels_compete() -> None:
    _, edges = delaunay(60)
    problem = random_problem(6, 60, 6, edges)
    good = solve(*problem, iterations=200, tolerance=0)
    again = solve(*problem, iterations=1, initial=good.labels)
    assert again.energy <= good.energy
    assert_sound(again, problem)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"unary": np.full((3, 2), np.inf)}, "finite unary"),
        ({"unary": np.zeros(3)}, "unary of shape"),
        ({"edges": [(0, 3)]}, "two different nodes"),
        ({"edges": [(1, 1)]}, "two different nodes"),
        ({"weights": [-1.0]}, "not negative"),
        ({"attributes": [True]}, "attributes of shape"),
        ({"initial": [0, 0, 2]}, "initial labels"),
        ({"iterations": 0}, "iterations"),
    ],
)
def test_refuses_what_makes_no_sense(change: dict[str, Any], message: str) -> None:
    arguments = {"unary": np.zeros((3, 2)), "edges": [(0, 1)], "weights": [1.0]} | change
    with pytest.raises(ValueError, match=message):
        solve(**arguments)

"""The energy of eq. 3.4 - 3.8 against a direct computation, and the graph that it lives on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import Delaunay

from ifsvideo.segmentation.assignment import assign, residuals
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.refinement import data_term, delaunay_edges, refine, similarity
from ifsvideo.segmentation.sampling import AffineModels, sample_models
from ifsvideo.types import Tracks
from tests.scenes import LEFT_CAR, make_scene

CONFIG = SegmenterConfig(models=15)


def connected(points: int, edges: np.ndarray) -> bool:
    reached = {0}
    for _ in range(points):
        reached |= {int(q) for p, q in edges if p in reached} | {int(p) for p, q in edges if q in reached}
    return len(reached) == points


def test_edges_are_those_of_the_triangulation() -> None:
    xy = np.random.default_rng(0).uniform(0, 100, (50, 2))
    corners = Delaunay(xy).simplices
    expected = {tuple(sorted((int(t[i]), int(t[j])))) for t in corners for i, j in ((0, 1), (1, 2), (0, 2))}
    edges = delaunay_edges(xy)
    assert {tuple(edge) for edge in edges.tolist()} == expected
    assert len(edges) == len(expected)
    assert (edges[:, 0] < edges[:, 1]).all()


@pytest.mark.parametrize("points", [0, 1])
def test_no_edges_without_two_points(points: int) -> None:
    assert delaunay_edges(np.zeros((points, 2))).shape == (0, 2)


def test_two_points_are_joined() -> None:
    assert delaunay_edges(np.array([[5.0, 5.0], [1.0, 2.0]])).tolist() == [[0, 1]]
    assert delaunay_edges(np.array([[5.0, 5.0], [5.0, 5.0]])).tolist() == [[0, 1]]


def test_three_points_are_a_triangle() -> None:
    assert delaunay_edges(np.array([[0.0, 0.0], [9.0, 1.0], [3.0, 7.0]])).tolist() == [[0, 1], [0, 2], [1, 2]]


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (1.0, 2.0), (0.3, -0.7)])
def test_points_on_a_line_are_joined_along_it(direction: tuple[float, float]) -> None:
    place = np.array([3.0, 0.0, 7.0, 1.0, 4.0])
    edges = delaunay_edges(100 + place[:, None] * np.array(direction))
    assert edges.tolist() == [[0, 3], [0, 4], [1, 3], [2, 4]]


@pytest.mark.parametrize("points", [3, 4, 20])
def test_coincident_points_are_joined_too(points: int) -> None:
    edges = delaunay_edges(np.full((points, 2), 42.0))
    assert connected(points, edges)
    assert (edges[:, 0] < edges[:, 1]).all()


@pytest.mark.parametrize("width", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("points", [3, 4, 60])
def test_points_nearly_on_a_line_are_all_joined(points: int, width: float) -> None:
    rng = np.random.default_rng(0)
    along = rng.uniform(0, 500, points)
    edges = delaunay_edges(np.column_stack([along, 0.3 * along]) + rng.normal(0, 1, (points, 2)) * width)
    assert connected(points, edges)


def test_doubled_points_are_not_dropped() -> None:
    xy = np.random.default_rng(0).uniform(0, 100, (20, 2))
    assert connected(30, delaunay_edges(np.concatenate([xy, xy[:10]])))


def test_similarity_is_equation_3_7() -> None:
    tracks = make_scene(movers=(LEFT_CAR,), static=40).tracks
    edges = delaunay_edges(tracks.xy[0])
    sigma, unit = 5.0, 2.0
    found = similarity(tracks, edges, unit, sigma)
    for alpha, (p, q) in zip(found, edges, strict=True):
        x_p, x_q = tracks.xy[:, p] / unit, tracks.xy[:, q] / unit
        v_p, v_q = np.diff(x_p, axis=0), np.diff(x_q, axis=0)
        distance = np.linalg.norm(x_p - x_q, axis=1).mean()
        slip = (np.linalg.norm(v_p - v_q, axis=1) ** 2).mean()
        assert alpha == pytest.approx(np.exp(-((1 + distance) ** 2) * slip / (2 * sigma**2)), abs=1e-12)
    assert ((found >= 0) & (found <= 1)).all()
    assert np.ptp(found) > 0.5


def test_similarity_counts_shared_frames_only() -> None:
    xy = np.zeros((6, 3, 2))
    xy[:, 1] = [10.0, 0.0]
    xy[:, 2] = [0.0, 10.0]
    xy[3:, 0] += 100.0  # jumps where its partner is not seen
    xy[3:, 1] = np.nan
    xy[:5, 2] = np.nan
    alpha = similarity(Tracks.from_array(xy), np.array([[0, 1], [0, 2], [1, 2]]), 1.0, 5.0)
    assert alpha.tolist() == [1.0, 0.0, 0.0]


def test_data_term_is_equation_3_5() -> None:
    residual = np.array([[0.5, 1.0, 9.0], [2.0, 0.1, np.inf]])
    inliers = np.array([[True, False, True], [False, True, False]])
    models = AffineModels(inliers, np.zeros((2, 3, 2)), np.array([False, True]))
    moving = np.array([0.1, 0.8, 0.3])
    strict = replace(CONFIG, attribute_data=True, outlier_cost=3.0)
    assert_allclose(data_term(residual, models, moving, 1.0, strict), [[0.5, 3.0], [3.0, 0.1], [3.0, 3.0]])
    free = replace(strict, attribute_data=False, moving_weight=0.0)
    assert_allclose(data_term(residual, models, moving, 1.0, free), [[0.5, 2.0], [1.0, 0.1], [3.0, 3.0]])
    assert_allclose(data_term(residual, models, moving, 2.0, free)[0], [0.25, 1.0])


def test_a_model_costs_by_how_far_its_inliers_are_from_the_point_in_moving() -> None:
    inliers = np.array([[True, False, True], [False, True, False]])
    models = AffineModels(inliers, np.zeros((2, 3, 2)), np.array([False, True]))
    soft = replace(CONFIG, attribute_data=False, moving_weight=2.0)
    cost = data_term(np.zeros((2, 3)), models, np.array([0.1, 0.8, 0.3]), 1.0, soft)
    assert_allclose(cost, [[0.2, 1.4], [1.2, 0.0], [0.2, 1.0]])


@pytest.mark.parametrize("attribute_data", [False, True])
def test_energy_is_equation_3_4_with_every_edge_twice(attribute_data: bool) -> None:
    scene = make_scene(movers=(LEFT_CAR,), static=60)
    tracks, background = scene.tracks, scene.truth == 0
    config = replace(
        CONFIG,
        data_weight=0.7,
        motion_weight=0.9,
        attribute_weight=1.3,
        attribute_cost=0.4,
        attribute_data=attribute_data,
    )
    models = sample_models(tracks, background, 0, 1.0, config, np.random.default_rng(0))
    assert 0 < models.foreground.mean() < 1
    residual = residuals(tracks, models, config.centred)
    start = assign(tracks, models, residual, 0, config.nearest_models)
    edges = delaunay_edges(tracks.xy[0])
    D = data_term(residual, models, 1.0 - background, 1.0, config)
    labels, solution = refine(tracks, models, D, start, edges, 1.0, config)

    alpha = similarity(tracks, edges, 1.0, config.motion_sigma)
    attribute = models.foreground
    total = config.data_weight * sum(D[p, label] for p, label in enumerate(labels))
    for p in range(tracks.points):  # the sum over p and over N(p)
        for a, (i, j) in zip(alpha, edges, strict=True):
            if p in (i, j):
                lp, lq = labels[i], labels[j]
                total += config.motion_weight * a * (lp != lq)
                total += config.attribute_weight * config.attribute_cost * (attribute[lp] != attribute[lq])
    assert solution.energy == pytest.approx(total)
    assert solution.lower_bound <= total + 1e-9
    assert len(np.unique(labels)) > 1


def test_smoothness_alone_leaves_one_label_and_data_alone_the_best() -> None:
    scene = make_scene(movers=(LEFT_CAR,), static=60)
    tracks, edges = scene.tracks, delaunay_edges(scene.tracks.xy[0])
    models = sample_models(tracks, np.ones(90, bool), 0, 1.0, CONFIG, np.random.default_rng(0))
    residual = residuals(tracks, models, True)
    start = np.zeros(90, np.int64)

    def labels(**weights: float) -> np.ndarray:
        config = replace(CONFIG, **weights)
        cost = data_term(residual, models, np.zeros(90), 1.0, config)
        return refine(tracks, models, cost, start, edges, 1.0, config)[0]

    smooth = labels(data_weight=0.0, motion_weight=1.0)
    assert len(np.unique(smooth)) == 1
    best = labels(motion_weight=0.0, attribute_weight=0.0, outlier_cost=1e6, moving_weight=0.0)
    assert_allclose(residual[best, np.arange(90)], residual.min(axis=0))

"""Stage 4: the over-segmentation that respects motion boundaries, as an MRF (thesis 3.0.4, eq. 3.4 - 3.8)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from ifsvideo.segmentation import trws
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.sampling import AffineModels
from ifsvideo.types import Tracks


def delaunay_edges(xy: NDArray[np.float64]) -> NDArray[np.int64]:
    """Edges (E, 2), each once and lower index first, of the Delaunay triangulation of points (N, 2).

    Two points, and points all on one line, have no triangles: they are joined along the line.
    """
    if len(xy) < 2:
        return np.empty((0, 2), dtype=np.int64)
    centred = xy - xy.mean(axis=0)
    _, (length, width), axes = np.linalg.svd(centred, full_matrices=False)
    if width <= 1e-9 * max(length, 1.0):
        # Joggled, they would have slivers that join the far ends.
        order = np.argsort(centred @ axes[0], kind="stable")
        low, high = np.sort(np.stack([order[:-1], order[1:]]), axis=0)
    else:
        # QJ joggles, so that no point is dropped where several share a place; it needs four points.
        triangle = np.array([[0, 1, 2]])
        simplices = triangle if len(xy) == 3 else Delaunay(centred / length, qhull_options="QJ Pp").simplices
        first, second = simplices.T.astype(np.int64)[[[0, 1, 2], [1, 2, 0]]].reshape(2, -1)
        low, high = np.minimum(first, second), np.maximum(first, second)
    # Sorted by hand, where np.unique hashes.
    edges = np.sort(low * len(xy) + high)
    once = np.append(True, edges[1:] != edges[:-1])
    return np.stack(np.divmod(edges[once], len(xy)), axis=1)


def similarity(tracks: Tracks, edges: NDArray[np.int64], unit: float, sigma: float) -> NDArray[np.float64]:
    """Motion similarity alpha_pq of the two ends of every edge (thesis eq. 3.7), in 0..1.

    ``alpha = exp(-(1 + |x_p - x_q|)^2 |v_p - v_q|^2 / (2 sigma^2))``; the squares are means over the frames
    that both points share, so that an edge between broken tracks is judged by what was measured. Edges
    without two such frames get 0.
    """
    p, q = edges.T
    beside = (tracks.planes.take(p, axis=2) - tracks.planes.take(q, axis=2)) / unit  # (2, F, E)
    both = tracks.visible[:, p] & tracks.visible[:, q]
    step = both[1:] & both[:-1]
    apart = np.where(both, np.sqrt((beside * beside).sum(axis=0)), 0.0)
    velocity = np.diff(beside, axis=1)
    slip = np.where(step, (velocity * velocity).sum(axis=0), 0.0)
    distance = apart.sum(axis=0) / np.maximum(both.sum(axis=0), 1)
    shared = step.sum(axis=0)
    exponent = (1 + distance) ** 2 * slip.sum(axis=0) / np.maximum(shared, 1) / (2 * sigma**2)
    return np.where(shared > 0, np.exp(-exponent), 0.0)


def data_term(
    residual: NDArray[np.float64],
    models: AffineModels,
    moving: NDArray[np.float64],
    unit: float,
    config: SegmenterConfig,
) -> NDArray[np.float64]:
    """Cost D of every model at every point (thesis eq. 3.5), (P, M), pixels.

    The residual where the attribute of point and model agree, else the constant sigma_out; or, softer, the
    residual and a share of how far the point is from the model's inliers in its probability of moving. The
    residual is cut at sigma_out: a point that no model explains must not pay more for one it resembles than
    for one it does not.
    """
    cost = np.minimum(residual.T / unit, config.outlier_cost)
    if config.attribute_data:
        return np.where((moving[:, None] > 0.5) == models.foreground, cost, config.outlier_cost)
    typical = models.inliers @ moving / np.maximum(models.inliers.sum(axis=1), 1)
    return np.asarray(cost + config.moving_weight * np.abs(moving[:, None] - typical))


def refine(
    tracks: Tracks,
    models: AffineModels,
    cost: NDArray[np.float64],
    start: NDArray[np.int64],
    edges: NDArray[np.int64],
    unit: float,
    config: SegmenterConfig,
) -> tuple[NDArray[np.int64], trws.Solution]:
    """Minimise the energy of thesis eq. 3.4 by TRW-S.

    Parameters
    ----------
    models : AffineModels
        The M models among which points choose.
    cost : (P, M) float
        The data term, pixels.
    start : (P,) int
        Labels of stage 3, which compete with what the solver finds.
    edges : (E, 2) int
        The graph of the points.

    Returns
    -------
    labels : (P,) int
        Index of the model.
    solution : trws.Solution
        Energy and lower bound of each iteration.
    """
    # eq. 3.4 sums over p and over N(p), so every edge counts twice.
    weights = 2 * config.motion_weight * similarity(tracks, edges, unit, config.motion_sigma)
    solution = trws.solve(
        config.data_weight * cost,
        edges,
        weights,
        np.full(len(edges), 2 * config.attribute_weight * config.attribute_cost),
        models.foreground,
        iterations=config.iterations,
        initial=start,
    )
    return solution.labels, solution

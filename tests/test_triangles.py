"""Many small symmetric systems at once."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ifsvideo.segmentation.triangles import Triangles


@pytest.mark.parametrize("rows", [1, 2, 3, 4])
def test_triangles_solve_symmetric_systems(rows: int) -> None:
    rng = np.random.default_rng(rows)
    A = rng.normal(0, 1, (7, rows, rows))
    V, right = A @ A.transpose(0, 2, 1) + 0.1 * np.eye(rows), rng.normal(0, 1, (7, rows))
    solved = np.linalg.solve(V, right[..., None])[..., 0]
    triangles = Triangles(V.transpose(1, 2, 0))
    assert_allclose(triangles.solve(right.T).T, solved)
    half = Triangles(V.transpose(1, 2, 0)[:, :, None]).halfway(np.stack([right.T, 2 * right.T], axis=1))
    assert_allclose((half**2).sum(axis=0), np.outer([1, 4], (right * solved).sum(axis=1)))

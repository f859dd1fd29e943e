"""Robust bundle adjustment of a short window: camera poses, points by inverse depth, focal length and lens.

A point is its bearing (a, b) in the reference frame and its inverse depth rho >= 0; camera k sees it along
``q = R_k (a, b, 1) + rho t_k``, projected as ``u = f xy (1 + k1 |xy|^2)`` with ``xy = (q_x, q_y) / q_z``
(inverse depth: Civera, Davison and Montiel, T-RO 2008; Schur complement: Triggs et al., Bundle Adjustment,
2000). Inverse depth holds far points and a camera that only turns without a special case. Movers do not fit;
a point's whole track is weighed by how well it does (Geman-McClure).

Picture coordinates here are normalised: origin in the centre, unit the longer side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Bools

Array = NDArray[np.float64]

_NEAREST = 0.05
"""Least depth q_z relative to that in the reference frame; keeps a diverging step finite."""
_IDLE = 1e-3
"""Share of the cost by which a step must change it: after two in a row that do not, it is done."""
_GLOBALS = 2
"""Shared unknowns: logarithm of the focal length, radial distortion."""


def skew(v: Array) -> Array:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    o = np.zeros_like(x)
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def rotation(omega: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), Rodrigues' formula."""
    angle = np.maximum(np.linalg.norm(omega, axis=-1), 1e-12)[..., None, None]
    cross = skew(omega)
    return np.asarray(
        np.eye(3) + np.sin(angle) / angle * cross + (1 - np.cos(angle)) / angle**2 * (cross @ cross)
    )


def by_points(J: Array) -> Array:
    """Measurements (K, P, 2, N) of K cameras as those of P points, (P, 2K, N): then a sum over all that is
    seen of a point is one product of matrices."""
    return J.transpose(1, 0, 2, 3).reshape(J.shape[1], -1, J.shape[3])


@dataclass(frozen=True)
class Estimate:
    """Cameras R (K, 3, 3), t (K, 3); points X (P, 3) as (a, b, rho); log_focal, k1 of all cameras."""

    R: Array
    t: Array
    X: Array
    log_focal: float
    k1: float

    @property
    def lens(self) -> Array:
        """The shared unknowns as a vector."""
        return np.array([self.log_focal, self.k1])


@dataclass(frozen=True)
class Projection:
    """Intermediate values of a projection, kept for its derivatives."""

    turned: Array
    depth: Array
    xy: Array
    u: Array


class Bundle:
    """The observations of one window.

    Parameters
    ----------
    observed : (K, P, 2) float, normalised
    seen : (K, P) bool
    weight : (P,) float
        Importance of each point.
    tolerance : (P,) float, normalised
        Error that a static point is granted; residuals count in units of it.
    reference : int
        The camera that defines bearings and depth: R = I, t = 0.
    lens_prior, lens_spread : (2,) float
        Expected log focal length and k1, and how far they may be off (standard deviation).
    """

    def __init__(
        self,
        observed: Array,
        seen: Bools,
        weight: Array,
        tolerance: Array,
        reference: int,
        lens_prior: Array,
        lens_spread: Array,
    ) -> None:
        self.seen = seen
        self.observed = np.where(seen[..., None], observed, 0.0)
        self.weight = weight
        self.tolerance = tolerance
        self.reference = reference
        self.lens_prior = lens_prior
        self.lens_spread = lens_spread
        # A point spends 3 unknowns on its 2 measurements a frame.
        self.freedom = np.maximum(2.0 * seen.sum(axis=0) - 3.0, 1.0)
        self._free = np.delete(np.arange(len(seen)), reference)

    def subset(self, points: NDArray[np.int64]) -> Bundle:
        """The same window, some of its points."""
        return Bundle(
            self.observed[:, points],
            self.seen[:, points],
            self.weight[points],
            self.tolerance[points],
            self.reference,
            self.lens_prior,
            self.lens_spread,
        )

    def project(self, e: Estimate) -> Projection:
        """Where the cameras see the points."""
        bearing = np.column_stack([e.X[:, :2], np.ones(len(e.X))])
        turned = bearing @ e.R.transpose(0, 2, 1)
        q = turned + e.X[None, :, 2, None] * e.t[:, None]
        depth = np.maximum(q[..., 2], _NEAREST)
        xy = q[..., :2] / depth[..., None]
        bend = 1 + e.k1 * (xy**2).sum(axis=2, keepdims=True)
        return Projection(turned, depth, xy, np.exp(e.log_focal) * bend * xy)

    def residual(self, e: Estimate) -> Array:
        """Projection minus observation (K, P, 2), zero where unseen."""
        return self._missed(self.project(e))

    def _missed(self, p: Projection) -> Array:
        return np.where(self.seen[..., None], p.u - self.observed, 0.0)

    def rms(self, residual: Array) -> Array:
        """Root of the mean square residual of each point (P,), normalised units, its own unknowns taken
        off."""
        return np.asarray(np.sqrt((residual**2).sum(axis=(0, 2)) / self.freedom))

    def cost(self, residual: Array, width: float) -> float:
        """Mean of e^2 / (1 + e^2) over the points, e = rms / (width * tolerance): 0 all fit, 1 none does."""
        square = (self.rms(residual) / (width * self.tolerance)) ** 2
        return float((self.weight * square / (1 + square)).sum() / self.weight.sum())

    def solve(self, e: Estimate, widths: list[float], translate: bool = True) -> Estimate:
        """Levenberg-Marquardt, one step per entry of ``widths``, the widths of the robust cost, usually
        falling.

        ``translate=False`` keeps the cameras in place: they only turn.
        """
        damping, idle = 1e-3, 0
        seen = self.project(e)
        for place, width in enumerate(widths):
            residual = self._missed(seen)
            step = self._step(e, seen, residual, width, damping, translate)
            seen_then = self.project(step)
            before, after = self.cost(residual, width), self.cost(self._missed(seen_then), width)
            if after <= before * (1 + 1e-9):
                e, seen, damping = step, seen_then, max(damping / 5, 1e-7)
            else:
                damping *= 10
            idle = idle + 1 if abs(after - before) < _IDLE * before else 0
            if idle == 2 and set(widths[place:]) == {width}:
                break
        return e

    def solve_points(self, e: Estimate, iterations: int) -> Estimate:
        """Points alone, each by itself, cameras fixed."""
        damping = np.full(len(e.X), 1e-3)
        residual = self.residual(e)
        cost = (residual**2).sum(axis=(0, 2))
        for _ in range(iterations):
            p = self.project(e)
            Jx = by_points(self._by_point(e, self._by_place(e, p)))
            V = Jx.transpose(0, 2, 1) @ Jx
            g = (Jx.transpose(0, 2, 1) @ by_points(residual[..., None]))[:, :, 0]
            V += (damping[:, None] * np.einsum("paa->pa", V) + 1e-9)[:, :, None] * np.eye(3)
            X = e.X - np.linalg.solve(V, g[:, :, None])[:, :, 0]
            behind = X[:, 2] < 0
            if behind.any():
                # At the bound the bearing moves with rho held at 0.
                pull = g[behind, :2] - V[behind, :2, 2] * e.X[behind, 2, None]
                X[behind, :2] = (
                    e.X[behind, :2] - np.linalg.solve(V[behind, :2, :2], pull[:, :, None])[:, :, 0]
                )
                X[behind, 2] = 0.0
            moved = replace(e, X=X)
            new = self.residual(moved)
            better = (new**2).sum(axis=(0, 2)) <= cost
            e = replace(e, X=np.where(better[:, None], X, e.X))
            residual = np.where(better[None, :, None], new, residual)
            cost = (residual**2).sum(axis=(0, 2))
            damping = np.where(better, damping / 10, damping * 10)
        return e

    def _derivatives(self, e: Estimate, p: Projection) -> tuple[Array, Array, Array]:
        """Derivatives of the projections by camera (K, P, 2, 6), point (K, P, 2, 3), lens (K, P, 2, 2); zero
        where unseen."""
        by_q = self._by_place(e, p)
        by_camera = np.concatenate([-by_q @ skew(p.turned), by_q * e.X[None, :, 2, None, None]], axis=3)
        square = (p.xy**2).sum(axis=2)
        by_lens = np.stack([p.u, np.exp(e.log_focal) * p.xy * square[..., None]], axis=3)
        return by_camera, self._by_point(e, by_q), by_lens * self.seen[..., None, None]

    def _by_place(self, e: Estimate, p: Projection) -> Array:
        """Derivatives of the projections by q (K, P, 2, 3)."""
        square = (p.xy**2).sum(axis=2)
        by_xy = 2 * e.k1 * p.xy[..., :, None] * p.xy[..., None, :]
        by_xy += (1 + e.k1 * square)[..., None, None] * np.eye(2)
        by_xy *= (np.exp(e.log_focal) * self.seen / p.depth)[..., None, None]
        return np.concatenate([by_xy, -np.einsum("kpij,kpj->kpi", by_xy, p.xy)[..., None]], axis=3)

    def _by_point(self, e: Estimate, by_q: Array) -> Array:
        """Derivatives of the projections by (a, b, rho), (K, P, 2, 3)."""
        axes = np.stack([e.R[:, :, 0], e.R[:, :, 1], e.t], axis=2)  # dq / d(a, b, rho)
        return np.asarray(by_q @ axes[:, None])

    def _step(
        self, e: Estimate, p: Projection, residual: Array, width: float, damping: float, translate: bool
    ) -> Estimate:
        """One damped Gauss-Newton step: points are eliminated, cameras and lens solved, points filled in
        again."""
        Jc, Jx, Jl = self._derivatives(e, p)
        if not translate:
            Jc[..., 3:] = 0.0
            Jx[..., 2] = 0.0
        square = (self.rms(residual) / (width * self.tolerance)) ** 2
        weight = self.weight / (1 + square) ** 2 / self.tolerance**2 / self.freedom
        free, cameras = self._free, len(e.R)
        shared = 6 * len(free) + _GLOBALS

        # A camera's unknowns touch its own measurements only: blocks (K, 6 or 2, ...) instead of one matrix.
        by_camera, by_lens = (J.reshape(cameras, -1, J.shape[3]) for J in (Jc, Jl))
        heavy = np.repeat(weight, 2)[None, :, None]
        r = residual.reshape(cameras, -1, 1)
        heavy_camera_t = (by_camera * heavy).transpose(0, 2, 1)
        heavy_lens_t = (by_lens * heavy).transpose(0, 2, 1)
        U = np.zeros((shared, shared))
        blocks, beside = heavy_camera_t @ by_camera, heavy_camera_t @ by_lens
        for column, k in enumerate(free):
            rows = slice(6 * column, 6 * column + 6)
            U[rows, rows] = blocks[k]
            U[rows, -_GLOBALS:] = beside[k]
            U[-_GLOBALS:, rows] = beside[k].T
        U[-_GLOBALS:, -_GLOBALS:] = (heavy_lens_t @ by_lens).sum(axis=0) + np.diag(1 / self.lens_spread**2)
        gradient = np.append((heavy_camera_t @ r)[free].ravel(), (heavy_lens_t @ r).sum(axis=0).ravel())
        gradient[-_GLOBALS:] += (e.lens - self.lens_prior) / self.lens_spread**2

        own_t = (Jx * weight[:, None, None]).transpose(0, 1, 3, 2)
        V = (own_t @ Jx).sum(axis=0)
        trace = np.einsum("paa->p", V) + 1e-12 * float(weight.max(initial=1.0))
        V = V + (1e-3 * damping * trace)[:, None, None] * np.eye(3) + 1e-12 * trace[:, None, None] * np.eye(3)
        own_gradient = (own_t @ residual[..., None]).sum(axis=0)[:, :, 0]
        # (P, 3, shared): points against cameras and lens.
        with_cameras = (own_t[free] @ Jc[free]).transpose(1, 2, 0, 3).reshape(len(e.X), 3, -1)
        cross = np.concatenate([with_cameras, (own_t @ Jl).sum(axis=0)], axis=2)
        inverse = np.linalg.inv(V)
        eliminated = (inverse @ cross).reshape(-1, shared)
        S = U - cross.reshape(-1, shared).T @ eliminated
        S += np.diag(damping * np.diag(U) + 1e-9 * np.trace(U) / shared)
        shared_step = -np.linalg.solve(S, gradient - eliminated.T @ own_gradient.ravel())
        own_step = -np.einsum("pab,pb->pa", inverse, own_gradient + cross @ shared_step)
        return self._moved(e, shared_step, own_step, translate)

    def _moved(self, e: Estimate, shared_step: Array, own_step: Array, translate: bool) -> Estimate:
        """The estimate after a step, its free scale fixed: root mean square of the camera's distances 1, rho
        >= 0."""
        cameras = shared_step[:-_GLOBALS].reshape(-1, 6)
        R, t = e.R.copy(), e.t.copy()
        R[self._free] = rotation(cameras[:, :3]) @ e.R[self._free]
        X = e.X + own_step
        if translate:
            t[self._free] += cameras[:, 3:]
            scale = float(np.sqrt((t**2).sum() / max(len(self._free), 1)))
            if scale > 1e-9:
                t /= scale
                X[:, 2] *= scale
        X[:, 2] = np.maximum(X[:, 2], 0.0)
        lens = e.lens + shared_step[-_GLOBALS:]
        low, high = self.lens_prior - 3 * self.lens_spread, self.lens_prior + 3 * self.lens_spread
        log_focal, k1 = np.clip(lens, low, high)
        return Estimate(R, t, X, float(log_focal), float(k1))

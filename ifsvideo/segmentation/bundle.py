"""Robust bundle adjustment of a short window: camera poses, points by inverse depth, focal length and lens.

A point is its bearing (a, b) in the reference frame and its inverse depth rho >= 0; camera k sees it along
``q = R_k (a, b, 1) + rho t_k``, projected as ``u = f xy (1 + k1 |xy|^2)`` with ``xy = (q_x, q_y) / q_z``
(inverse depth: Civera, Davison and Montiel, T-RO 2008; Schur complement: Triggs et al., Bundle Adjustment,
2000). Inverse depth holds far points and a camera that only turns without a special case. Movers do not fit;
a point's whole track is weighed by how well it does (Geman-McClure).

Picture coordinates here are normalised: origin in the centre, unit the longer side.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.triangles import Triangles
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
    cross = np.zeros((*v.shape, 3))
    for row, column, axis in ((2, 1, 0), (0, 2, 1), (1, 0, 2)):
        cross[..., row, column] = v[..., axis]
        cross[..., column, row] = -v[..., axis]
    return cross


def rotation(omega: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), Rodrigues' formula."""
    angle = np.maximum(np.linalg.norm(omega, axis=-1), 1e-12)[..., None, None]
    cross = skew(omega)
    return np.asarray(
        np.eye(3) + np.sin(angle) / angle * cross + (1 - np.cos(angle)) / angle**2 * (cross @ cross)
    )


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
    """Intermediate values of a projection, kept for its derivatives: R (a, b, 1) (K, 3, P), depth (K, P),
    xy and u (K, 2, P), the square of xy (K, P)."""

    turned: Array
    depth: Array
    xy: Array
    square: Array
    u: Array


@dataclass(frozen=True)
class Freed:
    """The projections of all points to the first order, where each point may follow the cameras.

    What a point's own place can make up for is what its residuals have in common with three directions of
    their 2K; of these only the coordinates are kept.

    Attributes
    ----------
    free : (C,) int
        The cameras but the reference.
    J : (K, 8, 2, P) float
        Derivatives by each camera and the lens.
    residual : (K, 2, P) float
    made_up : (P, 3, N) float
        Coordinates of the derivatives by all N = 6 C + 2 unknowns.
    missed : (P, 3) float
        Coordinates of the residuals.
    """

    free: NDArray[np.int64]
    J: Array
    residual: Array
    made_up: Array
    missed: Array

    def information(self, points: NDArray[np.int64], weight: Array) -> tuple[Array, Array]:
        """What points (n,) of some weight (n,) tell of cameras and lens: matrix (N, N) and gradient (N,) of
        the normal equations."""
        matrix, gradient = _normal_equations(
            self.free, self.J[..., points], self.residual[..., points], weight
        )
        root = np.sqrt(weight)[:, None]
        rows = (self.made_up[points] * root[..., None]).reshape(-1, len(matrix))
        return matrix - rows.T @ rows, gradient - rows.T @ (self.missed[points] * root).ravel()

    def square(self, points: NDArray[np.int64], step: Array | None = None) -> Array:
        """Sum of squares (n,) of the residuals of points (n,), after a step (N,) of cameras and lens."""
        residual, missed = self.residual[..., points], self.missed[points]
        if step is not None:
            each = np.zeros((len(self.J), 1, 6 + _GLOBALS))
            each[self.free, 0, :6] = step[:-_GLOBALS].reshape(-1, 6)
            each[:, 0, 6:] = step[-_GLOBALS:]
            J = self.J[..., points]
            residual = residual + (each @ J.reshape(*J.shape[:2], -1)).reshape(residual.shape)
            missed = missed + self.made_up[points] @ step
        left = _square(residual) - np.einsum("pa,pa->p", missed, missed)
        return np.asarray(np.maximum(left, 0.0))


class Bundle:
    """The observations of one window.

    Arrays have the points last: what is done to all of them is then one run through memory.

    Parameters
    ----------
    observed : (K, 2, P) float, normalised
    seen : (K, P) bool
    weight : (P,) float
        Importance of each point.
    tolerance : (P,) float, normalised
        Error that a static point is granted; residuals count in units of it.
    reference : int
        The camera that defines bearings and depth: R = I, t = 0.
    lens_prior, lens_spread : (2,) float
        Expected log focal length and k1, and how far they may be off (standard deviation).
    farthest : (P,) float, optional
        Least inverse depth of each point; by default 0, infinitely far.
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
        farthest: Array | float = 0.0,
    ) -> None:
        self.seen = seen
        self.farthest = np.broadcast_to(np.asarray(farthest, dtype=np.float64), weight.shape)
        self.observed = np.where(seen[:, None], observed, 0.0)
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
            self.observed[..., points],
            self.seen[:, points],
            self.weight[points],
            self.tolerance[points],
            self.reference,
            self.lens_prior,
            self.lens_spread,
            self.farthest[points],
        )

    def no_farther(self, farthest: Array | float) -> Bundle:
        """The same window with other least inverse depths."""
        other = copy(self)
        other.farthest = np.broadcast_to(np.asarray(farthest, dtype=np.float64), self.weight.shape)
        return other

    def project(self, e: Estimate) -> Projection:
        """Where the cameras see the points."""
        turned = e.R @ np.vstack([e.X[:, :2].T, np.ones(len(e.X))])
        q = turned + e.t[:, :, None] * e.X[:, 2]
        depth = np.maximum(q[:, 2], _NEAREST)
        xy = q[:, :2] / depth[:, None]
        square = np.einsum("kip,kip->kp", xy, xy)
        return Projection(
            turned, depth, xy, square, (np.exp(e.log_focal) * (1 + e.k1 * square))[:, None] * xy
        )

    def residual(self, e: Estimate) -> Array:
        """Projection minus observation (K, 2, P), zero where unseen."""
        return self._missed(self.project(e))

    def _missed(self, p: Projection) -> Array:
        return np.where(self.seen[:, None], p.u - self.observed, 0.0)

    def rms(self, residual: Array) -> Array:
        """Root of the mean square residual of each point (P,), normalised units, its own unknowns taken
        off."""
        return np.asarray(np.sqrt(_square(residual) / self.freedom))

    def cost(self, residual: Array, width: float) -> float:
        """Mean of e^2 / (1 + e^2) over the points, e = rms / (width * tolerance): 0 all fit, 1 none does."""
        square = _square(residual) / (self.freedom * (width * self.tolerance) ** 2)
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

    def solve_points(self, e: Estimate, iterations: int, nearest: float = np.inf) -> Estimate:
        """Points alone, each by itself, none with an inverse depth over ``nearest``; cameras fixed."""
        damping = np.full(len(e.X), 1e-3)
        seen = self.project(e)
        residual = self._missed(seen)
        cost = _square(residual)
        for _ in range(iterations):
            J = self._by_point(e, self._by_place(e, seen))
            V = np.einsum("kaip,kbip->abp", J, J)
            g = np.einsum("kaip,kip->ap", J, residual)
            for axis in range(3):
                V[axis, axis] += damping * V[axis, axis] + 1e-9
            X = e.X - Triangles(V).solve(g).T
            held = np.clip(X[:, 2], self.farthest, nearest)
            beyond = held != X[:, 2]
            if beyond.any():
                # At a bound the bearing moves with rho held there.
                pull = g[:2, beyond] + V[:2, 2, beyond] * (held - e.X[:, 2])[beyond]
                X[beyond, :2] = e.X[beyond, :2] - Triangles(V[:2, :2, beyond]).solve(pull).T
                X[:, 2] = held
            moved = replace(e, X=X)
            seen_then = self.project(moved)
            new = self._missed(seen_then)
            square = _square(new)
            better = square <= cost
            e = replace(e, X=np.where(better[:, None], X, e.X))
            seen = seen_then if better.all() else self.project(e)
            residual = np.where(better, new, residual)
            cost = np.where(better, square, cost)
            damping = np.where(better, damping / 10, damping * 10)
        return e

    def spread_of_nearness(self, e: Estimate) -> Array:
        """How far each inverse depth (P,) may be off if all measurements are off by what is granted, one way.

        Of one whose bearing and depth cannot be told apart it is large, not infinite.
        """
        own = self._by_point(e, self._by_place(e, self.project(e)))
        V = np.einsum("kaip,kbip->pab", own, own)
        V += (1e-9 * np.einsum("paa->p", V) + 1e-12)[:, None, None] * np.eye(3)
        return np.asarray(self.tolerance * np.sqrt(self.freedom * np.linalg.inv(V)[:, 2, 2]))

    def without_places(self, e: Estimate, translate: bool) -> Freed:
        """Residuals and their derivatives by cameras and lens, what each point's own place can make up for
        taken off.

        ``translate=False``: the cameras only turn, all points are far.
        """
        p = self.project(e)
        J, own = self._derivatives(e, p)
        if not translate:
            J[:, 3:6] = 0.0
            own[:, 2] = 0.0
        residual = self._missed(p)
        # A point that is held as far as it may be cannot go farther.
        farther = np.einsum("kip,kip->p", own[:, 2], residual) > 0
        own[:, 2, :, (e.X[:, 2] <= self.farthest) & farther] = 0.0
        V = np.einsum("kaip,kbip->abp", own, own)
        trace = np.einsum("aap->p", V)
        for axis in range(3):
            V[axis, axis] += 1e-9 * trace + 1e-12
        points = Triangles(V)
        made_up = points.halfway(self._against_points(J, own))
        missed = points.halfway(np.einsum("kaip,kip->ap", own, residual))
        return Freed(self._free, J, residual, np.ascontiguousarray(made_up.transpose(2, 1, 0)), missed.T)

    def _derivatives(self, e: Estimate, p: Projection) -> tuple[Array, Array]:
        """Derivatives of the projections by camera (rotation, place) and lens (K, 8, 2, P), and by point
        (K, 3, 2, P); zero where unseen."""
        by_q, v = self._by_place(e, p), p.turned[:, :, None]
        J = np.empty((len(e.R), 6 + _GLOBALS, 2, len(e.X)))
        for axis in range(3):  # v x dq
            after, last = (axis + 1) % 3, (axis + 2) % 3
            np.multiply(v[:, after], by_q[:, last], out=J[:, axis])
            J[:, axis] -= v[:, last] * by_q[:, after]
        np.multiply(by_q, e.X[:, 2], out=J[:, 3:6])
        np.multiply(p.u, self.seen[:, None], out=J[:, 6])
        np.multiply(p.xy, (np.exp(e.log_focal) * p.square * self.seen)[:, None], out=J[:, 7])
        return J, self._by_point(e, by_q)

    def _by_place(self, e: Estimate, p: Projection) -> Array:
        """Derivatives of the projections by q (K, 3, 2, P)."""
        scale = np.exp(e.log_focal) * self.seen / p.depth
        by_q = np.empty((len(scale), 3, 2, scale.shape[1]))
        np.multiply(p.xy[:, :, None], (2 * e.k1 * scale)[:, None, None] * p.xy[:, None], out=by_q[:, :2])
        straight = scale * (1 + e.k1 * p.square)
        for axis in range(2):
            by_q[:, axis, axis] += straight
        np.einsum("kqip,kqp->kip", by_q[:, :2], -p.xy, out=by_q[:, 2])
        return by_q

    def _by_point(self, e: Estimate, by_q: Array) -> Array:
        """Derivatives of the projections by (a, b, rho), (K, 3, 2, P)."""
        axes = np.stack([e.R[:, :, 0], e.R[:, :, 1], e.t], axis=1)  # dq / d(a, b, rho)
        return (axes @ by_q.reshape(len(axes), 3, -1)).reshape(by_q.shape)

    def _step(
        self, e: Estimate, p: Projection, residual: Array, width: float, damping: float, translate: bool
    ) -> Estimate:
        """One damped Gauss-Newton step: points are eliminated, cameras and lens solved, points filled in
        again."""
        J, own = self._derivatives(e, p)
        if not translate:
            J[:, 3:6] = 0.0
            own[:, 2] = 0.0
        square = _square(residual) / (self.freedom * (width * self.tolerance) ** 2)
        weight = self.weight / (1 + square) ** 2 / self.tolerance**2 / self.freedom
        U, gradient = self._of_cameras(e, J, residual, weight)
        own_heavy = own * weight
        V = np.einsum("kaip,kbip->abp", own_heavy, own)
        trace = np.einsum("aap->p", V) + 1e-12 * float(weight.max(initial=1.0))
        for axis in range(3):
            V[axis, axis] += (1e-3 * damping + 1e-12) * trace
        points = Triangles(V)
        half = points.halfway(self._against_points(J, own_heavy))
        own_half = points.halfway(np.einsum("kaip,kip->ap", own_heavy, residual))
        eliminated = half.reshape(len(half), -1)
        S = U - eliminated @ eliminated.T
        S += np.diag(damping * np.diag(U) + 1e-9 * np.trace(U) / len(U))
        shared_step = -np.asarray(np.linalg.solve(S, gradient - eliminated @ own_half.ravel()), np.float64)
        own_step = points.rest(-own_half - (shared_step @ eliminated).reshape(own_half.shape))
        return self._moved(e, shared_step, own_step.T, translate)

    def _against_points(self, J: Array, own: Array) -> Array:
        """Products (shared, 3, P) of the derivatives by cameras and lens with those by points."""
        cross = np.einsum("kcip,kaip->kcap", J, own)
        with_cameras = cross[self._free, :6].reshape(-1, *cross.shape[2:])
        return np.concatenate([with_cameras, cross[:, 6:].sum(axis=0)])

    def _of_cameras(self, e: Estimate, J: Array, residual: Array, weight: Array) -> tuple[Array, Array]:
        """Normal equations of cameras and lens alone (shared, shared), and their gradient (shared,)."""
        U, gradient = _normal_equations(self._free, J, residual, weight)
        U[-_GLOBALS:, -_GLOBALS:] += np.diag(1 / self.lens_spread**2)
        gradient[-_GLOBALS:] += (e.lens - self.lens_prior) / self.lens_spread**2
        return U, gradient

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
        X[:, 2] = np.maximum(X[:, 2], self.farthest)
        lens = e.lens + shared_step[-_GLOBALS:]
        low, high = self.lens_prior - 3 * self.lens_spread, self.lens_prior + 3 * self.lens_spread
        log_focal, k1 = np.clip(lens, low, high)
        return Estimate(R, t, X, float(log_focal), float(k1))


def _normal_equations(
    free: NDArray[np.int64], J: Array, residual: Array, weight: Array
) -> tuple[Array, Array]:
    """Those of cameras and lens (shared, shared) and their gradient (shared,), points where they are."""
    # A camera's unknowns touch its own measurements only: blocks (K, 8, 8) instead of one matrix.
    heavy = (J * weight).reshape(*J.shape[:2], -1)
    blocks = heavy @ J.reshape(heavy.shape).transpose(0, 2, 1)
    pull = (heavy @ residual.reshape(len(J), -1, 1))[:, :, 0]
    count = 6 * len(free)
    U = np.zeros((count + _GLOBALS, count + _GLOBALS))
    each = np.arange(len(free))
    U[:count, :count].reshape(len(free), 6, len(free), 6)[each, :, each] = blocks[free, :6, :6]
    U[:count, count:] = blocks[free, :6, 6:].reshape(count, _GLOBALS)
    U[count:, :count] = U[:count, count:].T
    U[count:, count:] = blocks[:, 6:, 6:].sum(axis=0)
    return U, np.append(pull[free, :6].ravel(), pull[:, 6:].sum(axis=0))


def _square(residual: Array) -> Array:
    """Sum of squares of each point's residuals (K, 2, P)."""
    return np.asarray(np.einsum("kip,kip->p", residual, residual))

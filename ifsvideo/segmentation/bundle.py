"""Robust bundle adjustment of a short window: camera poses, points by inverse depth, focal length and lens.

A point is its bearing (a, b) in the reference frame and its inverse depth rho >= 0; camera k sees it along
``q = R_k (a, b, 1) + rho t_k``, projected as ``u = f xy (1 + k1 |xy|^2)`` with ``xy = (q_x, q_y) / q_z``
(inverse depth: Civera, Davison and Montiel, T-RO 2008; Schur complement: Triggs et al., Bundle Adjustment,
2000). Inverse depth holds far points and a camera that only turns without a special case. Movers do not fit;
a point's whole track is weighed by how well it does (Geman-McClure).

Picture coordinates here are normalised: origin in the centre, unit the longer side.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ifsvideo.segmentation.triangles import Triangles
from ifsvideo.types import Bools

Array = NDArray[np.float64]
_Stack = TypeVar("_Stack", "Estimate", "Projection")

_NEAREST = 0.05
"""Least depth q_z relative to that in the reference frame; keeps a diverging step finite."""
_IDLE = 1e-3
"""Share of the cost by which a step must change it: after two in a row that do not, it is done."""
_SETTLED = 1e-9
"""Share of a point's squared error by which a step must change it: else the point has found its place."""
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
    angle = np.maximum(np.sqrt((omega * omega).sum(axis=-1)), 1e-12)[..., None, None]
    across = omega[..., :, None] * omega[..., None, :] * ((1 - np.cos(angle)) / angle**2)
    return np.asarray(np.cos(angle) * np.eye(3) + np.sin(angle) / angle * skew(omega) + across)


@dataclass(frozen=True)
class Estimate:
    """Cameras R (K, 3, 3), t (K, 3); points X (P, 3) as (a, b, rho); log_focal, k1 of all cameras.

    Several may be stacked: each array has one axis more then, the first, and log_focal and k1 are arrays.
    """

    R: Array
    t: Array
    X: Array
    log_focal: float | Array
    k1: float | Array

    @property
    def lens(self) -> Array:
        """The shared unknowns as a vector (..., 2)."""
        return np.stack([self.log_focal, self.k1], axis=-1)

    @classmethod
    def stacked(cls, estimates: Sequence[Estimate]) -> Estimate:
        """Several as one."""
        return cls(*(np.stack(values) for values in zip(*map(_values, estimates), strict=True)))

    def each(self) -> list[Estimate]:
        """The estimates of a stack."""
        return [Estimate(*values) for values in zip(*_values(self), strict=True)]


@dataclass(frozen=True)
class Projection:
    """A projection, and the intermediate values that its derivatives need.

    Attributes
    ----------
    turned : (..., K, 3, P) float
        R (a, b, 1).
    depth : (..., K, P) float
    xy, u : (..., K, 2, P) float
    square : (..., K, P) float
        |xy|^2.
    residual : (..., K, 2, P) float
        u minus the observation, zero where unseen.
    error : (..., P) float
        Sum of squares of each point's residuals.
    """

    turned: Array
    depth: Array
    xy: Array
    square: Array
    u: Array
    residual: Array
    error: Array


@dataclass(frozen=True)
class Freed:
    """The projections of all points to the first order, where each point may follow the cameras.

    What a point's own place can make up for is what its residuals have in common with three directions of
    their 2K; of these only the coordinates are kept.

    Attributes
    ----------
    others : (K - 1,) int
        The cameras but the reference.
    J : (..., K, 9, 2, P) float
        Derivatives by each camera and the lens, and the residuals.
    made_up : (..., N + 1, 3, P) float
        Coordinates of the derivatives by all N = 6 (K - 1) + 2 unknowns, and of the residuals.
    """

    others: NDArray[np.int64]
    J: Array
    made_up: Array

    def subset(self, points: NDArray[np.int64]) -> Freed:
        """The same of several sets (S, n) of as many points each."""
        J, made_up = (
            np.stack([values.take(own, axis=-1) for own in points]) for values in (self.J, self.made_up)
        )
        return Freed(self.others, J, made_up)

    def information(self, weight: Array) -> tuple[Array, Array]:
        """What the points, of some weight (..., P), tell of cameras and lens: matrix (..., N, N) and gradient
        (..., N) of the normal equations."""
        root = np.sqrt(weight)
        rows = self.made_up * root[..., None, None, :]
        rows = rows.reshape(*rows.shape[:-2], -1)
        left = _normal_equations(self.others, self.J * root[..., None, None, None, :])
        left -= rows @ rows.swapaxes(-1, -2)
        return left[..., :-1, :-1], left[..., :-1, -1]

    def square(self, step: Array | None = None) -> Array:
        """Sum of squares (..., P) of the residuals, after a step (..., N) of cameras and lens."""
        if step is None:
            residual, missed = self.J[..., -1, :, :], self.made_up[..., -1, :, :]
        else:
            each = np.zeros((*self.J.shape[:-3], 6 + _GLOBALS + 1))
            each[..., self.others, :6] = step[..., :-_GLOBALS].reshape(*step.shape[:-1], -1, 6)
            each[..., 6:-1] = step[..., None, -_GLOBALS:]
            each[..., -1] = 1.0
            residual = _along(each, self.J)
            missed = _along(np.concatenate([step, np.ones((*step.shape[:-1], 1))], axis=-1), self.made_up)
        left = _square(residual) - (missed * missed).sum(axis=-2)
        return np.asarray(np.maximum(left, 0.0))


def _along(step: Array, derivatives: Array) -> Array:
    """Sum (..., R, P) of derivatives (..., N, R, P), each times its part of a step (..., N)."""
    shape = derivatives.shape
    return np.asarray(
        (step[..., None, :] @ derivatives.reshape(*shape[:-2], -1)).reshape(*shape[:-3], *shape[-2:])
    )


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
        self._others = np.delete(np.arange(len(seen)), reference)
        self._complete = bool(seen.all())
        self._shown = seen.astype(np.float64)
        self._granted = self.freedom * tolerance**2
        self._importance = np.sqrt(weight / self._granted)

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
        """Where the cameras see the points, and how far that is from what was observed."""
        rays = np.ones((*e.X.shape[:-2], 3, e.X.shape[-2]))
        rays[..., :2, :] = e.X[..., :2].swapaxes(-1, -2)
        turned = (e.R.reshape(*e.X.shape[:-2], -1, 3) @ rays).reshape(*e.t.shape, -1)
        q = turned + e.t[..., None] * e.X[..., None, None, :, 2]
        depth = np.maximum(q[..., 2, :], _NEAREST)
        xy = q[..., :2, :] / depth[..., None, :]
        square = xy[..., 0, :] * xy[..., 0, :] + xy[..., 1, :] * xy[..., 1, :]
        u = (_focal(e) * (1 + _k1(e) * square))[..., None, :] * xy
        residual = u - self.observed
        if not self._complete:
            residual = np.where(self.seen[:, None], residual, 0.0)
        return Projection(turned, depth, xy, square, u, residual, _square(residual))

    def residual(self, e: Estimate) -> Array:
        """Projection minus observation (..., K, 2, P), zero where unseen."""
        return self.project(e).residual

    def rms(self, residual: Array) -> Array:
        """Root of the mean square residual of each point (P,), normalised units, its own unknowns taken
        off."""
        return np.asarray(np.sqrt(_square(residual) / self.freedom))

    def cost(self, residual: Array, width: float) -> Array:
        """Mean (...) of e^2 / (1 + e^2) over the points, e = rms / (width * tolerance): 0 all fit, 1 none
        does."""
        return self._cost(_square(residual), width)

    def _cost(self, error: Array, width: float) -> Array:
        square = error / (self._granted * width**2)
        return np.asarray((square / (1 + square)) @ self.weight / self.weight.sum())

    def solve(self, e: Estimate, widths: list[float], translate: bool = True) -> Estimate:
        """Levenberg-Marquardt, one step per entry of ``widths``, the widths of the robust cost, usually
        falling.

        ``translate=False`` keeps the cameras in place: they only turn.
        """
        return self.solve_each([e], widths, translate)[0]

    def solve_each(
        self, estimates: Sequence[Estimate], widths: list[float], translate: bool = True
    ) -> list[Estimate]:
        """The same from several estimates, each by itself, but in one go: most of a step's time is taken by
        calls, not by numbers."""
        found, left = list(estimates), np.arange(len(estimates))
        e = Estimate.stacked(estimates)
        damping, idle = np.full(len(left), 1e-3), np.zeros(len(left), dtype=np.int64)
        seen = self.project(e)
        for place, width in enumerate(widths):
            step = self._step(e, seen, width, damping, translate)
            seen_then = self.project(step)
            before, after = self._cost(seen.error, width), self._cost(seen_then.error, width)
            better = after <= before * (1 + 1e-9)
            e, seen = _where(better, step, e), _where(better, seen_then, seen)
            damping = np.where(better, np.maximum(damping / 5, 1e-7), damping * 10)
            idle = np.where(np.abs(after - before) < _IDLE * before, idle + 1, 0)
            done = (idle == 2) & (set(widths[place:]) == {width})
            if done.any() or place == len(widths) - 1:
                for number, estimate in zip(left.tolist(), e.each(), strict=True):
                    found[number] = estimate
                left, damping, idle = left[~done], damping[~done], idle[~done]
                e, seen = _some(e, ~done), _some(seen, ~done)
            if not len(left):
                break
        return found

    def solve_points(self, e: Estimate, iterations: int, nearest: float = np.inf) -> Estimate:
        """Points alone, each by itself, none with an inverse depth over ``nearest``; cameras fixed."""
        return self._solve_points(e, iterations, nearest, np.full(len(e.X), 1e-3))

    def _solve_points(self, e: Estimate, iterations: int, nearest: float, damping: Array) -> Estimate:
        seen = self.project(e)
        for iteration in range(1, iterations + 1):
            J = self._by_point(e, self._by_place(e, seen, self._shown))
            V = np.einsum("kaip,kbip->abp", J, J)
            g = np.einsum("kaip,kip->ap", J, seen.residual)
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
            seen_then = self.project(replace(e, X=X))
            better = seen_then.error <= seen.error
            e = replace(e, X=np.where(better[:, None], X, e.X))
            damping = np.where(better, damping / 10, damping * 10)
            left = np.flatnonzero(np.abs(seen_then.error - seen.error) > _SETTLED * seen.error)
            if 2 * len(left) < len(better):
                # The few that still move go on by themselves.
                X = e.X.copy()
                if len(left):
                    few = replace(e, X=X[left])
                    X[left] = (
                        self.subset(left)._solve_points(few, iterations - iteration, nearest, damping[left]).X
                    )
                return replace(e, X=X)
            # The points are last in each array.
            seen = (
                seen_then
                if better.all()
                else Projection(
                    *(np.where(better, x, y) for x, y in zip(_values(seen_then), _values(seen), strict=True))
                )
            )
        return e

    def spread_of_nearness(self, e: Estimate) -> Array:
        """How far each inverse depth (P,) may be off if all measurements are off by what is granted, one way.

        Of one whose bearing and depth cannot be told apart it is large, not infinite.
        """
        own = self._by_point(e, self._by_place(e, self.project(e), self._shown))
        V = np.einsum("kaip,kbip->abp", own, own)
        trace = np.einsum("aap->p", V)
        for axis in range(3):
            V[axis, axis] += 1e-9 * trace + 1e-12
        last = Triangles(V).halfway(np.eye(3)[:, 2:])[2]  # its square is the last of the inverse
        return np.asarray(self.tolerance * np.sqrt(self.freedom) * last)

    def without_places(self, e: Estimate, translate: bool) -> Freed:
        """Residuals and their derivatives by cameras and lens, what each point's own place can make up for
        taken off.

        ``translate=False``: the cameras only turn, all points are far.
        """
        p = self.project(e)
        J, own = self._linearised(e, p, self._shown, translate)
        # A point that is held as far as it may be cannot go farther.
        farther = np.einsum("kip,kip->p", own[:, 2], p.residual) > 0
        own[:, 2, :, (e.X[:, 2] <= self.farthest) & farther] = 0.0
        V = np.einsum("kaip,kbip->abp", own, own)
        trace = np.einsum("aap->p", V)
        for axis in range(3):
            V[axis, axis] += 1e-9 * trace + 1e-12
        own = Triangles(V[:, :, None, None]).halfway(own.swapaxes(0, 1))
        return Freed(self._others, J, self._made_up(J[None], own[:, None])[0])

    def _linearised(self, e: Estimate, p: Projection, weight: Array, translate: bool) -> tuple[Array, Array]:
        """Derivatives of the projections by camera (rotation, place) and lens, and the residuals
        (..., K, 9, 2, P); derivatives by point (..., K, 3, 2, P).

        All times a weight (..., K, P), which is zero where unseen.
        """
        by_q, v = self._by_place(e, p, weight), p.turned[..., None, :]
        own = self._by_point(e, by_q)
        J = np.empty((*by_q.shape[:-3], 6 + _GLOBALS + 1, *by_q.shape[-2:]))
        for axis in range(3):  # v x dq
            after, last = (axis + 1) % 3, (axis + 2) % 3
            np.multiply(v[..., after, :, :], by_q[..., last, :, :], out=J[..., axis, :, :])
            J[..., axis, :, :] -= v[..., last, :, :] * by_q[..., after, :, :]
        if translate:
            np.multiply(by_q, e.X[..., None, None, None, :, 2], out=J[..., 3:6, :, :])
        else:
            J[..., 3:6, :, :] = own[..., 2, :, :] = 0.0
        np.multiply(p.u, weight[..., None, :], out=J[..., 6, :, :])
        np.multiply(p.xy, (_focal(e) * p.square * weight)[..., None, :], out=J[..., 7, :, :])
        np.multiply(p.residual, weight[..., None, :], out=J[..., 8, :, :])
        return J, own

    def _by_place(self, e: Estimate, p: Projection, weight: Array) -> Array:
        """Derivatives of the projections by q (..., K, 3, 2, P), times a weight (..., K, P)."""
        scale = _focal(e) * weight / p.depth
        by_q = np.empty((*p.xy.shape[:-2], 3, *p.xy.shape[-2:]))
        bent = (2 * _k1(e) * scale)[..., None, :] * p.xy
        straight = scale * (1 + _k1(e) * p.square)
        for axis in range(2):
            np.multiply(p.xy[..., axis, None, :], bent, out=by_q[..., axis, :, :])
            by_q[..., axis, axis, :] += straight
        np.multiply(by_q[..., 0, :, :], p.xy[..., 0, None, :], out=by_q[..., 2, :, :])
        by_q[..., 2, :, :] += by_q[..., 1, :, :] * p.xy[..., 1, None, :]
        np.negative(by_q[..., 2, :, :], out=by_q[..., 2, :, :])
        return by_q

    def _by_point(self, e: Estimate, by_q: Array) -> Array:
        """Derivatives of the projections by (a, b, rho), (..., K, 3, 2, P)."""
        axes = np.stack([e.R[..., 0], e.R[..., 1], e.t], axis=-2)  # dq / d(a, b, rho)
        return (axes @ by_q.reshape(*axes.shape[:-1], -1)).reshape(by_q.shape)

    def _step(self, e: Estimate, p: Projection, width: float, damping: Array, translate: bool) -> Estimate:
        """One damped Gauss-Newton step of each of S estimates: points are eliminated, cameras and lens
        solved, points filled in again."""
        # The robust weight belongs to squares.
        root = self._importance / (1 + p.error / (self._granted * width**2))
        J, own = self._linearised(e, p, self._shown * root[:, None], translate)
        V = np.einsum("skaip,skbip->absp", own, own)
        trace = V[0, 0] + V[1, 1] + V[2, 2] + 1e-12 * (root**2).max(axis=1, initial=1.0, keepdims=True)
        for axis in range(3):
            V[axis, axis] += (1e-3 * damping[:, None] + 1e-12) * trace
        points = Triangles(V[..., None, None, :])
        own = points.halfway(own.transpose(2, 0, 1, 3, 4))
        rows = self._made_up(J, own).reshape(len(J), -1, 3 * len(e.X[0]))
        U = self._of_cameras(e, J)
        left = U - rows @ rows.transpose(0, 2, 1)
        unknowns = np.arange(len(U[0]) - 1)
        diagonal = U[:, unknowns, unknowns]
        left[:, unknowns, unknowns] += damping[:, None] * diagonal + 1e-9 * diagonal.mean(axis=1)[:, None]
        shared_step = -np.asarray(np.linalg.solve(left[:, :-1, :-1], left[:, :-1, -1:]), np.float64)[..., 0]
        along = np.concatenate([shared_step, np.ones((len(U), 1))], axis=1)[:, None] @ rows
        own_step = -points.rest(along.reshape(len(U), 3, 1, 1, -1).swapaxes(0, 1))[:, :, 0, 0]
        return self._moved(e, shared_step, own_step.transpose(1, 2, 0), translate)

    def _made_up(self, J: Array, own: Array) -> Array:
        """Products (S, N + 1, 3, P) of the derivatives by cameras and lens, and of the residuals
        (S, K, 9, 2, P), with those by points (3, S, K, 2, P)."""
        count = 6 * (len(self.seen) - 1)
        products = np.empty((len(J), count + _GLOBALS + 1, 3, J.shape[-1]))
        cameras = products[:, :count].reshape(len(J), -1, 6, *products.shape[2:])
        before = self.reference
        for here, there in ((slice(before), slice(before)), (slice(before, None), slice(before + 1, None))):
            np.einsum("skcip,askip->skcap", J[:, there, :6], own[:, :, there], out=cameras[:, here])
        np.einsum("skcip,askip->scap", J[:, :, 6:], own, out=products[:, count:])
        return products

    def _of_cameras(self, e: Estimate, J: Array) -> Array:
        """Normal equations (S, N + 1, N + 1) of cameras and lens alone, the gradient in the last column."""
        U = _normal_equations(self._others, J)
        lens = np.arange(-_GLOBALS - 1, -1)
        U[:, lens, lens] += 1 / self.lens_spread**2
        U[:, lens, -1] += (e.lens - self.lens_prior) / self.lens_spread**2
        return U

    def _moved(self, e: Estimate, shared_step: Array, own_step: Array, translate: bool) -> Estimate:
        """The estimates after a step, their free scale fixed: root mean square of the camera's distances 1,
        rho >= 0."""
        others = self._others
        cameras = shared_step[:, :-_GLOBALS].reshape(len(shared_step), -1, 6)
        R, t = e.R.copy(), e.t.copy()
        R[:, others] = rotation(cameras[..., :3]) @ e.R[:, others]
        X = e.X + own_step
        if translate:
            t[:, others] += cameras[..., 3:]
            scale = np.sqrt((t * t).sum(axis=(1, 2)) / max(len(others), 1))
            scale = np.where(scale > 1e-9, scale, 1.0)
            t /= scale[:, None, None]
            X[..., 2] *= scale[:, None]
        X[..., 2] = np.maximum(X[..., 2], self.farthest)
        least, most = self.lens_prior - 3 * self.lens_spread, self.lens_prior + 3 * self.lens_spread
        lens = np.minimum(np.maximum(e.lens + shared_step[:, -_GLOBALS:], least), most)
        return Estimate(R, t, X, lens[:, 0], lens[:, 1])


def _normal_equations(others: NDArray[np.int64], J: Array) -> Array:
    """Those of cameras and lens (..., N + 1, N + 1), points where they are, the gradient in the last column;
    from derivatives and residuals (..., K, 9, 2, P)."""
    # A camera's unknowns touch its own measurements only: blocks (K, 9, 8) instead of one matrix.
    rows = J.reshape(*J.shape[:-2], -1)
    blocks = rows @ rows[..., :-1, :].swapaxes(-1, -2)
    cameras, stack = blocks[..., others, :, :], J.shape[:-4]
    each, count = np.arange(len(others)), 6 * len(others)
    U = np.zeros((*stack, count + _GLOBALS + 1, count + _GLOBALS + 1))
    by_camera = U[..., :count, :count].reshape(*stack, len(each), 6, len(each), 6).swapaxes(-3, -2)
    by_camera[..., each, each, :, :] = cameras[..., :6, :6]
    U[..., count:, :count] = cameras[..., 6:, :6].swapaxes(-3, -2).reshape(*stack, -1, count)
    U[..., :count, count:] = U[..., count:, :count].swapaxes(-1, -2)
    U[..., count:, count:-1] = blocks[..., 6:, 6:].sum(axis=-3)
    U[..., count:-1, -1] = U[..., -1, count:-1]
    return U


def _focal(e: Estimate) -> Array:
    """Focal length, to go with arrays (..., K, P)."""
    return np.asarray(np.exp(e.log_focal))[..., None, None]


def _k1(e: Estimate) -> Array:
    """Radial distortion, to go with arrays (..., K, P)."""
    return np.asarray(e.k1)[..., None, None]


def _square(residual: Array) -> Array:
    """Sum of squares of each point's residuals (..., K, 2, P)."""
    return np.asarray(np.einsum("...kip,...kip->...p", residual, residual))


def _values(every: Estimate | Projection) -> list[Any]:
    return [getattr(every, entry.name) for entry in fields(every)]


def _some(stack: _Stack, which: Bools) -> _Stack:
    """Those of a stack (S, ...) that are chosen (S,)."""
    return type(stack)(*(values[which] for values in _values(stack)))


def _where(better: Bools, new: _Stack, old: _Stack) -> _Stack:
    """Of a stack (S, ...) the new ones where these are better (S,), else the old ones."""
    if better.all() or not better.any():
        return new if better.all() else old
    chosen = [
        np.where(better.reshape(-1, *[1] * (x.ndim - 1)), x, y)
        for x, y in zip(_values(new), _values(old), strict=True)
    ]
    return type(new)(*chosen)

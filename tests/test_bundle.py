"""Bundle adjustment: derivatives against differences, and known cameras and depths found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from ifsvideo.segmentation.bundle import Bundle, Estimate, rotation, skew
from tests.scenes import FOCAL, SIZE, Camera, Mover, Scene, make_scene

SIDE = float(max(SIZE))
LENS = np.array([np.log(FOCAL / SIDE), 0.0])
REFERENCE = 2


def bundle_of(scene: Scene) -> Bundle:
    observed = ((scene.tracks.xy - (np.array(SIZE) - 1) / 2) / SIDE).transpose(0, 2, 1)
    points = scene.tracks.points
    tolerance = np.full(points, 0.4 / SIDE)
    spread = np.array([0.3, 0.15])
    return Bundle(observed, scene.tracks.visible, np.ones(points), tolerance, REFERENCE, LENS, spread)


def true_estimate(scene: Scene) -> Estimate:
    """Truth in the reference camera's coordinates, the camera's distances of root mean square 1."""
    camera, here = scene.camera, scene.camera.R[REFERENCE]
    R = camera.R @ here.T
    t = np.einsum("kij,kj->ki", camera.R, camera.centre[REFERENCE] - camera.centre)
    q = (scene.world[REFERENCE] - camera.centre[REFERENCE]) @ here.T
    scale = max(float(np.sqrt((t**2).sum() / (len(R) - 1))), 1e-12)
    X = np.column_stack([q[:, :2] / q[:, 2:], scale / q[:, 2]])
    return Estimate(R, t / scale, X, float(LENS[0]), float(LENS[1]))


def disturbed(e: Estimate, seed: int = 0) -> Estimate:
    rng = np.random.default_rng(seed)
    R = rotation(rng.normal(0, 0.005, (len(e.R), 3))) @ e.R
    t = e.t + rng.normal(0, 0.1, e.t.shape)
    R[REFERENCE], t[REFERENCE] = np.eye(3), 0
    X = e.X * rng.uniform([0.98, 0.98, 0.5], [1.02, 1.02, 1.5], e.X.shape)
    return Estimate(R, t, X, e.log_focal + 0.1, 0.05)


def turned_by(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between rotations, radians."""
    return np.asarray(Rotation.from_matrix(a @ b.transpose(0, 2, 1)).magnitude())


@pytest.fixture(scope="module")
def aside() -> Scene:
    return make_scene(Camera.path(frames=6, step=(0.5, 0.1, 0.3)), static=60, noise=0.0)


def test_rotation_and_skew() -> None:
    omega = np.random.default_rng(0).normal(0, 1, (5, 3))
    assert_allclose(rotation(omega), Rotation.from_rotvec(omega).as_matrix(), atol=1e-12)
    assert_allclose(rotation(np.zeros((1, 3)))[0], np.eye(3))
    assert_allclose(skew(omega[0]) @ omega[1], np.cross(omega[0], omega[1]))


def test_truth_projects_onto_what_was_observed(aside: Scene) -> None:
    bundle = bundle_of(aside)
    assert np.abs(bundle.residual(true_estimate(aside))).max() < 1e-12


def test_derivatives_agree_with_differences(aside: Scene) -> None:
    bundle, h = bundle_of(aside), 1e-6
    e = replace(disturbed(true_estimate(aside)), k1=0.1)
    by_shared, by_point = bundle._linearised(e, bundle.project(e), bundle.seen.astype(float), True)

    def difference(plus: Estimate, minus: Estimate) -> np.ndarray:
        return np.asarray((bundle.project(plus).u - bundle.project(minus).u) / (2 * h))

    for axis in range(3):
        nudge = h * np.eye(3)[axis]
        turn = [replace(e, R=rotation(sign * nudge) @ e.R) for sign in (1, -1)]
        move = [replace(e, t=e.t + sign * nudge) for sign in (1, -1)]
        point = [replace(e, X=e.X + sign * nudge) for sign in (1, -1)]
        assert_allclose(by_shared[:, axis], difference(turn[0], turn[1]), atol=1e-7)
        assert_allclose(by_shared[:, 3 + axis], difference(move[0], move[1]), atol=1e-7)
        assert_allclose(by_point[:, axis], difference(point[0], point[1]), atol=1e-7)
    focal = [replace(e, log_focal=e.log_focal + sign * h) for sign in (1, -1)]
    bend = [replace(e, k1=e.k1 + sign * h) for sign in (1, -1)]
    assert_allclose(by_shared[:, 6], difference(focal[0], focal[1]), atol=1e-7)
    assert_allclose(by_shared[:, 7], difference(bend[0], bend[1]), atol=1e-7)


def test_unseen_observations_have_no_say(aside: Scene) -> None:
    scene = aside.with_gaps(least=3)
    bundle, e = bundle_of(scene), disturbed(true_estimate(aside))
    hidden = ~scene.tracks.visible
    assert hidden.any()
    assert not bundle.residual(e).transpose(0, 2, 1)[hidden].any()
    for derivative in bundle._linearised(e, bundle.project(e), bundle.seen.astype(float), True):
        assert not derivative.transpose(0, 3, 1, 2)[hidden].any()


def test_finds_known_cameras_and_depths_up_to_scale(aside: Scene) -> None:
    truth, bundle = true_estimate(aside), bundle_of(aside)
    found = bundle.solve(disturbed(truth), [8.0, 4.0, 2.0] + [1.0] * 25)
    assert turned_by(found.R, truth.R).max() < 2e-3
    assert_allclose(found.t, truth.t, atol=0.03)
    assert_allclose(found.X[:, 2], truth.X[:, 2], rtol=0.1)
    assert found.log_focal == pytest.approx(truth.log_focal, abs=0.05)
    assert SIDE * bundle.rms(bundle.residual(found)).max() < 0.05


def test_scale_stays_fixed_and_points_in_front(aside: Scene) -> None:
    found = bundle_of(aside).solve(disturbed(true_estimate(aside)), [4.0, 1.0, 1.0])
    assert np.sqrt((found.t**2).sum() / (len(found.t) - 1)) == pytest.approx(1)
    assert (found.X[:, 2] >= 0).all()
    assert_allclose(found.R[REFERENCE], np.eye(3))
    assert not found.t[REFERENCE].any()


@pytest.mark.parametrize("seed", range(5))
def test_a_step_never_raises_the_cost(aside: Scene, seed: int) -> None:
    bundle, e = bundle_of(aside), disturbed(true_estimate(aside), seed)
    e = replace(e, X=e.X * [1, 1, 0.1], t=-e.t)  # far off: a whole step often overshoots
    costs = [bundle.cost(bundle.residual(e), 1.0)]
    for steps in range(1, 8):
        moved = bundle.solve(e, [1.0] * steps)
        costs.append(bundle.cost(bundle.residual(moved), 1.0))
    assert (np.diff(costs) <= 1e-9).all()
    assert costs[-1] < costs[0]


def test_several_estimates_are_solved_as_each_by_itself(aside: Scene) -> None:
    bundle, truth = bundle_of(aside), true_estimate(aside)
    far_off = disturbed(truth, 1)
    starts = [disturbed(truth), replace(far_off, X=far_off.X * [1, 1, 0.1], t=-far_off.t), truth]
    # The truth is idle soon, and ends before the others.
    together = bundle.solve_each(starts, [2.0] + [1.0] * 9)
    for start, found in zip(starts, together, strict=True):
        alone = bundle.solve(start, [2.0] + [1.0] * 9)
        for name in ("R", "t", "X", "log_focal", "k1"):
            assert_allclose(getattr(found, name), getattr(alone, name), atol=1e-9)


def test_points_alone_are_found_with_known_cameras(aside: Scene) -> None:
    truth, bundle = true_estimate(aside), bundle_of(aside)
    start = replace(truth, X=disturbed(truth).X)
    found = bundle.solve_points(start, 15)
    assert_allclose(found.X, truth.X, atol=1e-5)
    assert_allclose(found.R, truth.R)


def test_a_point_beyond_infinity_is_held_there() -> None:
    """A point that contracts towards the way ahead would lie behind the camera: no inverse depth fits."""
    camera = Camera.path(frames=6, step=(0, 0, 0.3), shake=0.0)
    scene = make_scene(camera, (Mover((3.0, 1.0, 20.0), (0, 0, 1.0)),), static=40, noise=0.0)
    bundle, truth = bundle_of(scene), true_estimate(scene)
    assert (bundle.solve(truth, [32.0] * 5).X[:, 2] >= 0).all()
    found = bundle.solve_points(truth, 20)
    car = scene.truth == 1
    assert not found.X[car, 2].any()
    assert SIDE * bundle.rms(bundle.residual(found))[car].min() > 0.4
    assert SIDE * bundle.rms(bundle.residual(found))[~car].max() < 1e-6


def test_a_point_may_not_be_farther_than_told(aside: Scene) -> None:
    truth = true_estimate(aside)
    held = np.where(np.arange(len(truth.X)) < 5, 2.0, 0.5) * truth.X[:, 2]
    bundle = bundle_of(aside).no_farther(held)
    found = bundle.solve_points(replace(truth, X=np.column_stack([truth.X[:, :2], held])), 20)
    assert_allclose(found.X[:5, 2], held[:5])
    assert_allclose(found.X[5:], truth.X[5:], atol=1e-5)
    error = SIDE * bundle.rms(bundle.residual(found))
    assert error[:5].min() > 0.5 > 1e-3 > error[5:].max()
    few = np.arange(3)
    assert_allclose(bundle.subset(few).farthest, held[:3])
    # Cameras that give way move such a point's picture, not its depth.
    assert bundle.without_places(found, True).subset(np.arange(5)[None]).square().min() > (0.5 / SIDE) ** 2


def test_the_spread_of_nearness_is_in_units_of_the_cameras_way() -> None:
    spread = {}
    for step in (0.05, 0.5):
        scene = make_scene(Camera.path(step=(step, 0, 0)), static=40)
        truth, bundle = true_estimate(scene), bundle_of(scene)
        spread[step] = bundle.spread_of_nearness(truth)
        assert (spread[step] > 0).all()
        # One way off by all that is granted: no more than that spread.
        moved = replace(truth, X=truth.X + spread[step][:, None] * [0, 0, 1])
        assert np.median(bundle.rms(bundle.residual(moved)) / bundle.tolerance) > 0.9
    # In units of the camera's way, which is ten times as long.
    assert np.median(spread[0.05] / spread[0.5]) == pytest.approx(1, rel=0.2)


def test_a_camera_that_only_turns() -> None:
    camera = Camera.path(frames=6, step=(0, 0, 0), turn=(0, 0.02, 0.005))
    scene = make_scene(camera, static=60, noise=0.0)
    truth, bundle = true_estimate(scene), bundle_of(scene)
    start = replace(truth, R=np.repeat(np.eye(3)[None], 6, axis=0), t=np.zeros((6, 3)))
    start = replace(start, X=start.X * [1, 1, 0])
    found = bundle.solve(start, [32.0, 16.0, 8.0, 4.0, 2.0] + [1.0] * 10, translate=False)
    assert turned_by(found.R, truth.R).max() < 1e-3
    assert not found.t.any()
    assert SIDE * bundle.rms(bundle.residual(found)).max() < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_three_movers_in_ten_do_not_pull_the_cameras(seed: int) -> None:
    scene = make_scene(Camera.path(frames=8, step=(0.5, 0.1, 0.3)), static=84, noise=0.1, seed=seed)
    rng = np.random.default_rng(seed)
    moving = np.arange(84) >= 58
    velocity = rng.normal(0, 4.0, (26, 2))
    xy = scene.tracks.xy.copy()
    xy[:, moving] += np.arange(8)[:, None, None] * velocity
    spoilt = replace(scene, tracks=replace(scene.tracks, xy=xy))
    truth, bundle = true_estimate(scene), bundle_of(spoilt)
    found = bundle.solve(disturbed(truth, seed), [16.0, 8.0, 8.0, 4.0, 4.0, 2.0, 2.0] + [1.0] * 20)
    error = SIDE * bundle.rms(bundle.residual(found))
    assert turned_by(found.R, truth.R).max() < 5e-3
    assert np.quantile(error[~moving], 0.95) < 0.4
    assert np.median(error[moving]) > 1.0


def test_a_subset_is_the_same_window_with_fewer_points(aside: Scene) -> None:
    bundle, e = bundle_of(aside), disturbed(true_estimate(aside))
    some = np.array([3, 5, 40])
    part = bundle.subset(some)
    assert_allclose(part.residual(replace(e, X=e.X[some])), bundle.residual(e)[..., some])


@pytest.mark.parametrize("translate", [True, False])
def test_what_is_left_without_places_is_the_misfit_after_points_found_their_best_ones(
    aside: Scene, translate: bool
) -> None:
    """A small step of the cameras changes residuals as the derivatives say, once the points have followed."""
    bundle = bundle_of(aside)
    start = disturbed(true_estimate(aside))
    if not translate:
        start = replace(start, t=np.zeros_like(start.t), X=start.X * [1, 1, 0])
    fitted = bundle.solve_points(start, 30)
    if not translate:
        fitted = replace(fitted, X=fitted.X * [1, 1, 0])
    step = np.zeros(6 * 5 + 2)
    step[-2] = 1e-4
    freed = bundle.without_places(fitted, translate)
    before, told = freed.square(), freed.square(step)
    after = bundle.without_places(replace(fitted, log_focal=fitted.log_focal + 1e-4), translate).square()
    assert_allclose(told - before, after - before, atol=0.01 * np.abs(after - before).max())
    # Nothing of it can be made up for by a point's own place.
    a_little = np.array([1e-6, -1e-6, 1e-6 * translate])
    followed = bundle.without_places(replace(fitted, X=fitted.X + a_little), translate)
    assert_allclose(followed.square(), before, atol=1e-9)


def test_what_points_tell_of_the_cameras_is_how_their_misfit_changes(aside: Scene) -> None:
    freed = bundle_of(aside).without_places(disturbed(true_estimate(aside)), True)
    some = freed.subset(np.array([np.arange(7, 30), np.arange(30, 53)]))
    rng = np.random.default_rng(0)
    weights, steps = rng.uniform(size=(2, 23)), 1e-2 * rng.normal(size=(2, 6 * 5 + 2))
    changes = (weights * (some.square(steps) - some.square())).sum(axis=1)
    for matrix, pull, step, change in zip(*some.information(weights), steps, changes, strict=True):
        assert 2 * pull @ step + step @ matrix @ step == pytest.approx(change)

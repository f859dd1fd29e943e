"""The cameras' freedom: what lies where they are badly known fits once they gave way, what moves does not."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.segmentation.leeway import Leeway
from ifsvideo.segmentation.world import World, fit_world
from tests.scenes import LEFT_CAR, RIGHT_CAR, SIZE, Camera, Scene, make_scene

THRESHOLD = 5.0


def world_of(scene: Scene, core: np.ndarray) -> World:
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    return world.fitted_to(core)


def fixed(world: World, points: np.ndarray) -> float:
    return float(np.median(world.evidence(THRESHOLD)[points]))


@pytest.mark.parametrize("seed", range(3))
def test_cameras_that_are_known_from_one_corner_give_way_to_the_rest_of_the_world(seed: int) -> None:
    scene = make_scene(Camera.path(step=(0.2, 0, 0.2)), seed=seed)
    x, y = scene.tracks.xy[0].T
    core = np.flatnonzero((x < 260) & (y < 200))
    rest = np.flatnonzero((x > 450) & (y > 300))
    assert len(core) >= 8
    assert len(rest) >= 8
    world = world_of(scene, core)
    leeway = Leeway(world, core, THRESHOLD)
    assert leeway.evidence([rest])[0] < 0.7 * fixed(world, rest)
    assert leeway.evidence([core])[0] == pytest.approx(fixed(world, core), rel=0.3)


@pytest.mark.parametrize("seed", range(3))
def test_cars_do_not_bend_cameras_that_the_whole_world_holds(seed: int) -> None:
    scene = make_scene(Camera.path(step=(0.1, 0, 0.2)), (LEFT_CAR, RIGHT_CAR), seed=seed)
    core = np.flatnonzero(scene.truth == 0)
    world = world_of(scene, core)
    leeway = Leeway(world, core, THRESHOLD)
    for car in (1, 2):
        points = np.flatnonzero(scene.truth == car)
        assert leeway.evidence([points])[0] > 1
        assert leeway.evidence([points])[0] > 0.25 * fixed(world, points)


def test_one_point_far_off_does_not_decide() -> None:
    scene = make_scene(Camera.path(step=(0.1, 0, 0.2)), (LEFT_CAR,))
    core = np.flatnonzero(scene.truth == 0)
    world = world_of(scene, core)
    mixed = np.append(core[:12], np.flatnonzero(scene.truth == 1)[:1])
    assert Leeway(world, core, THRESHOLD).evidence([mixed])[0] < 0.5

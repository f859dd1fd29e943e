"""The road's plane: where it is seen, nothing static lies below it; elsewhere it says nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ifsvideo.segmentation.road import find_road
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.segmentation.world import World, fit_world
from tests.scenes import SIZE, Camera, Mover, Scene, make_scene

HEIGHT = 1.4
FORWARD = Camera.path(step=(0, 0, 0.3))
ROAD = Mover(centre=(0.0, HEIGHT, 18.0), velocity=(0, 0, 0), extent=(14.0, 0.0, 24.0), points=80)
LEAD = Mover(centre=(0.3, 0.9, 11.0), velocity=(0, 0, 0.3), extent=(1.8, 1.0, 1.5), points=40)
"""A car that keeps its distance: nothing of it moves in the picture."""


def drive(*movers: Mover, camera: Camera = FORWARD, road: Mover = ROAD, seed: int = 0) -> Scene:
    """A road (static, like all that is above it) and movers, 1, 2, ..."""
    scene = make_scene(camera, (road, *movers), seed=seed, depth=(8.0, 60.0), static=400)
    shown = np.flatnonzero((scene.world[:, :, 1] < HEIGHT + 1e-9).all(axis=0))
    truth = np.maximum(scene.truth - 1, 0)
    return replace(scene, tracks=scene.tracks.select(shown), truth=truth[shown], world=scene.world[:, shown])


def world_of(scene: Scene) -> World:
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    return world


def free(world: World) -> World:
    """The same where nothing is known of the road."""
    bundle = world.bundle.no_farther(0.0)
    return replace(world, bundle=bundle, estimate=bundle.solve_points(world.estimate, 10))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_car_that_keeps_its_distance_would_be_below_the_road(seed: int) -> None:
    scene = drive(LEAD, seed=seed)
    world = world_of(scene)
    lead = scene.truth == 1
    assert np.median(free(world).evidence(5.0)[lead]) < 0.3  # as far as its own way tells it stands still
    assert np.median(world.evidence(5.0)[lead]) > 1.5
    assert np.mean(world.evidence(5.0)[~lead] < 1) > 0.99


def test_the_segmenter_finds_a_car_that_keeps_its_distance() -> None:
    scene = drive(LEAD)
    labels = IFSSegmenter().segment(scene.tracks).labels
    assert (labels[scene.truth == 1] > 0).mean() > 0.6
    assert (labels[scene.truth == 0] > 0).mean() < 0.02


def test_the_plane_is_where_the_road_is() -> None:
    world = world_of(drive())
    found = find_road(*evidence_for(world))
    assert found is not None
    n = found.m / np.linalg.norm(found.m)
    assert n[1] > 0.999
    # The camera's height, in the unit of the world: the root mean square of its way from the reference.
    way = np.sqrt((np.linalg.norm(FORWARD.centre[world.frames] - FORWARD.centre[9], axis=1) ** 2).mean())
    assert 1 / np.linalg.norm(found.m) == pytest.approx(HEIGHT / way, rel=0.15)
    below, above = np.array([[0.0, 0.3]]), np.array([[0.0, -0.3]])
    assert found.least_nearness(below)[0] > 0
    assert found.least_nearness(above)[0] == 0


def evidence_for(world: World) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `find_road` is told of a world."""
    e = world.estimate
    centres = -np.einsum("kij,ki->kj", e.R, e.t)
    sure = world.rms < 2.5 * world.tolerance
    return e.X, world.bundle.spread_of_nearness(e), sure, centres


@pytest.mark.parametrize(
    "camera",
    [Camera.path(step=(0, 0, 0)), Camera.path(step=(0, 0.1, 0.1)), Camera.path(step=(0, 0, 0.03))],
    ids=["stands", "rises from it", "hardly moves"],
)
def test_a_camera_that_does_not_drive_has_no_road(camera: Camera) -> None:
    world = world_of(drive(camera=camera))
    assert not world.bundle.farthest.any()


def test_a_road_of_a_few_points_is_none() -> None:
    world = world_of(drive(road=replace(ROAD, points=8)))
    assert not world.bundle.farthest.any()


def test_what_lies_lower_than_the_plane_in_many_places_says_that_it_is_no_road() -> None:
    """A table's plane, and the floor beside it."""
    floor = Mover(centre=(0.0, 3 * HEIGHT, 24.0), velocity=(0, 0, 0), extent=(20.0, 0.0, 24.0), points=80)
    scene = make_scene(FORWARD, (replace(ROAD, points=60), floor), depth=(8.0, 60.0), static=400)
    shown = np.flatnonzero((scene.world[:, :, 1] < 0).all(axis=0) | (scene.truth > 0))
    world = world_of(replace(scene, tracks=scene.tracks.select(shown)))
    assert (world.evidence(5.0) < 1).mean() > 0.99

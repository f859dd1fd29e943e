"""The static world of a window: whom it explains, whom it does not, and when it says nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ifsvideo.segmentation import world as fitting
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.world import World, fit_world
from ifsvideo.types import Tracks
from tests.scenes import LEFT_CAR, RIGHT_CAR, SIZE, Camera, Mover, Scene, make_scene


def static_evidence(
    tracks: Tracks, size: tuple[int, int], threshold: float, rng: np.random.Generator
) -> tuple[np.ndarray, World | None]:
    world = fit_world(tracks, size, rng)
    return (np.zeros(tracks.points) if world is None else world.evidence(threshold)), world


FORWARD = Camera.path(step=(0, 0, 0.3))


def evidence_of(scene: Scene) -> np.ndarray:
    threshold = SegmenterConfig().evidence_threshold
    evidence, world = static_evidence(scene.tracks, SIZE, threshold, np.random.default_rng(0))
    assert world is not None
    assert evidence.shape == world.tolerance.shape == (scene.tracks.points,)
    assert (world.tolerance > 0).all()
    return evidence


CAMERAS = {
    "ahead": FORWARD,
    "aside": Camera.path(step=(0.2, 0, 0)),
    "turning": Camera.path(step=(0.05, 0, 0.25), turn=(0, 0.005, 0)),
    "only turning": Camera.path(step=(0, 0, 0), turn=(0, 0.005, 0)),
    "standing": Camera.path(step=(0, 0, 0), shake=0.0),
}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())
@pytest.mark.parametrize("gaps", [False, True])
def test_a_rigid_scene_has_no_movers(camera: Camera, gaps: bool) -> None:
    scene = make_scene(camera, depth=(8.0, 80.0))  # near to far as 1 to 10
    if gaps:
        scene = scene.with_gaps()
    assert (evidence_of(scene) < 1).mean() >= 0.97


@pytest.mark.parametrize("name", CAMERAS)
def test_movers_do_not_fit_into_it(name: str) -> None:
    scene = make_scene(CAMERAS[name], (LEFT_CAR, RIGHT_CAR), seed=1)
    evidence = evidence_of(scene)
    assert (evidence[scene.truth == 0] < 1).mean() >= 0.97
    for car in (1, 2):
        assert (evidence[scene.truth == car] > 1).mean() > 0.9


def with_bonnet(scene: Scene, points: int = 60) -> Tracks:
    """The same tracks with as many in a corner of the picture, fixed to the camera."""
    rng = np.random.default_rng(3)
    strip = rng.uniform([40, SIZE[1] - 20], [290, SIZE[1] - 2], (points, 2))
    fixed = strip + rng.normal(0, 0.1, (scene.tracks.frames, points, 2))
    return Tracks.from_array(np.concatenate([scene.tracks.xy, fixed], axis=1), size=SIZE)


def test_what_is_fixed_to_the_camera_tells_nothing_of_the_world() -> None:
    """Hills far off on poor pictures, and the bonnet, which fits a camera that stands far better."""
    camera = Camera.path(frames=30, step=(0, 0, 0.3), turn=(0, 0.002, 0))
    static, fits = 60, []
    for seed in range(6):
        tracks = with_bonnet(make_scene(camera, static=static, depth=(40.0, 400.0), noise=0.65, seed=seed))
        evidence, world = static_evidence(tracks, SIZE, 5.0, np.random.default_rng(0))
        assert np.array_equal(np.flatnonzero(world.bundle.weight == 0), np.arange(static, tracks.points))
        fits.append((evidence[:static] < 1).mean())
    assert np.mean(fits) > 0.75


def test_too_few_points_beside_the_bonnet_are_asked_with_it() -> None:
    """Fewer points move than a world needs: then all tell."""
    scene = make_scene(FORWARD, static=7)
    world = fit_world(with_bonnet(scene, 1), SIZE, np.random.default_rng(0))
    assert (world.bundle.weight > 0).all()


def test_before_a_standing_camera_what_rests_is_the_world() -> None:
    """Though something moves in most of the picture."""
    scene = make_scene(CAMERAS["standing"], (LEFT_CAR, RIGHT_CAR), static=60)
    evidence = evidence_of(scene)
    assert (evidence[scene.truth == 0] < 1).all()
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert (world.bundle.weight > 0).all()


@pytest.mark.parametrize("name", ["standing", "only turning"])
@pytest.mark.parametrize("car", [LEFT_CAR, RIGHT_CAR], ids=["left", "right"])
def test_one_car_before_a_camera_that_stays_is_no_parallax(name: str, car: Mover) -> None:
    """A camera that passes the car while all else is far away would fit as well."""
    scene = make_scene(CAMERAS[name], (car,))
    evidence = evidence_of(scene)
    assert (evidence[scene.truth == 0] < 1).mean() >= 0.97
    assert (evidence[scene.truth == 1] > 1).mean() > 0.9


@pytest.mark.parametrize("name", ["standing", "only turning"])
def test_a_camera_that_surely_stayed_is_not_tried_on_its_way_and_that_changes_nothing(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    tracks = make_scene(CAMERAS[name], (LEFT_CAR,), seed=1).tracks
    tried = []

    def counting(*arguments: Any) -> Any:
        tried.append(arguments)
        return best_start(*arguments)

    best_start, in_many_places = fitting._best_start, fitting._in_many_places
    monkeypatch.setattr(fitting, "_best_start", counting)
    without = fit_world(tracks, SIZE, np.random.default_rng(0))
    assert not tried
    # As if some cells were not enough to tell that it stayed.
    told: list[bool] = []

    def at_first_unsure(*arguments: Any) -> bool:
        told.append(in_many_places(*arguments) if told else True)
        return told[-1]

    monkeypatch.setattr(fitting, "_in_many_places", at_first_unsure)
    tried_all = fit_world(tracks, SIZE, np.random.default_rng(0))
    assert len(tried) == 1
    assert told == [True, False]
    assert without is not None
    assert tried_all is not None
    assert np.array_equal(without.evidence(1.0), tried_all.evidence(1.0))


def test_movers_in_broken_tracks() -> None:
    scene = make_scene(FORWARD, (LEFT_CAR,)).with_gaps(least=10)
    evidence = evidence_of(scene)
    assert (evidence[scene.truth == 0] < 1).mean() >= 0.97
    assert (evidence[scene.truth == 1] > 1).mean() > 0.9


@pytest.mark.parametrize(
    ("velocity", "acceleration"),
    [((0, 0, 0.45), (0, 0, 0)), ((0, 0, 0.3), (0, 0, 0.03))],
    ids=["gap opens", "gap closes, then opens"],
)
def test_a_car_followed_at_a_changing_distance(velocity: tuple, acceleration: tuple) -> None:
    """It moves in parallel with the camera, so every fundamental matrix holds it for static."""
    car = Mover((0.5, 0.5, 12.0), velocity, acceleration, extent=(3.0, 2.0, 3.0))
    scene = make_scene(FORWARD, (car,))
    evidence = evidence_of(scene)
    assert (evidence[scene.truth == 0] < 1).mean() >= 0.97
    assert (evidence[scene.truth == 1] > 1).mean() > 0.7


def test_depths_are_found_up_to_scale() -> None:
    scene = make_scene(FORWARD, noise=0.05)
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    middle = world.frames[world.bundle.reference]
    depth = (scene.world[middle] - scene.camera.centre[middle]) @ scene.camera.R[middle][2]
    # The camera does not turn, so that a point moves by its depth alone.
    sure = np.linalg.norm(scene.tracks.xy[-1] - scene.tracks.xy[0], axis=1) > 20
    assert sure.sum() > 30
    product = world.estimate.X[sure, 2] * depth[sure]
    assert np.std(product) < 0.05 * np.mean(product)


def test_more_noise_is_granted_to_all() -> None:
    """Footage that fits worse everywhere is usual for the window, not a picture full of movers."""
    assert (evidence_of(make_scene(FORWARD, noise=0.6)) < 1).mean() >= 0.97


def test_the_size_of_the_picture_does_not_matter() -> None:
    scene = make_scene(FORWARD, (LEFT_CAR,))
    large = Tracks.from_array(scene.tracks.xy * 3 + 1)
    threshold = SegmenterConfig().evidence_threshold
    small, world = static_evidence(scene.tracks, SIZE, threshold, np.random.default_rng(0))
    other, wider = static_evidence(large, (1920, 1440), threshold, np.random.default_rng(0))
    assert world is not None
    assert wider is not None
    assert wider.tolerance == pytest.approx(3 * world.tolerance, rel=1e-3)
    assert ((small > 1) == (other > 1)).mean() > 0.98


def test_too_few_points_say_nothing() -> None:
    scene = make_scene(static=7)
    assert fit_world(scene.tracks, SIZE, np.random.default_rng(0)) is None
    evidence, world = static_evidence(scene.tracks, SIZE, 5.0, np.random.default_rng(0))
    assert world is None
    assert not evidence.any()


def test_points_that_share_no_frames_say_nothing() -> None:
    xy = np.full((20, 40, 2), np.nan)
    xy[np.arange(40) % 20, np.arange(40)] = 100.0
    assert fit_world(Tracks.from_array(xy), SIZE, np.random.default_rng(0)) is None


def test_a_point_without_two_key_frames_has_no_evidence() -> None:
    xy = make_scene(FORWARD).tracks.xy.copy()
    xy[:-1, 0] = np.nan
    xy[:, 1] = np.nan
    world = fit_world(Tracks.from_array(xy), SIZE, np.random.default_rng(0))
    assert world is not None
    assert np.isnan(world.rms[:2]).all()
    assert np.isfinite(world.rms[2:]).all()
    evidence, _ = static_evidence(Tracks.from_array(xy), SIZE, 5.0, np.random.default_rng(0))
    assert not evidence[:2].any()
    assert np.isfinite(evidence).all()


@pytest.mark.parametrize("frames", [2, 3, 5])
def test_few_frames(frames: int) -> None:
    scene = make_scene(Camera.path(frames=frames, step=(0, 0, 0.5)))
    assert (evidence_of(scene) < 1).mean() >= 0.97


@pytest.mark.parametrize("value", [0.0, 100.0])
def test_points_that_all_share_a_place(value: float) -> None:
    tracks = Tracks.from_array(np.full((10, 20, 2), value))
    evidence, _ = static_evidence(tracks, SIZE, 5.0, np.random.default_rng(0))
    assert (evidence < 1).all()


def test_same_seed_same_evidence() -> None:
    scene = make_scene(FORWARD, (LEFT_CAR,))
    assert np.array_equal(evidence_of(scene), evidence_of(scene))


@pytest.mark.parametrize("seed", [0, 2])
def test_a_world_of_static_points_alone_tells_a_mover_that_was_explained_before(seed: int) -> None:
    """Aside of a camera that goes aside, a steady car is like a thing at another depth."""
    scene = make_scene(Camera.path(step=(0.2, 0, 0)), (LEFT_CAR, RIGHT_CAR), seed=seed)
    few = np.flatnonzero(scene.truth == 0)[:40]
    shown = np.sort(np.concatenate([few, np.flatnonzero(scene.truth > 0)]))
    tracks, truth = scene.tracks.select(shown), scene.truth[shown]
    world = fit_world(tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    static = np.flatnonzero(truth == 0)
    before, after = world.evidence(5.0), world.fitted_to(static).evidence(5.0)
    assert np.median(before[truth == 2]) < 1 < 1.3 < np.median(after[truth == 2])
    assert np.median(after[truth == 1]) > 5
    assert np.median(after[static]) < 0.3
    assert world.fitted_to(static[:3]) is world  # three points make no world


def test_a_way_too_slight_for_all_points_is_found_from_those_that_are_surely_static() -> None:
    """Two millimetres a frame before a scene 4 to 30 m away: half a pixel of parallax in all. What crosses
    the view is not taken for something a hundred times nearer."""
    scene = make_scene(Camera.path(step=(0.002, 0, 0)), (RIGHT_CAR,), noise=0.03)
    static = np.flatnonzero(scene.truth == 0)
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    assert not world.has_moved
    own = world.fitted_to(static)
    assert own.has_moved
    assert np.median(own.rms[static]) < 0.6 * np.median(world.rms[static])
    assert np.median(own.evidence(5.0)[scene.truth == 1]) > 5


@pytest.mark.parametrize("turn", [0.0, 0.01])
def test_a_camera_that_stands_or_turns_is_not_set_off_by_noise(turn: float) -> None:
    for seed in range(3):
        scene = make_scene(Camera.path(step=(0, 0, 0), turn=(0, turn, 0)), (LEFT_CAR,), seed=seed)
        world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
        assert world is not None
        assert not world.fitted_to(np.flatnonzero(scene.truth == 0)).has_moved


def test_nearness_is_the_cameras_way_over_the_distance() -> None:
    scene = make_scene(FORWARD, depth=(8.0, 80.0))
    world = fit_world(scene.tracks, SIZE, np.random.default_rng(0))
    assert world is not None
    assert (world.nearness >= 0).all()
    again = world.fitted_to(np.arange(scene.tracks.points))
    assert np.corrcoef(world.nearness, again.nearness)[0, 1] > 0.99
    turning = fit_world(make_scene(CAMERAS["standing"]).tracks, SIZE, np.random.default_rng(0))
    assert turning is not None
    assert not turning.nearness.any()
    assert not turning.has_moved

"""Points fixed to the camera: told from the world by its shake, and from nothing when nothing moves."""

from __future__ import annotations

import numpy as np
import pytest

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.camera_fixed import CameraFixed
from ifsvideo.tracking.steps import steps_of
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import FramePoints, Tracks
from tests.scenes import SIZE, Camera, Mover, make_scene

CONFIG = ObjectsConfig()
SHAKING = Camera.path(frames=40, step=(0, 0, 0.15), shake=0.02)
SMOOTH = Camera.path(frames=40, step=(0, 0, 0.15), shake=0.0)
STANDING = Camera.path(frames=40, step=(0, 0, 0), shake=0.0)


def with_logo(camera: Camera, movers: tuple[Mover, ...] = (), jitter: float = 0.1) -> Trajectories:
    """A scene and twelve more tracks, ids 1000 to 1011, that stay where they are in the picture."""
    rng = np.random.default_rng(0)
    scene = make_scene(camera, movers)
    frames = scene.tracks.frames
    logo = rng.uniform((20, 400), (200, 470), (12, 2)) + rng.normal(0, jitter, (frames, 12, 2))
    ids = np.concatenate([scene.tracks.ids, 1000 + np.arange(12)])
    return Trajectories.from_tracks(
        Tracks.from_array(np.concatenate([scene.tracks.xy, logo], axis=1), ids=ids)
    )


def camera_fixed_tracks(trajectories: Trajectories, config: ObjectsConfig, step: int = 15) -> np.ndarray:
    """What is known at the end, where a look is taken every few frames."""
    fixed = CameraFixed(trajectories.size, 30.0, config)
    for frame, each in enumerate(steps_of(trajectories), 1):
        fixed.add(each.points)
        if frame % step == 0:
            fixed.update()
    fixed.update()
    return fixed.ids


def scaled(trajectories: Trajectories, factor: float) -> Trajectories:
    xy = (trajectories.xy * factor).astype(np.float32)
    size = (int(SIZE[0] * factor), int(SIZE[1] * factor))
    return Trajectories(trajectories.frame, trajectories.ids, xy, trajectories.frames, size)


@pytest.mark.parametrize("factor", [0.5, 1.0, 8.0])
def test_a_logo_before_a_shaking_world(factor: float) -> None:
    fixed = camera_fixed_tracks(scaled(with_logo(SHAKING, jitter=0.1), factor), CONFIG)
    assert fixed.tolist() == list(range(1000, 1012))


def test_nothing_is_fixed_to_a_camera_that_stands() -> None:
    car = Mover((-4.0, 0.5, 15.0), (0.3, 0.0, 0.0))
    for movers in ((), (car,)):
        assert not len(camera_fixed_tracks(scaled(with_logo(STANDING, movers), 1.0), CONFIG))


def test_without_shake_there_is_no_telling() -> None:
    """Ahead of a camera that drives smoothly, the far end of the road stays put as well."""
    whole = with_logo(SMOOTH)
    # As many points on all sides of the way ahead, so that what they have in common is nothing.
    other = (np.array(SIZE) - 1 - whole.xy)[whole.ids < 1000]
    frame = np.concatenate([whole.frame, whole.frame[whole.ids < 1000]])
    order = np.argsort(frame, kind="stable")
    both = Trajectories(
        frame[order],
        np.concatenate([whole.ids, 5000 + whole.ids[whole.ids < 1000]])[order],
        np.concatenate([whole.xy, other.astype(np.float32)])[order],
        whole.frames,
        SIZE,
    )
    assert not len(camera_fixed_tracks(both, CONFIG))


def test_a_distant_world_that_shakes_is_not_fixed() -> None:
    scene = make_scene(Camera.path(frames=40, step=(0, 0, 0.1), shake=0.02), depth=(50, 500))
    assert not len(camera_fixed_tracks(Trajectories.from_tracks(scene.tracks), CONFIG))


def test_a_followed_car_is_not_fixed() -> None:
    """Its distance varies, and the camera pitches and yaws."""
    car = Mover((0.0, 0.5, 12.0), (0, 0, 0.15), (0, 0, 0.002))
    scene = make_scene(SHAKING, (car,))
    assert not len(camera_fixed_tracks(Trajectories.from_tracks(scene.tracks), CONFIG))


def test_a_broken_logo_is_fixed_wherever_it_lives_long_enough() -> None:
    whole = with_logo(SHAKING)
    seen = (whole.ids < 1000) | (whole.frame % 40 > 12) | (whole.ids % 2 == 0)
    part = Trajectories(whole.frame[seen], whole.ids[seen], whole.xy[seen], whole.frames, SIZE)
    assert camera_fixed_tracks(part, CONFIG).tolist() == list(range(1000, 1012))


@pytest.mark.parametrize("frames", [0, 1, 5])
def test_no_points_are_no_error(frames: int) -> None:
    empty = Trajectories(np.empty(0, np.int32), np.empty(0, np.int64), np.empty((0, 2), np.float32), frames)
    fixed = camera_fixed_tracks(empty, CONFIG)
    assert fixed.shape == (0,)
    assert fixed.dtype == np.int64


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_few_frames_fix_nothing(frames: int) -> None:
    tracks = make_scene(static=20).tracks
    short = Tracks.from_array(tracks.xy[:frames])
    assert not len(camera_fixed_tracks(Trajectories.from_tracks(short), CONFIG))
    assert not len(camera_fixed_tracks(Trajectories.from_tracks(short.select(np.arange(1))), CONFIG))


def test_points_that_all_vanish_are_no_error() -> None:
    """A fade to black: the frames since the last look have no points, the one before them had."""
    fixed = CameraFixed(SIZE, 30.0, CONFIG)
    for count in (5, 5, 0, 0, 3, 3):
        fixed.add(FramePoints(np.arange(count), np.zeros((count, 2), np.float32)))
        fixed.update()
    assert not len(fixed.ids)

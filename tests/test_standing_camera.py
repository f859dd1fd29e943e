"""Before a camera that stands or turns each track tells by itself whether it moves; else none does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ifsvideo.objects.standing_camera import add_movers, add_vanished, sure_of_added
from ifsvideo.types import Tracks
from tests.scenes import SIZE, Camera, Mover, Scene, make_scene

WALKER = Mover(centre=(0.0, 0.0, 12.0), velocity=(0.12, 0.0, 0.0), extent=(0.5, 1.0, 0.3), points=3)
STANDS, TURNS = Camera.path(step=(0, 0, 0), shake=0.0), Camera.path(step=(0, 0, 0), turn=(0.0, 0.01, 0.002))


def told(scene: Scene, labels: np.ndarray | None = None) -> np.ndarray:
    """Labels of all tracks, where the window took all for background unless told."""
    if labels is None:
        labels = np.zeros(scene.tracks.points, np.int64)
    return add_movers(scene.tracks, np.arange(scene.tracks.points), labels, 1.0)


def shortened(scene: Scene, frames: int) -> Scene:
    """The movers are seen but a few frames, in the middle of the window."""
    xy = scene.tracks.xy.copy()
    middle = len(xy) // 2
    away = np.ones(len(xy), bool)
    away[middle : middle + frames] = False
    xy[np.ix_(away, scene.truth > 0)] = np.nan
    return replace(scene, tracks=Tracks.from_array(xy, size=SIZE))


@pytest.mark.parametrize("camera", [STANDS, TURNS], ids=["stands", "turns"])
@pytest.mark.parametrize("frames", [20, 4, 2])
def test_few_and_short_tracks_tell_that_they_move(camera: Camera, frames: int) -> None:
    scene = shortened(make_scene(camera, (WALKER,), static=300), frames)
    assert told(scene).tolist() == scene.truth.tolist()


@pytest.mark.parametrize("step", [(0.0, 0.0, 0.1), (0.05, 0.0, 0.0)])
def test_nothing_is_told_where_there_is_parallax(step: tuple[float, float, float]) -> None:
    scene = make_scene(Camera.path(step=step), (WALKER,), static=300)
    assert not told(scene).any()


def test_things_apart_are_things_of_their_own_and_single_tracks_none() -> None:
    second = replace(WALKER, centre=(-4.0, 0.0, 12.0))
    single = replace(WALKER, centre=(4.0, 0.0, 12.0), points=1)
    scene = make_scene(STANDS, (WALKER, second, single), static=300)
    labels = told(scene)
    assert {len(set(labels[scene.truth == k])) for k in (1, 2)} == {1}
    assert len(set(labels[scene.truth > 0])) == 3
    assert not labels[np.isin(scene.truth, (0, 3))].any()


def test_tracks_join_the_thing_that_is_near_and_goes_alike() -> None:
    across = replace(WALKER, velocity=(0.0, 0.08, 0.0))
    scene = make_scene(STANDS, (WALKER, across), static=300)
    labels = np.where(scene.truth == 1, 7, 0)
    labels[np.flatnonzero(scene.truth == 1)[0]] = 0
    expected = np.where(scene.truth == 1, 7, np.where(scene.truth == 2, 8, 0))
    assert told(scene, labels).tolist() == expected.tolist()


def test_a_small_background_tells_nothing() -> None:
    scene = make_scene(STANDS, (WALKER,), static=30)
    assert not told(scene).any()
    assert told(scene, np.full(scene.tracks.points, -1)).tolist() == [-1] * scene.tracks.points


@pytest.mark.parametrize(
    ("camera", "frame", "away", "expected"),
    [
        (STANDS, 9, 0.0, 1),
        (STANDS, 9, 60.0, -1),  # beside nothing that moves
        (STANDS, 0, 0.0, -1),  # may have been there before
        (STANDS, 19, 0.0, -1),  # may go on
        (TURNS, 9, 0.0, -1),
    ],
    ids=["stands", "away", "first", "last", "turns"],
)
def test_what_is_lost_at_once_before_a_camera_that_stands_is_of_what_moves(
    camera: Camera, frame: int, away: float, expected: int
) -> None:
    scene = make_scene(camera, (replace(WALKER, extent=(0.2, 0.4, 0.3)),), static=300)
    walker = scene.truth == 1
    seen_once = np.full((20, 1, 2), np.nan)
    seen_once[frame, 0] = scene.tracks.xy[frame, walker].mean(axis=0) + np.array([away, 0.0])
    tracks = Tracks.from_array(np.concatenate([scene.tracks.xy, seen_once], axis=1), size=SIZE)
    labels = np.append(walker.astype(np.int64), -1)
    told = add_vanished(tracks, np.arange(len(walker)), labels, 1.0)
    assert told.tolist() == [*labels[:-1].tolist(), expected]


def test_what_is_lost_at_once_tells_nothing_before_a_small_background() -> None:
    scene = make_scene(STANDS, (WALKER,), static=30)
    seen_once = np.full((20, 1, 2), np.nan)
    seen_once[9] = scene.tracks.xy[9, scene.truth == 1][:1]
    tracks = Tracks.from_array(np.concatenate([scene.tracks.xy, seen_once], axis=1), size=SIZE)
    labels = np.append((scene.truth == 1).astype(np.int64), -1)
    assert add_vanished(tracks, np.arange(len(scene.truth)), labels, 1.0)[-1] == -1


def test_many_tracks_are_surer_than_few() -> None:
    labels = np.array([0, 1, 1, 2, 2, 2, 2, 3])
    sure = sure_of_added(labels, np.arange(8) > 0)
    assert sure[0] == 0
    assert sure[7] < sure[1] == sure[2] < sure[3] < 1
    assert not sure_of_added(labels, np.zeros(8, bool)).any()


def test_no_tracks() -> None:
    none = np.empty(0, np.int64)
    for add in (add_movers, add_vanished):
        assert add(Tracks.from_array(np.empty((5, 0, 2))), none, none, 1.0).shape == (0,)

"""Tracks from anywhere: one window where they last, windows as long as they live elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

import ifsvideo
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter, _Prepared
from ifsvideo.segmenting import TracksSegmenter, window_length
from ifsvideo.types import Segmentation, Tracks
from tests.scenes import LEFT_CAR, SIZE, Camera, Mover, Scene, make_scene, share_wrong

LASTING = SegmenterConfig().lasting


def drive(frames: int, life: int, seed: int = 0) -> Scene:
    """A camera that goes ahead and a car that crosses, points seen for ``life`` frames each, cut at random:
    the first of them are behind the camera in the end."""
    camera = Camera.path(frames=frames, step=(0, 0, 0.3), shake=0.002)
    rng = np.random.default_rng(seed)
    reach = 0.15 * frames
    side = rng.choice([-1, 1], 6000) * rng.uniform(2, 12, 6000)
    street = np.column_stack([side, rng.uniform(-4, 1.5, 6000), rng.uniform(-reach, reach + 60, 6000)])
    time = np.arange(frames) - (frames - 1) / 2
    box = rng.uniform(-0.5, 0.5, (250, 3)) * (2.5, 1.5, 2.5) + (0, 0.3, 14)
    way = np.column_stack([2.2 * np.sin(time / 12), 0 * time, 0.3 * time])
    world = np.concatenate([np.repeat(street[None], frames, axis=0), box + way[:, None]], axis=1)
    truth = np.repeat([0, 1], [len(street), len(box)])
    xy, depth = camera.see(world)
    seen = ((xy >= 0) & (xy < SIZE)).all(axis=2) & (depth > 2) & (depth < 50)
    born = rng.integers(-life, frames, len(truth))
    alive = (np.arange(frames)[:, None] >= born) & (np.arange(frames)[:, None] < born + life)
    shown = np.flatnonzero((seen & alive).sum(axis=0) >= 4)
    xy = xy + rng.normal(0, 0.1, xy.shape)
    tracks = Tracks.from_array(xy[:, shown], (seen & alive)[:, shown], size=SIZE)
    return Scene(tracks, truth[shown], camera, world[:, shown])


def test_tracks_that_last_are_one_window() -> None:
    tracks = make_scene(movers=(LEFT_CAR,)).tracks
    ours, one = TracksSegmenter().segment(tracks), IFSSegmenter(alone=True).segment(tracks)
    assert np.array_equal(ours.labels, one.labels)
    assert np.array_equal(ours.segments, one.segments)
    assert np.array_equal(ours.confidence, one.confidence)


def test_one_window_is_voted_on_and_windows_of_a_drive_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where every run doubts, and none is like another."""
    made: list[int] = []

    def run(self: IFSSegmenter, prepared: _Prepared, *_: object) -> Segmentation:
        made.append(prepared.tracks.points)
        labels = np.arange(made[-1]) % (1 + len(made))
        sure, still = np.ones(len(labels)), labels == 0
        return Segmentation(labels, still, labels, sure, {"doubt": 0.5, "world": None})

    monkeypatch.setattr(IFSSegmenter, "_stages", run)
    tracks = make_scene(static=20).tracks
    for votes, runs in ((5, 5), (1, 1)):
        made.clear()
        TracksSegmenter(SegmenterConfig(votes=votes)).segment(tracks)
        assert len(made) == runs
    made.clear()
    short = drive(40, 12).tracks
    length = window_length(short, LASTING)
    assert length is not None
    TracksSegmenter().segment(short)
    assert len(made) <= 2 * 40 / length + 1


@pytest.mark.parametrize("seed", [0, 1])
def test_a_long_drive_of_short_tracks_is_one_world_and_one_car(seed: int) -> None:
    scene = drive(90, 16, seed)
    labels = ifsvideo.segment(scene.tracks).labels
    assert share_wrong(labels, scene.truth) < 0.05
    car = labels[scene.truth == 1]
    assert (car == 1).mean() > 0.8  # one number from the first frame to the last
    # As one window, what the camera has passed before the middle has no place in its picture.
    one_window = IFSSegmenter().segment(scene.tracks).labels
    assert share_wrong(labels, scene.truth) < 0.5 * share_wrong(one_window, scene.truth)


def test_windows_need_no_more_frames_than_there_are() -> None:
    scene = drive(12, 8)
    labels = ifsvideo.segment(scene.tracks).labels
    assert labels.shape == (scene.tracks.points,)
    assert (labels[scene.truth == 0] <= 0).mean() > 0.95


def test_ids_and_the_pictures_size_may_be_anything() -> None:
    scene = drive(60, 16)
    told = ifsvideo.segment(scene.tracks).labels
    renamed = Tracks.from_array(
        scene.tracks.xy, scene.tracks.visible, 10**6 - 7 * np.arange(scene.tracks.points), SIZE
    )
    assert np.array_equal(ifsvideo.segment(renamed).labels, told)
    untold = ifsvideo.segment(scene.tracks.xy).labels
    assert share_wrong(untold, scene.truth) < 0.1


def test_the_same_seed_gives_the_same_labels() -> None:
    scene = drive(40, 12)
    one, other = (ifsvideo.segment(scene.tracks, seed=3) for _ in range(2))
    assert np.array_equal(one.labels, other.labels)
    assert np.array_equal(one.confidence, other.confidence)
    assert ((one.confidence >= 0) & (one.confidence <= 1)).all()


def test_who_knows_the_number_of_motions_or_wants_the_thesis_has_one_window() -> None:
    scene = drive(30, 12)
    assert np.array_equal(
        ifsvideo.segment(scene.tracks, motions=2).labels, IFSSegmenter().segment(scene.tracks, 2).labels
    )
    thesis = SegmenterConfig.thesis()
    assert np.array_equal(
        ifsvideo.segment(scene.tracks, config=thesis).labels,
        IFSSegmenter(thesis).segment(scene.tracks).labels,
    )


def test_objects_are_numbered_by_size() -> None:
    near = Mover((-2.0, 0.5, 12.0), (0.15, 0, 0.3), points=60)
    far = Mover((4.0, 0.5, 16.0), (-0.2, 0, 0.2), points=25)
    scene = make_scene(Camera.path(frames=40, step=(0, 0, 0.2)), (far, near), static=150)
    labels = ifsvideo.segment(scene.with_gaps(least=12).tracks).labels
    sizes = np.bincount(labels[labels > 0])[1:]
    assert len(sizes) >= 2
    assert (sizes > 0).all()
    assert (np.diff(sizes) <= 0).all()


@pytest.mark.parametrize("points", [0, 1, 30])
def test_points_seen_once_are_undecided(points: int) -> None:
    visible = np.zeros((20, points), bool)
    visible[np.arange(points) % 20, np.arange(points)] = True
    found = ifsvideo.segment(Tracks.from_array(np.zeros((20, points, 2)), visible, size=SIZE))
    assert (found.labels == -1).all()
    assert not found.confidence.any()


def test_length_of_windows() -> None:
    def of(frames: int, life: int) -> int | None:
        visible = np.arange(frames)[:, None] < np.full(9, life)
        return window_length(Tracks.from_array(np.zeros((frames, 9, 2)), visible), LASTING)

    assert of(30, 30) is None
    assert of(30, 23) is None
    assert of(110, 40) == 50
    assert of(110, 8) == 15
    assert of(10, 5) == 10
    assert window_length(Tracks.from_array(np.zeros((20, 0, 2))), LASTING) is None

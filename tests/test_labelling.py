"""A whole clip: one number an object, fixed points undecided for life, false objects sent home."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.labelling import label_frames
from ifsvideo.objects.windows import WindowLabeller
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.tracking.steps import steps_of
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import Segmentation, Segmenter, Tracks
from tests.scenes import SIZE, Camera, Mover, Scene, make_scene

CONFIG = ObjectsConfig()
FPS = 30.0


@dataclass
class Told:
    """A segmenter that is told the label of each track, by its id and the number of the window, and how sure
    each window is."""

    label: Callable[[np.ndarray, int], np.ndarray]
    windows: int = 0
    sure: Callable[[int], float] = lambda window: 0.999

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        labels = np.asarray(self.label(tracks.ids, self.windows), dtype=np.int64)
        confidence = np.full(len(labels), self.sure(self.windows))
        self.windows += 1
        return Segmentation(labels, labels == 0, labels, confidence)


@dataclass
class Made:
    """Labels that are there already, or that nobody sees before he waits for them."""

    labels: np.ndarray
    late: bool = False

    def done(self) -> bool:
        return not self.late

    def value(self) -> np.ndarray:
        return self.labels


def label_clip(
    clip: Trajectories, segmenter: Segmenter, config: ObjectsConfig, late: bool = False
) -> np.ndarray:
    """Label of every row of a clip."""
    labeller = WindowLabeller(segmenter, config)

    def label(tracks: Tracks) -> Made:
        return Made(labeller(tracks), late)

    frames = list(label_frames(steps_of(clip), label, config, clip.size, clip.fps))
    assert [frame.place for frame in frames] == list(range(clip.frames))
    return np.concatenate([np.empty(0, np.int64), *(frame.labels for frame in frames)])


def clip_of(scene: Scene) -> Trajectories:
    return replace(Trajectories.from_tracks(scene.tracks), size=SIZE, fps=FPS)


def standing_crowd(frames: int = 120, tracks: int = 60) -> Trajectories:
    xy = np.random.default_rng(0).uniform(0, SIZE, (tracks, 2)) + np.zeros((frames, 1, 1))
    return replace(Trajectories.from_tracks(Tracks.from_array(xy)), size=SIZE, fps=FPS)


def numbers_of(trajectories: Trajectories, labels: np.ndarray, ids: np.ndarray) -> list[int]:
    return np.unique(labels[np.isin(trajectories.ids, ids)]).tolist()


def test_a_moving_object_has_one_number_for_the_whole_clip() -> None:
    """Tracks live a third of the clip, and so does none of the first window's in the last."""
    camera = Camera.path(frames=75, step=(0, 0, 0.1))
    car = Mover((-1.0, 0.5, 15.0), (0.08, 0.0, 0.1), points=80)
    scene = make_scene(camera, (car,), static=250)
    rng = np.random.default_rng(0)
    birth = rng.integers(-20, 60, scene.tracks.points)
    time = np.arange(75)[:, None]
    alive = (time >= birth) & (time < birth + 35)
    clip = clip_of(replace(scene, tracks=Tracks.from_array(scene.tracks.xy, alive)))
    labels = label_clip(clip, IFSSegmenter(), CONFIG)
    truth = scene.truth[clip.ids]
    assert set(np.unique(labels)) <= {-1, 0, 1}
    assert (labels[truth == 1] == 1).mean() > 0.9
    assert (labels[truth == 0] == 0).mean() > 0.95
    assert labels.shape == clip.ids.shape


def test_points_fixed_to_the_camera_are_undecided_for_life() -> None:
    scene = make_scene(Camera.path(frames=70, step=(0, 0, 0.1), shake=0.02))
    rng = np.random.default_rng(0)
    logo = rng.uniform((20, 400), (200, 470), (10, 2)) + rng.normal(0, 0.05, (70, 10, 2))
    both = Tracks.from_array(np.concatenate([scene.tracks.xy, logo], axis=1))
    clip = clip_of(replace(scene, tracks=both))
    labels = label_clip(clip, Told(lambda ids, _: np.zeros(len(ids))), CONFIG)
    assert numbers_of(clip, labels, np.arange(200, 210)) == [-1]
    assert numbers_of(clip, labels, np.arange(200)) == [0]


def test_labels_do_not_depend_on_how_fast_windows_are_labelled() -> None:
    """The world begins to shake late: what is fixed to the camera is found out while windows wait."""
    smooth, shaking = (Camera.path(frames=150, step=(0, 0, 0.1), shake=shake) for shake in (0.0, 0.02))
    paths = [make_scene(camera).tracks.xy for camera in (smooth, shaking)]
    world = np.concatenate([paths[0][:70], paths[1][70:] - paths[1][70] + paths[0][70]])
    rng = np.random.default_rng(0)
    logo = rng.uniform((20, 400), (200, 470), (10, 2)) + rng.normal(0, 0.05, (150, 10, 2))
    both = Tracks.from_array(np.concatenate([world, logo], axis=1))
    clip = replace(Trajectories.from_tracks(both), size=SIZE, fps=FPS)
    told = [label_clip(clip, Told(lambda ids, _: np.zeros(len(ids))), CONFIG, late) for late in (False, True)]
    assert np.array_equal(*told)
    of_logo = told[0][clip.ids >= 200]
    assert of_logo[0] == 0
    assert of_logo[-1] == -1


@pytest.mark.parametrize("gap", [20, 40, 60, 80])
def test_nor_do_those_of_tracks_with_gaps(gap: int) -> None:
    """A tracker of one's own may find a track again: what is still known of it is no matter of speed."""
    scene = make_scene(
        Camera.path(frames=180, step=(0, 0, 0.1)), (Mover((-1.0, 0.5, 25.0), (0.02, 0.0, 0.1)),)
    )
    seen = np.ones(scene.tracks.visible.shape, dtype=bool)
    seen[70 : 70 + gap, scene.truth == 1] = False
    clip = clip_of(replace(scene, tracks=Tracks.from_array(scene.tracks.xy, seen & scene.tracks.visible)))
    moves = scene.truth == 1
    told = [label_clip(clip, Told(lambda ids, _: moves[ids] * 1), CONFIG, late) for late in (False, True)]
    assert np.array_equal(*told)
    assert {0, 1} <= set(np.unique(told[0]))


def test_before_a_standing_camera_all_is_background() -> None:
    clip = standing_crowd()
    assert not label_clip(clip, IFSSegmenter(), CONFIG).any()


def test_a_short_lived_object_goes_to_the_background() -> None:
    """One window's fancy is no object; one that stays is."""
    clip = standing_crowd(frames=150)

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        return np.where(ids < 10, 1, np.where((ids < 20) & (window == 3), 2, 0))

    segmenter = Told(label)
    labels = label_clip(clip, segmenter, replace(CONFIG, least_windows=2))
    assert segmenter.windows > 5
    assert numbers_of(clip, labels, np.arange(10)) == [1]
    assert numbers_of(clip, labels, np.arange(10, 60)) == [0]


@pytest.mark.parametrize(("sure", "counts"), [(0.99, False), (0.999, False), (0.99999, True)])
def test_an_object_of_one_window_counts_if_that_is_very_sure(sure: float, counts: bool) -> None:
    """If those beside it cannot tell."""
    clip = standing_crowd(frames=150)

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        return np.where(ids < 20, 1 if window == 3 else -1, 0)

    labels = label_clip(clip, Told(label, sure=lambda window: sure), replace(CONFIG, least_seconds=0.1))
    assert bool((labels > 0).any()) == counts


def test_what_no_window_is_sure_of_is_background_and_keeps_its_number_once_one_is() -> None:
    clip = standing_crowd(frames=150)

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        return np.where(ids < 20, 1, 0)

    def surest_window(number: int, sure: float, usual: float = 0.9) -> np.ndarray:
        return label_clip(clip, Told(label, sure=lambda window: sure if window == number else usual), CONFIG)

    assert not surest_window(4, 0.98).any()
    assert not surest_window(4, 0.993).any()
    assert surest_window(4, 0.993, 0.987).any()
    assert surest_window(4, 0.99995, 0.01).any()
    labels = surest_window(4, 0.9995)
    assert numbers_of(clip, labels, np.arange(20)) == [0, 1]
    moving = clip.frame[labels > 0]
    assert 0 < moving.min() < 60  # two windows after the frame, its labels are final
    assert moving.max() == 149


def test_an_object_that_lives_too_short_a_time_goes_too() -> None:
    clip = standing_crowd(frames=150)

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        return np.where((ids < 20) & (window in (3, 4)), 1, 0)

    long, short = (
        label_clip(clip, Told(label), replace(CONFIG, least_windows=1, least_seconds=s)) for s in (0.1, 4.0)
    )
    assert numbers_of(clip, long, np.arange(20)) == [0, 1]
    assert not short.any()


def test_objects_keep_their_numbers_when_windows_swap_their_names() -> None:
    clip = standing_crowd(frames=150)

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        return np.where(ids < 10, 1 + window % 2, np.where(ids < 20, 2 - window % 2, 0))

    labels = label_clip(clip, Told(label), CONFIG)
    assert numbers_of(clip, labels, np.arange(10)) == [1]
    assert numbers_of(clip, labels, np.arange(10, 20)) == [2]


def test_numbers_follow_the_order_of_appearance_without_gaps() -> None:
    clip = standing_crowd(frames=200)

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        late = np.where((ids < 30) & (window >= 4), 1, 0)
        passing = np.where((ids >= 50) & (window == 2), 3, 0)
        return np.where((ids >= 30) & (ids < 40), 2, late + passing)

    labels = label_clip(clip, Told(label), CONFIG)
    assert numbers_of(clip, labels, np.arange(30, 40)) == [1]
    assert numbers_of(clip, labels, np.arange(30)) == [0, 2]
    assert np.unique(labels).tolist() == [0, 1, 2]


def changes(says: list[int]) -> list[int]:
    """Frames at which the first track's label changes, given what its windows say one after the other."""
    clip = standing_crowd(frames=90)
    labels = label_clip(clip, Told(lambda ids, window: np.full(len(ids), says[window])), CONFIG)
    return (np.flatnonzero(np.diff([labels[clip.frame == f][0] for f in range(90)])) + 1).tolist()


def test_each_frame_takes_the_label_of_the_window_whose_centre_is_nearest() -> None:
    starts = np.arange(0, 61, CONFIG.window_frames // 2)
    centres = starts + CONFIG.window_frames / 2
    between = (centres[1:] + centres[:-1]) / 2
    assert len(starts) == 5
    assert changes([0, 1, 1, 0, 0]) == pytest.approx(between[[0, 2]].tolist(), abs=1)


def test_a_window_that_misses_what_those_on_either_side_saw_is_not_believed() -> None:
    """But one at the beginning or at the end is: the object may have begun to move, or have stopped."""
    assert changes([1, 1, 0, 1, 1]) == []
    assert changes([1, 0, -1, 1, 1]) != []
    assert len(changes([0, 1, 0, 1, 1])) == 1


def test_nor_is_one_that_alone_saw_something_move() -> None:
    """However sure it is; but of two in a row either may be right."""
    assert changes([0, 0, 1, 0, 0]) == []
    assert len(changes([0, 1, 1, 0, 0])) == 2
    assert len(changes([1, 1, 0, 0, 0])) == 1


def test_nor_is_one_that_took_the_object_for_the_world() -> None:
    """Not even of what it alone has seen, for all that it calls moving stands."""
    clip = standing_crowd(frames=90)
    brief = (clip.ids != 40) | ((clip.frame >= 39) & (clip.frame < 45))
    clip = replace(clip, frame=clip.frame[brief], ids=clip.ids[brief], xy=clip.xy[brief])

    def label(ids: np.ndarray, window: int) -> np.ndarray:
        return np.where(ids < 15, 1, 0) if window != 2 else np.where(ids < 15, 0, 2)

    sure = Told(label, sure=lambda window: 1.0)
    labels = label_clip(clip, sure, replace(CONFIG, least_seconds=0.1))
    assert (labels == np.where(clip.ids < 15, 1, 0)).all()


def test_short_tracks_follow_their_neighbours() -> None:
    clip = standing_crowd(frames=60)
    brief = (clip.ids != 0) | (clip.frame < 6)
    clip = replace(clip, frame=clip.frame[brief], ids=clip.ids[brief], xy=clip.xy[brief])

    def label(ids: np.ndarray, _: int) -> np.ndarray:
        assert 0 not in ids
        return np.zeros(len(ids))

    labels = label_clip(clip, Told(label), CONFIG)
    assert numbers_of(clip, labels, np.array([0])) == [0]


def test_a_clip_without_points_or_frames() -> None:
    for frames in (0, 50):
        clip = Trajectories(
            np.empty(0, np.int32), np.empty(0, np.int64), np.empty((0, 2), np.float32), frames, SIZE, FPS
        )
        assert label_clip(clip, IFSSegmenter(), CONFIG).shape == (0,)


def test_a_clip_of_one_frame_is_undecided() -> None:
    assert (label_clip(standing_crowd(frames=1), IFSSegmenter(), CONFIG) == -1).all()

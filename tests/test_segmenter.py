"""The segmenter as a whole: how many motions, odd input, and the same labels for the same seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ifsvideo.errors import UsageError
from ifsvideo.segmentation.agglomeration import Agglomeration
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.segmentation.shape_interaction import Cut
from ifsvideo.segmentation.whole import Whole
from ifsvideo.types import Segmentation, Tracks
from tests.scenes import LEFT_CAR, RIGHT_CAR, SIZE, Camera, Mover, Scene, make_scene, share_wrong

THESIS = SegmenterConfig.thesis()
BOTH = pytest.mark.parametrize("config", [SegmenterConfig(), THESIS], ids=["default", "thesis"])
CARS = {1: (), 2: (LEFT_CAR,), 3: (LEFT_CAR, RIGHT_CAR)}


@pytest.mark.parametrize("broken", [False, True], ids=["complete", "broken"])
@pytest.mark.parametrize(("count", "seed"), [(1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (3, 0), (3, 1), (3, 2)])
def test_the_number_of_motions_is_found(count: int, seed: int, broken: bool) -> None:
    scene = make_scene(movers=CARS[count], seed=seed)
    if broken:
        scene = scene.with_gaps(seed)
    result = IFSSegmenter(seed=seed).segment(scene.tracks)
    assert np.unique(result.labels).tolist() == list(range(count))
    assert share_wrong(result.labels, scene.truth) < 0.05
    assert (result.labels[scene.truth == 0] == 0).mean() > 0.95


@pytest.mark.parametrize(
    "step", [(0.2, 0, 0), (0.1, 0.05, 0.2), (0, 0, 0.8)], ids=["aside", "aslant", "fast"]
)
def test_a_deep_rigid_scene_is_one_motion(step: tuple[float, float, float]) -> None:
    scene = make_scene(Camera.path(step=step), depth=(10, 100), static=150)
    assert not IFSSegmenter().segment(scene.tracks).labels.any()


@pytest.mark.parametrize("motions", [1, 2, 3, 4])
def test_a_known_number_of_motions_is_kept(motions: int) -> None:
    scene = make_scene(movers=CARS[3])
    labels = IFSSegmenter().segment(scene.tracks, motions).labels
    assert np.unique(labels).tolist() == list(range(motions))
    if motions == 3:
        assert share_wrong(labels, scene.truth) < 0.05


@BOTH
@pytest.mark.parametrize("motions", [0, -1])
def test_fewer_than_one_motion_is_refused(config: SegmenterConfig, motions: int) -> None:
    with pytest.raises(ValueError, match="at least 1"):
        IFSSegmenter(config).segment(make_scene(static=20).tracks, motions)


@pytest.mark.parametrize("seed", range(3))
def test_the_thesis_parts_two_strong_motions(seed: int) -> None:
    """A distant flat world and a car across it: no depth for the plain measure to stumble over."""
    car = Mover(centre=(-3.0, 0.0, 20.0), velocity=(0.3, 0.0, 0.0), points=40)
    scene = make_scene(Camera.path(step=(0, 0, 0.1)), (car,), depth=(40, 60), noise=0.05, seed=seed)
    labels = IFSSegmenter(THESIS, seed).segment(scene.tracks).labels
    share = [np.bincount(labels[scene.truth == k]).max() for k in (0, 1)]
    of = [np.bincount(labels[scene.truth == k]).argmax() for k in (0, 1)]
    assert of[0] == 0
    assert of[1] != 0
    assert share[0] > 150
    assert share[1] > 30


@BOTH
def test_same_seed_same_labels(config: SegmenterConfig) -> None:
    tracks = make_scene(movers=CARS[3]).with_gaps().tracks
    one, other = (IFSSegmenter(config, 5).segment(tracks) for _ in range(2))
    for name in ("labels", "background", "segments", "confidence"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()


def test_the_order_of_points_matters_little() -> None:
    scene = make_scene(movers=CARS[3])
    order = np.random.default_rng(0).permutation(scene.tracks.points)
    labels = IFSSegmenter().segment(scene.tracks).labels
    shuffled = IFSSegmenter().segment(scene.tracks.select(order)).labels
    assert share_wrong(shuffled, labels[order]) < 0.05


@BOTH
def test_what_every_stage_found_is_kept(config: SegmenterConfig) -> None:
    scene = make_scene(movers=CARS[2])
    tracks = scene.tracks
    result = IFSSegmenter(config).segment(tracks)
    assert result.background[scene.truth == 0].mean() > 0.9
    assert result.background[scene.truth == 1].mean() < 0.3
    names = np.unique(result.segments)
    assert names.tolist() == list(range(len(names)))
    assert len(names) >= len(np.unique(result.labels))
    assert ((result.confidence >= 0) & (result.confidence <= 1)).all()
    assert result.details["solution"].lower_bound <= result.details["solution"].energy + 1e-9


def moved(xy: Any) -> Tracks:
    return Tracks.from_array(xy)


def odd_inputs() -> dict[str, Tracks]:
    rng = np.random.default_rng(0)
    scene = make_scene(static=60).tracks
    seldom = scene.xy.copy()
    seldom[:, 5] = np.nan
    seldom[1:, 6] = np.nan
    sparse = np.where(rng.random((20, 60, 1)) < 0.15, scene.xy, np.nan)
    line = np.linspace(0, 100, 30)[None, :, None] * [1.0, 0.5] + np.arange(10)[:, None, None]
    return {
        "no frames": moved(np.empty((0, 12, 2))),
        "no points": moved(np.empty((12, 0, 2))),
        "nothing": moved(np.empty((0, 0, 2))),
        "one frame": moved(scene.xy[:1]),
        "two frames": moved(scene.xy[:2]),
        "three frames": moved(scene.xy[:3]),
        "one point": moved(scene.xy[:, :1]),
        "two points": moved(scene.xy[:, :2]),
        "three points": moved(scene.xy[:, :3]),
        "nine points": moved(scene.xy[:, :9]),
        "coincident": moved(np.full((10, 30, 2), 100.0)),
        "coincident in the corner": moved(np.zeros((10, 30, 2))),
        "coincident and going": moved(np.repeat(np.arange(10.0)[:, None, None], 30, axis=1) * [3.0, 2.0]),
        "on a line": moved(line),
        "never seen": moved(np.full((10, 20, 2), np.nan)),
        "some seldom seen": moved(seldom),
        "hardly ever seen": moved(sparse),
        "first half and second half": moved(
            np.concatenate(
                [
                    np.where(np.arange(20)[:, None, None] < 10, scene.xy, np.nan),
                    np.where(np.arange(20)[:, None, None] >= 10, scene.xy, np.nan),
                ],
                axis=1,
            )
        ),
        "wild": moved(rng.uniform(0, 480, (15, 50, 2))),
        "far out": moved(scene.xy * 1e4 - 1e6),
        "left of the picture": moved(scene.xy - 2000),
        "tiny": moved(scene.xy * 1e-3),
    }


@BOTH
@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("name", odd_inputs())
def test_odd_input_neither_fails_nor_warns(name: str, alone: bool, config: SegmenterConfig) -> None:
    tracks = odd_inputs()[name]
    result = IFSSegmenter(config, alone=alone).segment(tracks)
    assert result.labels.shape == (tracks.points,)
    assert result.labels.dtype == np.int64
    undecided = tracks.visible.sum(axis=0) < 2
    assert (result.labels[undecided] == -1).all()
    assert (result.labels[~undecided] >= 0).all()
    assert np.isfinite(result.confidence).all()


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize(
    "name", ["no points", "two frames", "one point", "three points", "coincident", "wild"]
)
def test_a_known_number_of_motions_of_odd_input(name: str, alone: bool) -> None:
    labels = IFSSegmenter(alone=alone).segment(odd_inputs()[name], 2).labels
    assert set(labels.tolist()) <= {0, 1}


@pytest.mark.parametrize("car", [LEFT_CAR, RIGHT_CAR], ids=["left", "right"])
def test_one_car_before_a_standing_camera_is_found(car: Mover) -> None:
    scene = make_scene(Camera.path(step=(0, 0, 0), shake=0.0), (car,))
    labels = IFSSegmenter().segment(scene.tracks).labels
    assert share_wrong(labels, scene.truth) < 0.05
    assert (labels[scene.truth == 0] == 0).mean() > 0.95


def test_a_standing_picture_is_background() -> None:
    still = np.repeat(make_scene().tracks.xy[:1], 15, axis=0)
    assert not IFSSegmenter().segment(Tracks.from_array(still, size=SIZE)).labels.any()


def test_two_frames_tell_a_car_from_the_world() -> None:
    """The frame count is no special case: two frames with enough motion between them are a window too."""
    whole = make_scene(Camera.path(step=(0.05, 0, 0.3)), (LEFT_CAR, RIGHT_CAR), noise=0.05)
    tracks = Tracks.from_array(whole.tracks.xy[[0, -1]], size=SIZE)
    segments = IFSSegmenter().segment(tracks).segments
    assert purity(segments, whole) > 0.95


def purity(segments: np.ndarray, scene: Scene) -> float:
    """Share of points whose segment is mostly of their own motion."""
    right = [np.bincount(scene.truth[segments == s]).max() for s in np.unique(segments)]
    return float(sum(right) / len(segments))


@BOTH
def test_the_over_segmentation_keeps_motions_apart(config: SegmenterConfig) -> None:
    scene = make_scene(movers=CARS[3])
    segments = IFSSegmenter(config).segment(scene.tracks).segments
    assert len(np.unique(segments)) >= 3
    assert purity(segments, scene) > 0.95


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("split", "magic"),
        ("merging", ""),
        ("models", 0),
        ("pairs", 0),
        ("disk_radius", -1.0),
        ("inlier_error", float("nan")),
        ("motion_sigma", float("inf")),
        ("foreground_share", 1.5),
        ("shear_ratio", -3.0),
    ],
)
def test_settings_that_make_no_sense_are_refused(name: str, value: Any) -> None:
    with pytest.raises(UsageError, match=rf"segmentation\.{name}"):
        replace(SegmenterConfig(), **{name: value})


@pytest.mark.parametrize("origin", [(0, 0), (SIZE[0] / 2, SIZE[1] / 2)], ids=["corner", "middle"])
def test_coordinates_may_count_from_the_middle_of_the_picture(origin: tuple[float, float]) -> None:
    scene = make_scene(movers=CARS[2], seed=1)
    xy = scene.tracks.xy - np.array(origin)
    result = IFSSegmenter().segment(Tracks.from_array(xy, scene.tracks.visible))
    assert share_wrong(result.labels, scene.truth) < 0.05


def test_what_its_votes_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a sequence of its own: how sure it is, and the tracks as they were measured, with their noise."""
    given: list[tuple[Segmentation, int, Whole, int | None]] = []

    def voted(segment: Callable[[], Segmentation], votes: int, whole: Whole, motions: int | None) -> Any:
        given.append((segment(), votes, whole, motions))
        return given[-1][0]

    monkeypatch.setattr("ifsvideo.segmentation.segmenter.voted", voted)
    scene = make_scene(movers=(LEFT_CAR,), noise=1.0)
    IFSSegmenter().segment(scene.tracks)
    assert not given
    IFSSegmenter(SegmenterConfig(votes=3), alone=True).segment(scene.tracks, 2)
    ((found, votes, whole, motions),) = given
    assert (votes, motions) == (3, 2)
    assert 0 <= found.details["doubt"] < 0.5
    assert found.details["apart"].shape == (2, 2)
    assert found.details["apart"][0, 1] > 0.9
    error = found.details["world"].fitted_to(np.flatnonzero(scene.truth == 0)).rms
    assert np.median(error[scene.truth == 0]) < 0.5 < np.median(error[scene.truth == 1])
    assert whole.misfit(scene.truth) == pytest.approx(Whole(scene.tracks).misfit(scene.truth))


@pytest.mark.parametrize(("noise", "noisy"), [(0.1, False), (1.0, True)])
def test_the_whole_is_told_of_noise_and_short_gaps_are_none(
    noise: float, noisy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[Tracks, bool]] = []

    def whole(tracks: Tracks, noisy: bool) -> Whole:
        asked.append((tracks, noisy))
        return Whole(tracks, noisy)

    monkeypatch.setattr("ifsvideo.segmentation.segmenter.Whole", whole)
    tracks = make_scene(Camera.path(), (LEFT_CAR,), noise=noise).tracks
    visible = tracks.visible.copy()
    visible[5:7, ::2] = False
    gaps = Tracks.from_array(np.where(visible[..., None], tracks.xy, np.nan), size=tracks.size)
    IFSSegmenter(alone=True).segment(gaps)
    ((given, told),) = asked
    assert told == noisy
    assert np.array_equal(given.visible, tracks.visible)
    assert np.array_equal(given.xy[visible], tracks.xy[visible])


def test_parts_of_the_ground_that_a_cut_has_as_one_are_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stage 5 is made to leave the ground in two parts, of which it is not sure."""
    scene = make_scene(movers=(LEFT_CAR,))
    right = scene.tracks.xy[0, :, 0] > SIZE[0] / 2
    parts = np.where(scene.truth == 1, 2, right)

    def split(merging: Agglomeration, *_: Any) -> tuple[np.ndarray, np.ndarray]:
        merging.doubt = 0.4
        return parts.astype(np.int64), np.ones(len(parts))

    monkeypatch.setattr("ifsvideo.segmentation.segmenter.merge_and_label", split)
    monkeypatch.setattr(Whole, "cut", lambda _, motions: Cut((scene.truth, parts)[motions - 2], 1.0))
    labels = IFSSegmenter(SegmenterConfig(contest=False), alone=True).segment(scene.tracks).labels
    assert np.array_equal(labels, scene.truth)


@pytest.mark.parametrize(("contest", "alone"), [(True, True), (False, True), (True, False)])
def test_movers_may_contest_what_was_merged(
    monkeypatch: pytest.MonkeyPatch, contest: bool, alone: bool
) -> None:
    """In a sequence of its own, not in a window of a clip."""

    def all_of_it(labels: np.ndarray, confidence: np.ndarray, *_: Any) -> tuple[np.ndarray, np.ndarray]:
        return labels + 1, confidence / 2

    monkeypatch.setattr("ifsvideo.segmentation.segmenter.contested", all_of_it)
    config = SegmenterConfig(contest=contest)
    result = IFSSegmenter(config, alone=alone).segment(make_scene(static=40).tracks)
    assert (result.labels == (contest and alone)).all()
    assert (result.confidence == (0.5 if contest and alone else 1)).all()

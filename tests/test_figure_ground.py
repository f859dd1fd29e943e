"""A square that slides over a textured ground: whose pixels a point shows decides, not how it moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest

from ifsvideo.config import Config, ObjectsConfig
from ifsvideo.objects.figure_ground import FigureGround
from ifsvideo.objects.sighting import look_for
from ifsvideo.pipeline import Pipeline
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import FramePoints, Segmentation, Tracks, VideoInfo
from ifsvideo.video import FrameSource
from ifsvideo.video.picture import Picture

WIDTH, HEIGHT, FRAMES, SIDE = 320, 240, 30, 60
LEFT, TOP = 60, 90
STEP, PAN = 2, -1
"""Pixels a frame, to the right, of the square and of the ground."""


def blotches(height: int, width: int, seed: int, contrast: float) -> np.ndarray:
    """Smooth texture without any plain place, (H, W) float; its standard deviation in grey levels."""
    rough = np.random.default_rng(seed).normal(size=(height, width)).astype(np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), 1.5)
    return 128 + contrast * smooth / smooth.std()


@dataclass(frozen=True)
class Clip:
    """Pictures, tracks and the tracks' kinds."""

    greys: list[np.ndarray]
    points: Trajectories
    ground: np.ndarray
    on_object: np.ndarray
    outside: np.ndarray

    def labels(self) -> np.ndarray:
        return np.where(np.isin(self.points.ids, self.ground), 0, 1).astype(np.int32)

    def ground_beside_the_square(self) -> np.ndarray:
        """Tracks of the ground, those nearest to the square's way first."""
        away = np.abs(self.points.xy - (LEFT + SIDE, TOP + SIDE)).max(axis=1)
        rows = np.flatnonzero(np.isin(self.points.ids, self.ground) & (self.points.frame == 10))
        return self.points.ids[rows[np.argsort(away[rows])]]

    def corrected(
        self,
        fps: float | None = None,
        labels: np.ndarray | None = None,
        guessed: np.ndarray | None = None,
        joined: np.ndarray | None = None,
    ) -> np.ndarray:
        """Labels of all rows after the check; all is decided unless ``guessed`` (T,) names tracks. ``joined``
        (T,) have lain on the object before."""
        check = FigureGround(fps=fps)
        for _ in range(5 if joined is not None else 0):
            check._votes.cast(joined, 1, np.ones(len(joined), bool))
        labels = self.labels() if labels is None else labels
        short = np.isin(self.points.ids, [] if guessed is None else guessed)
        for frame, grey in enumerate(self.greys):
            rows = np.flatnonzero(self.points.frame == frame)
            rows = rows[np.argsort(self.points.ids[rows])]
            seen = FramePoints(self.points.ids[rows], self.points.xy[rows])
            ground = (labels[rows] == 0) & ~short[rows]
            check.add(Picture(np.dstack([grey] * 3)), seen, labels[rows], ground, short[rows])
        check.finish()
        return check.corrected(self.points.ids, labels, short)

    def sent_home(self, fps: float | None = None) -> set[int]:
        """Tracks that the check takes from the object, in all their rows."""
        return set(self.points.ids[self.corrected(fps) != self.labels()].tolist())


def sliding_square(*, step: int = STEP, contrast: float = 40.0, scale: int = 1) -> Clip:
    """Tracks on the ground (from 0), 4 px inside the square (from 1000) and 2 px outside it (from 2000), the
    last riding along; tracks of the ground are not seen under the square. ``contrast`` is the ground's.
    Pictures and tracks are a bit noisy.
    """
    rng = np.random.default_rng(0)
    wall = blotches(HEIGHT, WIDTH + FRAMES, 1, contrast)
    square = blotches(SIDE, SIDE, 2, 40.0)
    greys = []
    for f in range(FRAMES):
        grey = wall[:, -PAN * f : WIDTH - PAN * f].copy()
        left = LEFT + step * f
        grey[TOP : TOP + SIDE, left : left + SIDE] = square
        grey = np.clip(grey + rng.normal(0, 4, grey.shape), 0, 255).astype(np.uint8)
        greys.append(grey.repeat(scale, axis=0).repeat(scale, axis=1))
    along = np.arange(4.0, SIDE - 4, 8)
    square_now = np.array([LEFT, TOP]) + np.arange(FRAMES)[:, None, None] * [step, 0]
    inside = square_now + [(a, b) for a in along for b in along]
    some = along[::2]
    outside = square_now + np.concatenate([*_sides(some, -2.0), *_sides(some, SIDE + 1.0)])
    places = [(x, y) for x in range(20, WIDTH - 20, 12) for y in range(20, HEIGHT - 20, 12)]
    still = np.arange(FRAMES)[:, None, None] * [PAN, 0] + np.array(places, float)
    under = still - square_now
    hidden = ((under > -6) & (under < SIDE + 5)).all(axis=2)
    still[hidden] = np.nan
    still = still[:, hidden.mean(axis=0) < 0.4]
    parts = (still, inside, outside)
    ids = [1000 * k + np.arange(part.shape[1]) for k, part in enumerate(parts)]
    xy = np.concatenate(parts, axis=1)
    xy = (xy + rng.normal(0, 0.1, xy.shape) + 0.5) * scale - 0.5
    tracks = Tracks.from_array(xy, ids=np.concatenate(ids), size=(WIDTH * scale, HEIGHT * scale), fps=30.0)
    return Clip(greys, Trajectories.from_tracks(tracks), *ids)


def _sides(along: np.ndarray, far: float) -> tuple[np.ndarray, np.ndarray]:
    """Points along an upright and along a level side of the square."""
    beside = np.full_like(along, far)
    return np.column_stack([beside, along]), np.column_stack([along, beside])


def only(clip: Clip, rows: np.ndarray) -> Clip:
    """The same pictures with some of the observations."""
    points = clip.points
    kept = replace(points, frame=points.frame[rows], ids=points.ids[rows], xy=points.xy[rows])
    return replace(clip, points=kept)


@pytest.mark.parametrize("contrast", [10.0, 40.0])
def test_points_outside_the_outline_that_ride_along_go_to_the_ground(contrast) -> None:
    """Also before a ground of little contrast."""
    clip = sliding_square(contrast=contrast)
    assert clip.sent_home() == set(clip.outside.tolist())


def test_pictures_are_compared_over_the_same_time_at_any_rate() -> None:
    """At a low rate no frames so many apart are asked: what is on the object has changed by then."""
    clip = sliding_square()
    assert FigureGround(fps=30.0).lags == (1, 2, 3, 4, 6, 8, 10) == FigureGround().lags
    assert FigureGround(fps=10.0).lags == (1, 2, 3)
    assert FigureGround(fps=1.0).lags == (1,)
    assert FigureGround(fps=120.0).lags[-1] == 40
    assert clip.sent_home(15.0) == set(clip.outside.tolist())


def test_large_pictures_are_looked_at_as_the_tracker_does(monkeypatch) -> None:
    """In twice the size, above what is tracked in full, all is the same."""
    small = sliding_square().sent_home()
    monkeypatch.setattr("ifsvideo.tracking.tracker.LARGEST", 1.1 * np.hypot(WIDTH, HEIGHT))
    assert sliding_square(scale=2).sent_home() == small


def test_without_relative_motion_nothing_changes() -> None:
    assert not sliding_square(step=PAN).sent_home()


def test_before_a_camera_that_stands_nothing_is_looked_at(monkeypatch) -> None:
    """Limbs do not move as a body does; a corner beside an outline stays behind by itself."""
    monkeypatch.setattr("tests.test_figure_ground.PAN", 0)
    assert not sliding_square().sent_home()


def test_before_a_plain_ground_nothing_changes() -> None:
    """There are no corners on it; those far away say nothing of what lies behind the square."""
    clip = sliding_square(contrast=0)
    x, y = clip.points.xy.T
    near = (x > LEFT - 40) & (x < LEFT + SIDE + STEP * FRAMES + 40) & (y > TOP - 40) & (y < TOP + SIDE + 40)
    assert not only(clip, ~near | (clip.points.ids >= 1000)).sent_home()


def test_few_tracks_of_the_ground_tell_nothing() -> None:
    clip = sliding_square()
    beside = clip.ground_beside_the_square()
    for count, tells in ((7, False), (80, True)):
        kept = np.isin(clip.points.ids, beside[:count]) | (clip.points.ids >= 1000)
        assert bool(only(clip, kept).sent_home()) == tells


def test_a_silhouette_that_holds_few_of_its_tracks_sends_none_away() -> None:
    """It is that of a part, or of something else."""
    clip = sliding_square()
    few = np.isin(clip.points.ids, clip.on_object[::6]) | ~np.isin(clip.points.ids, clip.on_object)
    assert not only(clip, few).sent_home()


def test_tracks_seen_shortly_join_the_object_on_which_they_lie() -> None:
    """Of tracks of which no window could decide those on the square are its own, those beside it are not."""
    clip = sliding_square()
    ids = clip.points.ids
    short = np.concatenate([clip.on_object[::3], clip.outside[::3], clip.ground_beside_the_square()[:12]])
    labels = np.where(np.isin(ids, short), -1, clip.labels())
    corrected = clip.corrected(labels=labels, guessed=short)
    joined = np.isin(ids, clip.on_object[::3])
    assert (corrected[joined] == 1).all()
    assert (corrected[np.isin(ids, short) & ~joined] == -1).all()
    assert (clip.corrected(labels=labels)[joined] == -1).all()


def test_what_passes_close_by_is_followed_by_its_short_tracks() -> None:
    """Windows decided of a corner of the square alone, and only for a time; all else on it is guessed to be
    ground."""
    clip = sliding_square()
    ids, frame = clip.points.ids, clip.points.frame
    corner = clip.on_object[:9]
    rows = (~np.isin(ids, corner) | (frame < 12)) & ~np.isin(ids, clip.outside)
    clip = only(clip, rows)
    ids, frame = clip.points.ids, clip.points.frame
    # A life is eight frames: then another track goes on in the same place.
    brief = np.isin(ids, clip.on_object) & ~np.isin(ids, corner)
    reborn = replace(clip.points, ids=np.where(brief, ids + 10_000 * (1 + (frame + ids) // 8), ids))
    clip = replace(clip, points=reborn)
    labels = np.where(np.isin(reborn.ids, corner), 1, 0).astype(np.int32)
    corrected = clip.corrected(labels=labels, guessed=np.unique(reborn.ids[brief]))
    assert (corrected[brief] == 1).mean() > 0.95
    assert (corrected[brief & (frame > 20)] == 1).mean() > 0.95
    assert not corrected[~brief & ~np.isin(reborn.ids, corner)].any()


def test_what_joined_leaves_where_it_lies_far_from_the_rest() -> None:
    """A thing does not fall apart."""
    clip = sliding_square()
    far = clip.ground_beside_the_square()[-8:]
    on_it = clip.on_object[::3]
    guessed = np.concatenate([far, on_it])
    labels = np.where(np.isin(clip.points.ids, on_it), 0, clip.labels())
    corrected = clip.corrected(labels=labels, guessed=guessed, joined=guessed)
    assert not corrected[np.isin(clip.points.ids, far)].any()
    assert corrected[np.isin(clip.points.ids, on_it)].all()


def test_what_a_window_called_ground_on_an_object_is_its_own() -> None:
    """A face of a turning thing may stand still for a window."""
    clip = sliding_square()
    ids = clip.points.ids
    face = clip.on_object[:12]
    labels = np.where(np.isin(ids, face), 0, clip.labels())
    corrected = clip.corrected(labels=labels)
    assert (corrected[np.isin(ids, face)] == 1).all()
    assert not corrected[np.isin(ids, clip.ground)].any()


def test_tracks_that_live_between_two_looks_are_asked_too() -> None:
    """Looks are four frames apart; each of these tracks lives for one frame, on the square or beside it."""
    clip = sliding_square()
    ids, frame = clip.points.ids, clip.points.frame
    brief = np.isin(ids, [*clip.on_object[1::3], *clip.outside])
    single = replace(clip.points, ids=np.where(brief, ids + 10_000 * (1 + frame), ids))
    clip = replace(clip, points=single)
    labels = np.where(brief & (frame % 2 == 0), 0, np.where(brief, 1, clip.labels())).astype(np.int32)
    labels[np.isin(ids, clip.ground)] = 0
    corrected = clip.corrected(labels=labels, guessed=np.unique(single.ids[brief]))
    inside = np.isin(ids, clip.on_object)
    assert (corrected[brief & inside] == 1).mean() > 0.95
    assert (corrected[brief & ~inside] == 0).mean() > 0.95


@pytest.mark.parametrize("brief", ["none", "moving", "taken for ground", "beside it"])
def test_an_object_is_looked_at_rarely_once_its_tracks_are_told(brief: str, monkeypatch) -> None:
    """Not so if many tracks on it, or round it, live for one frame each."""
    clip = sliding_square()
    ids, frame = clip.points.ids, clip.points.frame
    own = {"none": [], "beside it": clip.outside}.get(brief, clip.on_object[::2])
    new = np.isin(ids, own)
    labels = np.where(new & (brief != "moving"), 0, clip.labels()).astype(np.int32)
    clip = replace(clip, points=replace(clip.points, ids=np.where(new, ids + 10_000 * (1 + frame), ids)))
    places: list[int] = []

    def looked(frames, place, own, lags):
        places.append(place)
        return look_for(frames, place, own, lags)

    monkeypatch.setattr("ifsvideo.objects.figure_ground.look_for", looked)
    clip.corrected(labels=labels, guessed=None if brief == "moving" else np.unique(clip.points.ids[new]))
    if brief == "none":
        assert places == [0, 5, 10, 22]
    else:
        assert np.diff([*places, FRAMES]).max() <= 5


def test_a_new_object_is_looked_at_in_the_frames_before() -> None:
    """The window that knows nothing of it labels the first half; of its tracks there one in two ends before
    the other half begins."""
    clip = sliding_square()
    ids, frame = clip.points.ids, clip.points.frame
    inside = np.isin(ids, clip.on_object)
    short = np.isin(ids, clip.on_object[::2])
    rows = (~short | (frame < 10)) & ~np.isin(ids, clip.outside)
    clip = only(clip, rows)
    ids, frame, inside, short = clip.points.ids, clip.points.frame, inside[rows], short[rows]
    labels = np.where(inside & (frame >= 15), 1, 0).astype(np.int32)
    corrected = clip.corrected(labels=labels, guessed=clip.on_object)
    assert (corrected[inside & ~short] == 1).all()
    assert (corrected[short] == 1).mean() > 0.9
    assert not corrected[~inside].any()


def test_no_points_are_no_error() -> None:
    clip = sliding_square()
    assert not only(clip, np.zeros(len(clip.points.ids), bool)).sent_home()


class Pictures(FrameSource):
    """The frames of a clip."""

    path = Path("square.mp4")
    info = VideoInfo(WIDTH, HEIGHT, Fraction(30))

    def __init__(self, clip: Clip) -> None:
        self.clip = clip

    def frames(self):
        for grey in self.clip.greys:
            yield np.dstack([grey] * 3)


@dataclass
class Given:
    """A tracker that knows the tracks, and a segmenter that knows what they are."""

    clip: Clip
    label_of_kind: tuple[int, int, int]

    def track(self, frames, ignore=None):
        points = self.clip.points
        for f, _ in enumerate(frames):
            rows = points.frame == f
            yield FramePoints(points.ids[rows], points.xy[rows])

    def segment(self, tracks, motions=None):
        labels = np.array(self.label_of_kind)[tracks.ids // 1000]
        return Segmentation(labels, labels == 0, labels, np.ones(len(labels)))


def run(label_of_kind: tuple[int, int, int], config: ObjectsConfig | None = None):
    clip = sliding_square()
    given = Given(clip, label_of_kind)
    pipeline = Pipeline(Config(objects=config or ObjectsConfig()), tracker=given, segmenter=given)
    result = pipeline.run(Pictures(clip))
    return result, [result.table.labels[result.table.ids // 1000 == kind] for kind in range(3)]


def test_the_pipeline_sends_home_what_only_rides_along() -> None:
    _, (ground, on_object, outside) = run((0, 1, 1))
    assert not ground.any()
    assert (on_object == 1).all()
    assert not outside.any()


def test_the_check_is_left_out_where_it_is_not_wanted() -> None:
    _, (_, on_object, outside) = run((0, 1, 1), ObjectsConfig(check_borders=False))
    assert (on_object == 1).all()
    assert (outside == 1).all()


def test_where_nothing_moves_no_picture_is_looked_at(monkeypatch) -> None:
    monkeypatch.setattr(Picture, "grey", property(lambda self: pytest.fail("a picture was looked at")))
    _, (_, on_object, _) = run((0, 0, 0))
    assert not on_object.any()


def test_tracks_without_pictures_are_not_checked() -> None:
    clip = sliding_square()
    tracks = clip.points.window(0, FRAMES)
    result = Pipeline(segmenter=Given(clip, (0, 1, 1))).run(tracks)
    assert (result.table.labels[result.table.ids >= 1000] == 1).all()

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import ifsvideo
from ifsvideo.config import Config, TrackerConfig
from ifsvideo.errors import InputError, OutputError, UsageError
from ifsvideo.pipeline import Pipeline
from ifsvideo.summary import summary
from ifsvideo.types import FramePoints, Segmentation, Tracks, VideoInfo
from ifsvideo.video import FrameSource

from .conftest import FPS, HEIGHT, WIDTH, decoded, encode, pictures


class ByStep:
    """Segmenter: what steps differently from the most moves. Enough for these scenes, and quick."""

    def segment(self, tracks, motions=None):
        counts = np.maximum(tracks.visible.sum(axis=0) - 1, 1)
        first = np.argmax(tracks.visible, axis=0)
        last = tracks.frames - 1 - np.argmax(tracks.visible[::-1], axis=0)
        points = np.arange(tracks.points)
        step = (tracks.xy[last, points] - tracks.xy[first, points]) / counts[:, None]
        moves = np.abs(step - np.median(step, axis=0)).max(axis=1) > 1.0
        labels = moves.astype(np.int64)
        return Segmentation(labels, ~moves, labels, np.full(len(labels), 0.999))


@pytest.fixture
def pipeline() -> Pipeline:
    return Pipeline(Config(tracking=TrackerConfig(max_points=150)), segmenter=ByStep())


def test_a_clip_gives_labels_an_overlay_and_a_result(pipeline, clip, tmp_path):
    stages = []
    result = pipeline.run(
        clip, tmp_path / "o.mp4", tmp_path / "o.csv", progress=lambda *step: stages.append(step)
    )
    assert decoded(tmp_path / "o.mp4") == (24, (WIDTH, HEIGHT), FPS)
    assert result.table.frames == 24
    assert [item.label for item in result.objects] == [1]
    assert result.objects[0].tracks >= 3
    assert result.warnings == ()
    assert set(result.seconds) == {"reading", "tracking", "segmenting", "linking", "writing"}
    assert (result.output, result.labels) == (tmp_path / "o.mp4", tmp_path / "o.csv")
    assert stages == [("frames", done, 24) for done in range(25)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.mp4", "o.csv", "o.mp4"]


def test_the_table_is_ordered_and_the_csv_holds_all_of_it(pipeline, clip, tmp_path):
    result = pipeline.run(clip, labels=tmp_path / "o.csv")
    table = result.table
    order = np.lexsort((table.ids, table.frame))
    np.testing.assert_array_equal(order, np.arange(len(order)))
    rows = np.genfromtxt(tmp_path / "o.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(rows["track_id"], table.ids)
    np.testing.assert_array_equal(rows["label"], table.labels)
    assert not (tmp_path / "o.mp4").exists()


def test_same_seed_same_bytes(clip, tmp_path):
    for name in ("a.csv", "b.csv"):
        few = TrackerConfig(max_points=80)
        Pipeline(Config(tracking=few, seed=4)).run(clip, labels=tmp_path / name, end=0.6)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_nothing_is_written_where_nothing_was_asked_for(pipeline, clip, tmp_path):
    result = pipeline.run(clip)
    assert (result.output, result.labels) == (None, None)
    assert len(result.table.labels) > 0
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]


def test_a_stretch_counts_frames_from_0_and_keeps_the_time_of_the_input(pipeline, clip, tmp_path):
    result = pipeline.run(clip, tmp_path / "o.mp4", tmp_path / "o.csv", start=0.5, end=99)
    assert result.table.frames == 14
    assert decoded(tmp_path / "o.mp4")[0] == 14
    assert (tmp_path / "o.csv").read_text().splitlines()[1].startswith("0,0.5000,")


def test_the_tracker_knows_the_rate(pipeline, clip):
    """At 10 frames a second it looks for new corners in every frame, at 30 in every third."""
    slow, fast = (pipeline.run(clip, fps=fps).table for fps in (10, 30))
    assert len(np.unique(slow.ids)) > len(np.unique(fast.ids))
    first = np.array([fast.frame[fast.ids == track].min() for track in np.unique(fast.ids)])
    assert (first % 3 == 0).all()


def test_ignored_places_hold_no_points(pipeline, clip, tmp_path):
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[:, 120:] = True
    table = pipeline.run(clip, ignore=[(0, 0, 40, HEIGHT), mask]).table
    assert len(table.xy) > 0
    assert table.xy[:, 0].min() >= 39
    assert table.xy[:, 0].max() <= 120


def test_own_parts_take_the_place_of_ours(clip, tmp_path):
    class Grid:
        def track(self, frames, ignore=None):
            for _ in frames:
                yield FramePoints(np.array([9, 2]), np.array([[5, 5], [9, 9]], np.float32))

    class Plain:
        def __init__(self):
            self.scenes = []

        def draw(self, image, scene):
            self.scenes.append(scene)
            return image

    renderer = Plain()
    result = Pipeline(tracker=Grid(), segmenter=ByStep(), renderer=renderer).run(clip, tmp_path / "o.mp4")
    np.testing.assert_array_equal(result.table.ids[:4], [2, 9, 2, 9])
    assert [scene.frame for scene in renderer.scenes] == list(range(24))
    np.testing.assert_array_equal(renderer.scenes[5].ids, [2, 9])
    np.testing.assert_array_equal(renderer.scenes[5].trails[-2], [[9, 9], [5, 5]])


def test_a_tracker_that_loses_frames_is_told_so(clip):
    class Lazy:
        def track(self, frames, ignore=None):
            for index, _ in enumerate(frames):
                if index % 2:
                    yield FramePoints(np.empty(0, np.int64), np.empty((0, 2), np.float32))

    with pytest.raises(ValueError, match="12 of 24 frames"):
        Pipeline(tracker=Lazy(), segmenter=ByStep()).run(clip)


def test_a_tracker_that_uses_an_id_twice_is_told_so(clip):
    class Twins:
        def track(self, frames, ignore=None):
            for _ in frames:
                yield FramePoints(np.array([3, 3]), np.zeros((2, 2), np.float32))

    with pytest.raises(ValueError, match="track 3"):
        Pipeline(tracker=Twins(), segmenter=ByStep()).run(clip)


@pytest.mark.parametrize(
    ("name", "frames", "warning"), [("one", 1, "only one frame"), ("two", 2, ""), ("white", 5, "no corner")]
)
def test_too_little_to_see_is_no_error(pipeline, clips, tmp_path, name, frames, warning):
    result = pipeline.run(clips[name], tmp_path / "o.mp4", tmp_path / "o.csv")
    assert decoded(tmp_path / "o.mp4")[0] == frames
    assert result.objects == ()
    assert warning in " ".join(result.warnings)
    assert (tmp_path / "o.csv").read_text().startswith("frame,")


def tracks_of_two_motions() -> np.ndarray:
    xy = np.random.default_rng(0).uniform(20, 300, (30, 2))
    steps = np.arange(12)[:, None, None] * np.where(np.arange(30) < 10, 4.0, 1.0)[:, None]
    return xy + steps * [1.0, 0.5]


@pytest.mark.parametrize("form", ["array", "tracks", "file"])
def test_tracks_in_place_of_pictures(pipeline, tmp_path, form):
    xy = tracks_of_two_motions()
    xy[:3, 4] = np.nan
    source = {"array": xy, "tracks": Tracks.from_array(xy), "file": tmp_path / "t.npz"}[form]
    if form == "file":
        np.savez(source, xy=xy)
    result = pipeline.run(source, labels=tmp_path / "t.csv")
    assert result.table.frames == 12
    assert len(result.table.labels) == 12 * 30 - 3
    assert result.info.fps == 10
    np.testing.assert_array_equal(result.table.labels[result.table.ids < 10] > 0, True)
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 12 * 30 - 3 + 1


def test_rate_of_tracks_can_be_told(pipeline):
    xy = tracks_of_two_motions()
    assert pipeline.run(xy, fps=29.97).info.fps == Fraction("29.97")
    assert pipeline.run(Tracks.from_array(xy, fps=25.0)).info.fps == 25


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"output": "o.mp4"}, "hold no pictures"),
        ({"start": 1.0}, "taken whole"),
        ({"ignore": [(0, 0, 5, 5)]}, "hold no pictures"),
        ({"motions": 0}, "at least 1"),
        ({"fps": -1.0}, "positive"),
    ],
)
def test_what_tracks_cannot(pipeline, options, complaint):
    with pytest.raises(UsageError, match=complaint):
        pipeline.run(tracks_of_two_motions(), **options)


class Short(FrameSource):
    """Promises ten frames and gives six."""

    path = Path("short.mp4")
    info = VideoInfo(WIDTH, HEIGHT, Fraction(FPS), frames=10)

    def frames(self):
        yield from pictures(6)
        self.warnings = ("short.mp4: only 6 of 10 frames",)


def test_fewer_frames_than_promised_are_a_warning(pipeline, tmp_path):
    result = pipeline.run(Short(), tmp_path / "o.mp4", tmp_path / "o.csv")
    assert result.table.frames == 6
    assert decoded(tmp_path / "o.mp4")[0] == 6
    assert result.warnings == ("short.mp4: only 6 of 10 frames",)
    assert "warning     short.mp4: only 6 of 10 frames" in summary("short.mp4", result, 2.0)
    for options in ({"start": 1.0}, {"fps": 5.0}):
        with pytest.raises(UsageError, match="leave out"):
            pipeline.run(Short(), **options)


def test_an_odd_side_is_a_warning(pipeline, tmp_path):
    source = encode(tmp_path / "odd.mkv", pictures(3, 101, 75), "-c:v", "ffv1", "-pix_fmt", "bgr0")
    result = pipeline.run(source, tmp_path / "o.mp4")
    assert decoded(tmp_path / "o.mp4")[:2] == (3, (102, 76))
    assert "padded by one pixel" in " ".join(result.warnings)


@pytest.mark.parametrize("area", [(0, 0, 5000, 1), (WIDTH, 0, 5, 5), np.zeros((3, 4), bool)])
def test_areas_are_checked_against_the_picture(pipeline, clip, area):
    if isinstance(area, tuple) and area[0] == 0:
        assert pipeline.run(clip, ignore=[area]).table.xy[:, 1].min() > 0
        return
    with pytest.raises(UsageError, match=r"outside|mask is 4x3"):
        pipeline.run(clip, ignore=[area])


def test_a_failure_while_drawing_leaves_the_older_outputs(pipeline, clip, tmp_path):
    class Broken:
        def draw(self, image, scene):
            if scene.frame == 5:
                raise RuntimeError("broken renderer")
            return image

    for name in ("o.mp4", "o.csv"):
        (tmp_path / name).write_text("old")
    pipeline.renderer = Broken()
    with pytest.raises(RuntimeError, match="broken renderer"):
        pipeline.run(clip, tmp_path / "o.mp4", tmp_path / "o.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.mp4", "o.csv", "o.mp4"]
    assert (tmp_path / "o.mp4").read_text() == (tmp_path / "o.csv").read_text() == "old"


def test_errors_are_raised_before_any_work(pipeline, clip, tmp_path):
    def never(stage, done, total):
        raise AssertionError("work was begun")

    for error, options in (
        (UsageError, {"output": clip}),
        (UsageError, {"labels": clip}),
        (UsageError, {"output": tmp_path / "o.avi"}),
        (UsageError, {"output": tmp_path / "o.mp4", "labels": tmp_path / "o.mp4"}),
        (UsageError, {"start": 100.0}),
        (OutputError, {"labels": tmp_path / "none" / "o.csv"}),
        (OutputError, {"labels": tmp_path}),
    ):
        with pytest.raises(error):
            pipeline.run(clip, progress=never, **options)
    with pytest.raises(InputError):
        pipeline.run(tmp_path / "none.mp4", progress=never)


def test_segment_takes_arrays_with_gaps_masks_and_tracks():
    xy = tracks_of_two_motions()
    masked = np.ma.masked_array(xy, np.zeros(xy.shape, bool))
    masked[:3, 4] = np.ma.masked
    gaps = xy.copy()
    gaps[:3, 4] = np.nan
    found = [ifsvideo.segment(source, seed=1).labels for source in (masked, gaps, Tracks.from_array(gaps))]
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])
    assert found[0].shape == (30,)


def test_public_names_are_there_and_documented():
    assert sorted(ifsvideo.__all__, key=str.lower) == sorted(set(ifsvideo.__all__), key=str.lower)
    for name in ifsvideo.__all__:
        assert getattr(ifsvideo, name).__doc__, name
    wanted = {"Pipeline", "segment", "Config", "Tracks", "Segmentation", "Result", "VideoInfo", "FramePoints"}
    assert wanted | {"Scene", "IfsVideoError", "load_tracks", "__version__"} <= set(ifsvideo.__all__)


def test_pictures_differ():
    # The scene of these tests must move, or they would show nothing.
    first, second = pictures(2)
    assert (first != second).mean() > 0.05

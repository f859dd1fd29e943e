"""Tracks written to an archive come back as they were, dense or as rows."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import ifsvideo
from ifsvideo.errors import InputError
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.tracks_npz import TracksSink
from ifsvideo.tracking.files import load_tracks, load_trajectories
from ifsvideo.types import Scene, VideoInfo

INFO = VideoInfo(320, 200, Fraction(30000, 1001))


def scenes(frames: int = 6) -> list[Scene]:
    """Track 7 goes away and comes back; frame 3 is empty."""
    seen = [[2, 7, 9], [2, 9], [2, 7], [], [7, 40], [40]][:frames]
    rng = np.random.default_rng(3)
    found = []
    for frame, names in enumerate(seen):
        ids = np.array(names, np.int64)
        xy = rng.uniform(0, 200, (len(ids), 2)).astype(np.float32)
        found.append(Scene(frame, 0.0, ids, xy, (ids % 3).astype(np.int32), xy[None]))
    return found


def write(path: Path, frames: list[Scene], most_cells: int) -> Path:
    with Outputs() as outputs:
        sink = TracksSink(path, INFO, outputs, most_cells)
        for scene in frames:
            sink.add(scene, None)
        sink.finish()
    return path


@pytest.mark.parametrize("most_cells", [2**20, 0], ids=["dense", "rows"])
def test_what_was_written_is_read_again(tmp_path, most_cells):
    path = write(tmp_path / "t.npz", scenes(), most_cells)
    tracks = load_tracks(path)
    assert (tracks.frames, tracks.ids.tolist(), tracks.size) == (6, [2, 7, 9, 40], (320, 200))
    assert tracks.fps == pytest.approx(30000 / 1001)
    for scene in scenes():
        column = np.searchsorted(tracks.ids, scene.ids)
        np.testing.assert_array_equal(tracks.xy[scene.frame, column], scene.xy)
        np.testing.assert_array_equal(np.flatnonzero(tracks.visible[scene.frame]), column)
    rows = load_trajectories(path)
    np.testing.assert_array_equal(rows.ids, np.concatenate([scene.ids for scene in scenes()]))
    assert [file.name for file in tmp_path.iterdir()] == ["t.npz"]


def test_numpy_reads_the_arrays(tmp_path):
    with np.load(write(tmp_path / "t.npz", scenes(), 2**20)) as content:
        assert set(content) == {"ids", "xy", "visible", "labels", "size", "fps"}
        assert content["xy"].shape == (6, 4, 2)
        assert np.isnan(content["xy"][~content["visible"]]).all()
        assert content["labels"][0].tolist() == [2, 1, 0, -1]


def test_a_clip_without_a_point_is_written(tmp_path):
    path = write(tmp_path / "t.npz", [scenes()[3]], 2**20)
    with np.load(path) as content:
        assert content["xy"].shape == (1, 0, 2)
    with pytest.raises(InputError, match="holds 0 tracks over 1 frames"):
        load_tracks(path)


def test_the_pipeline_and_the_segmenter_take_them_back(tmp_path):
    rng = np.random.default_rng(0)
    start = rng.uniform(0, 300, (60, 2))
    step = np.where(np.arange(60)[:, None] < 40, [1.0, 0.2], [-2.0, 1.0])
    xy = (start + np.arange(20)[:, None, None] * step).astype(np.float32)
    ids, none = np.arange(60), np.zeros(60, np.int32)
    path = write(
        tmp_path / "t.npz", [Scene(k, 0.0, ids, row, none, row[None]) for k, row in enumerate(xy)], 0
    )
    result = ifsvideo.Pipeline().run(path)
    assert (result.info.width, result.info.height, result.info.fps) == (320, 200, Fraction(30000, 1001))
    assert len(result.table.frame) == 20 * 60
    assert len(ifsvideo.segment(load_tracks(path)).labels) == 60


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frame": np.array([1, 0], np.int32)}, "frame does not rise from 0 to 1"),
        ({"frame": np.array([0, 2], np.int32)}, "frame does not rise from 0 to 1"),
        ({"track": np.array([0.5, 1.0])}, "track is float64"),
        ({"xy": np.array([[np.nan, 0], [1, 1]])}, "not finite"),
        ({"size": np.array([0, 3])}, "size is"),
        ({"fps": np.array(-1.0)}, "fps is -1"),
    ],
)
def test_rows_that_make_no_sense_are_refused(tmp_path, change, message):
    good = {"frame": np.array([0, 1], np.int32), "track": np.array([4, 4]), "xy": np.ones((2, 2))}
    np.savez(tmp_path / "t.npz", **{**good, "frames": np.array(2), **change})
    with pytest.raises(InputError, match=message):
        load_tracks(tmp_path / "t.npz")

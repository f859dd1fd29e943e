from __future__ import annotations

import csv
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.labels import HEADER, LabelSink
from ifsvideo.types import Scene, VideoInfo

INFO = VideoInfo(100, 80, Fraction(30000, 1001), start=1.5)


def scene(frame, ids, xy, labels) -> Scene:
    xy = np.asarray(xy, np.float32).reshape(-1, 2)
    time_s = INFO.time_of(frame)
    return Scene(frame, time_s, np.asarray(ids, np.int64), xy, np.asarray(labels, np.int32), xy[None])


def write(path: Path, scenes: list[Scene]) -> None:
    with Outputs() as outputs:
        sink = LabelSink(path, outputs)
        for each in scenes:
            sink.add(each, None)
        sink.finish()


def test_text_is_exactly_the_contract(tmp_path):
    first = scene(0, [3, 12], [[1.005, 2], [-0.001, -0.004]], [0, -1])
    write(tmp_path / "a.csv", [first, scene(1, [], [], []), scene(2, [3], [[99.999, 7.5]], [2])])
    assert (tmp_path / "a.csv").read_bytes() == (
        b"frame,time_s,track_id,x,y,label\n"
        b"0,1.5000,3,1.00,2.00,0\n"
        b"0,1.5000,12,0.00,0.00,-1\n"
        b"2,1.5667,3,100.00,7.50,2\n"
    )


def test_no_rows_is_a_header_alone(tmp_path):
    write(tmp_path / "a.csv", [])
    assert (tmp_path / "a.csv").read_text() == HEADER + "\n"


def test_pandas_reads_it(tmp_path):
    write(
        tmp_path / "a.csv", [scene(0, [3, 12], [[1, 2], [3.25, -4]], [0, -1]), scene(1, [3], [[5, 6]], [2])]
    )
    read = pd.read_csv(tmp_path / "a.csv")
    assert read.dtypes.astype(str).to_dict() == {
        **dict.fromkeys(("frame", "track_id", "label"), "int64"),
        **dict.fromkeys(("time_s", "x", "y"), "float64"),
    }
    assert read.groupby("track_id").size().to_dict() == {3: 2, 12: 1}
    assert read.loc[read["label"] == -1, ["x", "y"]].to_numpy().tolist() == [[3.25, -4.0]]


def test_every_row_arrives_in_order(tmp_path):
    rng = np.random.default_rng(0)
    xy = rng.uniform(-5, 99, (5, 1000, 2))
    labels = rng.integers(-1, 4, (5, 1000))
    write(tmp_path / "a.csv", [scene(f, range(1000), xy[f], labels[f]) for f in range(5)])
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["frame"]) for row in rows] == np.repeat(range(5), 1000).tolist()
    assert [int(row["track_id"]) for row in rows] == list(range(1000)) * 5
    assert [int(row["label"]) for row in rows] == labels.ravel().tolist()
    np.testing.assert_allclose(
        [[float(row["x"]), float(row["y"])] for row in rows], xy.reshape(-1, 2), atol=0.0051
    )
    assert not any("-0.00" in row.values() for row in rows)


def test_folder_that_is_missing(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        write(tmp_path / "none" / "a.csv", [])


def test_after_a_failure_nothing_is_left(tmp_path):
    def fail() -> None:
        with Outputs() as outputs:
            LabelSink(tmp_path / "a.csv", outputs).add(scene(0, [3], [[1, 2]], [0]), None)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_one_line_that_names_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr(Outputs, "add", lambda self, target: Path("/dev/full"))
    with pytest.raises(OutputError, match=r"a\.csv: cannot be written \(No space left"):
        write(tmp_path / "a.csv", [scene(0, range(9), np.zeros((9, 2)), np.zeros(9))])

from __future__ import annotations

import csv
from fractions import Fraction

import numpy as np
import pytest

from ifsvideo.errors import OutputError
from ifsvideo.output import labels
from ifsvideo.output.labels import write_labels
from ifsvideo.types import LabelTable, VideoInfo

INFO = VideoInfo(100, 80, Fraction(30000, 1001), start=1.5)


def table(frame, ids, xy, label) -> LabelTable:
    return LabelTable(
        np.asarray(frame, np.int32),
        np.asarray(ids, np.int64),
        np.asarray(xy, np.float32).reshape(-1, 2),
        np.asarray(label, np.int32),
        5,
    )


def test_text_is_exactly_the_contract(tmp_path):
    rows = table([0, 0, 2], [3, 12, 3], [[1.005, 2], [-0.001, -0.004], [99.999, 7.5]], [0, -1, 2])
    write_labels(tmp_path / "a.csv", rows, INFO)
    assert (tmp_path / "a.csv").read_bytes() == (
        b"frame,time_s,track_id,x,y,label\n"
        b"0,1.5000,3,1.00,2.00,0\n"
        b"0,1.5000,12,0.00,0.00,-1\n"
        b"2,1.5667,3,100.00,7.50,2\n"
    )


def test_no_rows_is_a_header_alone(tmp_path):
    write_labels(tmp_path / "a.csv", table([], [], [], []), INFO)
    assert (tmp_path / "a.csv").read_text() == labels.HEADER + "\n"


def test_blocks_join_without_a_seam(tmp_path, monkeypatch):
    monkeypatch.setattr(labels, "_BLOCK", 7)
    rng = np.random.default_rng(0)
    frame = np.sort(rng.integers(0, 5, 50))
    xy = rng.uniform(-5, 99, (50, 2))
    label = rng.integers(-1, 4, 50)
    write_labels(tmp_path / "a.csv", table(frame, np.arange(50), xy, label), INFO)
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["frame"]) for row in rows] == frame.tolist()
    assert [int(row["track_id"]) for row in rows] == list(range(50))
    assert [int(row["label"]) for row in rows] == label.tolist()
    np.testing.assert_allclose([[float(row["x"]), float(row["y"])] for row in rows], xy, atol=0.0051)
    np.testing.assert_allclose(
        [float(row["time_s"]) for row in rows], 1.5 + frame * 1001 / 30000, atol=0.000051
    )
    assert not any("-0.00" in row.values() for row in rows)


def test_folder_that_is_missing(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        write_labels(tmp_path / "none" / "a.csv", table([], [], [], []), INFO)

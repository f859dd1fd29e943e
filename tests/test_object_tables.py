"""The CSV of objects and MOTChallenge's rows, read by others."""

from __future__ import annotations

import csv

import numpy as np
import pandas as pd
import pytest

from ifsvideo.objects.history import ObjectTable
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.object_tables import write_mot, write_objects

from .drives import drive, history


@pytest.fixture(scope="module")
def table() -> ObjectTable:
    """A car that comes closer for a second, and then goes away."""
    return history(drive(lambda t: (-1.0, 15.0 + 12.0 * t + 10.0 * abs(t - 1.0), 0.0), seconds=2.0)).table


def test_the_csv_holds_the_table(table, tmp_path):
    with Outputs() as outputs:
        write_objects(tmp_path / "o.csv", table, outputs)
    with (tmp_path / "o.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    names = "frame,time_s,object,points,left,top,width,height,cx,cy,vx,vy,scale_rate,ttc_s,ttc_confidence"
    assert list(rows[0]) == names.split(",")
    assert len(rows) == len(table) == 50
    for name in names.split(","):
        column = getattr(table, name)
        empty = np.array([row[name] == "" for row in rows])
        np.testing.assert_array_equal(empty, np.isnan(column))
        read = np.array([float(row[name]) for row in rows if row[name]])
        np.testing.assert_allclose(read, column[~empty], atol=0.00501)
    assert (rows[10]["ttc_s"] != "", rows[40]["ttc_s"]) == (True, "")


def test_pandas_reads_both(table, tmp_path):
    with Outputs() as outputs:
        write_objects(tmp_path / "o.csv", table, outputs)
        write_mot(tmp_path / "m.txt", table, outputs)
    read = pd.read_csv(tmp_path / "o.csv")
    whole = {"frame", "object", "points"}
    assert {name: kind.kind for name, kind in read.dtypes.items()} == {
        name: "i" if name in whole else "f" for name in read.columns
    }
    assert read["ttc_s"].isna().sum() == np.isnan(table.ttc_s).sum() > 0
    assert (read["ttc_s"].dropna() > 0).all()
    boxes = pd.read_csv(tmp_path / "m.txt", header=None)
    assert boxes.shape == (50, 10)
    np.testing.assert_allclose(boxes[4], read["width"], atol=0.011)


def test_nothing_moves_gives_the_header_alone(tmp_path):
    with Outputs() as outputs:
        write_objects(tmp_path / "o.csv", ObjectTable.empty(), outputs)
        write_mot(tmp_path / "m.txt", ObjectTable.empty(), outputs)
    assert (tmp_path / "o.csv").read_text().count("\n") == 1
    assert (tmp_path / "m.txt").read_text() == ""


def test_mot_counts_frames_and_pixels_from_one(table, tmp_path):
    with Outputs() as outputs:
        write_mot(tmp_path / "m.txt", table, outputs)
    rows = np.loadtxt(tmp_path / "m.txt", delimiter=",")
    assert rows.shape == (50, 10)
    assert rows[0, :2].tolist() == [1, 1]
    assert (rows[:, 6:] == [1, -1, -1, -1]).all()
    # Of a box over columns 3 to 5, MOTChallenge's left is 4 and its width 3; ours goes from 2.5 to 5.5.
    np.testing.assert_allclose(rows[:, 2], table.left + 1.5, atol=0.006)
    np.testing.assert_allclose(rows[:, 2] + rows[:, 4], table.left + table.width + 1.5, atol=0.011)


def test_trackeval_scores_it(table, tmp_path):
    """TrackEval reads the rows and finds what is in them. It is installed without what it asks for (``pip
    install --no-deps trackeval``): its opencv-python would take the place of the headless one."""
    trackeval = pytest.importorskip("trackeval")
    truth, found = (
        tmp_path / "gt" / "T-train" / "drive" / "gt",
        tmp_path / "trackers" / "T-train" / "us" / "data",
    )
    for folder in (truth, found):
        folder.mkdir(parents=True)
    with Outputs() as outputs:
        write_mot(found / "drive.txt", table, outputs)
    rows = np.loadtxt(found / "drive.txt", delimiter=",")
    wide = np.column_stack([rows[:, :6], np.ones((len(rows), 3))])
    np.savetxt(truth / "gt.txt", wide, "%g", ",")
    # From the middle on the object has another number, as if it had been lost.
    rows[25:, 1] = 2
    np.savetxt(found / "drive.txt", rows, "%g", ",")
    (truth.parent / "seqinfo.ini").write_text("[Sequence]\nname=drive\nseqLength=50\n")
    quiet = dict.fromkeys(("PRINT_CONFIG", "PRINT_RESULTS", "OUTPUT_SUMMARY", "OUTPUT_DETAILED"), False)
    places = {"GT_FOLDER": str(tmp_path / "gt"), "TRACKERS_FOLDER": str(tmp_path / "trackers")}
    dataset = trackeval.datasets.MotChallenge2DBox(
        {**places, "BENCHMARK": "T", "SEQ_INFO": {"drive": 50}, "DO_PREPROC": False, "PRINT_CONFIG": False}
    )
    evaluator = trackeval.Evaluator({**quiet, "PLOT_CURVES": False, "TIME_PROGRESS": False})
    metrics = [
        kind({"PRINT_CONFIG": False}) for kind in (trackeval.metrics.CLEAR, trackeval.metrics.Identity)
    ]
    results, _ = evaluator.evaluate([dataset], metrics)
    scores = results["MotChallenge2DBox"]["us"]["drive"]["pedestrian"]
    assert (scores["CLEAR"]["CLR_TP"], scores["CLEAR"]["CLR_FP"], scores["CLEAR"]["IDSW"]) == (50, 0, 1)
    assert scores["CLEAR"]["MOTP"] == pytest.approx(1.0)
    assert scores["Identity"]["IDF1"] == pytest.approx(0.5)

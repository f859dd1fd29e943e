"""The benchmark of objects: its scores on a drive whose truth is known, and what it costs to write all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import cost, objects
from ifsvideo.benchmark.object_truth import load_truth
from ifsvideo.config import Config, TrackerConfig
from ifsvideo.errors import InputError
from ifsvideo.pipeline import Pipeline
from ifsvideo.types import Counts, LabelTable, Result

from .drives import FPS, INFO, drive
from .test_pipeline import ByStep

SCRIPT = "time_s,object,kind\n0.0,1,appears\n0.1,1,comes closer fast\n2.7,1,leaves\n"


def approaching(t: float) -> tuple[float, float, float]:
    """An oncoming car, 24 m/s nearer."""
    return (-3.0, 75.0 - 12.0 * t, 0.0)


def result() -> Result:
    scenes = drive(approaching)
    frame = np.concatenate([np.full(len(one.ids), one.frame, np.int32) for one in scenes])
    ids, xy, labels = (
        np.concatenate([getattr(one, name) for one in scenes]) for name in ("ids", "xy", "labels")
    )
    table = LabelTable(frame, ids, xy, labels, len(scenes))
    return Result(INFO, Counts(100, 1, 0, 1, 0), (), None, None, (), {}, kept=table)


def write_truth(folder: Path, shift: int = 0, script: str = SCRIPT) -> Path:
    """Masks that are the boxes of the points, moved to the right by ``shift`` pixels; poses as they are."""
    scenes = drive(approaching, noise=0.0)
    masks = np.zeros((len(scenes), 360, 640), np.uint8)
    for scene, mask in zip(scenes, masks, strict=True):
        xy = scene.xy[scene.labels == 1]
        if len(xy):
            (left, top), (right, bottom) = (
                np.rint(xy.min(axis=0)).astype(int),
                np.rint(xy.max(axis=0)).astype(int),
            )
            mask[top : bottom + 1, left + shift : right + shift + 1] = 1
    camera, poses = np.tile(np.eye(4), (len(scenes), 1, 1)), np.tile(np.eye(4), (len(scenes), 1, 1, 1))
    times = np.arange(len(scenes)) / FPS
    camera[:, 2, 3] = -12.0 * times
    poses[:, 0, 2, 3] = 75.0 - 12.0 * times
    np.savez(folder / "clip_truth.npz", masks=masks, camera=camera, poses=poses)
    (folder / "clip_events.csv").write_text(script)
    (folder / "clip.mp4").touch()
    return folder / "clip_truth.npz"


def test_what_is_right_scores_well(tmp_path):
    found = objects.score(result(), load_truth(write_truth(tmp_path), FPS))
    one = found.objects[1]
    assert one.iou > 0.55  # far away, the box's margin is no small part of it
    assert one.seen > 97
    assert one.told > 80
    assert (one.error_s < 0.15, one.over_limit < 0.6, one.away) == (True, True, 0)
    assert (found.events.true, found.events.found, found.events.extra) == (3, 3, 0)
    assert 0 < found.events.late < 0.5


def test_what_is_wrong_scores_badly(tmp_path):
    script = SCRIPT.replace("2.7", "3.9") + "1.0,1,stops\n"
    truth = load_truth(write_truth(tmp_path, shift=12, script=script), FPS)
    found = objects.score(result(), truth)
    assert found.objects[1].iou < 0.4
    assert (found.events.true, found.events.found, found.events.extra) == (4, 2, 1)
    backwards = load_truth(tmp_path / "clip_truth.npz", -FPS)
    assert objects.score(result(), backwards).objects[1].away > 40


def test_the_truth_is_that_of_masks_and_poses(tmp_path):
    truth = load_truth(write_truth(tmp_path), FPS)
    assert truth.approach[25, 0] == pytest.approx(24.0 / (75.0 - 24.0), rel=1e-3)
    assert truth.boxes[0, 0].tolist() == pytest.approx([292.5, 148.5, 306.5, 158.5], abs=1.5)
    assert np.isnan(truth.boxes[-1, 0]).all()


@pytest.mark.parametrize(
    ("script", "message"),
    [("time_s,object,kind\n0,1,sings\n", "'sings' is no kind of event"), ("a,b\n1,2\n", "no list of events")],
)
def test_a_script_that_cannot_be_read_is_named(tmp_path, script, message):
    with pytest.raises(InputError, match=rf"clip_events\.csv: .*{message}"):
        load_truth(write_truth(tmp_path, script=script), FPS)
    (tmp_path / "clip_truth.npz").write_bytes(b"PK cut off")
    with pytest.raises(InputError, match=r"clip_truth\.npz: holds no masks, camera, poses"):
        load_truth(tmp_path / "clip_truth.npz", FPS)


class FromTheDrive:
    """Stands in for the pipeline of a seed; picklable."""

    def __init__(self, seed: int) -> None:
        pass

    def run(self, source: Path) -> Result:
        return result()


def test_the_table_has_a_line_for_each_object_and_clip(tmp_path):
    truth = write_truth(tmp_path)
    report = objects.run_objects({"clip": (tmp_path / "clip.mp4", truth)}, FromTheDrive, runs=2, quiet=True)
    (row,) = report["objects"]
    assert len(row["by_run"]) == 2
    shown = objects.as_table({"dataset": "objects", **report})
    assert "mean IoU: 0." in shown
    assert shown.count("\nclip ") == 4


def test_cost_is_measured_in_turn(clip, tmp_path, capsys):
    pipeline = Pipeline(Config(tracking=TrackerConfig(max_points=80)), segmenter=ByStep())
    report = cost.run_cost(clip, pipeline, 1, quiet=True)
    assert {way: len(spent) for way, spent in report["seconds"].items()} == {
        "overlay and labels": 1,
        "everything": 1,
    }
    assert report["ratio"] > 0
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]


def test_commands_refuse_what_is_not_there(tmp_path, capsys):
    assert command.main(["cost", str(tmp_path / "no.mp4")]) == 3
    assert command.main(["objects", str(tmp_path)]) == 3
    assert "holds no NAME_truth.npz" in capsys.readouterr().err

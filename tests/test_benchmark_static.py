"""The benchmark of clips in which nothing moves."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import static
from ifsvideo.types import Counts, LabelTable, Result, VideoInfo

CONTRACT = {"name", "moving_percent", "undecided_percent", "objects", "longest_s"}


def result(labels: np.ndarray, fps: int = 4) -> Result:
    """Points with one label a frame, (F, P)."""
    frames, points = labels.shape
    rows = LabelTable(
        np.repeat(np.arange(frames, dtype=np.int32), points),
        np.tile(np.arange(points, dtype=np.int64), frames),
        np.zeros((frames * points, 2), np.float32),
        labels.ravel().astype(np.int32),
        frames,
    )
    return Result(VideoInfo(8, 6, Fraction(fps)), Counts(0, 0, 0, 0, 0), (), None, None, (), {}, kept=rows)


class Stretched:
    """A pipeline that calls everything moving with an odd seed, and notes the stretch in the labels."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def run(self, source: Path, *, start: float = 0.0, end: float | None = None) -> Result:
        assert (start, end) == (0.5, 1.0)
        return result(np.full((4, 2), self.seed % 2))


def test_every_row_that_is_called_moving_is_wrong():
    labels = np.array([[0, 0, 0, -1, 0], [3, 0, 0, 0, 0], [0, 0, 7, 7, 0], [3, 0, 0, -1, 0]])
    score = static.score(result(labels))
    assert score == static.StaticScore(20.0, 10.0, 2, 0.75)


def test_nothing_called_moving_and_no_row_at_all():
    assert static.score(result(np.zeros((4, 2)))) == static.StaticScore(0, 0, 0, 0)
    assert static.score(result(np.zeros((4, 0)))) == static.StaticScore(0, 0, 0, 0)


def test_clips_in_order_and_mean_over_seeds():
    clips = [Path("b.mp4"), Path("a.mp4")]
    report = static.run_static(clips, Stretched, 0.5, 1.0, runs=2, quiet=True)
    assert [clip["name"] for clip in report["clips"]] == ["b.mp4", "a.mp4"]
    for clip in report["clips"]:
        assert (clip["moving_percent"], clip["objects"], clip["longest_s"]) == (50.0, 0.5, 0.5)
        assert [one["objects"] for one in clip["by_run"]] == [0, 1]


def test_command_runs_the_pipeline(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = tmp_path / "a.json"
    line = ["static", str(clip), "--end", "0:00.5", "--jobs", "1", "--json", str(out)]
    assert command.main(line) == 0
    report = json.loads(out.read_text())
    assert (report["dataset"], report["runs"], report["end"]) == ("static", 1, 0.5)
    (row,) = report["clips"]
    assert row.keys() >= CONTRACT
    assert row["name"] == "clip.mp4"
    assert 0 <= row["moving_percent"] <= 100
    assert row["longest_s"] <= 0.5
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "static: 1 clips, 1 run"
    assert printed[-1].split()[0] == "clip.mp4"


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["nowhere.mp4"], 3, "nowhere.mp4: does not exist"),
        (["clip.mp4", "nowhere.mp4"], 3, "nowhere.mp4: does not exist"),
        (["clip.mp4", "--start", "60"], 2, "clip.mp4: start 60 s is past the end"),
        (["clip.mp4", "--json", "nowhere/a.json"], 4, "nowhere/a.json: the folder nowhere does not"),
        (["clip.mp4", "--config", "nowhere.toml"], 2, "nowhere.toml: cannot be read"),
    ],
)
def test_what_cannot_end_well_is_refused_before_the_work(
    arguments: list[str],
    status: int,
    message: str,
    clip: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.chdir(clip.parent)
    monkeypatch.setattr(static, "in_processes", lambda *_: pytest.fail("work was begun"))
    assert command.main(["static", *arguments]) == status
    assert message in capsys.readouterr().err


def test_times_are_those_of_the_command(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit, match="2"):
        command.main(["static", "clip.mp4", "--start", "soon"])
    assert "--start" in capsys.readouterr().err

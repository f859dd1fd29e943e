"""The benchmark of the whole program on frames with labelled tracks, and the clips to look at."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from scipy.io import savemat

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import datasets, driving, side_by_side
from ifsvideo.benchmark.comparison import Method, Trial
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.errors import InputError
from ifsvideo.types import Counts, LabelTable, Result, Segmentation, Tracks, VideoInfo
from ifsvideo.video import open_source
from tests.conftest import decoded, texture

SIZE = (120, 60)
FRAMES = 3


def sequence(truth: list[int], unseen: tuple[tuple[int, int], ...] = ()) -> LabelledSequence:
    """Points at x = 20, 40, ..., y = 30, which stay; ``unseen`` are (frame, point)."""
    xy = np.array([[20.0 * (k + 1), 30.0] for k in range(len(truth))])
    visible = np.ones((FRAMES, len(truth)), bool)
    for frame, point in unseen:
        visible[frame, point] = False
    tracks = Tracks.from_array(np.tile(xy, (FRAMES, 1, 1)), visible, size=SIZE)
    return LabelledSequence("clip", "driving", tracks, np.array(truth))


def table(points: list[tuple[float, float, int]], frames: int = FRAMES) -> LabelTable:
    """The same points (x, y, label) in every frame."""
    n = len(points)
    return LabelTable(
        np.repeat(np.arange(frames, dtype=np.int32), n),
        np.tile(np.arange(n, dtype=np.int64), frames),
        np.tile(np.array([p[:2] for p in points], np.float32).reshape(-1, 2), (frames, 1)),
        np.tile(np.array([p[2] for p in points], np.int32), frames),
        frames,
    )


def test_a_labelled_point_takes_the_nearest_label_within_ten_pixels():
    own = table([(24, 33, 2), (20, 36, 1), (49.9, 30, 0), (70.1, 30, 5)])
    labels = driving.nearest_labels(own, sequence([1, 1, 1], unseen=((1, 1),)))
    assert labels.tolist() == [[2, 0, -2], [2, -2, -2], [2, 0, -2]]


def test_frames_without_points_cover_nothing():
    score = driving.score_frames(table([]), sequence([1, 2]))
    assert (score.error, score.covered, score.labelled) == (None, 0, 6)
    assert score.moves.as_dict() == {"precision": None, "recall": None}


def test_score_counts_each_labelled_point_in_each_frame():
    """Of five points one has no label, one nothing near; -1 is wrong, and a static point called moving."""
    own = table([(20, 30, 0), (40, 30, 7), (60, 30, -1), (80, 30, 3), (100, 60, 1)])
    score = driving.score_frames(own, sequence([1, 2, 2, 0, 1]))
    assert (score.covered, score.labelled) == (9, 12)
    assert score.error == pytest.approx(100 / 3)
    assert score.moves.as_dict() == {"precision": 100.0, "recall": 50.0}


class Half:
    """A pipeline that sees two of the four points of `dataset`; with an odd seed it calls both moving."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def run(self, source: Path, *, start: float = 0.0, end: float | None = None) -> Result:
        assert source.name == "clip"
        rows = table([(20, 30, self.seed % 2), (60, 30, 1)])
        return Result(
            VideoInfo(*SIZE, Fraction(10)), Counts(0, 0, 0, 0, 0), (), None, None, (), {}, kept=rows
        )


class AllMove:
    """A segmenter that calls everything moving."""

    def __init__(self, seed: int) -> None:
        pass

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        labels = np.full(tracks.points, 1 if motions is None else 0)
        return Segmentation(labels, labels == 0, labels, np.ones(tracks.points))


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """Four points, two of them moving, in three frames; the folder of the data set."""
    made = sequence([1, 1, 2, 2])
    points = np.concatenate([made.tracks.xy.transpose(2, 1, 0), np.ones((1, 4, FRAMES))])
    truth = made.truth.astype(np.uint8).reshape(-1, 1)
    savemat(tmp_path / "clip_Tracks.mat", {"Data": {"ySparse": points, "GtLabel": truth}})
    folder = tmp_path / "OriginalSequences" / "clip"
    folder.mkdir(parents=True)
    for frame in range(FRAMES):
        iio.imwrite(folder / f"{frame}.png", texture(SIZE[1], SIZE[0], 3))
    return tmp_path


def test_mean_over_runs_and_sequences(dataset: Path):
    sequences = datasets.load("kt3dmoseg", dataset)
    report = driving.run_frames(sequences, dataset, Half, runs=2, quiet=True)
    expected = {"error": 25.0, "precision": pytest.approx(200 / 3), "recall": 100.0, "coverage": 50.0}
    assert {key: report[key] for key in expected} == expected
    assert report["sequences"] == [{"name": "clip", **expected}]


def test_frames_must_be_there_and_as_many_as_the_tracks_have(dataset: Path):
    sequences = datasets.load("kt3dmoseg", dataset)
    longer = replace(sequences[0], tracks=Tracks.from_array(np.ones((4, 4, 2))))
    with pytest.raises(InputError, match="holds 3 frames, but the tracks 4"):
        driving.run_frames([longer], dataset, Half, quiet=True)
    for file in (dataset / "OriginalSequences" / "clip").iterdir():
        file.unlink()
    with pytest.raises(InputError, match="OriginalSequences/clip: "):
        driving.check_frames(sequences, dataset)


def test_truth_above_result_of_a_wide_clip(dataset: Path, tmp_path: Path):
    sequences = datasets.load("kt3dmoseg", dataset)
    driving.run_frames(sequences, dataset, Half, quiet=True, overlay=tmp_path)
    assert decoded(tmp_path / "clip.mp4") == (FRAMES, (120, 120), 10.0)


@pytest.mark.parametrize("truth", [1, 2], ids=["nothing moves", "all moves"])
def test_both_halves_are_alike_where_the_result_is_the_truth(truth: int, dataset: Path, tmp_path: Path):
    # Pictures of noise would differ by the encoder alone.
    for file in (dataset / "OriginalSequences" / "clip").iterdir():
        iio.imwrite(file, np.full((SIZE[1], SIZE[0], 3), 128, np.uint8))
    sequences = [replace(one, truth=np.full(4, truth)) for one in datasets.load("kt3dmoseg", dataset)]
    method = Method("all", AllMove, motions_known=False)
    side_by_side.draw_all(sequences, dataset, method, Trial(quiet=True), tmp_path)
    image = next(open_source(tmp_path / "clip.mp4").frames()).astype(int)
    difference = np.abs(image[20:40] - image[80:100]).mean()
    assert difference < 3 if truth == 2 else difference > 10


def test_command_reports_frames_and_floors(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(command, "IFSFactory", lambda config: AllMove)
    monkeypatch.setattr(command.samples, "PipelineFactory", lambda config: Half)
    out = tmp_path / "a.json"
    line = ["kt3dmoseg", str(dataset), "--video", "--overlay", str(tmp_path / "clips"), "--json", str(out)]
    assert command.main([*line, "--jobs", "1"]) == 0
    report = json.loads(out.read_text())
    assert report["video"].keys() >= {"error", "precision", "recall", "coverage"}
    assert report["one_motion"] == report["number_known"] == report["sequences"][0]["number_known"] == 50.0
    printed = capsys.readouterr().out
    assert "all one motion: 50.00; number known, same tree: 50.00" in printed
    assert "whole program on frames" in printed
    assert [file.name for file in (tmp_path / "clips").iterdir()] == ["clip.mp4"]


def test_command_without_video_draws_the_tracks(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(command, "IFSFactory", lambda config: AllMove)
    line = ["kt3dmoseg", str(dataset), "--motions-known", "--overlay", str(tmp_path), "--jobs", "1"]
    assert command.main(line) == 0
    assert (tmp_path / "clip.mp4").is_file()


@pytest.mark.parametrize("option", [["--video"], ["--overlay", "there"]])
def test_frames_are_asked_of_kt3dmoseg_only(option: list[str], capsys: pytest.CaptureFixture[str]):
    assert command.main(["hopkins155", ".", *option]) == 2
    assert f"{option[0]}: is for frames" in capsys.readouterr().err


def test_missing_frames_are_told_before_the_work(
    dataset: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (dataset / "OriginalSequences").rename(dataset / "elsewhere")
    monkeypatch.setattr(command.comparison, "compare", lambda *_: pytest.fail("work was begun"))
    assert command.main(["kt3dmoseg", str(dataset), "--video"]) == 3
    assert "OriginalSequences/clip: does not exist" in capsys.readouterr().err

"""The benchmark: its scores on cases done by hand, its loaders, its command and its JSON contract."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import imageio.v3 as imageio
import numpy as np
import pytest
from scipy.io import savemat

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import datasets, metrics, options, runner, samples, table
from ifsvideo.config import Config
from ifsvideo.errors import IfsVideoError, InputError, OutputError, UsageError
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.types import Counts, LabelTable, Result, Segmentation, Tracks, VideoInfo

SHARED = Path(__file__).resolve().parents[2] / "shared" / "datasets"
CONTRACT = {"dataset", "runs", "error", "median", "exact_count", "seconds", "sequences"}
ROW_CONTRACT = {"name", "motions", "estimated", "error", "seconds"}


class ByDisplacement:
    """A segmenter: points that end to the right of where they began move; with seed 1, none does."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        labels = (tracks.xy[-1, :, 0] > tracks.xy[0, :, 0] + 1).astype(np.int64)
        labels *= self.seed != 1
        if motions is not None:
            labels[:motions] = -1
        nothing = np.zeros(tracks.points)
        return Segmentation(labels, labels == 0, np.full(tracks.points, -1), nothing)


class Broken:
    """A segmenter that fails."""

    def __init__(self, seed: int) -> None:
        pass

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        raise ZeroDivisionError("boom")


class Killed(Broken):
    """A segmenter whose process is killed."""

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError


class FakePipeline:
    """A pipeline that finds one point right, one wrong, and writes nothing."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def run(self, source: Path) -> Result:
        info = VideoInfo(8, 6, Fraction(2))
        return Result(
            info, Counts(0, 0, 0, 0, 0), (), None, None, (), {}, kept=label_table([1, 2 if self.seed else 0])
        )


def made_points(still: int = 12, moving: int = 8, frames: int = 6) -> np.ndarray:
    """(F, P, 2): points that stay, then points that go right."""
    rng = np.random.default_rng(0)
    xy = np.repeat(rng.uniform(10, 90, (1, still + moving, 2)), frames, axis=0)
    xy[:, still:, 0] += 3.0 * np.arange(frames)[:, None]
    return xy


def homogeneous(xy: np.ndarray) -> np.ndarray:
    return np.concatenate([xy.transpose(2, 1, 0), np.ones((1, xy.shape[1], xy.shape[0]))])


def write_hopkins(folder: Path, name: str, still: int = 12, moving: int = 8) -> None:
    xy = made_points(still, moving)
    (folder / name).mkdir()
    truth = np.r_[np.full(still, 2), np.full(moving, 1)].reshape(-1, 1)
    fields = {"y": homogeneous(xy), "s": truth.astype(np.uint8), "width": 320, "height": 240}
    savemat(folder / name / f"{name}_truth.mat", fields)


def write_kt3dmoseg(folder: Path, name: str, **changes: Any) -> None:
    xy = made_points()
    truth = np.r_[np.full(12, 1), np.full(6, 2), [0, 0]].reshape(-1, 1)
    visible = np.ones((20, 6), np.uint8)
    visible[3, 2:] = 0
    points = homogeneous(xy)
    points[:, 3, 2:] = 0
    fields = {"ySparse": points, "visibleSparse": visible, "GtLabel": truth.astype(np.uint8), **changes}
    kept = {field: value for field, value in fields.items() if value is not None}
    savemat(folder / f"{name}_Tracks.mat", {"Data": kept})


def label_table(labels: list[int], frames: int = 4) -> LabelTable:
    """As many points as labels, one at x = 1, 5, ..., y = 2, in every frame."""
    n = len(labels)
    xy = np.array([[1.4 + 4 * k, 2.4] for k in range(n)], np.float32)
    return LabelTable(
        np.repeat(np.arange(frames, dtype=np.int32), n),
        np.tile(np.arange(n, dtype=np.int64), frames),
        np.tile(xy, (frames, 1)),
        np.tile(np.array(labels, np.int32), frames),
        frames,
    )


def left_half_moves(frames: int = 4) -> np.ndarray:
    """Masks (F, 6, 8): object 1 on the left."""
    masks = np.zeros((frames, 6, 8), np.uint8)
    masks[:, :, :4] = 1
    return masks


@pytest.mark.parametrize(
    ("estimated", "true", "wrong"),
    [
        pytest.param([0, 0, 1, 1, 2], [1, 1, 2, 2, 3], 0, id="perfect"),
        pytest.param([2, 2, 0, 0, 1], [1, 1, 2, 2, 3], 0, id="permuted"),
        pytest.param([0, 0, 0, 0, 0], [1, 1, 1, 2, 2], 40, id="merged"),
        pytest.param([0, 0, 1, 2, 2], [1, 1, 1, 2, 2], 20, id="split"),
        pytest.param([0, -1, -1, 1, 1], [1, 1, 1, 2, 2], 40, id="undecided is wrong"),
        pytest.param([-1, -1, -1, -1, -1], [1, 1, 1, 2, 2], 100, id="all undecided"),
        pytest.param([0, 7, 0, 1, 1], [1, 0, 1, 2, 2], 0, id="unlabelled is not counted"),
        pytest.param([0, 0, 0, 1, 1, 1], [1, 1, 2, 1, 1, 2], 50, id="one to one, not by majority"),
    ],
)
def test_error(estimated: list[int], true: list[int], wrong: float) -> None:
    assert metrics.error(np.array(estimated), np.array(true)) == pytest.approx(wrong)


def test_error_needs_a_truth() -> None:
    with pytest.raises(ValueError, match="no point"):
        metrics.error(np.zeros(3, int), np.zeros(3, int))


def test_group_count_takes_background_but_neither_undecided_nor_unlabelled() -> None:
    assert metrics.group_count(np.array([0, 1, -1, 5]), np.array([1, 2, 2, 0])) == 2


def test_moves_adds_up() -> None:
    count = metrics.moves(np.array([0, 3, 1, -1, 2]), np.array([1, 1, 2, 3, 0]))
    assert count == metrics.MovesCount(both=1, called=2, truly=2)
    assert (count + metrics.MovesCount(1, 2, 2)).as_dict() == {"precision": 50.0, "recall": 50.0}
    assert metrics.MovesCount().as_dict() == {"precision": None, "recall": None}


@pytest.mark.parametrize(
    ("estimated", "true", "expected"),
    [
        pytest.param([0, 4, 4, 9], [0, 1, 1, 2], 100, id="perfect under other numbers"),
        pytest.param([1, 1, 2, 2], [1, 1, 1, 1], 50, id="a number that changes"),
        pytest.param([1, 1, 1, 1], [1, 1, 2, 2], 50, id="two under one number"),
        pytest.param([1, 1, 0, -1], [0, 1, 1, 0], 50, id="a miss and a false one"),
        pytest.param([0, 0], [1, 1], 0, id="nothing found"),
        pytest.param([1, 1], [0, 0], 0, id="nothing there"),
        pytest.param([0, -1], [0, 0], None, id="nothing there, nothing found"),
    ],
)
def test_idf1(estimated: list[int], true: list[int], expected: float | None) -> None:
    assert metrics.idf1(np.array(estimated), np.array(true)) == expected


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("1R2RC", "checkerboard"),
        ("2T3RCRTP_g12", "checkerboard"),
        ("three-cars_g13", "checkerboard"),
        ("cars2B_g12", "traffic"),
        ("truck2", "traffic"),
        ("kanatani1", "traffic"),
        ("kanatani3", "articulated"),
        ("articulated_g12", "articulated"),
        ("arm", "articulated"),
        ("two_cranes_g23", "articulated"),
        ("dancing", "other"),
    ],
)
def test_hopkins_kind(name: str, kind: str) -> None:
    assert datasets.hopkins_kind(name) == kind


def test_hopkins_loader_takes_pixels_size_and_any_name(tmp_path: Path) -> None:
    write_hopkins(tmp_path, "street scene.2")
    (sequence,) = datasets.load("hopkins155", tmp_path)
    assert (sequence.name, sequence.kind, sequence.motions) == ("street scene.2", "other", 2)
    assert sequence.tracks.size == (320, 240)
    np.testing.assert_array_equal(sequence.tracks.xy, made_points())
    assert sequence.truth.tolist() == [2] * 12 + [1] * 8


def test_kt3dmoseg_loader_without_frames(tmp_path: Path) -> None:
    write_kt3dmoseg(tmp_path, "any")
    (sequence,) = datasets.load("kt3dmoseg", tmp_path)
    assert (sequence.name, sequence.motions, sequence.tracks.size) == ("any", 2, None)
    assert not sequence.tracks.visible[2:, 3].any()
    assert np.isnan(sequence.tracks.xy[2:, 3]).all()
    assert sequence.tracks.visible.sum() == 20 * 6 - 4


def test_kt3dmoseg_loader_without_visibility_sees_every_point(tmp_path: Path) -> None:
    write_kt3dmoseg(tmp_path, "any", visibleSparse=None)
    assert datasets.load("kt3dmoseg", tmp_path)[0].tracks.visible.all()


def test_kt3dmoseg_loader_takes_the_size_of_the_frames(tmp_path: Path) -> None:
    write_kt3dmoseg(tmp_path, "any")
    frames = tmp_path / "OriginalSequences" / "any"
    frames.mkdir(parents=True)
    imageio.imwrite(frames / "000001.png", np.zeros((30, 50), np.uint8))
    assert datasets.load("kt3dmoseg", tmp_path)[0].tracks.size == (50, 30)


def test_a_single_frame_keeps_its_shape(tmp_path: Path) -> None:
    one = homogeneous(made_points())[:, :, :1]
    write_kt3dmoseg(tmp_path, "any", ySparse=one, visibleSparse=np.ones((20, 1), np.uint8))
    assert datasets.load("kt3dmoseg", tmp_path)[0].tracks.xy.shape == (1, 20, 2)


def test_only_chooses_by_name(tmp_path: Path) -> None:
    for name in ("cars1", "cars2", "truck1"):
        write_hopkins(tmp_path, name)
    assert [one.name for one in datasets.load("hopkins155", tmp_path, "cars*")] == ["cars1", "cars2"]
    with pytest.raises(UsageError, match="no sequence is called people"):
        datasets.load("hopkins155", tmp_path, "people")


def test_loader_names_the_file_and_the_fault(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        datasets.load("kt3dmoseg", tmp_path / "nowhere")
    with pytest.raises(InputError, match="holds no"):
        datasets.load("kt3dmoseg", tmp_path)
    write_kt3dmoseg(tmp_path, "a", GtLabel=None)
    with pytest.raises(InputError, match=r"a_Tracks\.mat: has no field 'GtLabel'"):
        datasets.load("kt3dmoseg", tmp_path)
    write_kt3dmoseg(tmp_path, "a", GtLabel=np.ones((3, 1)))
    with pytest.raises(InputError, match=r"a_Tracks\.mat: .*expected labels of shape \(20,\)"):
        datasets.load("kt3dmoseg", tmp_path)
    (tmp_path / "a_Tracks.mat").write_bytes(b"MATLAB 5.0, cut off")
    with pytest.raises(InputError, match=r"a_Tracks\.mat: cannot be read"):
        datasets.load("kt3dmoseg", tmp_path)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the data sets are not here")
@pytest.mark.parametrize(("dataset", "number", "floor"), [("hopkins155", 155, 33.4), ("kt3dmoseg", 11, 31.9)])
def test_floor_on_the_real_data(dataset: str, number: int, floor: float) -> None:
    sequences = datasets.load(dataset, SHARED / dataset)
    assert len(sequences) == number
    errors = [metrics.error(np.zeros_like(one.truth), one.truth) for one in sequences]
    assert np.mean(errors) == pytest.approx(floor, abs=0.06)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the data sets are not here")
def test_kinds_of_the_real_data() -> None:
    sequences = datasets.load("hopkins155", SHARED / "hopkins155")
    counts = {
        (kind, motions): sum((one.kind, one.motions) == (kind, motions) for one in sequences)
        for kind in ("checkerboard", "traffic", "articulated")
        for motions in (2, 3)
    }
    assert list(counts.values()) == [78, 26, 31, 7, 11, 2]


def test_report_averages_over_runs_and_sequences(tmp_path: Path) -> None:
    write_hopkins(tmp_path, "cars1")
    write_hopkins(tmp_path, "people1", still=15, moving=5)
    sequences = datasets.load("hopkins155", tmp_path)
    report = runner.run_points(sequences, ByDisplacement, runs=2, seed=0, jobs=2, quiet=True)
    assert [row["estimated"] for row in report["sequences"]] == [[2, 1], [2, 1]]
    assert [row["errors"] for row in report["sequences"]] == [[0, 40], [0, 25]]
    assert report["error"] == {"all": 16.25, "2": 16.25}
    assert (report["median"], report["exact_count"], report["one_motion"]) == (16.25, 50, 32.5)
    assert report["std"] == pytest.approx(16.25)
    assert [(row["kind"], row["motions"]) for row in report["breakdown"]] == [
        (kind, motions) for kind in ("all", "articulated", "traffic") for motions in ("all", "2")
    ]


def test_number_of_motions_is_told_only_when_asked(tmp_path: Path) -> None:
    write_hopkins(tmp_path, "cars1")
    sequences = datasets.load("hopkins155", tmp_path)
    report = runner.run_points(sequences, ByDisplacement, motions_known=True, quiet=True)
    assert report["error"]["all"] == pytest.approx(10)


def test_a_failing_segmenter_is_named(tmp_path: Path) -> None:
    write_hopkins(tmp_path, "cars1")
    sequences = datasets.load("hopkins155", tmp_path)
    with pytest.raises(ZeroDivisionError) as caught:
        runner.run_points(sequences, Broken, quiet=True)
    assert "while running cars1, seed 0" in caught.value.__notes__
    with pytest.raises(IfsVideoError, match="a worker was killed"):
        runner.run_points(sequences, Killed, quiet=True)


def test_workers_have_one_thread_and_the_caller_keeps_his(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    assert runner.in_processes(threads, [0], 1, quiet=True) == [("1", "1", 1)]
    assert threads(0)[:2] == ("3", None)


def threads(_: int) -> tuple[str | None, str | None, int]:
    return os.environ.get("OPENBLAS_NUM_THREADS"), os.environ.get("OMP_NUM_THREADS"), cv2.getNumThreads()


def test_rows_of_a_clip() -> None:
    perfect = samples.score_rows(label_table([7, 0]), left_half_moves(), 2.0)
    assert (perfect.found, perfect.false, perfect.undecided, perfect.idf1) == (100, 0, 0, 100)
    assert (perfect.objects, perfect.true_objects, perfect.longest_false_s) == (1, 1, 0)
    undecided = samples.score_rows(label_table([-1, -1]), left_half_moves(), 2.0)
    assert (undecided.found, undecided.false, undecided.undecided, undecided.idf1) == (0, 0, 100, 0)
    false = samples.score_rows(label_table([1, 2]), left_half_moves(), 2.0)
    assert (false.found, false.false, false.objects) == (100, 100, 2)
    assert false.idf1 == pytest.approx(200 / 3)
    assert false.longest_false_s == 2.0
    still = samples.score_rows(label_table([0, 0]), np.zeros((4, 6, 8), np.uint8), 2.0)
    assert (still.found, still.false, still.idf1, still.true_objects) == (None, 0, None, 0)


def test_a_row_takes_the_nearest_pixel_also_beyond_the_border() -> None:
    xy = np.array([[-0.7, 2], [7.6, 5.6], [3.4, 0], [3.6, 0]], np.float32)
    rows = LabelTable(np.zeros(4, np.int32), np.arange(4), xy, np.zeros(4, np.int32), 1)
    assert samples.truth_of_rows(rows, left_half_moves(1)).tolist() == [1, 0, 1, 0]


def write_sample(folder: Path, name: str, masks: np.ndarray) -> None:
    (folder / f"{name}.mp4").write_bytes(b"")
    np.savez(folder / f"{name}_truth.npz", masks=masks)


def test_samples_average_over_seeds(tmp_path: Path) -> None:
    write_sample(tmp_path, "clip", left_half_moves())
    report = samples.run_samples(samples.clips(tmp_path), FakePipeline, runs=2, quiet=True)
    (row,) = report["clips"]
    assert [one["false"] for one in row["by_run"]] == [0, 100]
    assert (row["found"], row["false"], row["objects"]) == (100, 50, 1.5)
    assert report["mean"]["longest_false_s"] == 1.0
    assert "clip" in table.samples({"dataset": "samples", **report})


def test_samples_name_the_file_and_the_fault(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no NAME_truth"):
        samples.clips(tmp_path)
    write_sample(tmp_path, "clip", left_half_moves(3))
    with pytest.raises(InputError, match=r"clip_truth\.npz: does not fit clip\.mp4 \(4 frames"):
        samples.run_samples(samples.clips(tmp_path), FakePipeline, quiet=True)
    with pytest.raises(UsageError, match="no clip is called other"):
        samples.clips(tmp_path, "other")
    (tmp_path / "clip.mp4").unlink()
    with pytest.raises(InputError, match=r"clip\.mp4: is missing"):
        samples.clips(tmp_path)
    (tmp_path / "clip_truth.npz").write_bytes(b"PK cut off")
    with pytest.raises(InputError, match=r"clip_truth\.npz: holds no masks"):
        samples.load_masks(tmp_path / "clip_truth.npz")


@pytest.mark.parametrize("dataset", ["hopkins155", "kt3dmoseg"])
def test_json_keeps_its_contract(
    dataset: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    {"hopkins155": write_hopkins, "kt3dmoseg": write_kt3dmoseg}[dataset](tmp_path, "cars1")
    monkeypatch.setattr(command, "IFSFactory", lambda config: ByDisplacement)
    out = tmp_path / "scores.json"
    assert command.main([dataset, str(tmp_path), "--runs", "2", "--jobs", "1", "--json", str(out)]) == 0
    report = json.loads(out.read_text())
    assert report.keys() >= CONTRACT
    assert (report["dataset"], report["runs"]) == (dataset, 2)
    assert report["error"].keys() == {"all", "2"}
    (row,) = report["sequences"]
    assert row.keys() >= ROW_CONTRACT
    assert (row["name"], row["motions"], row["estimated"]) == ("cars1", 2, [2, 1])
    if dataset == "kt3dmoseg":
        assert report["moves"] == {"precision": 100.0, "recall": 50.0}
    assert f"{dataset}: 1 sequences, 2 runs" in capsys.readouterr().out
    assert not list(tmp_path.glob(".*"))


def test_configuration_by_name_and_by_file(tmp_path: Path) -> None:
    assert options.configuration("default") == Config()
    assert options.configuration("thesis") == Config(segmentation=SegmenterConfig.thesis())
    file = tmp_path / "mine.toml"
    file.write_text("[tracking]\nmax_points = 50\n")
    assert options.configuration(str(file)).tracking.max_points == 50
    with pytest.raises(UsageError, match=r"none\.toml"):
        options.configuration(str(tmp_path / "none.toml"))


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["hopkins155", "nowhere"], 3, "nowhere: no such folder"),
        (["hopkins155", ".", "--json", "nowhere/a.json"], 4, "nowhere/a.json: the folder nowhere does not"),
        (["hopkins155", ".", "--json", "."], 4, "is a folder"),
        (["samples", ".", "--motions-known"], 2, "--motions-known"),
        (["samples", ".", "--drop", "0.1"], 2, "--drop"),
        (["other", "."], 2, "invalid choice"),
        (["samples", ".", "--runs", "0"], 2, "--runs: '0' is not a whole number of at least 1"),
        (["hopkins155", ".", "--seed", "-1"], 2, "--seed"),
        (["hopkins155", ".", "--noise", "-1"], 2, "--noise: '-1' is no number of pixels"),
        (["hopkins155", ".", "--noise", "nan"], 2, "--noise: 'nan' is no number of pixels"),
        (["hopkins155", ".", "--drop", "1"], 2, "--drop: '1' is no share"),
        (["hopkins155", ".", "--show", "cars1"], 2, "--show draws pictures; say where by --plot DIR"),
    ],
)
def test_command_refuses_in_one_line(arguments: list[str], status: int, message: str, tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "ifsvideo.benchmark", *arguments], cwd=tmp_path, capture_output=True, text=True
    )
    assert run.returncode == status
    assert message in run.stderr.splitlines()[-1]
    assert "Traceback" not in run.stderr


def test_help_states_the_scoring_rule() -> None:
    run = subprocess.run(
        [sys.executable, "-m", "ifsvideo.benchmark", "--help"], capture_output=True, text=True, check=True
    )
    assert "one-to-one matching" in run.stdout
    assert "2 IDTP / (2 IDTP + IDFP + IDFN)" in run.stdout


def test_command_runs_the_segmenter(tmp_path: Path) -> None:
    write_hopkins(tmp_path, "cars1", still=40, moving=25)
    arguments = ["hopkins155", str(tmp_path), "--runs", "2", "--json", "a.json"]
    run = subprocess.run(
        [sys.executable, "-m", "ifsvideo.benchmark", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    report = json.loads((tmp_path / "a.json").read_text())
    assert len(report["sequences"][0]["estimated"]) == 2
    assert "error %" in run.stdout


def test_a_failed_write_leaves_the_old_file_and_no_stray_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    out = tmp_path / "scores.json"
    out.write_text("old")
    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OutputError, match=r"scores\.json: cannot be written \(No space"):
        options.write_report(out, {"dataset": "hopkins155"})
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]

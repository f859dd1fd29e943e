"""Methods side by side: spoilt tracks, peers, published figures, noise, a user's own tracks."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import comparison, datasets, runner, table
from ifsvideo.benchmark.comparison import NOISE_LEVELS, Method, Trial
from ifsvideo.benchmark.perturb import Perturbation
from ifsvideo.benchmark.published import HOPKINS155
from ifsvideo.errors import InputError
from ifsvideo.types import Segmentation, Tracks

STILL, MOVING, FRAMES = 12, 8, 6


class ByDisplacement:
    """A segmenter: what ends further to the right than it began moves; with seed 1, nothing does."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        labels = (tracks.xy[-1, :, 0] > tracks.xy[0, :, 0] + 1).astype(np.int64) * (self.seed != 1)
        return Segmentation(labels, labels == 0, labels, np.ones(tracks.points))


class Told:
    """A peer: it moves one point more to the wrong side than it is told motions, and says so of itself."""

    def __init__(self, seed: int) -> None:
        pass

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        assert motions is not None
        labels = np.r_[np.zeros(STILL, np.int64), np.ones(MOVING, np.int64)]
        labels[:motions] = 1
        return Segmentation(labels, labels == 0, labels, np.ones(tracks.points))


def points() -> np.ndarray:
    """(F, P, 2): points that stay, then points that go right."""
    xy = np.random.default_rng(0).uniform(10, 90, (1, STILL + MOVING, 2)).repeat(FRAMES, axis=0)
    xy[:, STILL:, 0] += 3.0 * np.arange(FRAMES)[:, None]
    return xy


TRUTH = np.r_[np.full(STILL, 1), np.full(MOVING, 2)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two sequences of a user's own."""
    for name in ("a", "b"):
        np.savez(tmp_path / f"{name}.npz", xy=points(), labels=TRUTH)
    return tmp_path


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "IFSFactory", lambda config: ByDisplacement)
    monkeypatch.setattr(command, "_peers", lambda: [Method("told", Told, motions_known=True)])


def tracks_with_a_gap() -> Tracks:
    xy = points()
    xy[2:, 3] = np.nan
    return Tracks.from_array(xy, size=(320, 240), fps=25.0)


def test_no_noise_and_no_drop_change_nothing() -> None:
    tracks = tracks_with_a_gap()
    assert Perturbation().apply(tracks, 7) is tracks


def test_noise_has_the_strength_asked_for_and_keeps_the_gaps() -> None:
    tracks = Tracks.from_array(np.zeros((40, 50, 2)))
    noise = Perturbation(noise=2.0).apply(tracks, 7).xy
    assert noise.std() == pytest.approx(2, rel=0.05)
    assert abs(noise.mean()) < 0.1
    spoilt = Perturbation(noise=2.0).apply(tracks_with_a_gap(), 7)
    np.testing.assert_array_equal(np.isnan(spoilt.xy), np.isnan(tracks_with_a_gap().xy))
    assert (spoilt.size, spoilt.fps) == ((320, 240), 25.0)


def test_seed_draws_the_directions_and_sigma_their_length() -> None:
    tracks = Tracks.from_array(points())
    once, twice, other = (
        Perturbation(noise=noise).apply(tracks, seed).xy - tracks.xy
        for noise, seed in ((1.0, 3), (2.0, 3), (1.0, 4))
    )
    np.testing.assert_allclose(2 * once, twice)
    assert not np.allclose(once, other)


@pytest.mark.parametrize("share", [0.1, 0.37, 0.9])
def test_drop_deletes_exactly_the_share_of_what_was_seen(share: float) -> None:
    tracks = tracks_with_a_gap()
    spoilt = Perturbation(drop=share).apply(tracks, 7)
    before = int(tracks.visible.sum())
    assert before - spoilt.visible.sum() == round(share * before)
    assert not (spoilt.visible & ~tracks.visible).any()
    np.testing.assert_array_equal(np.isfinite(spoilt.xy).all(axis=2), spoilt.visible)
    np.testing.assert_array_equal(spoilt.xy[spoilt.visible], tracks.xy[spoilt.visible])
    assert (Perturbation(drop=share).apply(tracks, 8).visible != spoilt.visible).any()


@pytest.mark.parametrize("wrong", [{"noise": -1.0}, {"noise": float("nan")}, {"drop": 1.0}, {"drop": -0.1}])
def test_perturbation_checks_itself(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Perturbation(**wrong)


def test_spoilt_tracks_reach_the_segmenter_by_the_seed_of_the_run(folder: Path) -> None:
    (sequence, _) = datasets.load("tracks", folder)
    scores = [
        runner.score(runner.Run(sequence, ByDisplacement, seed, None, Perturbation(noise=5.0)))
        for seed in (0, 2)
    ]
    expected = []
    for seed in (0, 2):
        spoilt = Perturbation(noise=5.0).apply(sequence.tracks, seed)
        expected.append(runner.metrics.error(ByDisplacement(seed).segment(spoilt).labels, sequence.truth))
    assert [one.error for one in scores] == expected
    assert min(expected) > 0


def test_published_figures_are_those_of_the_thesis() -> None:
    by_name = {one.method: one for one in HOPKINS155}
    assert {name for name, one in by_name.items() if not one.motions_known} == {
        "MSL",
        "ORK",
        "IFS, tables",
        "IFS, text",
    }
    assert by_name["IFS, text"].error == {"all": 1.78, "2": 1.27, "3": 3.41}
    for name, one in by_name.items():
        if {"2", "3"} <= one.error.keys() and name not in ("MSL", "IFS, tables"):  # these two do not add up
            mean = (120 * one.error["2"] + 35 * one.error["3"]) / 155
            assert mean == pytest.approx(one.error["all"], abs=0.03), name


def run_json(folder: Path, *options: str) -> dict[str, Any]:
    """Run the command in this process on a folder of own tracks; the report it wrote."""
    out = folder / "scores.json"
    assert command.main(["tracks", str(folder), "--jobs", "1", "--json", str(out), *options]) == 0
    report: dict[str, Any] = json.loads(out.read_text())
    return report


@pytest.mark.usefixtures("fake")
def test_peers_are_told_the_number_and_stand_in_the_table(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = run_json(folder, "--peers", "--runs", "2")
    (peer,) = report["peers"]
    assert (report["motions_known"], peer["method"], peer["motions_known"]) == (False, "told", True)
    assert report["error"] == {"all": 20, "2": 20}  # seed 1 finds nothing: 8 of 20 in every second run
    assert peer["error"] == pytest.approx({"all": 10, "2": 10})
    assert (report["exact_count"], peer["exact_count"], report["published"]) == (50, 100, [])
    shown = [line.split() for line in capsys.readouterr().out.splitlines()]
    seconds = [f"{one['seconds']:.2f}" for one in (report, peer)]
    assert ["ifsvideo", "found", "20.00", "20.00", "20.00", "20.00", "50.00", seconds[0]] in shown
    assert ["told", "given", "10.00", "10.00", "10.00", "0.00", "100.00", seconds[1]] in shown


@pytest.mark.usefixtures("fake")
def test_noise_and_drop_are_reported_and_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain, spoilt = run_json(folder), run_json(folder, "--noise", "5", "--drop", "0.25")
    assert (plain["noise"], plain["drop"], spoilt["noise"], spoilt["drop"]) == (0, 0, 5, 0.25)
    assert spoilt["error"]["all"] > plain["error"]["all"] == 0
    assert "noise 5 px, 25 % of the observations dropped" in capsys.readouterr().out


def test_noise_curve_holds_every_level_and_measures_none_twice(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def record(trial: Trial, sequences: Any, method: Method) -> dict[str, Any]:
        asked.append((method.name, trial.perturbation))
        shown = {"error": {"all": trial.perturbation.noise}, "std": 0.0, "exact_count": 0.0}
        return {"method": method.name, "motions_known": False, "noise": trial.perturbation.noise, **shown}

    monkeypatch.setattr(Trial, "run", record)
    methods = [Method("one", ByDisplacement, False), Method("two", ByDisplacement, False)]
    trial = Trial(perturbation=Perturbation(noise=0.5, drop=0.1))
    report = comparison.compare("tracks", [], methods, trial)
    curve = comparison.noise_curve([], methods, trial, report)
    levels = [0.0, *NOISE_LEVELS]
    assert NOISE_LEVELS == (0.01, 0.25, 0.5, 1, 2, 4)
    assert [(one["method"], one["error"]["all"]) for one in curve] == [
        (name, level) for name in ("one", "two") for level in levels
    ]
    assert sorted(asked, key=str) == sorted(
        ((name, Perturbation(level, 0.1)) for name in ("one", "two") for level in levels), key=str
    )


def test_published_figures_stand_beside_the_measured_ones(folder: Path) -> None:
    sequences = datasets.load("tracks", folder)
    trial = Trial(quiet=True)
    report = comparison.compare("hopkins155", sequences, [Method("own", ByDisplacement, False)], trial)
    text = table.points({"dataset": "hopkins155", "configuration": "thesis", **report}, by_sequence=False)
    rows = [line.split() for line in text.splitlines()]
    assert ["RANSAC", "(published)", "given", "9.48", "5.56", "22.94", "-", "-", "-", "43.44"] in rows
    assert ["IFS,", "text", "(published)", "found", "1.78", "1.27", "3.41", "-", "0.31", "-", "-"] in rows
    assert next(row for row in rows if row[:2] == ["own", "found"])[2:5] == ["0.00", "0.00", "-"]
    assert "configuration thesis" in text
    json.dumps(report, allow_nan=False)


def test_own_tracks_of_every_layout(tmp_path: Path) -> None:
    visible = np.ones((FRAMES, STILL + MOVING), bool)
    visible[2:, 3] = False
    np.savez(tmp_path / "plain.npz", xy=points(), visible=visible, labels=np.where(TRUTH == 2, 0, 1))
    homogeneous = np.concatenate([points().transpose(2, 1, 0), np.ones((1, 20, FRAMES))])
    (tmp_path / "cars1").mkdir()
    hopkins = {"y": homogeneous, "s": TRUTH[:, None], "width": 320, "height": 240}
    savemat(tmp_path / "cars1" / "cars1_truth.mat", hopkins)
    savemat(tmp_path / "drive_Tracks.mat", {"Data": {"ySparse": homogeneous, "GtLabel": TRUTH[:, None]}})
    sequences = {one.name: one for one in datasets.load("tracks", tmp_path)}
    assert sequences.keys() == {"plain", "cars1", "drive"}
    assert {one.kind for one in sequences.values()} == {"tracks"}
    assert sequences["cars1"].tracks.size == (320, 240)
    assert not sequences["plain"].tracks.visible[2:, 3].any()
    assert [one.motions for one in sequences.values()] == [2, 2, 1]
    report = runner.run_points(list(sequences.values()), ByDisplacement, quiet=True)
    assert [row["labelled"] for row in report["sequences"]] == [20, 20, 12]
    shown = {"dataset": "tracks", "configuration": "default", "peers": [], "published": [], **report}
    shown["method"] = "own"
    assert "points counted: 52 of 60" in table.points(shown, by_sequence=True)


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"xy": points()}, "has no field 'labels.*; give .npz with xy"),
        ({"labels": TRUTH}, "has no field xy"),
        ({"xy": points(), "labels": TRUTH[:5]}, r"expected labels of shape \(20,\), got \(5,\)"),
        ({"xy": points(), "labels": TRUTH - 3}, "labels are not integers from 0"),
        ({"xy": points(), "labels": TRUTH / 2}, "labels are not integers from 0"),
        ({"xy": points(), "labels": 0 * TRUTH}, "no point carries a true label"),
    ],
)
def test_own_tracks_that_cannot_be_scored_are_named(
    tmp_path: Path, fields: dict[str, np.ndarray], fault: str
) -> None:
    np.savez(tmp_path / "mine.npz", **fields)
    with pytest.raises(InputError, match=rf"mine\.npz: .*{fault}") as caught:
        datasets.load("tracks", tmp_path)
    assert "\n" not in str(caught.value)


def test_own_tracks_in_a_bad_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no"):
        datasets.load("tracks", tmp_path)
    savemat(tmp_path / "mine.mat", {"y": np.ones((3, 20, 6)), "width": 9, "height": 9})
    with pytest.raises(InputError, match=r"mine\.mat: has no field 's'"):
        datasets.load("tracks", tmp_path)
    np.savez(tmp_path / "mine.npz", xy=points(), labels=TRUTH)
    with pytest.raises(InputError, match=r"mine\.npz: is called mine as .*mine\.mat is"):
        datasets.load("tracks", tmp_path)


def test_the_real_peers_run_by_the_command(folder: Path) -> None:
    arguments = ["tracks", str(folder), "--peers", "--only", "a", "--json", "scores.json", "--drop", "0.01"]
    run = subprocess.run(
        [sys.executable, "-m", "ifsvideo.benchmark", *arguments], cwd=folder, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    report = json.loads((folder / "scores.json").read_text())
    assert {one["method"] for one in report["peers"]} >= {"ransac", "ssc", "rsim"}
    assert all(one["motions_known"] for one in report["peers"])
    assert "given" in run.stdout


def test_plot_without_matplotlib_says_what_to_install(folder: Path) -> None:
    blocked = folder / "blocked" / "matplotlib"
    blocked.mkdir(parents=True)
    (blocked / "__init__.py").write_text("raise ModuleNotFoundError(name='matplotlib')")
    run = subprocess.run(
        [sys.executable, "-m", "ifsvideo.benchmark", "tracks", ".", "--plot", "pictures"],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(blocked.parent)},
    )
    assert run.returncode == 2
    assert run.stderr == "error: --plot needs matplotlib; install it by: pip install 'ifsvideo[plot]'\n"
    assert not (folder / "pictures").exists()

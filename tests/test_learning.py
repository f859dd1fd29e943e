"""How the rule of stage 5 is learnt: from what, that nothing is judged by itself, and the command."""

from __future__ import annotations

import json
import shutil
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import expit

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import learning, learning_data, metrics, simulation
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.learning_data import SOURCE_WEIGHTS, Example
from ifsvideo.benchmark.learning_oracle import FIRST_PAIRS, PAIRS_PER_MERGE, Pairs, Staged, Task, oracle_pairs
from ifsvideo.benchmark.metrics import MovesCount
from ifsvideo.config import Config
from ifsvideo.errors import InputError
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import CUES
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.segmentation.similarity import Similarity, feature_names, features, learnt
from tests.conftest import HEIGHT, WIDTH
from tests.scenes import LEFT_CAR, RIGHT_CAR, Scene, make_scene
from tests.test_benchmark import write_hopkins


def labelled(scene: Scene, name: str) -> LabelledSequence:
    return LabelledSequence(name, "made", scene.tracks, scene.truth + 1)


def stand_in(seed: int) -> LabelledSequence:
    """A window of a street with one or two cars."""
    cars = (LEFT_CAR,) if seed % 2 else (LEFT_CAR, RIGHT_CAR)
    return labelled(make_scene(movers=cars, static=60, seed=seed), f"street-{seed}")


def staged(seed: int = 0, truth: np.ndarray | None = None) -> Staged:
    sequence = stand_in(seed)
    if truth is not None:
        sequence = LabelledSequence(sequence.name, sequence.kind, sequence.tracks, truth)
    return Staged.of(Task(Example("simulated", f"street {seed}", sequence), SegmenterConfig(), 7))


def drawn(count: int, rule: np.ndarray, seed: int) -> Pairs:
    """Pairs whose truth follows a known rule."""
    rng = np.random.default_rng(seed)
    measured = rng.normal(0, 1, (count, 4 + len(CUES)))
    apart = rng.random(count) < expit(features(measured) @ rule)
    return Pairs(measured, apart, rng.uniform(2, 50, count))


KNOWN = np.where(np.isin(feature_names(), ["constant", "rigid.always", "gap.if_both_move"]), 1.5, 0.0)


def test_pairs_of_one_motion_weigh_as_much_as_those_of_two() -> None:
    pairs = Pairs(np.zeros((3, 12)), np.array([True, False, False]), np.array([5.0, 1.0, 10.0]))
    assert pairs.weights() == pytest.approx([0.5, 0.5 / (1 + 10**0.7), 0.5 * 10**0.7 / (1 + 10**0.7)])
    alone = Pairs(np.zeros((2, 12)), np.array([True, True]), np.array([4.0, 4.0]))
    assert alone.weights() == pytest.approx([0.25, 0.25])


def test_a_known_rule_is_learnt_again() -> None:
    found = learning.fit([drawn(4000, KNOWN, seed) for seed in range(3)], [1.0, 1.0, 1.0])
    fresh = features(drawn(2000, KNOWN, 9).measured)
    # Both kinds weigh the same, so the constant is not the drawn one; how pairs compare is.
    assert np.corrcoef(fresh @ found.weights, fresh @ KNOWN)[0, 1] > 0.98
    assert np.array_equal(found.weights, np.round(found.weights, 4))


def test_a_cue_that_is_left_out_weighs_nothing() -> None:
    pairs = [drawn(1000, KNOWN, 0)]
    whole, less = (learning.fit(pairs, [1.0], left_out) for left_out in (None, "gap"))
    own = np.array([name.startswith("gap.") for name in feature_names()])
    assert own.sum() == 3
    assert whole.weights[own].any()
    assert not less.weights[own].any()
    assert less.weights[~own].all()


def test_sequences_count_by_their_importance() -> None:
    one, other = drawn(1000, KNOWN, 0), drawn(1000, -KNOWN, 1)
    weights = [learning.fit([one, other], shares).weights for shares in ([1.0, 0.01], [0.01, 1.0])]
    place = feature_names().index("rigid.always")
    assert weights[0][place] > 0.5
    assert weights[1][place] < -0.5


@pytest.mark.parametrize("apart", [[], [True, True], [False]])
def test_both_kinds_of_pairs_are_needed(apart: list[bool]) -> None:
    pairs = Pairs(np.zeros((len(apart), 12)), np.array(apart, dtype=bool), np.ones(len(apart)))
    with pytest.raises(InputError, match="too few sequences"):
        learning.fit([pairs], [1.0])


def test_a_staged_sequence_is_what_the_segmenter_makes_of_it() -> None:
    """Stage 5 on what was kept, with the package's rule, gives the package's labels."""
    found = staged()
    sequence = found.task.example.sequence
    expected = IFSSegmenter(found.task.config, found.task.seed).segment(sequence.tracks)
    (score,) = learning.judge(learning.Judged(found, (learnt().final,)))
    assert score.error == metrics.error(expected.labels, sequence.truth)
    assert score.estimated == len(np.unique(expected.labels))
    assert found.cues.unit == 1.0


def test_the_oracle_measures_segments_and_what_they_grow_to() -> None:
    found = staged()
    pairs = oracle_pairs(found)
    segments = len(np.unique(found.window.segments))
    first = min(FIRST_PAIRS, segments * (segments - 1) // 2)
    assert first < len(pairs.apart) <= first + PAIRS_PER_MERGE * segments
    assert pairs.apart.any()
    assert not pairs.apart.all()
    assert pairs.measured.shape == (len(pairs.apart), 4 + len(CUES))
    # The whole background against a whole car is met at the end.
    assert pairs.apart[-1]
    assert pairs.smaller[-1] >= 25
    again = oracle_pairs(found)
    assert pairs.measured.tobytes() == again.measured.tobytes()


def test_segments_of_mixed_or_unknown_motion_are_left_out() -> None:
    whole = staged()
    truth = whole.task.example.sequence.truth
    mixed = np.zeros_like(truth)
    for _, reliable in whole.window.parts():
        mixed[reliable] = 1 + np.arange(len(reliable)) % 2  # one of three is not 80 %
    assert not len(oracle_pairs(staged(truth=mixed)).apart)
    unknown = np.where(truth == 1, 1, 0)
    assert not oracle_pairs(staged(truth=unknown)).apart.any()


def test_sequences_of_the_same_frames_share_a_fold(tmp_path: Path) -> None:
    for name in ("cars1", "cars2", "cars2_g12", "cars2_g13", "two_g"):
        write_hopkins(tmp_path, name)
    examples = learning_data.of_points("hopkins155", tmp_path)
    groups = {example.sequence.name: example.group for example in examples}
    assert groups["cars2"] == groups["cars2_g12"] == groups["cars2_g13"]
    assert len(set(groups.values())) == 3
    folds = learning.folds_of([str(k) for k in range(20)] * 2, seed=1)
    assert folds == learning.folds_of([str(k) for k in range(20)], seed=1)
    assert sorted(np.bincount(list(folds.values()))) == [3, 3, 3, 3, 4, 4]


def test_windows_of_a_clip_carry_what_the_masks_show(clips: dict[str, Path], tmp_path: Path) -> None:
    """The left part of the picture is object 2 while the clip's first half lasts, nothing after that."""
    shutil.copy(clips["plain"], tmp_path / "clip.mp4")
    masks = np.zeros((24, HEIGHT, WIDTH), np.uint8)
    masks[:12, :, : WIDTH // 2] = 2
    np.savez(tmp_path / "clip_truth.npz", masks=masks)
    config = Config()
    examples = learning_data.of_samples(tmp_path, config, quiet=True)
    assert [(e.source, e.group, e.sequence.name) for e in examples] == [
        ("samples", "samples clip", "clip_0"),
        ("samples", "samples clip", "clip_4"),
    ]
    for example, start in zip(examples, (0, 4), strict=True):
        tracks, truth = example.sequence.tracks, example.sequence.truth
        assert (tracks.frames, tracks.size, tracks.fps) == (20, (WIDTH, HEIGHT), 20.0)
        assert (tracks.visible.sum(axis=0) >= 10).all()
        assert set(truth) == {1, 3}
        for p in range(tracks.points):
            seen = np.flatnonzero(tracks.visible[:, p])
            left = (tracks.xy[seen, p, 0].round() < WIDTH // 2) & (seen + start < 12)
            if left.mean() != 0.5:
                assert truth[p] == (3 if left.mean() > 0.5 else 1)
    np.savez(tmp_path / "clip_truth.npz", masks=masks[:-1])
    with pytest.raises(InputError, match=r"clip_truth\.npz: does not fit clip\.mp4"):
        learning_data.of_samples(tmp_path, config, quiet=True)


def streets(count: int) -> list[Example]:
    return learning_data.of_simulation(stand_in, count, seed=3, quiet=True)


def test_simulated_windows_have_seeds_in_turn() -> None:
    assert [example.sequence.name for example in streets(2)] == ["street-3", "street-4"]


def test_no_sequence_is_judged_by_what_was_learnt_from_its_group(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = stand_in(0)
    examples = [Example("samples", f"samples {k // 2}", scene) for k in range(6)]
    prepared: list[Pairs] = []
    judged: list[learning.Judged] = []
    used: dict[int, list[int]] = {}

    def record(function: Callable[[Any], Any], tasks: Sequence[Any], *_: Any) -> list[Any]:
        if function is learning.prepare:
            prepared.extend(drawn(5, KNOWN, k) for k in range(len(tasks)))
            return [(task, pairs) for task, pairs in zip(tasks, prepared, strict=True)]
        judged.extend(tasks)
        return [[learning.Score(0.0, 2, MovesCount()), learning.Score(50.0, 1, MovesCount())] for _ in tasks]

    def fit(pairs: Sequence[Pairs], importance: Sequence[float], left_out: str | None) -> Similarity:
        assert left_out is None
        assert set(importance) == {SOURCE_WEIGHTS["samples"]}
        rule = Similarity(learnt().final.weights.copy())
        used[id(rule)] = [next(k for k, own in enumerate(prepared) if own is one) for one in pairs]
        return rule

    monkeypatch.setattr(learning, "in_processes", record)
    monkeypatch.setattr(learning, "fit", fit)
    _, report = learning.learn(examples, runs=2)
    assert len(judged) == 12
    for place, one in enumerate(judged):
        held_out, in_sample = (used[id(rule)] for rule in one.rules)
        others = {example.group for example in examples} - {examples[place // 2].group}
        assert {examples[k // 2].group for k in held_out} == others
        assert in_sample == list(range(12))
    assert [row["seed"] for row in report["sequences"]] == [0, 1] * 6
    (source,) = report["sources"]
    assert (source["held_out"]["error"], source["in_sample"]["error"]) == (0, 50)


def test_one_scene_cannot_be_judged_by_others() -> None:
    alone = [Example("samples", "the same", stand_in(seed)) for seed in range(2)]
    with pytest.raises(InputError, match="all show the same scene"):
        learning.learn(alone, quiet=True)


def arguments(folder: Path, *more: str) -> list[str]:
    written = str(folder / "w.toml")
    return ["learn", "--simulated", "4", "--seed", "3", "--jobs", "1", "--write", written, *more]


def test_the_command_learns_tells_and_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(simulation, "simulate", stand_in)
    out = tmp_path / "scores.json"
    assert command.main(arguments(tmp_path, "--json", str(out))) == 0
    told = capsys.readouterr().out
    report = json.loads(out.read_text())
    (row,) = report["sources"]
    assert (row["source"], row["sequences"], report["runs"], report["seed"]) == ("simulated", 4, 1, 3)
    for rule in ("held_out", "in_sample"):
        assert row[rule]["error"] < 5
        assert row[rule]["exact_count"] >= 50
        assert row[rule]["moves"]["recall"] > 90
        assert f"{row[rule]['error']:.2f}" in told
    assert len({one["fold"] for one in report["sequences"]}) == 4

    text = (tmp_path / "w.toml").read_text()
    assert report["command"] == "python -m ifsvideo.benchmark learn --simulated 4 --runs 1 --seed 3"
    assert report["command"] in text
    assert tomllib.loads(text).keys() == {"core", "final"}
    weights = tomllib.loads(text)["final"]
    flat = weights["first"] | {f"{cue}.{when}": w for cue in CUES for when, w in weights[cue].items()}
    assert [flat[name] for name in feature_names()] == [report["weights"][name] for name in feature_names()]

    assert [one["without"] for one in report["ablation"]] == [None]
    assert report["ablation"][0]["simulated"] == row["held_out"]["error"]

    assert command.main(arguments(tmp_path, "--ablate", "--json", str(out))) == 0
    assert (tmp_path / "w.toml").read_text() == text
    told, ablation = capsys.readouterr().out, json.loads(out.read_text())["ablation"]
    assert [one["without"] for one in ablation] == [None, *CUES]
    assert ablation[0] == report["ablation"][0]
    assert all(f"\n{cue} " in told for cue in CUES)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["scores.json", "w.toml"]


def test_the_command_that_is_written_names_no_place() -> None:
    options = command._learning_parser().parse_args(
        ["--hopkins155", "/a", "--samples", "/b", "--only", "c*", "--runs", "2"]
    )
    expected = (
        "python -m ifsvideo.benchmark learn --hopkins155 DIR --samples DIR --only 'c*' --runs 2 --seed 0"
    )
    assert command._command_of(options) == expected


def test_what_moves_is_not_told_where_no_group_is_known_to_be_the_background() -> None:
    score = {"error": 1.0, "estimated": 2, "moves": {"both": 1, "called": 2, "truly": 4}}
    row = {"name": "a", "motions": 2, "pairs": 5, "held_out": score, "in_sample": score}
    rows = [{**row, "source": source} for source in ("hopkins155", "kt3dmoseg")]
    hopkins, driving = (learning._summary(row["source"], rows) for row in rows)
    assert hopkins["held_out"]["moves"] == {"precision": None, "recall": None}
    assert driving["held_out"]["moves"] == {"precision": 50.0, "recall": 25.0}
    lines = learning.table({"sources": [hopkins, driving]}).splitlines()
    assert lines[1].split() == ["hopkins155", "1", "5", "1.00", "1.00", "100.00", "100.00", *"----"]


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        ([], 2, "nothing to learn from; name --hopkins155"),
        (["--hopkins155", "nowhere"], 3, "nowhere: no such folder"),
        (["--samples", "."], 3, "holds no NAME_truth"),
        (["--simulated", "2", "--write", "nowhere/w.toml"], 4, "nowhere/w.toml: the folder nowhere does not"),
        (["--simulated", "2", "--json", "."], 4, "is a folder"),
    ],
)
def test_the_command_refuses_in_one_line(
    options: list[str],
    status: int,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command.main(["learn", *options]) == status
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("options", [["--simulated", "0"], ["--peers"], ["hopkins155", "."]])
def test_options_that_make_no_sense_are_refused(options: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        command.main(["learn", *options])
    assert caught.value.code == 2

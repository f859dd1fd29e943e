"""Learns the weights of stage 5 (`ifsvideo.segmentation.similarity`) and tells what they reach.

A logistic regression learns to tell pairs of groups of two motions from those of one (`learning_oracle`).
What the weights are worth is told by running stage 5 on sequences from which they were not learnt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from ifsvideo.benchmark import metrics
from ifsvideo.benchmark.learning_data import SOURCE_WEIGHTS, Example, sources_of
from ifsvideo.benchmark.learning_oracle import Pairs, Staged, Task, prepare
from ifsvideo.benchmark.runner import Report, in_processes
from ifsvideo.benchmark.table import align
from ifsvideo.errors import InputError
from ifsvideo.segmentation.agglomeration import Agglomeration
from ifsvideo.segmentation.background import merge_and_label
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import CUES
from ifsvideo.segmentation.similarity import WHEN, Rules, Similarity, feature_names, features
from ifsvideo.types import UNDECIDED

Array = NDArray[np.float64]

FOLDS = 6
"""Parts of cross-validation: each is judged by weights that were learnt from the others."""
RIDGE = 5e-4
"""What the square of a standardised weight costs: cues that tell the same do not grow against each other."""
DECIMALS = 4
"""Of the weights that are written."""


def fit(pairs: Sequence[Pairs], importance: Sequence[float], left_out: str | None = None) -> Similarity:
    """Logistic regression with a small ridge, each sequence's pairs weighing its ``importance`` together.

    Parameters
    ----------
    left_out : str, optional
        A cue whose weights stay 0.

    Raises
    ------
    InputError
        If there are not pairs of both kinds: of one motion and of two.
    """
    apart = np.concatenate([one.apart for one in pairs]) if pairs else np.empty(0, dtype=bool)
    if not apart.any() or apart.all():
        raise InputError(
            "too few sequences to learn from: segments of one motion and of two are needed, both"
        )
    X = features(np.concatenate([one.measured for one in pairs]))
    X[:, [name.split(".")[0] == left_out for name in feature_names()]] = 0.0
    counts = np.concatenate([one.weights() * value for one, value in zip(pairs, importance, strict=True)])
    # The first feature is the constant: neither scaled nor held back by the ridge.
    mean, spread = X.mean(axis=0), X.std(axis=0) + 1e-9
    mean[0], spread[0] = 0.0, 1.0
    ridge = np.full(X.shape[1], RIDGE)
    ridge[0] = 0.0
    b = _logistic((X - mean) / spread, np.where(apart, 1.0, -1.0), counts / counts.sum(), ridge)
    weights = b / spread
    weights[0] -= weights @ mean
    return Similarity(np.round(weights, DECIMALS))


def _logistic(Z: Array, sign: Array, counts: Array, ridge: Array) -> Array:
    """Weights (K,) of least ``counts @ log(1 + exp(-sign * Z b)) + ridge @ b**2 / 2``."""

    def cost(b: Array) -> tuple[float, Array]:
        margin = sign * (Z @ b)
        slope = -counts * sign * expit(-margin)
        value = counts @ np.logaddexp(0.0, -margin) + ridge @ b**2 / 2
        return float(value), np.asarray(Z.T @ slope + ridge * b)

    start = np.zeros(Z.shape[1])
    return np.asarray(minimize(cost, start, jac=True, method="L-BFGS-B", options={"maxiter": 1000}).x)


@dataclass(frozen=True)
class Score:
    """What a rule reached on one sequence: error (per cent), groups found, what moves."""

    error: float
    estimated: int
    moves: metrics.MovesCount


@dataclass(frozen=True)
class Judged:
    """A sequence, and the rules that its segments are merged by."""

    staged: Staged
    rules: tuple[Similarity, ...]

    def __str__(self) -> str:
        return str(self.staged.task)


def judge(judged: Judged) -> list[Score]:
    """Score of each rule: the whole of stage 5 with it, on the segments that are there."""
    staged, scores = judged.staged, []
    truth = staged.task.example.sequence.truth
    for rule in judged.rules:
        labels = np.full(len(truth), UNDECIDED, dtype=np.int64)
        merging = Agglomeration(staged.cues, rule)
        labels[staged.usable], _ = merge_and_label(merging, staged.joined, staged.task.config)
        scores.append(
            Score(
                metrics.error(labels, truth), metrics.group_count(labels, truth), metrics.moves(labels, truth)
            )
        )
    return scores


def folds_of(groups: Sequence[str], seed: int) -> dict[str, int]:
    """Fold of every group: as even as can be, by chance."""
    names = sorted(set(groups))
    order = np.random.default_rng(seed).permutation(len(names))
    return {name: int(place) % FOLDS for name, place in zip(names, order, strict=True)}


def learn(
    examples: Sequence[Example],
    runs: int = 1,
    seed: int = 0,
    jobs: int = 1,
    quiet: bool = False,
    ablate: bool = False,
) -> tuple[Similarity, Report]:
    """Learn the rule from all examples, and measure it by cross-validation over their groups.

    It is that of the second pass of stage 5; in the first the package's own is followed.

    Parameters
    ----------
    examples : sequence of Example
    runs : int
        How often stages 1 to 4 are run on every sequence, with seeds ``seed``, ``seed + 1``, ...
    seed, jobs : int
    quiet : bool
        Whether progress is kept off stderr.
    ablate : bool
        Whether to learn and judge once more without each cue.

    Raises
    ------
    InputError
        If the sequences are too few to learn from and to judge by.
    """
    config = SegmenterConfig()
    tasks = [Task(example, config, seed + run) for example in examples for run in range(runs)]
    importance = [SOURCE_WEIGHTS[task.example.source] for task in tasks]
    folds = folds_of([example.group for example in examples], seed)
    fold = [folds[task.example.group] for task in tasks]
    if len(set(fold)) < 2:
        raise InputError("too few sequences to judge by: all show the same scene; give another one, too")
    prepared = in_processes(prepare, tasks, jobs, quiet, "stages 1 to 4")
    pairs = [found for _, found in prepared]

    def without(held_out: int | None, cue: str | None = None) -> Similarity:
        chosen = [k for k in range(len(tasks)) if fold[k] != held_out]
        return fit([pairs[k] for k in chosen], [importance[k] for k in chosen], cue)

    rule = without(None)
    left_out = (None, *CUES) if ablate else (None,)
    rules = {f: [without(f, cue) for cue in left_out] for f in sorted(set(fold))}
    judged = [
        Judged(staged, (rules[f][0], rule, *rules[f][1:]))
        for (staged, _), f in zip(prepared, fold, strict=True)
    ]
    scores = in_processes(judge, judged, jobs, quiet, "stage 5")
    rows = [
        _row(task, f, len(found.apart), score)
        for task, f, found, score in zip(tasks, fold, pairs, scores, strict=True)
    ]
    return rule, {
        "runs": runs,
        "seed": seed,
        "sources": [_summary(source, rows) for source in sources_of(examples)],
        "weights": _named(rule),
        "sequences": rows,
        "ablation": _ablation(tasks, scores, left_out),
    }


def _ablation(
    tasks: Sequence[Task], scores: Sequence[Sequence[Score]], left_out: Sequence[str | None]
) -> list[Report]:
    """Mean error of each source, held out, with all cues and without each of them."""
    rows: list[Report] = []
    for place, cue in enumerate(left_out):
        own: dict[str, list[float]] = {}
        for task, (held_out, _, *ablated) in zip(tasks, scores, strict=True):
            own.setdefault(task.example.source, []).append((held_out, *ablated)[place].error)
        rows.append({"without": cue, **{source: float(np.mean(errors)) for source, errors in own.items()}})
    return rows


def _named(rule: Similarity) -> dict[str, float]:
    """Weights by their names."""
    return dict(zip(feature_names(), rule.weights.tolist(), strict=True))


_RULES = ("held_out", "in_sample")
"""Weights learnt from the other folds, and from all."""
_BACKGROUND_UNKNOWN = ("hopkins155",)
"""Sources whose first group is any: what moves there cannot be scored."""


def _row(task: Task, fold: int, pairs: int, scores: Sequence[Score]) -> Report:
    """Scores of one run of a sequence."""
    sequence = task.example.sequence
    row = {"source": task.example.source, "name": sequence.name, "seed": task.seed, "fold": fold}
    reached = {name: asdict(score) for name, score in zip(_RULES, scores[: len(_RULES)], strict=True)}
    return {**row, "pairs": pairs, "motions": sequence.motions, **reached}


def _summary(source: str, rows: Sequence[Report]) -> Report:
    """Scores of a source: mean error over its runs, per cent with the right number of groups, what moves."""
    own = [row for row in rows if row["source"] == source]
    summary: dict[str, Any] = {
        "source": source,
        "weight": SOURCE_WEIGHTS[source],
        "sequences": len({row["name"] for row in own}),
        "pairs": sum(row["pairs"] for row in own),
    }
    for name in _RULES:
        known = [row for row in own if source not in _BACKGROUND_UNKNOWN]
        counts = (metrics.MovesCount(**row[name]["moves"]) for row in known)
        summary[name] = {
            "error": float(np.mean([row[name]["error"] for row in own])),
            "exact_count": 100.0 * float(np.mean([row[name]["estimated"] == row["motions"] for row in own])),
            "moves": sum(counts, metrics.MovesCount()).as_dict(),
        }
    return summary


def table(report: Report) -> str:
    """A line for each source: the same figures held out and in sample."""
    header = ["source", "sequences", "pairs"]
    for figure in ("error %", "exact count %", "precision %", "recall %"):
        header += [f"{figure} held out", "in sample %"]
    rows = []
    for row in report["sources"]:
        cells = [row["source"], row["sequences"], row["pairs"]]
        for figure in ("error", "exact_count"):
            cells += [row[name][figure] for name in _RULES]
        for figure in ("precision", "recall"):
            cells += [row[name]["moves"][figure] for name in _RULES]
        rows.append(cells)
    return align(header, rows)


def ablation_table(report: Report) -> str:
    """A line for each cue that was left out: error of each source, held out."""
    rows = report["ablation"]
    sources = [name for name in rows[0] if name != "without"]
    header = ["without", *(f"{source} %" for source in sources)]
    return align(
        header, [[row["without"] or "nothing", *(row[source] for source in sources)] for row in rows]
    )


def as_toml(rules: Rules, command: str) -> str:
    """The file `similarity.toml`, which a comment says is made by ``command``."""
    lines = [
        "# How stage 5 weighs what it measures of two segments; more speaks for two motions. first: the",
        "# constant, the logarithms of the larger and the smaller evidence of motion, the same after the",
        "# cameras gave way (ifsvideo/segmentation/leeway.py), the probabilities that one of the two",
        "# moves and that both do, and their product. Every other section is a cue",
        "# (ifsvideo/segmentation/cues.py): its weight always, and what is added the surer one of the two",
        "# moves, or both do.",
        "#",
        "# [core.*] is the rule of the first pass. It was learnt before models had a label cost and before",
        "# there was a second pass, from more and smaller segments, which serves it better than to be learnt",
        "# anew (ifsvideo/benchmark/TRIED.md). [final.*] is that of the second pass, learnt by",
        f"#   {command}",
    ]
    for part, rule in (("core", rules.core), ("final", rules.final)):
        weight = _named(rule)
        lines += ["", f"[{part}.first]"]
        lines += [f"{name} = {weight[name]:.{DECIMALS}f}" for name in weight if "." not in name]
        for cue in CUES:
            lines += ["", f"[{part}.{cue}]"]
            lines += [f"{when} = {weight[f'{cue}.{when}']:.{DECIMALS}f}" for when in WHEN]
    return "\n".join(lines) + "\n"

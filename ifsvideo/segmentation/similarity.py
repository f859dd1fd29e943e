"""How likely two segments are two motions: a logistic rule over their cues, with weights that were learnt.

There is one rule for each of the two passes. The weights are data, `similarity.toml`;
``python -m ifsvideo.benchmark learn`` makes those of the second, and prints what they reach on sequences that
they were not learnt from.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from ifsvideo.segmentation.cues import CUES

Array = NDArray[np.float64]

WHEN = ("always", "if_one_moves", "if_both_move")
"""Each cue has three weights: what it always tells, and what is added the surer one or both segments move.
Two static ones at different depths shear against each other; two that move do not if they are one thing."""


def features(measured: Array) -> Array:
    """What the rule weighs (N, 8 + 3 len(CUES)), from the columns of
    `ifsvideo.segmentation.cues.Cues.between`.

    A constant, both evidences, both after the cameras gave way, the probabilities that one moves and that
    both do, their product, and every cue by itself and times either probability.
    """
    evidence, yielding, cues = measured[:, :2], measured[:, 2:4], measured[:, 4:]
    moves = expit(evidence + yielding)  # e^2 / (1 + e^2) of e, the geometric mean of both evidences
    first = [np.ones((len(measured), 1)), evidence, yielding, moves, moves.prod(axis=1, keepdims=True)]
    return np.hstack([*first, cues, cues * moves[:, :1], cues * moves[:, 1:]])


def feature_names() -> list[str]:
    """Names of the columns of `features`."""
    first = ["constant", "larger_evidence", "smaller_evidence", "larger_yielding", "smaller_yielding"]
    first += ["one_moves", "both_move", "product"]
    return first + [f"{cue}.{when}" for when in WHEN for cue in CUES]


@dataclass(frozen=True)
class Similarity:
    """The learnt rule.

    Attributes
    ----------
    weights : (8 + 3 len(CUES),) float
        As the columns of `features`.
    """

    weights: Array

    def apart(self, measured: Array) -> Array:
        """Probability (N,) that two segments are different motions."""
        return np.asarray(expit(features(measured) @ self.weights))


@dataclass(frozen=True)
class Rules:
    """The rules of both passes of stage 5.

    Attributes
    ----------
    core : Similarity
        In the world of stage 1, which may explain parts of what moves.
    final : Similarity
        In the world of what is surely static (`ifsvideo.segmentation.static_core`), whose evidence is better.
    """

    core: Similarity
    final: Similarity


@cache
def learnt() -> Rules:
    """The rules that come with the package."""
    table = tomllib.loads((files("ifsvideo.segmentation") / "similarity.toml").read_text(encoding="utf-8"))
    return Rules(**{name: _read(table[name]) for name in ("core", "final")})


def _read(table: dict[str, dict[str, float]]) -> Similarity:
    flat = {f"{cue}.{when}": table[cue][when] for cue in CUES for when in WHEN} | table["first"]
    return Similarity(np.array([flat[name] for name in feature_names()], dtype=np.float64))

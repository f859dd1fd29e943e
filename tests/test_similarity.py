"""The learnt rule: its features carry the names that the file gives them, and the file is whole."""

from __future__ import annotations

import tomllib
from importlib.resources import files

import numpy as np
import pytest
from scipy.special import expit

from ifsvideo.segmentation.cues import CUES
from ifsvideo.segmentation.similarity import WHEN, Similarity, feature_names, features, learnt

MEASURED = np.random.default_rng(0).normal(0, 1, (5, 4 + len(CUES)))
FILE = tomllib.loads((files("ifsvideo.segmentation") / "similarity.toml").read_text(encoding="utf-8"))


def column(name: str) -> np.ndarray:
    return features(MEASURED)[:, feature_names().index(name)]


def test_there_is_a_name_for_every_column() -> None:
    names = feature_names()
    assert features(MEASURED).shape == (5, len(names))
    assert len(set(names)) == len(names) == 8 + 3 * len(CUES)


def test_columns_are_what_their_names_say() -> None:
    larger, smaller = MEASURED[:, 0], MEASURED[:, 1]
    larger_yielding, smaller_yielding = MEASURED[:, 2], MEASURED[:, 3]
    one, both = expit(larger + larger_yielding), expit(smaller + smaller_yielding)
    assert column("constant") == pytest.approx(np.ones(5))
    assert column("larger_evidence") == pytest.approx(larger)
    assert column("smaller_evidence") == pytest.approx(smaller)
    assert column("larger_yielding") == pytest.approx(larger_yielding)
    assert column("smaller_yielding") == pytest.approx(smaller_yielding)
    assert column("one_moves") == pytest.approx(one)
    assert column("both_move") == pytest.approx(both)
    assert column("product") == pytest.approx(one * both)
    for place, cue in enumerate(CUES):
        value = MEASURED[:, 4 + place]
        assert column(f"{cue}.always") == pytest.approx(value)
        assert column(f"{cue}.if_one_moves") == pytest.approx(value * one)
        assert column(f"{cue}.if_both_move") == pytest.approx(value * both)


@pytest.mark.parametrize("name", ["constant", "both_move", "gap.always", "rigid.if_one_moves"])
def test_probability_is_logistic_in_the_weighed_features(name: str) -> None:
    weights = np.zeros(len(feature_names()))
    weights[feature_names().index(name)] = 2.0
    assert Similarity(weights).apart(MEASURED) == pytest.approx(expit(2 * column(name)))


def test_the_file_holds_every_weight_and_no_other() -> None:
    assert FILE.keys() == {"core", "final"}
    for rule in FILE.values():
        assert rule.keys() == {"first", *CUES}
        assert list(rule["first"]) == feature_names()[:8]
        assert all(tuple(rule[cue]) == WHEN for cue in CUES)


@pytest.mark.parametrize("part", ["core", "final"])
def test_weights_of_the_file_are_finite_and_in_their_place(part: str) -> None:
    weights = dict(zip(feature_names(), getattr(learnt(), part).weights, strict=True))
    assert np.isfinite(list(weights.values())).all()
    for name, value in FILE[part]["first"].items():
        assert weights[name] == value
    for cue in CUES:
        for when in WHEN:
            assert weights[f"{cue}.{when}"] == FILE[part][cue][when]


def measured(evidence: tuple[float, float], **ratios: float) -> np.ndarray:
    """One pair, plain numbers in place of logarithms."""
    usual = {"rigid": 1.0, "affine": 1.0, "shear": 0.1, "shear_ratio": 1.0, "gap": 20.0}
    values = usual | {"larger": 50.0, "smaller": 30.0, "depth": 0.3} | ratios
    return np.log([[*evidence, *evidence, *(values[cue] for cue in CUES)]])


def test_the_rule_knows_clear_cases() -> None:
    """Static neighbours that predict each other are one motion; what moves unpredicted is another."""
    alike = measured((0.3, 0.2))
    apart = measured((30.0, 0.2), rigid=40.0, affine=40.0, shear=2.0, shear_ratio=20.0)
    for rule in (learnt().core, learnt().final):
        assert rule.apart(alike) < 0.1
        assert rule.apart(apart) > 0.9

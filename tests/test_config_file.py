from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal

import pytest

from ifsvideo.config import Config
from ifsvideo.config_file import _build, load_config
from ifsvideo.errors import UsageError


@pytest.fixture
def load(tmp_path):
    def write_and_load(text: str) -> Config:
        path = tmp_path / "settings.toml"
        path.write_text(text)
        return load_config(path)

    return write_and_load


def test_an_empty_file_gives_the_defaults(load):
    assert load("") == Config()


def test_what_is_named_is_set_and_the_rest_kept(load):
    config = load("seed = 3\n[tracking]\nmax_points = 250\n[overlay]\nlegend = false\nhull_opacity = 1\n")
    assert config.seed == 3
    assert config.tracking.max_points == 250
    assert config.overlay.legend is False
    assert config.overlay.hull_opacity == 1.0
    assert isinstance(config.overlay.hull_opacity, float)
    assert config.segmentation == Config().segmentation


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            "[tracking]\nbirth_intervall = 3",
            "unknown name tracking.birth_intervall; did you mean tracking.birth_interval?",
        ),
        ("[trakcing]\nmax_points = 3", "unknown name trakcing; did you mean tracking?"),
        ("zzz = 1", "unknown name zzz; known are tracking, segmentation, objects, overlay, seed"),
        ("[tracking]\nmax_points = 2.5", "tracking.max_points must be a whole number, got 2.5"),
        ("[tracking]\nmax_points = true", "tracking.max_points must be a whole number, got True"),
        ("[tracking]\nmax_points = '9'", "tracking.max_points must be a whole number, got '9'"),
        ("[overlay]\nlegend = 1", "overlay.legend must be true or false, got 1"),
        ("[overlay]\ntrail_s = 'long'", "overlay.trail_s must be a number, got 'long'"),
        ("[overlay]\ntrail_s = false", "overlay.trail_s must be a number, got False"),
        ("[overlay]\ntrail_s = -1", "overlay.trail_s must be 0 to 10"),
        ("[overlay]\nhull_opacity = nan", "overlay.hull_opacity must be 0 to 1"),
        ("tracking = 3", "tracking is a section; write [tracking]"),
        ("seed = [1]", "seed must be a whole number"),
        ("seed = ", "is not valid TOML"),
    ],
)
def test_what_is_wrong_is_named(load, text, complaint):
    with pytest.raises(UsageError) as caught:
        load(text)
    assert complaint in str(caught.value)
    assert "settings.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_missing_or_binary(tmp_path):
    with pytest.raises(UsageError, match="cannot be read"):
        load_config(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="not valid TOML"):
        load_config(tmp_path / "binary.toml")


@dataclass(frozen=True)
class Sample:
    mode: Literal["fast", "exact"] = "fast"
    limit: float | None = None
    sides: tuple[int, int] = (1, 2)
    steps: tuple[float, ...] = ()


def test_every_kind_of_field_is_understood():
    built = _build(Sample, {"mode": "exact", "limit": 3, "sides": [4, 5], "steps": [1, 2.5]}, "")
    assert built == Sample("exact", 3.0, (4, 5), (1.0, 2.5))
    for values, complaint in (
        ({"mode": "slow"}, "mode must be one of 'fast', 'exact'"),
        ({"sides": [1]}, "must have 2 items"),
        ({"sides": 1}, "must be a list"),
        ({"limit": "x"}, "must be a number"),
    ):
        with pytest.raises(UsageError, match=complaint):
            _build(Sample, values, "")


def test_every_field_of_every_section_can_be_written_in_the_file(tmp_path):
    def literal(value) -> str:
        if isinstance(value, bool):
            return str(value).lower()
        return str(list(value)) if isinstance(value, tuple) else repr(value)

    config = Config(seed=5)
    lines = ["seed = 5"]
    for section in dataclasses.fields(config):
        part = getattr(config, section.name)
        if not dataclasses.is_dataclass(part):
            continue
        lines.append(f"[{section.name}]")
        for field in dataclasses.fields(part):
            if getattr(part, field.name) is not None:
                lines.append(f"{field.name} = {literal(getattr(part, field.name))}")
    path = tmp_path / "all.toml"
    path.write_text("\n".join(lines))
    assert load_config(path) == config

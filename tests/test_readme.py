"""The README holds what it says: its Python runs, its names exist, its commands stand where one looks."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import ifsvideo
from ifsvideo import arguments
from ifsvideo.benchmark import __main__ as benchmark
from ifsvideo.output.labels import HEADER
from ifsvideo.video import open_source

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
LINES = README.splitlines()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)


def commands() -> list[str]:
    return [line for block in blocks("sh") for line in block.splitlines()]


def help_of(main, capsys, *command: str) -> str:
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--help"])
    return capsys.readouterr().out


def test_title_picture_and_both_commands_stand_on_the_first_screen():
    assert re.fullmatch(r"# \w+", LINES[0])
    assert LINES[4].startswith("![")
    main, tests = commands()[:2]
    assert LINES.index(main) < LINES.index(tests) < 18
    assert " .venv/bin/ifsvideo sample_clips/dashcam_drive.mp4 -o out.mp4" in main
    assert tests.endswith(" .venv/bin/python -m pytest")


def test_the_picture_moves_and_loads_quickly():
    place = re.search(r"!\[.*\]\((.*)\)", README)
    assert place
    picture = ROOT / place[1]
    assert picture.stat().st_size < 1.5e6
    assert iio.improps(picture, plugin="pillow", index=...).n_images > 20


@pytest.mark.parametrize("code", blocks("python"), ids=lambda code: re.findall(r"class (\w+)|$", code)[0])
def test_python_runs(code, clip, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    walk = np.cumsum(np.random.default_rng(0).normal(size=(12, 1, 2)), axis=0)
    np.savez("tracks.npz", xy=walk + np.random.default_rng(1).uniform(0, 300, (1, 40, 2)))
    names = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["result"].table.frames == 24
    assert len(names["result"].table.frame) > 24
    assert Path("out.mp4").is_file()
    assert Path("out.csv").is_file() == ('labels="out.csv"' in code)


def test_own_segmenter_and_renderer_are_the_ones_that_work(clip, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = next(code for code in blocks("python") if "renderer=" in code)
    names = {}
    exec(compile(code, "README.md", "exec"), names)
    assert (names["result"].table.labels == 1).any(), "the patch goes another way than the wall"
    plain, boxed = (np.stack(list(open_source(name).frames())) for name in ("clip.mp4", "out.mp4"))
    assert (reddish(boxed) > reddish(plain) + 100).any()


def reddish(pictures: np.ndarray) -> np.ndarray:
    """Nearly pure red pixels of each picture."""
    return (np.abs(pictures.astype(int) - (255, 0, 0)).sum(axis=3) < 120).sum(axis=(1, 2))


def test_thesis_as_a_file_is_the_thesis(tmp_path):
    (settings,) = blocks("toml")
    (tmp_path / "thesis.toml").write_text(settings)
    loaded = ifsvideo.load_config(tmp_path / "thesis.toml")
    assert loaded == ifsvideo.Config(segmentation=ifsvideo.SegmenterConfig.thesis())


def test_options_exist(capsys):
    known = help_of(arguments.parse, capsys)
    section = README.partition("## Options")[2].partition("\n## ")[0]
    named = set(re.findall(r"--[a-z][a-z-]*", section))
    assert len(named) > 10
    assert named <= set(re.findall(r"--[a-z-]+", known))
    assert set(re.findall(r"--[a-z-]+", known)) - named == {"--output", "--version", "--help"}


def test_benchmark_commands_are_understood(capsys):
    lines = [shlex.split(line) for line in commands() if "ifsvideo.benchmark" in line]
    own = {"samples", "objects", "static", "throughput", "page"}
    assert {line[3] for line in lines} == own | {"hopkins155", "kt3dmoseg"}
    for line in lines:
        assert line[:3] == [".venv/bin/python", "-m", "ifsvideo.benchmark"]
        known = re.findall(r"--[a-z-]+", help_of(benchmark.main, capsys, line[3]))
        assert all(word in known for word in line[3:] if word.startswith("--"))


def test_exit_statuses_are_those_of_the_errors():
    told = README.partition("Exit status: ")[2].partition(".")[0]
    assert {int(number) for number in re.findall(r"\b\d+\b", told)} == {0, 1, 2, 3, 4, 5, 130, 143}
    for fault, words in (
        (ifsvideo.UsageError, "wrong use"),
        (ifsvideo.InputError, "the input cannot be read"),
    ):
        assert f"{fault.exit_status} {words}" in told
    assert f"{ifsvideo.OutputError.exit_status} the output cannot be written" in " ".join(told.split())


def test_columns_are_those_of_the_csv():
    table = README.partition("| column |")[2].partition("\n\n")[0]
    named = [name for line in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", line.split("|")[1])]
    assert named == HEADER.split(",")


def test_files_named_are_there():
    named = set(re.findall(r"`((?:ifsvideo|sample_clips)/[\w./]*)`", README))
    named |= {f"ifsvideo/segmentation/{name}" for name in re.findall(r"`(\w+\.py)`", README)}
    assert len(named) > 8
    assert [name for name in named if not (ROOT / name).exists()] == []

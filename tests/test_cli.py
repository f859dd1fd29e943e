from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import ifsvideo
from ifsvideo import cli
from ifsvideo.arguments import parse
from ifsvideo.errors import IfsVideoError, InputError, OutputError, UsageError

from .conftest import FPS, HEIGHT, WIDTH, decoded, pictures

QUICK = ("--max-points", "80")


def files(folder) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_first_command_writes_the_overlay_and_the_csv_beside_it(command, clip, tmp_path):
    done = command("clip.mp4", "-o", "out.mp4", *QUICK)
    assert done.returncode == 0, done.stderr
    assert decoded(tmp_path / "out.mp4") == (24, (WIDTH, HEIGHT), FPS)
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == "frame,time_s,track_id,x,y,label"
    assert files(tmp_path) == ["clip.mp4", "out.csv", "out.mp4"]
    assert "24 frames, 1.2 s" in done.stdout
    for word in ("out.mp4", "out.csv", "frames per second", "points"):
        assert word in done.stdout
    for stage in ("reading", "tracking", "segmenting", "writing"):
        assert stage in done.stdout
    assert "24/24" in done.stderr
    assert re.search(r"24/24 \[\d\d:\d\d<\d\d:\d\d", done.stderr), "a bar tells the time left"


def test_quiet_prints_nothing(command, clip, tmp_path):
    done = command("clip.mp4", "--quiet", *QUICK)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert files(tmp_path) == ["clip.ifs.csv", "clip.ifs.mp4", "clip.mp4"]


def test_a_folder_writes_beside_itself(tmp_path, capsys):
    folder = tmp_path / "my.frames"
    folder.mkdir()
    for index, image in enumerate(pictures(4)):
        iio.imwrite(folder / f"{index}.png", image)
    assert cli.main([str(folder) + "/", "--fps", "5"]) == 0
    assert files(tmp_path) == ["my.frames", "my.frames.ifs.csv", "my.frames.ifs.mp4"]
    assert decoded(tmp_path / "my.frames.ifs.mp4") == (4, (WIDTH, HEIGHT), 5)
    assert "0.8 s" in capsys.readouterr().out


def test_the_folder_one_stands_in_has_a_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (job,) = parse(["."]).jobs
    assert job.output == tmp_path.with_name(tmp_path.name + ".ifs.mp4")


def test_tracks_give_labels_alone(tmp_path, capsys):
    np.savez(tmp_path / "t.npz", xy=np.random.default_rng(0).uniform(0, 99, (12, 20, 2)))
    assert cli.main([str(tmp_path / "t.npz")]) == 0
    assert files(tmp_path) == ["t.ifs.csv", "t.npz"]
    assert cli.main([str(tmp_path / "t.npz"), "--labels", str(tmp_path / "x.csv"), "--fps", "25"]) == 0
    assert ",0.0400," in (tmp_path / "x.csv").read_text()
    assert cli.main([str(tmp_path / "t.npz"), "-o", str(tmp_path / "x.mp4")]) == 2
    assert "hold no pictures" in capsys.readouterr().err


def test_options_reach_the_configuration(tmp_path):
    settings = tmp_path / "s.toml"
    settings.write_text("seed = 1\n[tracking]\nmax_points = 77\nbirth_interval = 5\n")
    mask = tmp_path / "mask.png"
    iio.imwrite(mask, np.zeros((4, 4), np.uint8))
    line = f"a.mp4 --config {settings} --seed 9 --no-legend --start 1:02.5 --end 70 --ignore 1,2,3,4"
    told = parse(f"{line} --ignore {mask} --motions 3 --fps 30000/1001 --distortion -.1 --quiet".split())
    assert (told.config.seed, told.config.tracking.max_points, told.config.tracking.birth_interval) == (
        9,
        77,
        5,
    )
    assert told.config.overlay.legend is False
    assert told.config.segmentation == ifsvideo.SegmenterConfig(distortion=-0.1)
    assert (told.start, told.end, told.motions, told.quiet) == (62.5, 70.0, 3, True)
    assert told.fps is not None
    assert told.fps.denominator == 1001
    assert told.ignore == ((1, 2, 3, 4), mask)
    assert parse(["a.mp4", "--config", str(settings), "--max-points", "5"]).config.tracking.max_points == 5


@pytest.mark.parametrize(
    ("arguments", "output", "labels"),
    [
        (["d/a.avi"], "d/a.ifs.mp4", "d/a.ifs.csv"),
        (["d/a.avi", "-o", "e/b.mkv"], "e/b.mkv", "e/b.csv"),
        (["d/a.avi", "--labels", "x.txt"], "d/a.ifs.mp4", "x.txt"),
        (["d/a.mat"], "None", "d/a.ifs.csv"),
    ],
)
def test_where_things_are_written(arguments, output, labels):
    (job,) = parse(arguments).jobs
    assert (str(job.output), str(job.labels)) == (output, labels)


def test_further_outputs_without_a_place_go_beside_the_overlay():
    options = ["--objects", "--mot", "--json", "--masks", "--tracks", "--clips", "--report"]
    (job,) = parse(["a.mp4", "-o", "d/b.mkv", *options]).jobs
    assert job.products == ifsvideo.Products(
        objects=Path("d/b.objects.csv"),
        mot=Path("d/b.mot.txt"),
        summary=Path("d/b.json"),
        masks=Path("d/b.masks"),
        tracks=Path("d/b.tracks.npz"),
        clips=Path("d/b.clips"),
        report=Path("d/b.html"),
    )
    (job,) = parse(["a.mp4", "--masks", ".", "--mot"]).jobs
    assert job.products == ifsvideo.Products(masks=Path(), mot=Path("a.ifs.mot.txt"))
    first, tracks = parse(["a.mp4", "t.npz", "--clips", "--objects"]).jobs
    assert first.products == ifsvideo.Products(objects=Path("a.ifs.objects.csv"), clips=Path("a.ifs.clips"))
    assert tracks.products == ifsvideo.Products(objects=Path("t.ifs.objects.csv"))


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "required: INPUT"),
        (["a.mp4", "--strat", "3"], "unrecognized arguments: --strat"),
        (["a.mp4", "--start", "1:99"], "--start: '1:99' is not a time"),
        (["a.mp4", "--start", "soon"], "'soon' is not a time"),
        (["a.mp4", "--fps", "0"], "'0' is no rate"),
        (["a.mp4", "--fps", "1/0"], "'1/0' is no rate"),
        (["a.mp4", "--motions", "0"], "--motions: '0' is not a whole number of at least 1"),
        (["a.mp4", "--max-points", "many"], "'many' is not a whole number"),
        (["a.mp4", "--max-points", "999999"], "tracking.max_points must be"),
        (["a.mp4", "--distortion", "strong"], "--distortion: 'strong' is no number"),
        (["a.mp4", "--distortion", "-0.2"], "--distortion: k1 must be above -4/27 (-0.148) and at most 1"),
        (["a.mp4", "--seed", "1.5"], "'1.5' is not a whole number"),
        (["a.mp4", "--ignore", "1,2,3"], "'1,2,3' is no rectangle"),
        (["a.mp4", "--ignore", "1,2,0,4"], "is no rectangle"),
        (["a.mp4", "--ignore", "none.png"], "neither x,y,w,h in pixels nor a mask image"),
        (["a.mp4", "--config", "none.toml"], "none.toml: cannot be read"),
        (["a.mp4", "-o", ""], "-o needs the name of a file"),
        (["a.mp4", "b.mp4", "-o", "c.mp4"], "name one file"),
        (["a.mp4", "b.mp4", "--clips", "c"], "write --clips alone, behind the inputs"),
        (["a.mp4", "b.mp4", "--labels", "c.csv"], "--labels c.csv would name one place for every input"),
        (["--mot", "a.mp4"], "required: INPUT"),
        (["a.mp4", "a.avi"], "a.ifs.csv: two inputs"),
    ],
)
def test_wrong_use_is_one_line_and_2(arguments, complaint, capsys):
    assert cli.main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("ifsvideo: error: ")
    assert err.count("\n") == 1
    assert complaint in err


def test_a_mask_of_the_wrong_size_or_kind(clip, tmp_path, capsys):
    mask = tmp_path / "mask.png"
    iio.imwrite(mask, np.zeros((4, 6), np.uint8))
    assert cli.main([str(clip), "--ignore", str(mask)]) == 2
    assert "mask.png: the mask is 6x4, the picture 160x120" in capsys.readouterr().err
    mask.write_text("no picture")
    assert cli.main([str(clip), "--ignore", str(mask)]) == 3
    assert "mask.png: is not an image" in capsys.readouterr().err
    assert files(tmp_path) == ["clip.mp4", "mask.png"]


@pytest.mark.parametrize("kind", ["RGB", "grey", "grey16"])
def test_black_of_a_mask_is_not_looked_at(clip, tmp_path, kind):
    image = np.zeros((HEIGHT, WIDTH), np.uint16 if kind == "grey16" else np.uint8)
    image[:, 80:] = np.iinfo(image.dtype).max
    mask = tmp_path / "mask.png"
    iio.imwrite(mask, np.stack([image, image, 0 * image], axis=2) if kind == "RGB" else image)
    assert cli.main([str(clip), "--quiet", "--ignore", str(mask)]) == 0
    x = np.genfromtxt(tmp_path / "clip.ifs.csv", delimiter=",", names=True)["x"]
    assert len(x) > 0
    assert x.min() >= 79


def test_help_shows_three_examples_first(capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["--help"])
    assert caught.value.code == 0
    text = capsys.readouterr().out
    examples, rest = text.split("usage:", 1)
    assert examples.startswith("examples:")
    assert len(re.findall(r"^  ifsvideo ", examples, re.MULTILINE)) == 3
    wanted = "-o --labels --fps --start --end --max-points --motions --distortion --ignore --config --seed"
    for option in [*wanted.split(), "--no-legend", "--quiet", "--debug", "--version"]:
        assert option in rest


def test_version(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--version"])
    assert capsys.readouterr().out == f"ifsvideo {ifsvideo.__version__}\n"


def test_the_command_is_installed_where_ctrl_c_is_caught_and_the_package_imports_nothing_large():
    settings = tomllib.loads((Path(ifsvideo.__file__).parents[1] / "pyproject.toml").read_text())
    assert settings["project"]["scripts"] == {"ifsvideo": "ifsvideo.__main__:main"}
    program = "import sys, ifsvideo; print(*sorted({'numpy', 'cv2', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "")
    with pytest.raises(AttributeError, match="'ifsvideo' has no attribute 'Pipelin'"):
        ifsvideo.Pipelin  # noqa: B018
    assert set(ifsvideo.__all__) <= set(dir(ifsvideo))


def test_several_inputs(clips, tmp_path, capsys):
    for name in ("a.mp4", "b.mp4"):
        shutil.copy(clips["two"], tmp_path / name)
    good = [str(tmp_path / name) for name in ("a.mp4", "b.mp4")]
    assert cli.main(good) == 0
    assert cli.main([good[0], str(tmp_path / "none.mp4"), good[1]]) == 5
    out, err = capsys.readouterr()
    assert "none.mp4: does not exist" in err
    assert out.count("frames per second") == 4


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (IfsVideoError("a.mp4: x; y"), 1),
        (UsageError("a.mp4: x; y"), 2),
        (InputError("a.mp4: x;\n y"), 3),
        (OutputError("a.mp4: x; y"), 4),
    ],
)
def test_status_follows_the_error(monkeypatch, capsys, error, status):
    def fail(*_):
        raise error

    monkeypatch.setattr(cli, "_process", fail)
    assert cli.main(["a.mp4"]) == status
    assert capsys.readouterr().err == "ifsvideo: error: a.mp4: x; y\n"


def test_a_fault_is_1_and_shows_its_place_only_with_debug(monkeypatch, capsys):
    def fail(*_):
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr(cli, "_process", fail)
    assert cli.main(["a.mp4"]) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "ZeroDivisionError: division by zero" in err
    assert "--debug" in err
    assert cli.main(["a.mp4", "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_a_reader_of_the_summary_that_leaves_is_no_fault(clip, tmp_path, monkeypatch):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)  # buffered, what is left over fails at exit
    for arguments in (f"{clip} --max-points 50 --end 0.5", "--help"):
        line = f"{sys.executable} -m ifsvideo {arguments} | true; exit ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
        assert done.returncode == 0
        assert "rror" not in done.stderr
    assert files(tmp_path) == ["clip.ifs.csv", "clip.ifs.mp4", "clip.mp4"]

"""Speed and memory are measured, not judged: no test here depends on how fast this machine is."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from ifsvideo.benchmark.__main__ import main
from ifsvideo.benchmark.memory import MemoryWatch, tree_megabytes
from ifsvideo.benchmark.throughput import looped

from .conftest import FPS, decoded, encode, pictures


def test_the_report_holds_what_is_promised(clips, tmp_path, capsys):
    path = tmp_path / "t.json"
    assert (
        main(["throughput", str(clips["plain"]), "--runs", "1", "--points", "60", "--json", str(path)]) == 0
    )
    report = json.loads(path.read_text())
    assert report["frames"] == 24
    assert report["points"] == 60
    assert report["ratio"] == pytest.approx(report["floor_fps"] / report["fps"])
    assert set(report["stages"]) == {"reading", "tracking", "segmenting", "linking", "writing"}
    assert report["cpu_ms"] > report["floor_cpu_ms"] > 0
    assert report["peak_rss_mb"] > 50
    out = capsys.readouterr().out
    for word in ("tracking", "ratio", "floor", "peak memory"):
        assert word in out


def test_growth_with_points_and_pixels_is_a_table(clips, tmp_path, capsys):
    path = tmp_path / "t.json"
    growth = ["--points", "20,60", "--height", "60,120", "--minutes", "0.01", "--no-video"]
    assert main(["throughput", str(clips["plain"]), "--runs", "1", *growth, "--json", str(path)]) == 0
    measured = json.loads(path.read_text())["measured"]
    assert [(one["height"], one["points"]) for one in measured] == [(60, 20), (60, 60), (120, 20), (120, 60)]
    assert [line.split()[:2] for line in capsys.readouterr().out.splitlines()[-4:]] == [
        ["80x60", "20"],
        ["80x60", "60"],
        ["160x120", "20"],
        ["160x120", "60"],
    ]


@pytest.mark.parametrize("growth", [["--points", "20,"], ["--height", "8,60"], ["--minutes", "-1"]])
def test_growth_that_makes_no_sense(clips, growth, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["throughput", str(clips["plain"]), *growth])
    assert ended.value.code == 2
    assert growth[0] in capsys.readouterr().err


def test_a_clip_that_cannot_be_read(tmp_path, capsys):
    assert main(["throughput", str(tmp_path / "none.mp4")]) == 3
    assert "none.mp4" in capsys.readouterr().err


def test_a_looped_clip_plays_to_and_fro(tmp_path):
    clip = encode(tmp_path / "clip.mp4", pictures(24))
    made = looped(clip, 0.1, 60, tmp_path)
    frames, size, fps = decoded(made)
    assert frames == pytest.approx(6 * FPS, abs=3)  # copied packets end where frames wait for their order
    assert (size, fps) == ((80, 60), FPS)
    assert looped(clip, 0, None, tmp_path) == clip


def test_memory_of_children_counts():
    hold = "import sys; data = b'x' * 60_000_000; print('here', flush=True); sys.stdin.read()"
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", hold], stdin=pipe, stdout=pipe) as child:
        assert child.stdout is not None
        alone = tree_megabytes(os.getpid()) - tree_megabytes(child.pid)
        assert child.stdout.read(4) == b"here"
        assert tree_megabytes(child.pid) > 60
        assert tree_megabytes(os.getpid()) > alone + 50
        child.communicate()
    assert tree_megabytes(child.pid) == 0


def test_the_slope_is_that_of_the_later_part():
    watch = MemoryWatch(1)
    time_s = np.arange(100.0)
    watch._samples = [(t, 300.0 if t > 50 else 10 * t) for t in time_s]
    assert watch.slope(0.6) == pytest.approx(0.0)
    assert watch.slope(0.99) is None
    assert watch.peak == 500

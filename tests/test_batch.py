"""Several inputs into one folder: what is written, what is done again, what a failure or Ctrl-C leaves."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import unquote

import pytest

from ifsvideo import cli
from ifsvideo.arguments import parse
from ifsvideo.batch import Outcome, each_done, local_executor
from ifsvideo.errors import IfsVideoError
from ifsvideo.ledger import Ledger
from ifsvideo.report.index import index_page

from .conftest import children_naming, encode, pictures


@pytest.fixture
def inputs(clips, tmp_path) -> Path:
    folder = tmp_path / "in"
    folder.mkdir()
    for name in ("a.mp4", "b.mp4"):
        shutil.copy(clips["two"], folder / name)
    return folder


def run(inputs: Path, *arguments: str) -> int:
    """The command over all inputs, into the folder ``out`` beside them."""
    sources = sorted(str(path) for path in inputs.iterdir())
    return cli.main([*sources, "-o", f"{inputs.parent / 'out'}/", *arguments])


def times(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.ifs.*")}


def links(page: Path) -> list[str]:
    return [unquote(found) for found in re.findall(r'href="\./([^"#]*)"', page.read_text(encoding="utf-8"))]


def test_one_folder_holds_everything_and_a_page_links_it(inputs, tmp_path, capsys):
    assert run(inputs) == 0
    out = tmp_path / "out"
    made = [f"{name}.ifs.{kind}" for name in "ab" for kind in ("csv", "html", "json", "mp4")]
    assert sorted(path.name for path in out.iterdir()) == [*made, "index.html", "index.json"]
    assert sorted(links(out / "index.html")) == made
    assert "index.html: all results" in capsys.readouterr().out


def test_further_outputs_of_every_input_stand_in_the_folder(inputs, tmp_path, capsys):
    options = ["--objects", "--mot", "--masks", "--tracks", "--clips"]
    (inputs / "c.mp4").write_text("no video")
    assert run(inputs, *options, "--jobs", "2") == 5
    out = tmp_path / "out"
    kinds = ["clips", "csv", "html", "json", "masks", "mot.txt", "mp4", "objects.csv", "tracks.npz"]
    made = [f"{name}.ifs.{kind}" for name in "ab" for kind in kinds]
    assert sorted(path.name for path in out.iterdir()) == [*made, "index.html", "index.json"]
    assert sorted(links(out / "index.html")) == made
    assert len(list((out / "a.ifs.masks").iterdir())) == 2
    (inputs / "c.mp4").unlink()
    capsys.readouterr()
    assert run(inputs, *options) == 0
    assert "2 of 2 inputs are done already" in capsys.readouterr().out
    shutil.rmtree(out / "a.ifs.masks")
    assert run(inputs, *options) == 0
    assert "1 of 2 inputs are done already" in capsys.readouterr().out
    assert len(list((out / "a.ifs.masks").iterdir())) == 2


def quick(job, told, progress=None) -> Outcome:
    """Writes all files of a job, with nothing in them."""
    places = (job.output, job.labels, job.products.report, job.products.summary)
    written = tuple(path for path in places if path is not None)
    for path in written:
        path.write_text("")
    return Outcome(f"{job.source}: frames per second", written, 1.0, 0, 0, None)


def test_what_is_done_and_unchanged_is_not_done_again(inputs, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cli, "perform", quick)
    assert run(inputs) == 0
    before = times(tmp_path / "out")
    capsys.readouterr()
    assert run(inputs) == 0
    assert "2 of 2 inputs are done already" in capsys.readouterr().out
    assert times(tmp_path / "out") == before

    os.utime(inputs / "a.mp4", ns=(1, 1))
    (tmp_path / "out" / "b.ifs.html").unlink()
    os.utime(inputs / "b.mp4")
    assert run(inputs) == 0
    after = times(tmp_path / "out")
    assert after.keys() == before.keys()
    assert all(after[name] > before[name] for name in before)

    assert run(inputs, "--max-points", "50") == 0
    assert all(time > after[name] for name, time in times(tmp_path / "out").items())
    assert run(inputs, "--max-points", "50", "--quiet", "--jobs", "2") == 0


def test_what_was_left_out_is_made_later(inputs, tmp_path, monkeypatch):
    monkeypatch.setattr(cli, "perform", quick)
    assert run(inputs, "--no-video") == 0
    assert not list((tmp_path / "out").glob("*.mp4"))
    assert run(inputs) == 0
    assert len(list((tmp_path / "out").glob("*.mp4"))) == 2


def test_a_failed_clip_is_told_at_the_end_and_stops_no_other(inputs, tmp_path, capsys, monkeypatch):
    (inputs / "aa broken.mp4").write_text("no video")
    assert run(inputs) == 5
    monkeypatch.setattr(cli, "perform", quick)
    out, err = capsys.readouterr()
    assert out.count("frames per second") == 2
    last = err.splitlines()[-2:]
    assert "aa broken.mp4" in last[0]
    assert last[1] == "ifsvideo: error: 1 of 3 inputs failed"
    page = (tmp_path / "out" / "index.html").read_text()
    assert "aa broken" in page
    assert "failed: " in page
    shutil.copy(inputs / "a.mp4", inputs / "aa broken.mp4")
    assert run(inputs) == 0
    assert "2 of 3 inputs are done already" in capsys.readouterr().out
    assert "failed" not in (tmp_path / "out" / "index.html").read_text().partition("<main>")[2]


def test_workers_do_the_same(inputs, tmp_path, capsys):
    (inputs / "c.mp4").write_text("no video")
    assert run(inputs, "--jobs", "2") == 5
    out, err = capsys.readouterr()
    assert out.count("frames per second") == 2
    assert "c.mp4" in err
    assert len(times(tmp_path / "out")) == 8


def test_several_inputs_stay_beside_themselves_without_a_folder(inputs):
    assert cli.main([str(inputs / "a.mp4"), str(inputs / "b.mp4"), "--quiet"]) == 0
    assert sorted(path.name for path in inputs.glob("*.ifs.*")) == [
        f"{name}.ifs.{kind}" for name in "ab" for kind in ("csv", "mp4")
    ]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["a.mp4", "x/a.avi", "-o", "out/"], "two inputs would be written there"),
        (
            ["a.mp4", "-o", "out/", "--report", "r.html"],
            "--report r.html would name one place for every input",
        ),
        (["a.mp4", "b.mp4", "-o", "c.gif"], "would name one file for several inputs"),
        (["-", "-o", "out/"], "standard input has no name"),
        (["a.mp4", "--jobs", "0"], "--jobs: '0' is not a whole number"),
    ],
)
def test_wrong_use(arguments, complaint, capsys):
    assert cli.main(arguments) == 2
    assert complaint in capsys.readouterr().err


def test_where_a_folder_cannot_be(inputs, tmp_path, capsys):
    (tmp_path / "out").write_text("a file")
    assert run(inputs) == 4
    (tmp_path / "out").unlink()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "index.json").write_text("[]")
    assert run(inputs) == 4
    assert "index.json: is no record of earlier runs" in capsys.readouterr().err
    assert (tmp_path / "out" / "index.json").read_text() == "[]"


def test_transparent_overlays_go_where_they_can():
    told = parse(["a.mp4", "t.npz", "-o", "out/", "--transparent"])
    assert [job.output for job in told.jobs] == [Path("out/a.ifs.mov"), None]


def test_names_from_outside_are_text():
    entry = {"files": ['<b>&".ifs.html'], "length_s": 1, "objects": 1, "events": 0, "contact": [1.0, 2.5]}
    page = index_page({'<b>&"': entry, "x": {"error": "<script>alert(1)</script>"}})
    assert "<b>" not in page
    assert "<script>" not in page
    assert "%3Cb%3E%26%22.ifs.html" in page
    assert "2 clips, 1 failed" in page
    assert '2.5 s <a href="./%3Cb%3E%26%22.ifs.html#t=1">at 0:01.00</a>' in page


@dataclass(frozen=True)
class Waiting:
    """Work that goes on till it is stopped, and says in a file how it ended."""

    folder: Path

    def __call__(self, job) -> Outcome:
        (self.folder / f"{job.source.name}.begun").touch()
        try:
            time.sleep(60)
        finally:
            (self.folder / f"{job.source.name}.ended").touch()
        raise AssertionError("nobody stopped it")


@dataclass(frozen=True)
class Dying:
    """Work that kills its process, as the system does where memory is short."""

    def __call__(self, job) -> Outcome:
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError("still alive")


def jobs(count: int):
    return iter(parse([f"{index}.mp4" for index in range(count)]).jobs)


def done(job) -> Outcome:
    if job.source.name == "1.mp4":
        raise IfsVideoError("1.mp4: broken")
    return Outcome(job.source.name, (), 1.0, 0, 0, None)


def test_another_executor_can_do_the_work():
    found = dict(each_done(jobs(5), done, ThreadPoolExecutor(3), at_once=3))
    assert len(found) == 5
    told = {job.source.name: value for job, value in found.items()}
    assert told["2.mp4"] == Outcome("2.mp4", (), 1.0, 0, 0, None)
    assert isinstance(told["1.mp4"], IfsVideoError)


def test_no_more_is_handed_out_than_can_be_done():
    given = []

    class Seen(ThreadPoolExecutor):
        def submit(self, function, /, *arguments, **named):
            given.append(arguments[0].source.name)
            return super().submit(function, *arguments, **named)

    with closing(each_done(jobs(9), done, Seen(1), at_once=2)) as outcomes:
        next(outcomes)
    assert len(given) <= 3


def test_a_killed_worker_fails_its_clip_with_a_reason():
    (_, failure), *_ = each_done(jobs(1), Dying(), local_executor(2), 2)
    assert "a worker was killed" in str(failure)


@pytest.fixture
def ctrl_c():
    """Ctrl-C raises, also where whoever started the tests ignores it, as a shell does in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
def test_workers_that_are_stopped_clean_up(tmp_path):
    with closing(each_done(jobs(4), Waiting(tmp_path), local_executor(2), 2)) as outcomes:
        stopper = ThreadPoolExecutor(1).submit(stop_when_begun, tmp_path)
        with pytest.raises(KeyboardInterrupt):
            next(outcomes)
        stopper.result()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "0.mp4.begun", "0.mp4.ended", "1.mp4.begun", "1.mp4.ended"
    ]  # fmt: skip


def stop_when_begun(folder: Path) -> None:
    while len(list(folder.glob("*.begun"))) < 2:
        time.sleep(0.05)
    os.kill(os.getpid(), signal.SIGINT)


def started(tmp_path: Path) -> subprocess.Popen[str]:
    """The command with two workers in the midst of two clips that take long."""
    sources = [tmp_path / "a.mp4", tmp_path / "b.mp4"]
    encode(sources[0], pictures(1) * 2000)
    shutil.copy(*sources)
    (tmp_path / "out").mkdir()
    line = [sys.executable, "-m", "ifsvideo", *map(str, sources), "-o", str(tmp_path / "out"), "--jobs", "2"]
    process = subprocess.Popen(
        line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 60
    while sum("ffmpeg" in line for line in children_naming(str(tmp_path))) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def test_ctrl_c_stops_all_workers_and_leaves_nothing(tmp_path):
    with started(tmp_path) as process:
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the whole group
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert children_naming(str(tmp_path)) == []
    assert list((tmp_path / "out").iterdir()) == []


def test_workers_do_not_outlive_a_killed_parent(tmp_path):
    with started(tmp_path) as process:
        process.kill()
        process.communicate(timeout=60)
    deadline = time.monotonic() + 30
    # A worker's own command line does not name the clip: it is done when its files are gone.
    while children_naming(str(tmp_path)) or list((tmp_path / "out").iterdir()):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_record_is_read_back(tmp_path):
    told = parse(["a.mp4", "-o", f"{tmp_path}/"])
    outcome = replace(quick(told.jobs[0], told), objects=2)
    Ledger(tmp_path).note(told.jobs[0], told, outcome)
    assert Ledger(tmp_path).complete(told.jobs[0], told)
    assert json.loads((tmp_path / "index.json").read_text())["clips"]["a"]["objects"] == 2
    (tmp_path / "a.ifs.csv").unlink()
    assert not Ledger(tmp_path).complete(told.jobs[0], told)

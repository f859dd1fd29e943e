"""The table of what can go wrong: one clear line, the right status, nothing lost, nothing left behind."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import imageio.v3 as iio
import pytest

from ifsvideo import cli

from .conftest import FFMPEG, children_naming, decoded, encode, pictures

OLD = b"an older output"
NOBODY = 65534


def snapshot(folder: Path) -> dict[str, bytes | None]:
    """Every name below a folder, hidden ones too, and what the file holds."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def run(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> tuple[int, str]:
    """Status and the error line; nothing but that line may be on stderr, and nothing on stdout."""
    status = cli.main([*map(str, arguments), "--quiet"])
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == (0 if status == 0 else 1)
    return status, err


def missing(folder: Path) -> Path:
    return folder / "in.mp4"


def folder_without_images(folder: Path) -> Path:
    (folder / "in").mkdir()
    (folder / "in" / "notes.txt").write_text("no picture")
    return folder / "in"


def mixed_sizes(folder: Path) -> Path:
    (folder / "in").mkdir()
    for index, side in enumerate((40, 40, 48)):
        iio.imwrite(folder / "in" / f"{index}.png", pictures(1, 64, side)[0])
    return folder / "in"


def text_named_mp4(folder: Path) -> Path:
    (folder / "in.mp4").write_text("this is no video\n" * 50)
    return folder / "in.mp4"


def empty_file(folder: Path) -> Path:
    (folder / "in.mp4").touch()
    return folder / "in.mp4"


def audio_only(folder: Path) -> Path:
    line = [FFMPEG, "-v", "error", "-f", "lavfi", "-i", "sine=duration=1", "-c:a", "aac"]
    subprocess.run([*line, str(folder / "in.mp4")], check=True)
    return folder / "in.mp4"


def truncated_download(folder: Path) -> Path:
    whole = encode(folder / "in.mp4", pictures(12)).read_bytes()
    (folder / "in.mp4").write_bytes(whole[: len(whole) // 2])
    return folder / "in.mp4"


def broken_tracks(folder: Path) -> Path:
    (folder / "in.npz").write_bytes(b"PK\x03\x04 not really")
    return folder / "in.npz"


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (missing, "does not exist"),
        (folder_without_images, "image"),
        (mixed_sizes, "size"),
        (text_named_mp4, "not a video"),
        (empty_file, "is empty"),
        (audio_only, "holds no video"),
        (truncated_download, "cut off"),
        (broken_tracks, "is damaged"),
    ],
)
def test_input_that_cannot_be_read_is_3(tmp_path, capsys, make, complaint):
    source = make(tmp_path)
    outputs = () if source.suffix == ".npz" else ("-o", tmp_path / "out.mp4")
    for name in ("out.mp4", "out.csv"):
        (tmp_path / name).write_bytes(OLD)
    before = snapshot(tmp_path)
    status, line = run(capsys, source, *outputs, "--labels", tmp_path / "out.csv")
    assert status == 3
    assert str(source) in line
    assert complaint in line
    assert snapshot(tmp_path) == before
    assert children_naming(str(tmp_path)) == []


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (("-o", "{}/clip.mp4"), 2, "is the input itself"),
        (("-o", "{}/link.mp4"), 2, "is the input itself"),
        (("--labels", "{}/clip.mp4"), 2, "is the input itself"),
        (("-o", "{}/out.mp4", "--labels", "{}/out.mp4"), 2, "is the video too"),
        (("-o", "{}/out.avi"), 2, "unknown ending '.avi'"),
        (("-o", "{}/out"), 2, "unknown ending"),
        (("--start", "100"), 2, "past the end"),
        (("--start", "1", "--end", "0.5"), 2, "not after"),
        (("-o", "{}/none/out.mp4"), 4, "does not exist"),
        (("--labels", "{}/none/out.csv"), 4, "does not exist"),
        (("-o", "{}/folder.mp4"), 4, "is a folder"),
    ],
)
def test_wrong_use_and_outputs_that_cannot_be(clip, tmp_path, capsys, arguments, status, complaint):
    (tmp_path / "link.mp4").symlink_to(clip)
    (tmp_path / "folder.mp4").mkdir()
    before = snapshot(tmp_path)
    got, line = run(capsys, clip, *(text.format(tmp_path) for text in arguments))
    assert got == status
    assert complaint in line
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize(("name", "frames"), [("one", 1), ("two", 2), ("white", 5)])
def test_too_little_to_see_is_0_and_says_so(clips, tmp_path, capsys, name, frames):
    assert cli.main([str(clips[name]), "-o", str(tmp_path / "out.mp4")]) == 0
    out = capsys.readouterr().out
    assert "nothing moves by itself" in out
    assert ("warning" in out) == (name != "two")
    assert decoded(tmp_path / "out.mp4")[0] == frames
    assert (tmp_path / "out.csv").read_text().startswith("frame,time_s")
    assert len(snapshot(tmp_path)) == 2


@contextmanager
def unprivileged(folder: Path) -> Iterator[None]:
    """Be nobody for a while, where the test runs as root, whom no permission stops."""
    if os.getuid() != 0:
        yield
        return
    for path in (folder, *folder.rglob("*")):
        os.chown(path, NOBODY, NOBODY)
    os.setresgid(NOBODY, NOBODY, 0)
    os.setresuid(NOBODY, NOBODY, 0)
    try:
        yield
    finally:
        os.setresuid(0, 0, 0)
        os.setresgid(0, 0, 0)


@pytest.fixture
def open_folder(clip, clips, monkeypatch) -> Iterator[Path]:
    """A folder that anybody may enter, with a clip in it, and an ffmpeg that anybody may run."""
    with tempfile.TemporaryDirectory() as name, tempfile.TemporaryDirectory() as tools:
        os.chmod(tools, 0o755)
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", shutil.copy(FFMPEG, tools))
        cli.main([str(clips["two"]), "--quiet"])  # all modules are loaded before their files are out of reach
        yield Path(shutil.copy(clip, name)).parent


@pytest.mark.parametrize(
    ("closed", "status", "complaint"),
    [
        ("clip.mp4", 3, "no permission to read"),
        ("sub", 4, "no permission to write"),
        ("sub/out.mp4", 4, "write-protected"),
    ],
)
def test_permissions(open_folder, capsys, closed, status, complaint):
    (open_folder / "sub").mkdir()
    (open_folder / "sub" / "out.mp4").write_bytes(OLD)
    before = snapshot(open_folder)
    mode = (open_folder / closed).stat().st_mode
    with unprivileged(open_folder):
        (open_folder / closed).chmod(0o500 if closed == "sub" else 0o000 if status == 3 else 0o444)
        got, line = run(capsys, open_folder / "clip.mp4", "-o", open_folder / "sub" / "out.mp4")
        (open_folder / closed).chmod(mode)
    assert got == status
    assert complaint in line
    assert snapshot(open_folder) == before


@pytest.fixture
def tiny_disk(tmp_path) -> Iterator[Path]:
    """A file system of 12 kB with an older output on it."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=12k", "tmpfs", str(place)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a file system cannot be mounted here")
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize("full", ["out.mp4", "out.csv"])
def test_a_full_disk_is_4(clip, tmp_path, tiny_disk, capsys, full):
    for folder in (tiny_disk, tmp_path):
        for name in ("out.mp4", "out.csv"):
            (folder / name).write_bytes(OLD)
    before = snapshot(tmp_path)
    places = {name: (tiny_disk if name == full else tmp_path) / name for name in ("out.mp4", "out.csv")}
    few = ("--max-points", "60", "--end", "0.6")
    status, line = run(capsys, clip, "-o", places["out.mp4"], "--labels", places["out.csv"], *few)
    assert status == 4
    assert full in line
    assert "free space" in line
    assert snapshot(tmp_path) == before
    assert children_naming(str(tmp_path)) == []


def test_a_limit_on_file_size_is_4(clip, tmp_path):
    (tmp_path / "out.mp4").write_bytes(OLD)
    before = snapshot(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "ifsvideo", "clip.mp4", "--end", "0.4", "-o", "out.mp4", "--quiet"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)),
    )
    assert done.returncode == 4, done.stderr
    assert done.stderr.count("\n") == 1
    assert snapshot(tmp_path) == before


# Runs the command, and comes to rest in the middle of the stage that is named first.
HELD = """
import sys, time
from ifsvideo import cli
from ifsvideo.objects.windows import WindowLabeller
from ifsvideo.output.labels import LabelSink
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.video import file
stage = sys.argv.pop(1)
def rest(*_):
    sys.stdout.write("here")
    sys.stdout.flush()
    time.sleep(60)
if stage == "reading":
    file.probe = rest
elif stage == "tracking":
    KltTracker.track_grey = rest
elif stage == "segmenting":
    WindowLabeller.__call__ = rest
elif stage == "writing":
    LabelSink.add = rest
else:
    LabelSink.finish = rest
sys.exit(cli.main())
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("stage", ["reading", "tracking", "segmenting", "writing", "finishing"])
def test_a_signal_ends_every_stage_cleanly(clip, tmp_path, stage, number):
    for name in ("out.mp4", "out.csv"):
        (tmp_path / name).write_bytes(OLD)
    before = snapshot(tmp_path)
    arguments = [stage, str(clip), "-o", str(tmp_path / "out.mp4"), "--max-points", "60", "--end", "0.6"]
    process = subprocess.Popen(
        [sys.executable, "-c", HELD, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.read(4) == "here"
        if stage != "reading":
            assert len(snapshot(tmp_path)) > len(before), "the video is being written under another name"
            assert any("ffmpeg" in line for line in children_naming(str(tmp_path)))
        process.send_signal(number)
        process.send_signal(number)  # impatient: cleaning up goes on
        _, err = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    assert "Traceback" not in err
    assert snapshot(tmp_path) == before
    assert children_naming(str(tmp_path)) == []


def test_a_signal_to_the_command_as_it_is(tmp_path):
    clip = encode(tmp_path / "clip.mp4", pictures(1) * 3000)
    process = subprocess.Popen(
        [sys.executable, "-m", "ifsvideo", str(clip)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with process:
        assert process.stderr is not None
        seen = b""
        while b"/3000" not in seen:
            assert process.poll() is None
            seen += process.stderr.read(1)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.endswith(b"ifsvideo: interrupted\n")
    assert list(snapshot(tmp_path)) == ["clip.mp4"]
    assert children_naming(str(tmp_path)) == []


# Runs the command as it is installed; somebody presses Ctrl-C while a library is being imported.
HASTY = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Finder:
    def find_spec(self, name, *_):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from ifsvideo.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize("library", ["numpy", "cv2", "scipy.optimize"])
def test_ctrl_c_while_libraries_are_loaded_is_one_line(library):
    done = subprocess.run(
        [sys.executable, "-c", HASTY, library], capture_output=True, text=True, timeout=30, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "ifsvideo: interrupted\n")

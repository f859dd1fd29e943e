"""One pass through what real recordings are: cut, repeated, in chapters, from a pipe; and what may break."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.ahead import Ahead
from ifsvideo.config import Config, TrackerConfig
from ifsvideo.errors import IfsVideoError, InputError, UsageError
from ifsvideo.objects.labelling import label_frames
from ifsvideo.objects.windows import WindowLabeller
from ifsvideo.pipeline import Pipeline
from ifsvideo.stopwatch import Stopwatch
from ifsvideo.tracking.cuts import alike
from ifsvideo.tracking.steps import follow
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.types import FramePoints
from ifsvideo.video import open_source, picture
from ifsvideo.video.picture import Picture
from ifsvideo.worker import Caller, Worker

from .conftest import FFMPEG, FPS, HEIGHT, WIDTH, children_naming, decoded, encode, pictures, texture
from .test_labelling import Made
from .test_pipeline import ByStep

FEW = TrackerConfig(max_points=150)


def drive(frames: int = 24) -> list[np.ndarray]:
    """The scene of the other tests, and the same seen by a camera that went elsewhere."""
    return pictures(frames)


def elsewhere(frames: int = 24) -> list[np.ndarray]:
    return [np.ascontiguousarray(image[::-1, :, ::-1]) for image in pictures(frames)]


def steps(images: list[np.ndarray], **options):
    return list(follow(KltTracker(FEW), (Picture(image) for image in images), **options))


def test_a_cut_is_found_where_it_is() -> None:
    scenes = [*drive(8), *elsewhere(8), *drive(8)]
    assert [place for place, step in enumerate(steps(scenes)) if step.cut] == [8, 16]


def test_a_jump_of_exposure_is_no_cut() -> None:
    images = drive(12)
    bright = [np.clip(image * 0.35 + 160, 0, 255).astype(np.uint8) for image in images[6:]]
    assert not any(step.cut for step in steps([*images[:6], *bright]))


@pytest.mark.parametrize("value", [0, 128])
def test_a_plain_picture_is_no_cut(value: int) -> None:
    plain = [np.full((HEIGHT, WIDTH, 3), value, np.uint8)] * 4
    assert not any(step.cut for step in steps([*drive(4), *plain, *drive(4)]))


def test_pictures_of_one_scene_are_alike_though_shifted() -> None:
    grey = texture(240, 400, 3)[..., 0]
    assert alike(grey[:, :320], grey[:, 30:350])
    assert not alike(grey[:, :320], texture(240, 320, 4)[..., 0])


def test_repeated_frames_are_known_also_when_encoded_anew(tmp_path) -> None:
    twice = [image for image in drive(12) for _ in range(2)]
    clip = encode(tmp_path / "twice.mp4", twice)
    found = list(follow(KltTracker(FEW), open_source(clip).pictures()))
    assert [step.repeats for step in found] == [False, True] * 12
    for one, again in zip(found[::2], found[1::2], strict=True):
        assert one.points is again.points


def test_repeated_frames_do_not_fake_stillness() -> None:
    """Every frame five times: the windows see the motion that they would see without."""

    class Given:
        """Tracks of a crowd and of ten points that move, and a look at the windows."""

        def __init__(self) -> None:
            self.steps: list[float] = []

        def track(self, frames, ignore=None):
            xy = np.random.default_rng(0).uniform(10, 100, (40, 2)).astype(np.float32)
            for frame, _ in enumerate(frames):
                yield FramePoints(np.arange(40), xy + np.where(np.arange(40) < 10, 2.0 * frame, 0)[:, None])

        def segment(self, tracks, motions=None):
            self.steps.append(float(np.diff(tracks.xy[:, 0, 0]).min()))
            return ByStep().segment(tracks)

    given = Given()
    images = [image for image in drive(40) for _ in range(5)]
    found = list(follow(given, (Picture(image) for image in images)))
    assert sum(step.repeats for step in found) == 160
    config = Config().objects
    labeller = WindowLabeller(given, config)
    frames = list(label_frames(found, lambda tracks: Made(labeller(tracks)), config, (160, 120), 20.0))
    assert min(given.steps) == pytest.approx(2.0)
    assert [frame.shown for frame in frames] == [5] * 40
    assert [frame.place for frame in frames] == list(range(0, 200, 5))


def test_a_freeze_does_not_hold_up_the_labels_for_ever(tmp_path) -> None:
    clip = encode(tmp_path / "frozen.mp4", [*drive(10), *drive(1) * 100])
    result = Pipeline(Config(tracking=FEW), segmenter=ByStep()).run(clip)
    assert result.counts.frames == 110


def test_objects_never_span_a_cut(tmp_path) -> None:
    clip = encode(tmp_path / "two.mp4", [*drive(), *elsewhere()])
    table = Pipeline(Config(tracking=FEW), segmenter=ByStep()).run(clip).table
    before, after = (np.unique(table.labels[part]) for part in (table.frame < 24, table.frame >= 24))
    assert set(before) & set(after) <= {-1, 0}
    assert 1 in before
    assert 2 in after


def test_a_drive_cut_in_three_and_joined_is_the_drive(tmp_path) -> None:
    images = drive(48)
    lossless = ("-c:v", "libx264", "-qp", "0")
    parts = [encode(tmp_path / f"{k}.mp4", images[16 * k : 16 * k + 16], *lossless) for k in range(3)]
    pipeline = Pipeline(Config(tracking=FEW), segmenter=ByStep())
    whole = pipeline.run(encode(tmp_path / "whole.mp4", images, *lossless))
    joined = pipeline.run(parts, tmp_path / "o.mp4")
    assert joined.counts == whole.counts
    assert joined.objects == whole.objects
    np.testing.assert_array_equal(joined.table.labels, whole.table.labels)
    assert decoded(tmp_path / "o.mp4")[0] == 48
    stretch = pipeline.run(parts, start=1.0, end=2.0)
    assert stretch.counts.frames == 20
    assert stretch.info.start == pytest.approx(1.0)


def test_files_that_are_not_of_one_recording(clips, tmp_path) -> None:
    other = encode(tmp_path / "other.mp4", pictures(3, 128, 96))
    with pytest.raises(InputError, match=r"other.mp4: has 128x96 pixels, but plain.mp4 has 160x120"):
        Pipeline().run([clips["plain"], other])
    with pytest.raises(UsageError, match="cannot be joined"):
        Pipeline().run([clips["plain"], Path("t.npz")])
    with pytest.raises(UsageError, match="no frame from 9 s"):
        Pipeline().run([clips["plain"], clips["plain"]], start=9.0)


def test_join_on_the_command_line(command, clips, tmp_path) -> None:
    done = command("--join", clips["plain"], clips["plain"], "-o", "o.mp4", "--max-points", "80")
    assert done.returncode == 0, done.stderr
    assert "48 frames" in done.stdout
    assert decoded(tmp_path / "o.mp4")[0] == 48


def beeping(path: Path, at: float | None) -> Path:
    """A clip of a second and a bit; a beep sounds from ``at`` on for 0.2 s, or there is no sound."""
    silent = encode(path.with_suffix(".mkv"), drive(26))
    if at is None:
        return silent
    tone = ("-f", "lavfi", "-i", f"aevalsrc=sin(2764*t)*between(t\\,{at}\\,{at + 0.2}):d=1.2:s=44100")
    line = [FFMPEG, "-v", "error", "-i", str(silent), *tone, "-c:v", "copy", "-c:a", "aac", str(path)]
    subprocess.run(line, check=True)
    silent.unlink()
    return path


@pytest.mark.parametrize(
    ("start", "beeps"),
    [(0.0, [0.5, 2.9, 4.1]), (1.6, [1.3, 2.5])],
    ids=["whole", "from the second chapter on"],
)
def test_joined_chapters_keep_their_sound_in_step(tmp_path, start, beeps) -> None:
    """1.3 s of pictures each: one with a beep, one without sound, two with a beep each."""
    places = (0.5, None, 0.3, 0.2)
    parts = [beeping(tmp_path / f"{k}.mp4", at) for k, at in enumerate(places)]
    run = Pipeline(Config(tracking=FEW), segmenter=ByStep()).run(parts, tmp_path / "o.mp4", start=start)
    assert run.warnings == ()
    line = [
        FFMPEG,
        "-v",
        "error",
        "-i",
        str(tmp_path / "o.mp4"),
        "-f",
        "f32le",
        "-ac",
        "1",
        "-ar",
        "8000",
        "-",
    ]
    heard = np.frombuffer(subprocess.run(line, check=True, capture_output=True).stdout, np.float32)
    loud = np.flatnonzero(np.abs(heard) > 0.1) / 8000
    begins = loud[np.flatnonzero(np.diff(loud, prepend=-1) > 0.1)]
    np.testing.assert_allclose(begins, beeps, atol=0.03)


@pytest.mark.parametrize("options", [(), ("-f", "mpegts"), ("-f", "matroska")])
def test_standard_input(clips, tmp_path, options) -> None:
    piped = tmp_path / "piped"
    form = options or ("-f", "mp4", "-movflags", "frag_keyframe+empty_moov")
    subprocess.run([FFMPEG, "-v", "error", "-i", clips["plain"], "-c", "copy", *form, piped], check=True)
    line = [sys.executable, "-m", "ifsvideo", "-", "-o", "o.mp4", "--max-points", "80", "--start", "0.5"]
    with piped.open("rb") as file:
        done = subprocess.run(
            line, cwd=tmp_path, stdin=file, capture_output=True, text=True, check=False, timeout=60
        )
    assert done.returncode == 0, done.stderr
    assert decoded(tmp_path / "o.mp4") == (14, (WIDTH, HEIGHT), FPS)
    assert (tmp_path / "o.csv").read_text().splitlines()[1].startswith("0,0.5000,")


@pytest.mark.parametrize(("data", "options"), [(b"", ()), (b"no video" * 99, ()), (None, ("--start", "99"))])
def test_standard_input_that_is_no_video(clips, tmp_path, data, options) -> None:
    line = [sys.executable, "-m", "ifsvideo", "-", "-o", "o.mp4", *options]
    data = clips["plain"].read_bytes() if data is None else data
    done = subprocess.run(line, cwd=tmp_path, input=data, capture_output=True, check=False, timeout=60)
    assert done.returncode == (2 if options else 3)
    assert b"standard input" in done.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


def test_standard_input_has_no_name(command) -> None:
    done = command("-")
    assert done.returncode == 2
    assert "name the output" in done.stderr


def test_preview_reads_a_second_now_and_then(command, tmp_path) -> None:
    clip = encode(tmp_path / "clip.mp4", drive(95))
    done = command(clip, "--preview", "2", "-o", "o.mp4", "--max-points", "80")
    assert done.returncode == 0, done.stderr
    assert decoded(tmp_path / "o.mp4")[0] == 20 + 20 + 15
    rows = np.genfromtxt(tmp_path / "o.csv", delimiter=",", names=True)
    assert rows["frame"].max() == 54
    np.testing.assert_allclose(np.unique(rows["time_s"][rows["frame"] >= 40]), 4 + np.arange(15) / 20)


def test_without_video(command, clip, tmp_path) -> None:
    done = command("clip.mp4", "--no-video", "--max-points", "80")
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.ifs.csv", "clip.mp4"]


def test_tracking_in_a_smaller_size_keeps_coordinates_and_overlay(tmp_path) -> None:
    clip = encode(tmp_path / "clip.mp4", pictures(24, 320, 240))
    config = Config(tracking=TrackerConfig(max_points=150, scale=0.5))
    result = Pipeline(config, segmenter=ByStep()).run(clip, tmp_path / "o.mp4")
    assert decoded(tmp_path / "o.mp4")[1] == (320, 240)
    assert result.table.xy.max() > 250
    assert [item.label for item in result.objects] == [1]


def test_who_runs_ahead_stops_at_the_limit_and_when_told() -> None:
    made = []

    def items():
        try:
            for k in range(1000):
                made.append(k)
                yield k
        finally:
            made.append("closed")

    with Ahead(items(), 3) as ahead:
        first = next(iter(ahead))
        time.sleep(0.2)
        assert len(made) <= 6
    assert first == 0
    assert made[-1] == "closed"


def test_what_fails_ahead_fails_here() -> None:
    def items():
        yield 1
        raise ValueError("broken")

    seen = []
    with pytest.raises(ValueError, match="broken"), Ahead(items(), 3) as ahead:
        seen.extend(ahead)
    assert seen == [1]


def test_a_call_that_fails_fails_here_and_the_next_goes_on() -> None:
    with Caller(lambda n: 12 // n, Stopwatch()) as caller:
        calls = [caller.begin(n) for n in (3, 0, 2)]
        assert calls[0].value() == 4
        with pytest.raises(ZeroDivisionError):
            calls[1].value()
        assert calls[2].value() == 6


def test_a_worker_calls_raises_and_ends_with_its_context() -> None:
    with Worker(int, "counts") as worker:
        assert worker("12") == 12
        with pytest.raises(ValueError, match="invalid literal"):
            worker("twelve")
        assert worker("3") == 3
        pid = worker.pid
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@pytest.mark.parametrize("keeps", [True, False])
def test_only_a_worker_that_is_told_so_keeps_memory(keeps: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MALLOC_TOP_PAD_", raising=False)
    with Worker(os.getenv, "asks", keeps_memory=keeps) as worker:
        assert (worker("MALLOC_TOP_PAD_") is not None) == keeps


def test_a_worker_that_is_killed_is_one_line() -> None:
    with Worker(int, "counts") as worker:
        os.kill(worker.pid, signal.SIGKILL)
        with pytest.raises(IfsVideoError, match=r"process that counts was killed \(signal 9\)"):
            worker("12")


def wait_for(what, process: subprocess.Popen[str]):
    """What a callable gives, once it gives anything."""
    end = time.monotonic() + 30
    while not (found := what()):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    return found


def children(process: subprocess.Popen[str], word: str) -> list[int]:
    """Ids of the children whose command holds a word."""
    listed = Path(f"/proc/{process.pid}/task").glob("*/children")
    ids = [int(child) for task in listed for child in task.read_text().split()]
    lines = {pid: Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ") for pid in ids}
    return [pid for pid, line in lines.items() if word in line]


@pytest.fixture
def long_clip(tmp_path) -> Path:
    """A clip that is too long to be done with here."""
    return encode(tmp_path / "clip.mp4", drive(40) * 50)


@pytest.fixture
def long_run(long_clip):
    """The command at work on it."""
    line = [sys.executable, "-m", "ifsvideo", str(long_clip), "--max-points", "80"]
    with subprocess.Popen(
        line, cwd=long_clip.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        yield run
        run.kill()


def labels_are_written(folder: Path) -> bool:
    """Whether a run that writes there is past its first windows."""
    return any(path.stat().st_size > 100 for path in folder.glob(".ifsvideo-*.csv"))


@pytest.mark.parametrize(
    ("word", "status", "complaint"),
    [
        ("ifsvideo.worker", 1, "the process that segments was killed (signal 9)"),
        ("libx264", 4, "clip.ifs.mp4: ffmpeg could not write the video (it was killed)"),
        ("out_color_matrix", 1, "clip.mp4: ffmpeg was killed while reading (signal 9)"),
    ],
    ids=["segmenter", "encoder", "decoder"],
)
def test_a_killed_process_ends_the_run(long_run, tmp_path, word, status, complaint) -> None:
    wait_for(lambda: labels_are_written(tmp_path), long_run)
    (child,) = wait_for(lambda: children(long_run, word), long_run)
    os.kill(child, signal.SIGKILL)
    _, err = long_run.communicate(timeout=20)
    assert long_run.returncode == status
    last = err.splitlines()[-1]
    assert last.startswith("ifsvideo: error: ")
    assert complaint in last
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]
    assert children_naming(str(tmp_path)) == []


def test_a_disk_that_fills_up_ends_the_run(long_clip) -> None:
    """What the encoder writes reaches the limit after its first seconds of video."""
    line = [sys.executable, "-m", "ifsvideo", str(long_clip), "--max-points", "80"]
    done = subprocess.run(
        line,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000)),
    )
    assert done.returncode == 4
    assert "clip.ifs." in done.stderr.splitlines()[-1]
    assert [path.name for path in long_clip.parent.iterdir()] == ["clip.mp4"]
    assert children_naming(str(long_clip.parent)) == []


def test_a_pipe_whose_writer_dies_gives_what_came(tmp_path) -> None:
    clip = encode(tmp_path / "clip.ts", drive(60))
    line = [sys.executable, "-m", "ifsvideo", "-", "-o", "o.mp4", "--max-points", "80"]
    with subprocess.Popen(line, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as run:
        assert run.stdin is not None
        data = clip.read_bytes()
        run.stdin.write(data[: len(data) // 2])
        run.stdin.close()
        assert run.wait(timeout=60) == 0
    assert 15 < decoded(tmp_path / "o.mp4")[0] < 50
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.ts", "o.csv", "o.mp4"]


def test_a_screen_that_goes_away_does_not_end_the_run(clip, tmp_path) -> None:
    """Who looked at the progress has left: `ifsvideo clip.mp4 2>&1 | head`."""
    reader, writer = os.pipe()
    os.close(reader)
    line = [sys.executable, "-m", "ifsvideo", str(clip), "--max-points", "80"]
    done = subprocess.run(line, stdout=writer, stderr=writer, check=False, timeout=60)
    os.close(writer)
    assert done.returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.ifs.csv", "clip.ifs.mp4", "clip.mp4"]


def test_a_large_picture_waits_as_jpeg(monkeypatch) -> None:
    image = drive(1)[0]
    assert Picture(image).to_wait().pixels is image
    monkeypatch.setattr(picture, "LARGEST_KEPT", 1000)
    (step,) = steps([image])
    assert step.picture is not None
    assert step.picture.pixels is not step.picture.pixels, "it is decoded when it is asked for"
    difference = np.abs(step.picture.rgb.astype(int) - image)
    assert 0 < difference.mean() < 3


def test_a_run_that_is_killed_leaves_no_process(long_run, tmp_path) -> None:
    (worker,) = wait_for(lambda: children(long_run, "ifsvideo.worker"), long_run)
    wait_for(lambda: children(long_run, "ffmpeg"), long_run)
    long_run.kill()
    long_run.communicate()
    end = time.monotonic() + 20
    while Path(f"/proc/{worker}/cmdline").exists() and Path(f"/proc/{worker}/cmdline").read_bytes():
        assert time.monotonic() < end, "the worker outlives its parent"
        time.sleep(0.05)

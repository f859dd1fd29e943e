"""H.264 files: colours, size, rate and sound as in the input; complete at their place, or not there."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from numpy.typing import NDArray

from ifsvideo.errors import OutputError, UsageError
from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import VideoWriter, check_output, open_source
from ifsvideo.video.picture import planes_of

SMALL = VideoInfo(64, 48, Fraction(25))
COLOURS = [
    (255, 0, 0),
    (0, 255, 0),
    (0, 0, 255),
    (255, 255, 0),
    (0, 255, 255),
    (255, 0, 255),
    (255, 255, 255),
]


def ffmpeg(*arguments: str | Path) -> bytes:
    """What ffmpeg writes to stdout; insists on success."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-nostdin", "-y", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def described(path: Path) -> str:
    """ffmpeg's own words about a file."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(path)]
    return subprocess.run(command, capture_output=True, check=False).stderr.decode()


def children() -> set[str]:
    """Process ids of children that still run or were not reaped."""
    command = ["ps", "-o", "pid=,comm=", "--ppid", str(os.getpid())]
    listed = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    return {line.split()[0] for line in listed.splitlines() if not line.endswith("ps")}


def pictures(info: VideoInfo, frames: int) -> Iterator[Image]:
    """Bars of plain colours, and a brightness that tells the frames apart."""
    bars = np.array([*COLOURS, (0, 0, 0)], dtype=np.uint8)[np.arange(info.width) * 8 // info.width]
    for k in range(frames):
        image = np.repeat(bars[None], info.height, axis=0)
        image[:, -info.width // 8 :] = k % 256
        yield image


def write(
    path: Path, info: VideoInfo = SMALL, frames: int = 10, audio_from: Path | None = None
) -> VideoWriter:
    """Write some frames."""
    with VideoWriter(path, info, audio_from=audio_from) as writer:
        for image in pictures(info, frames):
            writer.write(image)
    return writer


def fail_after(writer: VideoWriter, frames: int, error: BaseException) -> None:
    """Write some frames, then fail."""
    with writer:
        for image in pictures(SMALL, frames):
            writer.write(image)
        raise error


@pytest.mark.parametrize("ending", [".mp4", ".mov", ".mkv", ".MP4"])
def test_what_is_written_is_read_again(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"out{ending}"
    info = VideoInfo(80, 48, Fraction(30000, 1001), sample_aspect=Fraction(12, 11))
    writer = write(path, info, frames=40)
    assert (writer.frames, writer.padded, writer.warnings) == (40, False, ())
    source = open_source(path)
    again = source.info
    assert (again.width, again.height, again.fps, again.frames) == (80, 48, Fraction(30000, 1001), 40)
    assert again.sample_aspect == Fraction(12, 11)
    for image, original in zip(source.frames(), pictures(info, 40), strict=True):
        centres = 5 + 10 * np.arange(8)
        # Each bar is wide enough for a centre free of neighbours' colour; compression alone may change it.
        assert image[24, centres].astype(int) == pytest.approx(original[24, centres].astype(int), abs=6)
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize("size", [(2, 2), (160, 120), (1280, 722)])
def test_planes_are_those_of_the_standard(size: tuple[int, int]) -> None:
    """Rec. ITU-R BT.709, 16 to 235; also where a picture is so large that it is made in several strips."""
    width, height = size
    image = np.random.default_rng(0).integers(0, 256, (height, width, 3), np.uint8)
    planes = planes_of(image)
    luma = image / 255 @ (0.2126, 0.7152, 0.0722)
    blue, red = (image[..., 2] / 255 - luma) / 1.8556, (image[..., 0] / 255 - luma) / 1.5748
    halves = [plane.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3)) for plane in (blue, red)]
    expected = np.concatenate([219 * luma.ravel() + 16, 224 * np.ravel(halves) + 128])
    np.testing.assert_allclose(planes.ravel(), expected, atol=1.01)


def test_a_browser_plays_it(tmp_path: Path) -> None:
    path = tmp_path / "out.mp4"
    write(path)
    assert "Video: h264" in described(path)
    assert "yuv420p(tv, bt709" in described(path)
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")


@pytest.mark.parametrize(("size", "padded"), [((63, 48), (64, 48)), ((64, 47), (64, 48)), ((1, 1), (2, 2))])
def test_an_odd_side_is_padded_with_its_own_edge(
    tmp_path: Path, size: tuple[int, int], padded: tuple[int, int]
) -> None:
    path = tmp_path / "odd.mp4"
    info = VideoInfo(*size, Fraction(25), sample_aspect=Fraction(2864, 2871))
    with VideoWriter(path, info) as writer:
        for _ in range(3):
            writer.write(np.full((size[1], size[0], 3), 200, dtype=np.uint8))
    again = open_source(path)
    assert (again.info.width, again.info.height) == padded
    assert again.info.sample_aspect == Fraction(2864, 2871)
    assert next(again.frames())[-1, -1].tolist() == pytest.approx([200] * 3, abs=3)
    assert writer.padded
    assert "padded by one pixel to {}x{}".format(*padded) in writer.warnings[0]


@pytest.mark.parametrize(
    "image",
    [np.zeros((48, 63, 3), np.uint8), np.zeros((48, 64), np.uint8), np.zeros((48, 64, 3), np.float32)],
)
def test_a_frame_of_another_kind_is_refused(tmp_path: Path, image: Image) -> None:
    writer = VideoWriter(tmp_path / "out.mp4", SMALL)
    with pytest.raises(ValueError, match="expected uint8 image"), writer:
        writer.write(image)
    assert os.listdir(tmp_path) == []


def test_a_frame_need_not_be_contiguous(tmp_path: Path) -> None:
    with VideoWriter(tmp_path / "out.mp4", SMALL) as writer:
        for image in pictures(SMALL, 3):
            writer.write(image[:, ::-1])
    image = next(open_source(tmp_path / "out.mp4").frames())
    assert image[20, 60].tolist() == pytest.approx([255, 0, 0], abs=4)


def clip_with_beep(path: Path, codec: str, seconds: float = 4.0, beep: float = 2.0) -> Path:
    """A clip of 25 frames a second whose sound begins at ``beep`` seconds."""
    picture = ("-f", "lavfi", "-i", f"testsrc2=s=64x48:r=25:d={seconds}")
    sound = ("-f", "lavfi", "-i", f"aevalsrc='0.3*sin(6283*t)*gte(t,{beep})':d={seconds}:s=44100")
    ffmpeg(*picture, *sound, "-c:v", "libx264", "-c:a", codec, "-strict", "-2", path)
    return path


def sound_of(path: Path) -> NDArray[np.float32]:
    """Sound of a file, 8000 samples a second, from time 0 of the file on."""
    raw = ffmpeg(
        "-i", path, "-map", "0:a:0", "-af", "aresample=8000:first_pts=0", "-ac", "1", "-f", "f32le", "-"
    )
    return np.frombuffer(raw, dtype=np.float32)


@pytest.mark.parametrize(
    ("name", "codec", "output", "expected"),
    [
        ("in.mp4", "aac", "out.mp4", "aac"),
        ("in.mkv", "libmp3lame", "out.mp4", "mp3"),
        ("in.mkv", "libopus", "out.mkv", "opus"),
        ("in.mkv", "libvorbis", "out.mp4", "aac"),
        ("in.avi", "pcm_s16le", "out.mp4", "aac"),
        ("in.avi", "pcm_s16le", "out.mov", "pcm_s16le"),
    ],
)
def test_sound_is_kept_and_in_step(tmp_path: Path, name: str, codec: str, output: str, expected: str) -> None:
    source = open_source(clip_with_beep(tmp_path / name, codec))
    path = tmp_path / output
    writer = write(path, source.info, frames=100, audio_from=source.path)
    assert writer.warnings == ()
    assert f"Audio: {expected}" in described(path)
    loud = np.flatnonzero(np.abs(sound_of(path)) > 0.02)
    assert loud[0] / 8000 == pytest.approx(2.0, abs=0.015)
    assert sorted(os.listdir(tmp_path)) == sorted([name, output])


@pytest.mark.parametrize("name", ["in.mp4", "in.mkv", "in.avi"])
def test_sound_of_a_stretch_is_of_the_same_stretch(tmp_path: Path, name: str) -> None:
    source = open_source(
        clip_with_beep(tmp_path / name, "aac" if name != "in.avi" else "mp3"), start=1.48, end=3.0
    )
    path = tmp_path / "out.mp4"
    with VideoWriter(path, source.info, audio_from=source.path) as writer:
        for image in source.frames():
            writer.write(image)
    sound = sound_of(path)
    late = 0.025 if name == "in.avi" else 0.0  # AVI cannot say that MP3 begins with silence of the encoder's
    assert np.flatnonzero(np.abs(sound) > 0.02)[0] / 8000 == pytest.approx(0.52 + late, abs=0.015)
    assert len(sound) / 8000 == pytest.approx(1.52, abs=0.05)
    assert "Duration: 00:00:01.52" in described(path)


@pytest.mark.parametrize(("sound", "frames"), [(1.0, 100), (6.0, 50)])
def test_the_video_alone_decides_the_length(tmp_path: Path, sound: float, frames: int) -> None:
    source = clip_with_beep(tmp_path / "in.mp4", "aac", seconds=sound, beep=0.0)
    path = tmp_path / "out.mp4"
    write(path, SMALL, frames=frames, audio_from=source)
    assert open_source(path).info.frames == frames
    assert f"Duration: 00:00:0{frames // 25}.0" in described(path)


def test_sound_that_cannot_be_read_costs_only_the_sound(tmp_path: Path) -> None:
    silent = tmp_path / "silent.mp4"
    write(silent)
    writer = write(tmp_path / "out.mp4", audio_from=silent)
    assert "sound could not be kept" in writer.warnings[0]
    assert open_source(tmp_path / "out.mp4").info.frames == 10
    assert sorted(os.listdir(tmp_path)) == ["out.mp4", "silent.mp4"]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(3), GeneratorExit(), ValueError("x")])
@pytest.mark.parametrize("older", [None, b"older"])
def test_a_failure_leaves_no_file_and_no_process(
    tmp_path: Path, error: BaseException, older: bytes | None
) -> None:
    before = children()
    path = tmp_path / "out.mp4"
    if older is not None:
        path.write_bytes(older)
    with pytest.raises(type(error)):
        fail_after(VideoWriter(path, SMALL), 5, error)
    assert children() == before
    assert os.listdir(tmp_path) == ([] if older is None else ["out.mp4"])
    assert older is None or path.read_bytes() == older


def test_an_older_output_stands_until_the_new_one_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "out.mp4"
    path.write_bytes(b"older")
    with VideoWriter(path, SMALL) as writer:
        for image in pictures(SMALL, 5):
            writer.write(image)
        assert path.read_bytes() == b"older"
        assert all(name.startswith(".") for name in os.listdir(tmp_path) if name != "out.mp4")
    assert open_source(path).info.frames == 5


def test_a_writer_without_frames_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no frame was written"):
        write(tmp_path / "out.mp4", frames=0)
    assert os.listdir(tmp_path) == []


def test_a_killed_encoder_is_an_output_error(tmp_path: Path) -> None:
    before = children()
    writer = VideoWriter(tmp_path / "out.mp4", SMALL)

    def write_much() -> None:
        with writer:
            (child,) = children() - before
            os.kill(int(child), signal.SIGKILL)
            for image in pictures(SMALL, 1000):
                writer.write(image)

    with pytest.raises(OutputError, match="killed"):
        write_much()
    assert children() == before
    assert os.listdir(tmp_path) == []


LIMITED = """
import resource, signal, sys
from fractions import Fraction
from pathlib import Path
import numpy as np
from ifsvideo.errors import OutputError
from ifsvideo.types import VideoInfo
from ifsvideo.video import VideoWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
noise = np.random.default_rng(0)
try:
    with VideoWriter(Path(sys.argv[1]), VideoInfo(320, 240, Fraction(25))) as writer:
        for _ in range(int(sys.argv[2])):
            writer.write(noise.integers(0, 255, (240, 320, 3), dtype=np.uint8))
except OutputError as error:
    print(error)
"""


@pytest.mark.parametrize("frames", [12, 400])
def test_a_file_that_cannot_grow_is_an_output_error(tmp_path: Path, frames: int) -> None:
    command = [sys.executable, "-W", "error", "-c", LIMITED, str(tmp_path / "out.mp4"), str(frames)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "could not write the video" in done.stdout
    assert os.listdir(tmp_path) == []


def test_a_full_disk_is_named(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no permission to mount a small disk")
    info = VideoInfo(320, 240, Fraction(25))
    noise = np.random.default_rng(0)
    writer = VideoWriter(disk / "out.mp4", info)

    def write_much() -> None:
        with writer:
            for _ in range(100):
                writer.write(noise.integers(0, 255, (240, 320, 3), dtype=np.uint8))

    try:
        with pytest.raises(OutputError, match="the disk is full"):
            write_much()
        assert os.listdir(disk) == []
    finally:
        subprocess.run(["umount", str(disk)], check=True)


PATIENT = """
import os, signal, sys
from fractions import Fraction
from pathlib import Path
import numpy as np
from ifsvideo.types import VideoInfo
from ifsvideo.video import VideoWriter
signal.signal(signal.SIGINT, lambda *_: None)
with VideoWriter(Path(sys.argv[1]), VideoInfo(320, 240, Fraction(25))) as writer:
    for k in range(200):
        writer.write(np.zeros((240, 320, 3), np.uint8))
        if k == 100:
            os.killpg(0, signal.SIGINT)
print(writer.frames)
"""


def test_ctrl_c_of_the_terminal_does_not_reach_ffmpeg(tmp_path: Path) -> None:
    """A terminal sends SIGINT to the whole process group; here Python decides to go on."""
    command = [sys.executable, "-W", "error", "-c", PATIENT, str(tmp_path / "out.mp4")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, start_new_session=True)
    assert (done.stdout, done.returncode) == ("200\n", 0), done.stderr
    assert open_source(tmp_path / "out.mp4").info.frames == 200


def test_a_group_places_video_and_table_together(tmp_path: Path) -> None:
    video, table = tmp_path / "out.mp4", tmp_path / "out.csv"
    with Outputs() as outputs:
        outputs.add(table).write_text("frame\n")
        with VideoWriter(video, SMALL, outputs=outputs) as writer:
            for image in pictures(SMALL, 5):
                writer.write(image)
        assert not video.exists()
    assert open_source(video).info.frames == 5
    assert table.read_text() == "frame\n"


@pytest.mark.parametrize("name", ["out.avi", "out", "out.mp4.txt", ".mp4"])
def test_an_unknown_ending_is_a_usage_error(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match="unknown ending"):
        check_output(tmp_path / name)


@pytest.mark.parametrize("way", ["same", "relative", "symlink", "hardlink"])
def test_an_output_that_is_the_input_is_a_usage_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    source, other = tmp_path / "in.mp4", tmp_path / "other.mp4"
    source.write_bytes(b"precious")
    monkeypatch.chdir(tmp_path)
    if way == "symlink":
        other.symlink_to(source)
    elif way == "hardlink":
        other.hardlink_to(source)
    output = {"same": source, "relative": Path("./in.mp4")}.get(way, other)
    with pytest.raises(UsageError, match="is the input"):
        check_output(output, source)
    assert source.read_bytes() == b"precious"
    check_output(tmp_path / "free.mp4", source)


def test_places_where_nothing_can_be_written_are_output_errors(tmp_path: Path) -> None:
    (tmp_path / "folder.mp4").mkdir()
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe.mp4")
    for name, words in (
        ("folder.mp4", "is a folder"),
        ("missing/out.mp4", "does not exist"),
        ("file/out.mp4", "does not exist"),
        ("pipe.mp4", "not a regular file"),
    ):
        with pytest.raises(OutputError, match=words) as caught:
            check_output(tmp_path / name)
        assert str(caught.value).startswith(str(tmp_path / name))

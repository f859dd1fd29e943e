"""Video files: every frame, upright, at an exact rate; stretches exact to the frame; faults in one line."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from fractions import Fraction
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from ifsvideo.errors import IfsVideoError, InputError, UsageError
from ifsvideo.types import Image
from ifsvideo.video import FrameSource, open_source, parse_time
from ifsvideo.video.picture import Picture

from .conftest import encode, pictures

ODD = Path(__file__).resolve().parents[2] / "shared" / "videos" / "odd"
LOSSLESS = ("-c:v", "libx264", "-qp", "0", "-pix_fmt", "yuv444p")
Make = Callable[..., Path]


def numbered(frames: int, width: int = 80, height: int = 48) -> list[Image]:
    """Pictures that carry their number as ten vertical bars, black 0 and white 1, lowest bit on the left."""
    bars = np.arange(width) * 10 // width
    lines = [((k >> bars) & 1).astype(np.uint8) * 255 for k in range(frames)]
    return [np.ascontiguousarray(np.broadcast_to(line[None, :, None], (height, width, 3))) for line in lines]


def number_of(image: Image) -> int:
    """The number that a picture of `numbered` carries."""
    height, width = image.shape[:2]
    bits = image[height // 2, (2 * np.arange(10) + 1) * width // 20, 1] > 127
    return int((bits << np.arange(10)).sum())


def numbers_of(source: FrameSource) -> list[int]:
    """The numbers of all frames of a source."""
    return [number_of(image) for image in source.frames()]


def ffmpeg(*arguments: str | Path, feed: bytes = b"") -> None:
    """Run ffmpeg and insist on success."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-y", *map(str, arguments)]
    done = subprocess.run(command, input=feed, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()


def children() -> set[int]:
    """Process ids of the children of this process that still run or were not reaped."""
    listed = subprocess.run(
        ["ps", "-o", "pid=,comm=", "--ppid", str(os.getpid())], capture_output=True, text=True
    )
    return {int(line.split()[0]) for line in listed.stdout.splitlines() if not line.endswith("ps")}


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Makes a clip of numbered pictures."""

    def clip(
        name: str, *options: str, frames: int = 30, fps: str = "25", size: tuple[int, int] = (80, 48)
    ) -> Path:
        path = tmp_path / name
        feed = b"".join(image.tobytes() for image in numbered(frames, *size))
        raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-framerate", fps)
        ffmpeg(*raw, "-i", "-", *(options or LOSSLESS), path, feed=feed)
        return path

    return clip


@pytest.mark.parametrize(
    ("name", "options", "fps"),
    [
        ("h264.mp4", ("-c:v", "libx264", "-pix_fmt", "yuv420p"), "30000/1001"),
        ("h264.mkv", ("-c:v", "libx264", "-pix_fmt", "yuv420p"), "24000/1001"),
        (
            "hevc10.mp4",
            ("-c:v", "libx265", "-x265-params", "log-level=error", "-pix_fmt", "yuv420p10le"),
            "25",
        ),
        ("grey.mkv", ("-c:v", "ffv1", "-pix_fmt", "gray"), "12"),
        ("deep.mkv", ("-c:v", "ffv1", "-pix_fmt", "gbrp16le"), "50"),
        ("raw.avi", ("-c:v", "rawvideo", "-pix_fmt", "bgr24"), "15"),
        ("bframes.avi", ("-c:v", "libx264", "-bf", "2", "-pix_fmt", "yuv420p"), "10"),
        ("mpeg4.avi", ("-c:v", "mpeg4", "-q:v", "2"), "25"),
        ("elementary.h264", ("-c:v", "libx264", "-pix_fmt", "yuv420p"), "25"),
        ("stream.ts", ("-c:v", "libx264", "-pix_fmt", "yuv420p"), "25"),
        ("vp9.webm", ("-c:v", "libvpx-vp9", "-cpu-used", "8", "-deadline", "realtime"), "30"),
        ("moving.gif", (), "10"),
    ],
)
def test_every_frame_is_read_once_and_in_order(
    make: Make, name: str, options: tuple[str, ...], fps: str
) -> None:
    path = make(name, *(options or ("-f", "gif")), fps=fps)
    source = open_source(path)
    assert source.info.fps == Fraction(fps)
    assert (source.info.width, source.info.height, source.info.frames) == (80, 48, 30)
    assert numbers_of(source) == list(range(30))
    assert numbers_of(source) == list(range(30))  # a second pass
    assert source.warnings == ()


def test_frames_are_arrays_of_their_own(make: Make) -> None:
    images = list(open_source(make("a.mp4", frames=3)).frames())
    for image in images:
        assert image.dtype == np.uint8
        assert image.shape == (48, 80, 3)
        assert image.flags.c_contiguous
        assert image.flags.writeable
    assert not np.shares_memory(images[0], images[1])


@pytest.mark.parametrize("size", [(79, 47), (81, 48), (80, 49)])
def test_odd_sizes_are_read_as_they_are(make: Make, size: tuple[int, int]) -> None:
    source = open_source(make("odd.mp4", *LOSSLESS, frames=4, size=size))
    assert (source.info.width, source.info.height) == size
    assert numbers_of(source) == [0, 1, 2, 3]


def test_rotation_is_applied_and_swaps_the_pixel_aspect(make: Make, tmp_path: Path) -> None:
    lying = make("lying.mp4", *LOSSLESS, "-vf", "setsar=4/3", frames=3)
    path = tmp_path / "upright.mp4"
    ffmpeg("-display_rotation", "90", "-i", lying, "-c", "copy", path)
    source = open_source(path)
    assert (source.info.width, source.info.height) == (48, 80)
    assert source.info.sample_aspect == Fraction(3, 4)
    assert open_source(lying).info.sample_aspect == Fraction(4, 3)
    upright = list(source.frames())[2]
    assert (
        number_of(np.ascontiguousarray(np.rot90(upright, -1))) == 2
    )  # rotated by 90 degrees counterclockwise


def test_colours_of_the_picture_survive(tmp_path: Path) -> None:
    path = tmp_path / "red.mkv"
    ffmpeg("-f", "lavfi", "-i", "color=0xC81E0A:s=64x48:r=5:d=1", "-c:v", "ffv1", "-pix_fmt", "gbrp", path)
    assert next(open_source(path).frames())[20, 20] == pytest.approx((200, 30, 10), abs=1)


@pytest.mark.parametrize("matrix", ["bt709", "smpte170m"])
def test_planes_have_the_colours_that_the_file_says(tmp_path: Path, matrix: str) -> None:
    """Saturated colours differ by up to 30 grey levels between the two."""
    path = tmp_path / "bars.mkv"
    tagged = f"scale=out_color_matrix={matrix}:out_range=tv,format=yuv420p,setparams=colorspace={matrix}"
    bars = ("-f", "lavfi", "-i", "smptebars=s=128x96:r=5:d=1")
    ffmpeg(*bars, "-vf", tagged, "-c:v", "ffv1", "-colorspace", matrix, path)
    source = open_source(path)
    expected = next(source.frames()).astype(float)
    picture = next(source.pictures())
    assert np.abs(picture.rgb - expected).mean() < 2
    assert np.abs(picture.to_wait().rgb - expected).mean() < 2
    shares = (0.2126, 0.7152, 0.0722) if matrix == "bt709" else (0.299, 0.587, 0.114)
    assert np.abs(picture.grey - expected @ shares).mean() < 2, "grey is the file's own luma"


@pytest.mark.parametrize("bt709", [False, True])
@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("planes", [False, True])
def test_a_box_has_the_colours_of_the_picture(
    monkeypatch: pytest.MonkeyPatch, planes: bool, packed: bool, bt709: bool
) -> None:
    """Wherever its borders lie: in planes four pixels share their colour."""
    shape = (72, 64) if planes else (48, 64, 3)
    picture = Picture(np.random.default_rng(0).integers(0, 256, shape, np.uint8), bt709)
    if packed:
        monkeypatch.setattr("ifsvideo.video.picture.LARGEST_KEPT", 0)
        picture = picture.to_wait()
    assert picture.size == (64, 48)
    whole = picture.rgb
    assert whole.shape == (48, 64, 3)
    for left, top, width, height in ((0, 0, 64, 48), (7, 5, 21, 18), (8, 6, 19, 21), (63, 47, 1, 1)):
        assert (
            picture.rgb_of(left, top, width, height) == whole[top : top + height, left : left + width]
        ).all()


VARIABLE = (
    "-vf",
    "select='if(gt(n,9)*lt(n,15)+eq(n,20),0,1)'",
    "-fps_mode",
    "passthrough",
    "-enc_time_base",
    "1:600",
)


@pytest.mark.parametrize("name", ["variable.mp4", "variable.mkv"])
def test_a_variable_rate_becomes_the_nominal_constant_one(make: Make, name: str) -> None:
    source = open_source(make(name, *LOSSLESS, *VARIABLE, frames=60, fps="30"))
    held = [9 if 9 < k < 15 else 19 if k == 20 else k for k in range(60)]
    assert source.info.fps == 30
    assert source.info.frames == 60
    assert numbers_of(source) == held


def test_a_stretch_of_a_variable_rate_is_exact(make: Make) -> None:
    source = open_source(make("v.mp4", *LOSSLESS, *VARIABLE, frames=60, fps="30"), start=0.4, end=0.8)
    assert numbers_of(source) == [9, 9, 9, 15, 16, 17, 18, 19, 19, 21, 22, 23]
    assert source.info.start == pytest.approx(0.4)


def test_a_clock_is_not_taken_for_a_rate(make: Make) -> None:
    """Every frame a whole number of milliseconds from the last: the nominal rate is that of the clock."""
    jitter = "setpts='(N*40+mod(N*7,11)*3)/1000/TB'"
    path = make("clock.mkv", *LOSSLESS, "-vf", jitter, "-fps_mode", "passthrough", "-enc_time_base", "1:1000")
    source = open_source(path)
    assert 20 < source.info.fps < 30
    assert 28 <= len(numbers_of(source)) <= 32


def test_a_rate_that_is_told_takes_the_frames_one_by_one(make: Make) -> None:
    source = open_source(make("v.mp4", *LOSSLESS, *VARIABLE, frames=60, fps="30"), fps=Fraction(10))
    assert source.info.fps == 10
    assert source.info.frames == 54
    assert len(numbers_of(source)) == 54


@pytest.mark.parametrize(
    ("select", "expected"), [("1", [*range(10)]), ("not(eq(n,5))", [0, 1, 2, 3, 4, 4, 6, 7, 8, 9])]
)
def test_a_change_of_size_on_the_way_does_not_break_the_frames(
    make: Make, tmp_path: Path, select: str, expected: list[int]
) -> None:
    codec = ("-c:v", "libx264", "-bf", "0", "-vf", f"select='{select}'", "-fps_mode", "passthrough")
    parts = [make(f"{w}.ts", *codec, frames=10, size=(w, h)) for w, h in ((80, 48), (160, 96))]
    path = tmp_path / "both.ts"
    path.write_bytes(b"".join(part.read_bytes() for part in parts))
    source = open_source(path)
    assert (source.info.width, source.info.height) == (80, 48)
    assert numbers_of(source) == [*expected, *expected]


@pytest.mark.parametrize(
    ("start", "end", "first", "stop"),
    [
        (0.0, None, 0, 60),
        (1.0, None, 25, 60),
        (1.0, 1.2, 25, 30),
        (0.999, 1.201, 25, 30),
        (1.01, 1.19, 25, 30),
        (0.0, 0.04, 0, 1),
        (2.36, None, 59, 60),
        (2.0, 99.0, 50, 60),
    ],
)
@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.avi"])
def test_a_stretch_is_exact_to_the_frame(
    make: Make, name: str, start: float, end: float | None, first: int, stop: int
) -> None:
    source = open_source(make(name, frames=60), start=start, end=end)
    assert numbers_of(source) == list(range(first, stop))
    assert source.info.frames == stop - first
    assert source.info.start == pytest.approx(first / 25)


@pytest.mark.parametrize(
    "name_and_codec",
    [
        ("long.mp4", ("libx264", "-pix_fmt", "yuv420p")),
        ("long.mov", ("libx264", "-bf", "8", "-g", "400", "-pix_fmt", "yuv420p")),
        ("long.mkv", ("libx264", "-bf", "4", "-x264-params", "open-gop=1:keyint=40", "-pix_fmt", "yuv420p")),
        (
            "hevc.mp4",
            ("libx265", "-x265-params", "log-level=error:open-gop=1:keyint=40", "-pix_fmt", "yuv420p"),
        ),
        ("long.webm", ("libvpx-vp9", "-cpu-used", "8", "-deadline", "realtime")),
    ],
)
def test_a_late_start_is_found_without_decoding_all_before(
    make: Make, name_and_codec: tuple[str, tuple[str]]
) -> None:
    name, codec = name_and_codec
    path = make(name, "-c:v", *codec, frames=500, fps="30000/1001")
    whole = numbers_of(open_source(path))
    for first in (300, 333, 421, 499):
        source = open_source(path, start=first * 1001 / 30000)
        assert source._arguments().count("-ss") == 1  # type: ignore[attr-defined]
        assert numbers_of(source) == whole[first:] == list(range(first, 500))
        assert source.warnings == ()


@pytest.mark.parametrize(
    ("start", "end", "words"),
    [
        (5.0, None, "past the end"),
        (1.2, None, "past the end"),
        (0.5, 0.5, "not after"),
        (0.5, 0.2, "not after"),
        (-1.0, None, "not a time"),
        (float("nan"), None, "not a time"),
        (0.0, float("nan"), "not a time"),
        (0.0, 0.001, "no frame"),
    ],
)
def test_a_stretch_that_makes_no_sense_is_refused(
    make: Make, start: float, end: float | None, words: str
) -> None:
    path = make("a.mp4")
    with pytest.raises(UsageError, match=words):
        open_source(path, start=start, end=end)


def test_sound_is_noticed(make: Make, tmp_path: Path) -> None:
    silent, path = make("a.mp4"), tmp_path / "sound.mp4"
    ffmpeg("-i", silent, "-f", "lavfi", "-i", "sine=duration=1", "-c:v", "copy", path)
    assert not open_source(silent).info.has_audio
    assert open_source(path).info.has_audio
    assert not open_source(path, fps=Fraction(5)).info.has_audio


def test_a_cover_picture_is_no_video(tmp_path: Path) -> None:
    cover, path = tmp_path / "cover.png", tmp_path / "song.mp3"
    ffmpeg("-f", "lavfi", "-i", "color=red:s=32x32", "-frames:v", "1", cover)
    ffmpeg(
        "-f", "lavfi", "-i", "sine=duration=1", "-i", cover, "-map", "0", "-map", "1", "-c:v", "copy", path
    )
    with pytest.raises(InputError, match="holds no video, only sound"):
        open_source(path)


def bad_inputs(folder: Path) -> dict[str, tuple[Path, str]]:
    """Files that cannot be read, and a word of what is said of each."""
    files = {name: folder / name for name in ("empty.mp4", "text.mp4", "noise.mp4", "pipe.mp4")}
    files["empty.mp4"].touch()
    files["text.mp4"].write_text("This is no video.\n" * 50)
    files["noise.mp4"].write_bytes(np.random.default_rng(0).bytes(50_000))
    return {
        "missing": (folder / "missing.mp4", "does not exist"),
        "below a file": (files["empty.mp4"] / "x.mp4", "cannot be read"),
        "empty": (files["empty.mp4"], "is empty"),
        "text": (files["text.mp4"], "is not a video"),
        "noise": (files["noise.mp4"], "video"),
    }


@pytest.mark.parametrize("case", ["missing", "below a file", "empty", "text", "noise"])
def test_what_is_no_video_is_named_in_one_line(tmp_path: Path, case: str) -> None:
    path, words = bad_inputs(tmp_path)[case]
    with pytest.raises(InputError, match=words) as caught:
        open_source(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_file_without_permission_is_named(make: Make) -> None:
    path = make("secret.mp4")
    path.chmod(0)
    for folder in (path.parent, path.parent.parent, path.parent.parent.parent):
        folder.chmod(0o755)
    program = f"""
import os
if os.getuid() == 0:
    os.setuid(65534)
from pathlib import Path
from ifsvideo.errors import InputError
from ifsvideo.video.probe import _check_readable
try:
    _check_readable(Path({str(path)!r}))
except InputError as error:
    print(error)
"""
    preloaded = "import ifsvideo.video.probe\n" + program  # the package may lie where only root reads
    done = subprocess.run([sys.executable, "-c", preloaded], capture_output=True, text=True, check=True)
    assert "no permission" in done.stdout


def test_an_index_that_is_missing_is_named(make: Make) -> None:
    path = make("whole.mp4", frames=200)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(InputError, match="cut off"):
        open_source(path)


def test_missing_frames_are_told_and_the_rest_is_read(make: Make) -> None:
    path = make("part.mp4", *LOSSLESS, "-movflags", "+faststart", frames=200)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    source = open_source(path)
    numbers = numbers_of(source)
    assert 50 < len(numbers) < 200
    assert numbers[:50] == list(range(50))
    (warning,) = source.warnings
    assert f"only {len(numbers)} of 200 frames" in warning
    assert numbers_of(source) == numbers
    assert len(source.warnings) == 1
    with pytest.raises(UsageError, match="past the end"):
        list(open_source(path, start=199 / 25).frames())


def test_stopping_early_leaves_no_process(make: Make) -> None:
    before = children()
    source = open_source(make("a.mp4", frames=600, size=(320, 240)))
    with closing(source.frames()) as frames:
        next(frames)
        assert len(children() - before) == 1
    assert children() == before
    frames = source.frames()
    next(frames)
    del frames
    gc.collect()
    assert children() == before


def interrupted(source: FrameSource, error: type[BaseException]) -> None:
    """Read one frame and fail."""
    with closing(source.frames()) as frames:
        next(frames)
        raise error


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_exception_leaves_no_process(make: Make, error: type[BaseException]) -> None:
    before = children()
    source = open_source(make("a.mp4", frames=600, size=(320, 240)))
    with pytest.raises(error):
        interrupted(source, error)
    assert children() == before


def test_a_killed_decoder_is_no_end_of_the_file(make: Make) -> None:
    before = children()
    source = open_source(make("a.mp4", frames=600, size=(320, 240)))
    frames = source.frames()
    next(frames)
    (child,) = children() - before
    os.kill(child, 9)
    with pytest.raises(IfsVideoError, match="killed") as caught:
        list(frames)
    assert caught.value.exit_status == 1
    assert children() == before


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("62.5", 62.5),
        ("1:02.5", 62.5),
        ("0:01:02.5", 62.5),
        ("1:00:00", 3600.0),
        ("0", 0.0),
        (".5", 0.5),
        ("90", 90.0),
    ],
)
def test_times_are_parsed(text: str, seconds: float) -> None:
    assert parse_time(text) == seconds


@pytest.mark.parametrize(
    "text", ["", "-1", "nan", "inf", "1:60", "1:99:00", "1:2:3:4", "1,5", "abc", "1:", ":5", "1e3"]
)
def test_other_times_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="not a time"):
        parse_time(text)


@pytest.mark.skipif(not ODD.is_dir(), reason="the odd clips are not at hand")
@pytest.mark.parametrize(
    ("name", "size", "fps", "frames"),
    [
        ("dash_2s_raw_elementary.h264", (640, 352), "30000/1001", 60),
        ("dash_gray.mp4", (640, 360), "30", 90),
        ("dash_hevc_main10.mp4", (640, 360), "30", 150),
        ("dash_odd_319x179_yuv444.mp4", (319, 179), "30", 90),
        ("dash_rotmeta90.mp4", (360, 640), "30", 120),
        ("dash_vfr.mp4", (640, 360), "30", 515),
        ("one_frame.mp4", (640, 360), "30", 1),
        ("phone_h263_vfr_nonsquare.3gp", (352, 288), "30000/1001", 154),
        ("raw_bgr24_48x48_ABORTS_OPENCV.avi", (48, 48), "15", 51),
        ("rot90_3frames.mov", (320, 568), "30", 3),
        ("tiny_50x50_4frames.mov", (50, 50), "32", 4),
        ("truncated_28of50.mp4", (1280, 720), "10", 49),
        ("two_frames.mp4", (640, 360), "30", 2),
    ],
)
def test_odd_clips_from_the_wild(name: str, size: tuple[int, int], fps: str, frames: int) -> None:
    source = open_source(ODD / name)
    assert (source.info.width, source.info.height) == size
    assert source.info.fps == Fraction(fps)
    assert abs(sum(1 for _ in source.frames()) - frames) <= (name == "truncated_28of50.mp4")
    assert bool(source.warnings) == (name == "truncated_28of50.mp4")


@pytest.mark.skipif(not ODD.is_dir(), reason="the odd clips are not at hand")
@pytest.mark.parametrize("name", ["audio_only.mp4", "empty_0byte.mp4", "truncated_download.mp4"])
def test_unreadable_clips_from_the_wild(name: str) -> None:
    with pytest.raises(InputError):
        open_source(ODD / name)


def test_a_script_may_end_in_the_middle_of_a_video(tmp_path: Path) -> None:
    clip = encode(tmp_path / "clip.mp4", pictures(1) * 300)
    script = "import sys, pathlib, ifsvideo.video as v; source = v.open_source(pathlib.Path(sys.argv[1]));"
    script += "frames = source.frames(); next(frames); print('seen')"
    done = subprocess.run(
        [sys.executable, "-c", script, clip], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "seen\n", "")

"""Tiny clips made on the spot, and doors to the command."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"
FFMPEG = imageio_ffmpeg.get_ffmpeg_exe()
WIDTH, HEIGHT, FPS = 160, 120, 20


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder of real clips and data sets; the test is skipped where it is not there."""
    if not SHARED.is_dir():
        pytest.skip("the folder of real clips is not here")
    return SHARED


def texture(height: int, width: int, seed: int) -> np.ndarray:
    """Blotches with corners, (H, W, 3) uint8."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(40, 216, (height // 8 + 1, width // 8 + 1, 3), dtype=np.uint8)
    return np.ascontiguousarray(coarse.repeat(8, axis=0).repeat(8, axis=1)[:height, :width])


def pictures(frames: int, width: int = WIDTH, height: int = HEIGHT) -> list[np.ndarray]:
    """A textured wall that the camera passes, and a patch before it that goes the other way."""
    wall = texture(height, width + 2 * frames, 1)
    patch = texture(height // 3, width // 4, 2)
    images = []
    for frame in range(frames):
        image = wall[:, 2 * frame : 2 * frame + width].copy()
        left = max(0, width // 8 + 3 * frame) % (width - patch.shape[1])
        image[height // 3 : height // 3 + patch.shape[0], left : left + patch.shape[1]] = patch
        images.append(image)
    return images


def encode(path: Path, images: list[np.ndarray], *options: str) -> Path:
    """Write images as a video with ffmpeg."""
    height, width = images[0].shape[:2]
    command = [FFMPEG, "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    command += ["-r", str(FPS), "-i", "-", "-pix_fmt", "yuv420p", *options, str(path)]
    subprocess.run(command, input=b"".join(image.tobytes() for image in images), check=True)
    return path


def tone(path: Path, seconds: float) -> Path:
    """A file of sound alone."""
    source = f"aevalsrc='0.3*sin(6283*t)':d={seconds}:s=44100"
    subprocess.run([FFMPEG, "-v", "error", "-f", "lavfi", "-i", source, str(path)], check=True)
    return path


@pytest.fixture(scope="session")
def clips(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Clips that work, by name."""
    folder = tmp_path_factory.mktemp("clips")
    scene = pictures(24)
    return {
        "plain": encode(folder / "plain.mp4", scene),
        "one": encode(folder / "one.mp4", scene[:1]),
        "two": encode(folder / "two.mp4", scene[:2]),
        "white": encode(folder / "white.mp4", [np.full_like(scene[0], 255)] * 5),
    }


@pytest.fixture
def clip(clips: dict[str, Path], tmp_path: Path) -> Path:
    """A clip of 24 frames, alone in a folder of its own."""
    return Path(shutil.copy(clips["plain"], tmp_path / "clip.mp4"))


Command = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def command(tmp_path: Path) -> Command:
    """Runs ``python -m ifsvideo`` in a process of its own, in the test's folder."""

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-m", "ifsvideo", *map(str, arguments)]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        return subprocess.run(
            line, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False
        )

    return run


def decoded(path: Path) -> tuple[int, tuple[int, int], float]:
    """Frames that ffmpeg decodes of a video, their size, and their rate."""
    run = subprocess.run(
        [FFMPEG, "-v", "error", "-i", path, "-map", "0:v", "-f", "framecrc", "-"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stderr == ""
    told = dict(line[1:].split(" 0: ") for line in run.stdout.splitlines() if " 0: " in line)
    width, height = told["dimensions"].split("x")
    frames = sum(line.startswith("0,") for line in run.stdout.splitlines())
    return frames, (int(width), int(height)), float(1 / Fraction(told["tb"].strip()))


def children_naming(text: str) -> list[str]:
    """Command lines of the running processes that name a path: orphans, when nothing should run."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = entry.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if text in line and int(entry.parent.name) != os.getpid():
            found.append(line)
    return found

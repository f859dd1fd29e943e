"""The floor of `throughput`: what decoding, tracking and encoding cost by themselves. Frozen: figures of one
version are compared with those of another.

rgb24 from an ffmpeg pipe; grey by OpenCV; corners every 10th frame; Lucas-Kanade forward and backward, 21x21,
3 levels, OpenCV's default threads; the frame to an ffmpeg pipe. No drawing, no segmentation.
"""

from __future__ import annotations

import subprocess
import time
from dataclasses import dataclass

import cv2
import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray

Grey = NDArray[np.uint8]
Points = NDArray[np.float32]

CORNERS_EVERY = 10
ENCODER = ("-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt", "yuv420p")


@dataclass(frozen=True)
class Floor:
    """One run: the clip, its size and rate, points, and where the video goes; None leaves encoding out."""

    clip: str
    width: int
    height: int
    fps: str
    points: int
    output: str | None


def run(task: Floor) -> tuple[int, float]:
    """Frames, and seconds from the start of the decoder to the end of the encoder."""
    ffmpeg = imageio_ffmpeg.get_ffmpeg_exe()
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24"]
    begun = time.perf_counter()
    decode = [ffmpeg, "-v", "error", "-nostdin", "-i", task.clip, "-map", "0:V:0", *raw, "-"]
    decoder = subprocess.Popen(decode, stdout=subprocess.PIPE)
    encoder = None
    if task.output is not None:
        shape = ["-video_size", f"{task.width}x{task.height}", "-framerate", task.fps]
        encode = [ffmpeg, "-v", "error", *raw, *shape, "-i", "pipe:0", *ENCODER, "-y", task.output]
        encoder = subprocess.Popen(encode, stdin=subprocess.PIPE)
    assert decoder.stdout is not None
    frames = 0
    before: Grey | None = None
    points: Points = np.empty((0, 1, 2), np.float32)
    while True:
        image = np.empty((task.height, task.width, 3), np.uint8)
        if decoder.stdout.readinto(image.data.cast("B")) != image.nbytes:  # type: ignore[attr-defined]
            break
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
        if before is not None and len(points):
            moved, found = _klt(before, grey, points)
            _klt(grey, before, moved)
            points = moved[found]
        if frames % CORNERS_EVERY == 0:
            corners = cv2.goodFeaturesToTrack(grey, task.points, 0.01, 5)
            points = points[:0] if corners is None else np.asarray(corners, np.float32)
        if encoder is not None and encoder.stdin is not None:
            encoder.stdin.write(image.data.cast("B"))
        before, frames = grey, frames + 1
    decoder.stdout.close()
    decoder.wait()
    if encoder is not None and encoder.stdin is not None:
        encoder.stdin.close()
        encoder.wait()
    return frames, time.perf_counter() - begun


def _klt(before: Grey, after: Grey, points: Points) -> tuple[Points, NDArray[np.bool_]]:
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        before, after, points, np.empty_like(points), winSize=(21, 21), maxLevel=3
    )
    return np.asarray(moved, np.float32), np.asarray(found).ravel() == 1

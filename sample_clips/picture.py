"""Make the README's moving picture, ``overlay.webp``, out of the overlays of two sample clips.

    python sample_clips/picture.py [-o FILE]

Runs ifsvideo as a user would, so it is made anew when what ifsvideo finds or draws has changed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import cv2
import imageio.v3 as iio
import numpy as np

from ifsvideo import OverlayRenderer, Pipeline, Scene
from ifsvideo.types import Image

HERE = Path(__file__).resolve().parent
CLIPS = {"dashcam_drive": (1.0, 4.6), "follow_car": (0.6, 3.4)}
"""Which stretch of which clip is shown, seconds."""
WIDTH, HEIGHT = 512, 288
STEP = 2
"""Every second frame is enough for the eye, and halves the file."""
QUALITY = 55
"""Of WebP, 0 to 100; more and the file grows beyond what a page should load."""


class Keeper:
    """A renderer that draws the usual overlay and keeps some of the pictures, smaller."""

    def __init__(self, start: float, end: float) -> None:
        self.kept: list[Image] = []
        self._start, self._end = start, end
        self._overlay = OverlayRenderer()

    def draw(self, image: Image, scene: Scene) -> Image:
        """As of `ifsvideo.Renderer`."""
        drawn = self._overlay.draw(image, scene)
        if self._start <= scene.time_s < self._end and scene.frame % STEP == 0:
            small = cv2.resize(drawn, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
            self.kept.append(np.asarray(small, dtype=np.uint8))
        return drawn


def main() -> int:
    """Write the picture; prints where it is and how large."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=HERE / "overlay.webp", metavar="FILE")
    options = parser.parse_args()
    pictures: list[Image] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, (start, end) in CLIPS.items():
            keeper = Keeper(start, end)
            result = Pipeline(renderer=keeper).run(HERE / f"{name}.mp4", Path(folder) / f"{name}.mp4")
            pictures += keeper.kept
    milliseconds = round(1000 * STEP / result.info.fps)
    iio.imwrite(
        options.output, pictures, plugin="pillow", duration=milliseconds, loop=0, quality=QUALITY, method=6
    )
    print(f"{options.output}: {len(pictures)} pictures, {options.output.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Make the README's picture of a page, ``page.webp``, out of the report of a sample clip.

    python sample_clips/page_picture.py [-o FILE]

Runs ifsvideo as a user would, and needs a Chromium to show what it wrote.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import imageio.v3 as iio

from ifsvideo import Pipeline, Products

HERE = Path(__file__).resolve().parent
CLIP, MOMENT = "dashcam_drive", 3.2
"""What is shown, and when, seconds."""
WIDTH, HEIGHT, SHRINK = 1060, 1640, 0.7
"""Of the window, pixels, and of the picture beside it."""
QUALITY = 70
FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --hide-scrollbars --virtual-time-budget=4000"
)


def main() -> int:
    """Write the picture; prints where it is and how large."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=HERE / "page.webp", metavar="FILE")
    options = parser.parse_args()
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        parser.error("no chromium is installed")
    with tempfile.TemporaryDirectory() as folder:
        page, shot = Path(folder) / "report.html", Path(folder) / "shot.png"
        Pipeline().run(HERE / f"{CLIP}.mp4", products=Products(report=page))
        window = [f"--window-size={WIDTH},{HEIGHT}", f"--user-data-dir={folder}/profile"]
        command = [browser, *FLAGS.split(), *window, f"--screenshot={shot}", f"{page.as_uri()}#t={MOMENT}"]
        subprocess.run(command, check=True, capture_output=True)
        picture = iio.imread(shot)[..., :3]
    small = cv2.resize(picture, None, fx=SHRINK, fy=SHRINK, interpolation=cv2.INTER_AREA)
    iio.imwrite(options.output, small, plugin="pillow", quality=QUALITY, method=6)
    print(f"{options.output}: {options.output.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())

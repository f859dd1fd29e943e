"""Render the sample clips and their truth: ``python sample_clips/render.py [NAME ...] [-o DIR]``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
from renderer.scenes import SCENES
from renderer.store import write


def main() -> int:
    """Render the clips named on the command line, all four unless told."""
    here = Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"any of {', '.join(SCENES)}; default: all")
    parser.add_argument(
        "-o", "--output", type=Path, default=here, metavar="DIR", help="where to (default: here)"
    )
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in SCENES]
    if unknown:
        parser.error(f"no clip named {unknown[0]}: choose from {', '.join(SCENES)}")
    if not options.output.is_dir():
        parser.error(f"{options.output} is no folder: make it first")
    cv2.setNumThreads(1)
    for name in options.names or SCENES:
        print(write(SCENES[name](), options.output))
    return 0


if __name__ == "__main__":
    sys.exit(main())

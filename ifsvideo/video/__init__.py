"""Reading and writing through ffmpeg; image folders."""

from ifsvideo.video.animation import ENDINGS as ANIMATIONS
from ifsvideo.video.animation import AnimationWriter
from ifsvideo.video.opening import open_source
from ifsvideo.video.source import FrameSource
from ifsvideo.video.timecode import parse_time
from ifsvideo.video.writer import FORMATS, VideoWriter, check_output

__all__ = [
    "ANIMATIONS",
    "FORMATS",
    "AnimationWriter",
    "FrameSource",
    "VideoWriter",
    "check_output",
    "open_source",
    "parse_time",
]

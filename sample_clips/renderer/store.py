"""Writing a clip and the truth beside it."""

from __future__ import annotations

from pathlib import Path

import imageio_ffmpeg
import numpy as np

from renderer.film import SIZE, Scene, shoot
from renderer.geometry import Array, Picture


def write(scene: Scene, folder: Path) -> Path:
    """Render a scene to ``NAME.mp4`` and ``NAME_truth.npz`` in ``folder``; returns the clip's path."""
    clip = folder / f"{scene.name}.mp4"
    # One x264 thread and no version string: the same ffmpeg gives the same bytes.
    sink = imageio_ffmpeg.write_frames(
        str(clip),
        SIZE,
        fps=scene.fps,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=1,
        quality=None,
        output_params=f"-crf {scene.crf} -preset slow -threads 1 -movflags +faststart "
        "-fflags +bitexact -flags:v +bitexact".split(),
    )
    sink.send(None)
    masks, reach = [], []
    for frame in shoot(scene):
        sink.send(np.ascontiguousarray(frame.picture).tobytes())
        masks.append(frame.labels)
        reach.append(np.percentile(frame.depth[frame.depth > 0], [1, 99]))
    sink.close()
    _write_truth(scene, folder / f"{scene.name}_truth.npz", np.array(masks), np.array(reach))
    return clip


def _write_truth(scene: Scene, path: Path, masks: Picture, reach: Array) -> None:
    times = np.arange(scene.frames) / scene.fps
    movers = sorted((b for b in scene.bodies if b.pose is not None), key=lambda b: b.label)
    poses = [[b.pose(t) for b in movers if b.pose is not None] for t in times]
    np.savez_compressed(
        path,
        masks=masks,
        K=scene.K,
        camera=np.array([np.linalg.inv(scene.camera(t)) for t in times]),
        objects=np.array([b.name for b in movers], dtype=str),
        poses=np.array(poses).reshape(scene.frames, len(movers), 4, 4),
        depth_range=reach,
    )

"""Truth and result of a clip in one video, to look at."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.benchmark.comparison import Method, Trial
from ifsvideo.benchmark.datasets import LabelledSequence, frames_of
from ifsvideo.benchmark.runner import Run, in_processes
from ifsvideo.config import OverlayConfig
from ifsvideo.output.overlay import OverlayRenderer
from ifsvideo.output.scenes import Scenes
from ifsvideo.output.styles import look_of
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import FramePoints, LabelTable, Tracks
from ifsvideo.video import FrameSource, VideoWriter, open_source


@dataclass(frozen=True)
class PointsOverlay:
    """Labelled tracks, to be segmented once and drawn over their frames."""

    run: Run
    frames: Path
    file: Path

    def __str__(self) -> str:
        return str(self.run)


def draw_all(
    sequences: Sequence[LabelledSequence], folder: Path, method: Method, trial: Trial, overlay: Path
) -> None:
    """Draw truth and what the first run finds of the tracks of every sequence.

    Parameters
    ----------
    folder : Path
        Where the data set with its frames lies.
    overlay : Path
        Folder into which the clips go.
    """
    tasks = [
        PointsOverlay(
            Run(
                sequence,
                method.factory,
                trial.seed,
                sequence.motions if method.motions_known else None,
                trial.perturbation,
            ),
            frames_of(folder, sequence.name),
            overlay_file(overlay, sequence.name),
        )
        for sequence in sequences
    ]
    in_processes(draw_points, tasks, trial.jobs, trial.quiet, "drawing")


def draw_points(task: PointsOverlay) -> None:
    """Segment labelled tracks and write the clip with truth and result."""
    run = task.run
    tracks = run.perturbation.apply(run.sequence.tracks, run.seed)
    labels = run.factory(run.seed).segment(tracks, run.motions).labels
    truth = table_of(tracks, run.sequence.truth - 1)
    write_side_by_side(task.file, open_source(task.frames), truth, table_of(tracks, labels))


def overlay_file(folder: Path, name: str) -> Path:
    """The clip of a sequence in the folder that the user named."""
    return folder / f"{name}.mp4"


def table_of(tracks: Tracks, labels: NDArray[np.integer[Any]]) -> LabelTable:
    """The observations of tracks as rows.

    Parameters
    ----------
    tracks : Tracks
        ``ids`` ascending.
    labels : (P,) int
        As in `ifsvideo.types.Segmentation`.
    """
    rows = Trajectories.from_tracks(tracks)
    of_row = np.broadcast_to(labels, tracks.visible.shape)[tracks.visible].astype(np.int32)
    return LabelTable(rows.frame, rows.ids, rows.xy, of_row, rows.frames)


def write_side_by_side(path: Path, source: FrameSource, truth: LabelTable, result: LabelTable) -> None:
    """Draw the truth on the left and the result on the right; above and below where pictures are wide.

    Parameters
    ----------
    path : Path
        Video to be written, .mp4.
    source : FrameSource
        The clip.
    truth, result : LabelTable
        As many frames each as the clip has.

    Raises
    ------
    InputError
        If a frame cannot be read.
    OutputError
        If the video cannot be written.
    """
    renderer = OverlayRenderer(OverlayConfig())
    info = source.info
    below = info.width > 1.5 * info.height
    both = replace(info, height=2 * info.height) if below else replace(info, width=2 * info.width)
    tables = (truth, result)
    scenes = [Scenes(info, look_of(renderer.config).trail_s) for _ in tables]
    with VideoWriter(path, both) as writer, closing(source.frames()) as frames:
        for frame, image in enumerate(frames):
            panels = []
            for table, seen in zip(tables, scenes, strict=True):
                rows = table.at(frame)
                points = FramePoints(table.ids[rows], table.xy[rows])
                panels.append(renderer.draw(image, seen.next(points, table.labels[rows])))
            writer.write(np.concatenate(panels, axis=0 if below else 1))

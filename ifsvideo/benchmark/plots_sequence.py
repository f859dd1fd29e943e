"""Pictures of one sequence: its points after each stage, and the shear between two segments."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ifsvideo.benchmark.comparison import Method, Trial
from ifsvideo.benchmark.datasets import LabelledSequence
from ifsvideo.benchmark.stages import (
    Groups,
    Pair,
    anchors,
    base_frame,
    groups_by_stage,
    pairs_of_segments,
)
from ifsvideo.types import Segmentation, Tracks

# Okabe and Ito's colours that show on white; where they are used up, the next marker begins.
_COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_MARKERS = "os^Dv<>P*ph"
_BACKGROUND, _NOWHERE = "#9a9a9a", "#000000"
_STYLES = {
    "between": ("#000000", "-"),
    "inside first": (_COLOURS[0], "--"),
    "inside second": (_COLOURS[1], ":"),
}


def of_sequence(sequence: LabelledSequence, method: Method, trial: Trial) -> dict[str, Figure]:
    """The pictures of one sequence, segmented by the trial's first seed, by file name."""
    tracks = trial.perturbation.apply(sequence.tracks, trial.seed)
    told = sequence.motions if method.motions_known else None
    segmentation = method.factory(trial.seed).segment(tracks, told)
    name = sequence.name.replace("/", "_")
    figures = {f"{name}_stages.png": draw_stages(sequence, tracks, segmentation)}
    pairs = pairs_of_segments(tracks, segmentation)
    if pairs:  # a single segment has no other to be sheared against
        figures[f"{name}_shear.png"] = draw_pairs(sequence.name, tracks, pairs)
    return figures


def draw_stages(sequence: LabelledSequence, tracks: Tracks, segmentation: Segmentation) -> Figure:
    """The points after each stage of the segmenter, where they lie in the frame that sees most of them."""
    stages = groups_by_stage(segmentation, sequence.truth)
    place = anchors(tracks)
    figure = Figure(figsize=(13, 1 + 2 * (0.4 + 13 / 3 * _slope(place, tracks.size))), layout="constrained")
    panels = figure.subplots(2, 3).ravel()
    for axes, (name, groups) in zip(panels, stages.items(), strict=False):
        _points(axes, place, groups, tracks.size)
        axes.set_title(f"{name} ({_counted(groups)})", fontsize=10)
    for axes in panels[len(stages) :]:
        axes.set_axis_off()
    legend = "grey: static or background, black cross: no part of the stage"
    figure.suptitle(f"{sequence.name}, frame {base_frame(tracks)} ({legend})")
    return figure


def _counted(groups: Groups) -> str:
    count = len(np.unique(groups[groups >= 0]))
    return f"{count} group{'' if count == 1 else 's'}"


def _points(axes: Axes, place: NDArray[np.float64], groups: Groups, size: tuple[int, int] | None) -> None:
    """Points in the colours and markers of their groups, in picture coordinates."""
    for group in np.unique(groups):
        x, y = place[groups == group].T
        if group < 0:
            axes.plot(x, y, "x", color=_NOWHERE, markersize=4)
        elif group == 0:
            axes.plot(x, y, "o", color=_BACKGROUND, markersize=3)
        else:
            turn, colour = divmod(int(group) - 1, len(_COLOURS))
            axes.plot(x, y, _MARKERS[turn % len(_MARKERS)], color=_COLOURS[colour], markersize=4)
    _as_picture(axes, place, size)


def _as_picture(axes: Axes, place: NDArray[np.float64], size: tuple[int, int] | None) -> None:
    """Axes of the picture, y down."""
    low, high = _extent(place, size)
    axes.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]), aspect="equal", xticks=[], yticks=[])


def _extent(
    place: NDArray[np.float64], size: tuple[int, int] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the picture; of what the points span where nobody told its size, or where they leave it."""
    low, high = np.nanmin(place, axis=0) - 10, np.nanmax(place, axis=0) + 10
    return (np.minimum(low, 0), np.maximum(high, size)) if size else (low, high)


def _slope(place: NDArray[np.float64], size: tuple[int, int] | None) -> float:
    """Height of the picture over its width, within what fits a screen."""
    low, high = _extent(place, size)
    width, height = high - low
    return float(np.clip(height / width, 0.25, 1.5))


def draw_pairs(name: str, tracks: Tracks, pairs: list[Pair]) -> Figure:
    """Two segments at the beginning and the end, and their cumulative shear and stretch (thesis Fig. 3.5)."""
    height = max(2.6, 0.6 + 15 / 4 * _slope(tracks.xy.reshape(-1, 2), tracks.size))
    figure = Figure(figsize=(15, 0.8 + height * len(pairs)), layout="constrained")
    rows = figure.subplots(len(pairs), 4, squeeze=False)
    for row, pair in zip(rows, pairs, strict=True):
        _pair_at(row[0], tracks, pair, 0, f"segments {pair.title}, frame 0")
        _pair_at(row[1], tracks, pair, tracks.frames - 1, f"frame {tracks.frames - 1}")
        _curves(row[2], pair.shear, "cumulative shear, degrees")
        _curves(row[3], pair.stretch, "cumulative stretch, px")
    _same_height(rows[:, 2])
    _same_height(rows[:, 3])
    rows[0, 2].legend(frameon=False)
    figure.suptitle(
        f"{name}: mean change of the edges between two segments, and inside them, summed over frames"
    )
    return figure


def _pair_at(axes: Axes, tracks: Tracks, pair: Pair, frame: int, title: str) -> None:
    xy = tracks.xy[frame]
    axes.plot(*xy.T, ".", color="#cfcfcf", markersize=3)
    for place, members in enumerate(pair.members):
        axes.plot(
            *xy[members].T,
            _MARKERS[place],
            color=_COLOURS[place],
            markersize=4,
            label="first" if not place else "second",
        )
    axes.set_title(title, fontsize=10)
    axes.legend(loc="lower right", fontsize=8)
    _as_picture(axes, tracks.xy.reshape(-1, 2), tracks.size)


def _curves(axes: Axes, curves: Mapping[str, NDArray[np.float64]], label: str) -> None:
    for name, curve in curves.items():
        colour, style = _STYLES[name]
        axes.plot(np.arange(1, len(curve) + 1), curve, style, color=colour, label=name)
    axes.set_xlabel("frame")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title(label, fontsize=10)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _same_height(column: NDArray[np.object_]) -> None:
    """One scale for what is to be compared."""
    top = max(axes.get_ylim()[1] for axes in column)
    for axes in column:
        axes.set_ylim(0, top)

"""The benchmark's pictures; needs matplotlib, the extra ``plot``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ifsvideo.benchmark.options import made_folder
from ifsvideo.benchmark.runner import Report
from ifsvideo.benchmark.table import heading
from ifsvideo.output.atomic import output_error, replacing

# Okabe and Ito, "Color Universal Design" (2008); each goes with a marker or a hatching of its own.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_MARKERS = "os^Dv<>"
_HATCHES = ("", "///", "...", "xx")
_BIN = 5.0
"""Width of a bar of the histogram, per cent."""
_USUAL_WORST = 45.0
"""The histogram reaches so far, per cent, even where all is well, so that pictures compare."""


def write(figures: Mapping[str, Figure], folder: Path) -> list[Path]:
    """Write figures as PNG files of those names; returns their paths.

    Parameters
    ----------
    figures : mapping of file name to Figure
    folder : Path
        Made where it is missing.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    made_folder(folder)
    return [_save(figure, folder / name) for name, figure in figures.items()]


def _save(figure: Figure, file: Path) -> Path:
    with replacing(file) as part:
        try:
            figure.savefig(part, format="png", dpi=120)
        except OSError as fault:
            raise output_error(file, fault) from fault
    return file


def of_report(report: Report) -> dict[str, Figure]:
    """The pictures of a whole data set, by file name.

    Parameters
    ----------
    report : Report
        As of `comparison.compare`, with "dataset", "configuration" and "noise_curve".
    """
    return {
        "errors.png": error_histogram(report),
        "noise.png": noise_curve(report),
        "motions.png": motion_counts(report),
    }


def _named(method: Report) -> str:
    return f"{method['method']} (number of motions {'given' if method['motions_known'] else 'found'})"


def error_histogram(report: Report) -> Figure:
    """Sequences over their error, by number of motions (thesis Fig. 4.1); a row for each method."""
    methods = (report, *report["peers"])
    figure = Figure(figsize=(8, 1.2 + 2.6 * len(methods)), layout="constrained")
    rows = figure.subplots(len(methods), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    worst = max(row["error"] for method in methods for row in method["sequences"])
    edges = np.arange(0, _BIN * (max(worst, _USUAL_WORST) // _BIN + 2), _BIN)
    for axes, method in zip(rows, methods, strict=True):
        _histogram(axes, method, edges)
    rows[0].legend(frameon=False)
    rows[-1].set_xlabel(f"misclassified points of a sequence, mean over runs, % (bars of {_BIN:g})")
    figure.suptitle(heading(report))
    return figure


def _histogram(axes: Axes, method: Report, edges: np.ndarray) -> None:
    """Stacked bars with their totals."""
    below = np.zeros(len(edges) - 1)
    for place, motions in enumerate(sorted({row["motions"] for row in method["sequences"]})):
        errors = [row["error"] for row in method["sequences"] if row["motions"] == motions]
        counts = np.histogram(errors, edges)[0]
        axes.bar(
            edges[:-1],
            counts,
            _BIN,
            below,
            align="edge",
            color=_COLOURS[place % len(_COLOURS)],
            hatch=_HATCHES[place % len(_HATCHES)],
            edgecolor="white",
            label=f"{motions} motions",
        )
        below += counts
    for left, total in zip(edges[:-1], below, strict=True):
        if total:
            axes.text(left + _BIN / 2, total, f"{total:.0f}", ha="center", va="bottom")
    axes.margins(y=0.15)
    axes.set_xlim(0, edges[-1])
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("sequences")
    axes.set_title(
        f"{_named(method)}: mean {method['error']['all']:.2f} %, median {method['median']:.2f} %", fontsize=10
    )
    axes.spines[["top", "right"]].set_visible(False)


def noise_curve(report: Report) -> Figure:
    """Error over the noise added to the tracks (thesis Fig. 4.2), all sequences and by number of motions."""
    curve = report["noise_curve"]
    levels = sorted({one["noise"] for one in curve})
    keys = sorted({key for one in curve for key in one["error"]}, key=lambda key: (key != "all", key))
    figure = Figure(figsize=(1.5 + 3.6 * len(keys), 4.2), layout="constrained")
    panels = figure.subplots(1, len(keys), sharey=True, squeeze=False)[0]
    names = list(dict.fromkeys(_named(one) for one in curve))
    for axes, key in zip(panels, keys, strict=True):
        for place, name in enumerate(names):
            own = {one["noise"]: one["error"][key] for one in curve if _named(one) == name}
            style = {"color": _COLOURS[place % len(_COLOURS)], "marker": _MARKERS[place % len(_MARKERS)]}
            axes.plot(range(len(levels)), [own[level] for level in levels], label=name, **style)
        axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
        axes.set_title("all sequences" if key == "all" else f"{key} motions", fontsize=10)
        axes.set_xlabel("noise added, standard deviation, px")
        axes.grid(axis="y", alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylim(bottom=0)
    panels[0].set_ylabel("misclassified points, %")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(heading({**report, "noise": 0}))
    return figure


def motion_counts(report: Report) -> Figure:
    """Estimated against true number of motions, pairs of sequence and run (thesis Fig. 4.3)."""
    pairs = [(row["motions"], found) for row in report["sequences"] for found in row["estimated"]]
    true = sorted({motions for motions, _ in pairs})
    found = list(range(min(map(min, pairs)), max(map(max, pairs)) + 1))
    counts = np.array([[pairs.count((row, column)) for column in found] for row in true])
    shares = 100 * counts / counts.sum(axis=1, keepdims=True)
    figure = Figure(figsize=(max(8, 2.5 + 1.1 * len(found)), 2.4 + 0.9 * len(true)), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(shares, cmap="Blues", vmin=0, vmax=100, aspect="auto")
    for (row, column), count in np.ndenumerate(counts):
        ink = "white" if shares[row, column] > 55 else "black"
        text = f"{count}\n{shares[row, column]:.0f} %"
        right = true[row] == found[column]
        axes.text(
            column, row, text, ha="center", va="center", color=ink, weight="bold" if right else "normal"
        )
    axes.set_xticks(range(len(found)), [str(number) for number in found])
    axes.set_yticks(range(len(true)), [str(number) for number in true])
    axes.set_xlabel("number of motions found (bold: right)")
    axes.set_ylabel("true number")
    figure.colorbar(image, label="% of the row")
    figure.suptitle(f"{heading(report)}\nright in {report['exact_count']:.1f} %", fontsize=10)
    return figure

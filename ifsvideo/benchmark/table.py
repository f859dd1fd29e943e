"""Tables for the screen, made from the report that the JSON file holds too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ifsvideo.benchmark.runner import Report


def align(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Columns of text: names to the left, numbers to the right with two decimals, "-" for None."""
    texts = [list(header), *([_text(cell) for cell in row] for row in rows)]
    widths = [max(len(line[column]) for line in texts) for column in range(len(header))]
    lefts = [any(isinstance(row[column], str) for row in rows) for column in range(len(header))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if left else cell.rjust(width)
            for cell, width, left in zip(line, widths, lefts, strict=True)
        ).rstrip()
        for line in texts
    )


def _text(cell: Any) -> str:
    if cell is None:
        return "-"
    return f"{cell:.2f}" if isinstance(cell, float) else str(cell)


def points(report: Report, by_sequence: bool) -> str:
    """The table of a point data set; a line for each sequence or for each kind."""
    parts = [_sequences(report)] if by_sequence else []
    if report["dataset"] == "hopkins155":
        parts.append(_breakdown(report))
    parts.append(_footer(report))
    return "\n\n".join(parts)


def _breakdown(report: Report) -> str:
    fields = ("kind", "motions", "sequences", "error", "median", "exact_count")
    header = ("kind", "motions", "sequences", "error %", "median %", "exact count %")
    return align(header, [[row[field] for field in fields] for row in report["breakdown"]])


def _sequences(report: Report) -> str:
    header = ("sequence", "motions", "found", "error %", "one motion %", "precision %", "recall %", "seconds")
    moves = report["dataset"] == "kt3dmoseg"
    kept = [name for name in header if moves or name not in ("precision %", "recall %")]
    rows = []
    for row in report["sequences"]:
        found = ",".join(str(count) for count in row["estimated"])
        cells = [row["name"], row["motions"], found, row["error"], row["one_motion"]]
        cells += [row["moves"]["precision"], row["moves"]["recall"]] if moves else []
        rows.append([*cells, row["seconds"]])
    return align(kept, rows)


def _footer(report: Report) -> str:
    """The figures over all sequences, a line each."""
    moves, exact = report["moves"], report["exact_count"]
    by_motions = [f"{key} motions {value:.2f}" for key, value in report["error"].items() if key != "all"]
    told = ", number of motions given" if report["motions_known"] else ""
    lines = [
        f"{report['dataset']}: {len(report['sequences'])} sequences, {report['runs']} runs{told}",
        f"error %: {report['error']['all']:.2f} ({', '.join(by_motions)}), median {report['median']:.2f}, "
        f"std over runs {report['std']:.2f}; all one motion: {report['one_motion']:.2f}",
        f"exact count %: {exact:.1f}   seconds of one run: {report['seconds']:.1f}",
    ]
    if report["dataset"] == "kt3dmoseg":
        lines.append(f"moves: precision % {_text(moves['precision'])}, recall % {_text(moves['recall'])}")
    return "\n".join(lines)


def samples(report: Report) -> str:
    """The table of the sample clips: a line for each clip, then the mean."""
    columns = {
        "clip": "name",
        "found %": "found",
        "false %": "false",
        "undecided %": "undecided",
        "IDF1 %": "idf1",
        "objects": "objects",
        "true": "true_objects",
        "longest false s": "longest_false_s",
        "seconds": "seconds",
    }
    lines = (*report["clips"], {"name": "mean", **report["mean"]})
    rows = [[line[field] for field in columns.values()] for line in lines]
    title = f"samples: {len(report['clips'])} clips, {report['runs']} runs"
    return f"{title}\n\n{align(tuple(columns), rows)}"

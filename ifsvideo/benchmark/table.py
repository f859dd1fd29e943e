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
    """The tables of a point data set: sequences, kinds and numbers of motions, methods side by side."""
    parts = [_sequences(report)] if by_sequence else []
    if len(report["breakdown"]) > 2:  # one kind of one number of motions is the footer's line again
        parts.append(_breakdown(report))
    if report["peers"] or report["published"]:
        parts.append(_methods(report))
    if "noise_curve" in report:
        parts.append(_noise_curve(report["noise_curve"]))
    if "video" in report:
        parts.append(_video(report["video"]))
    parts.append(_footer(report))
    return "\n\n".join(parts)


def _breakdown(report: Report) -> str:
    """A line for each method measured, kind and number of motions."""
    fields = ("kind", "motions", "sequences", "error", "median", "std", "exact_count", "seconds")
    header = (
        "method",
        "kind",
        "motions",
        "sequences",
        "error %",
        "median %",
        "std %",
        "exact count %",
        "seconds",
    )
    kinds = {row["kind"] for row in report["breakdown"]}
    rows = [
        [one["method"], *(_scatter(one, row) if field == "std" else row[field] for field in fields)]
        for one in (report, *report["peers"])
        for row in one["breakdown"]
        if row["kind"] == "all" or len(kinds) > 2
    ]
    return align(header, rows)


def _methods(report: Report) -> str:
    """Methods side by side: measured in this run, then as published."""
    numbers = sorted({key for one in (report, *report["published"]) for key in one["error"]} - {"all"})
    header = ("method", "number of motions", "all %", *(f"{number} motions %" for number in numbers))
    header += ("median %", "std %", "exact count %", "seconds")
    measured = [
        [
            one["method"],
            *_told_and_errors(one, numbers),
            *(one["median"], _scatter(one, one), one["exact_count"], one["seconds"]),
        ]
        for one in (report, *report["peers"])
    ]
    printed = [
        [
            f"{one['method']} (published)",
            *_told_and_errors(one, numbers),
            None,
            one["std"],
            None,
            one["seconds"],
        ]
        for one in report["published"]
    ]
    lines = [align(header, measured + printed)]
    if report["peers"]:
        lines.append("peers: tracks with a gap stay undecided, which counts as wrong")
    if printed:
        lines.append(
            "published: all 155 sequences, complete tracks, no noise added; seconds on machines of their time"
        )
    return "\n".join(lines)


def _told_and_errors(one: Report, numbers: Sequence[str]) -> list[Any]:
    told = "given" if one["motions_known"] else "found"
    return [told, *(one["error"].get(key) for key in ("all", *numbers))]


def _scatter(report: Report, row: Report) -> float | None:
    """Standard deviation over runs; one run has none."""
    deviation: float = row["std"]
    return deviation if report["runs"] > 1 else None


def _noise_curve(curve: Sequence[Report]) -> str:
    """Error of every method against the noise added."""
    numbers = sorted({key for one in curve for key in one["error"]} - {"all"})
    header = (
        "method",
        "noise px",
        "number of motions",
        "all %",
        *(f"{number} motions %" for number in numbers),
    )
    rows = [
        [one["method"], float(one["noise"]), *_told_and_errors(one, numbers), one["exact_count"]]
        for one in curve
    ]
    return align((*header, "exact count %"), rows)


def _sequences(report: Report) -> str:
    """A line for each sequence of the package's own method."""
    header = ["sequence", "motions", "found", "error %", "one motion %"]
    known, moves = "number_known" in report, report["dataset"] == "kt3dmoseg"
    header += ["number known %"] if known else []
    header += ["precision %", "recall %"] if moves else []
    rows = []
    for row in report["sequences"]:
        found = ",".join(str(count) for count in row["estimated"])
        cells = [row["name"], row["motions"], found, row["error"], row["one_motion"]]
        cells += [row["number_known"]] if known else []
        cells += [row["moves"]["precision"], row["moves"]["recall"]] if moves else []
        rows.append([*cells, row["seconds"]])
    return align([*header, "seconds"], rows)


def _video(video: Report) -> str:
    """A line for each clip whose frames the whole program ran on, then all of them."""
    fields = ("name", "error", "precision", "recall", "coverage")
    header = ("whole program on frames", "error %", "precision %", "recall %", "coverage %")
    return align(
        header, [[row[field] for field in fields] for row in (*video["sequences"], {"name": "all", **video})]
    )


def _footer(report: Report) -> str:
    """The figures over all sequences, a line each."""
    floors = f"all one motion: {report['one_motion']:.2f}"
    if "number_known" in report:
        floors += f"; number known, same tree: {report['number_known']:.2f}"
    by_motions = [f"{key} motions {value:.2f}" for key, value in report["error"].items() if key != "all"]
    lines = [
        heading(report),
        f"error %: {report['error']['all']:.2f} ({', '.join(by_motions)}), median {report['median']:.2f}, "
        f"std over runs {_text(_scatter(report, report))}; {floors}",
        f"exact count %: {report['exact_count']:.1f}   seconds of one run: {report['seconds']:.1f}",
    ]
    if report["dataset"] == "kt3dmoseg":
        moves = report["moves"]
        lines.append(f"moves: precision % {_text(moves['precision'])}, recall % {_text(moves['recall'])}")
    labelled, every = (sum(row[key] for row in report["sequences"]) for key in ("labelled", "points"))
    if labelled < every:
        lines.append(f"points counted: {labelled} of {every}; the others have no true label (0)")
    return "\n".join(lines)


def heading(report: Report) -> str:
    """What was measured: data set, size, what the method was told, and what was done to the tracks."""
    runs = "1 run" if report["runs"] == 1 else f"{report['runs']} runs"
    parts = {
        f"configuration {report['configuration']}": report["configuration"] != "default",
        "number of motions given": report["motions_known"],
        f"noise {report['noise']:g} px": report["noise"],
        f"{100 * report['drop']:g} % of the observations dropped": report["drop"],
    }
    conditions = "".join(f", {text}" for text, holds in parts.items() if holds)
    return f"{report['dataset']}: {len(report['sequences'])} sequences, {runs}{conditions}"


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

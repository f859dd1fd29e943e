"""The page that links the reports of a folder."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any

from ifsvideo.output.legend import clock
from ifsvideo.report.page import beside, filled

_KINDS = {
    ".html": "report",
    ".video.mp4": "",
    ".json": "summary",
    ".objects.csv": "objects",
    ".mot.txt": "MOT",
    ".tracks.npz": "tracks",
    ".masks": "masks",
    ".clips": "clips",
    ".mp4": "overlay",
    ".mov": "overlay",
    ".csv": "labels",
}
"""What a file is called, by its ending, the longer ones first; a report's own video is not linked."""


def index_page(clips: Mapping[str, Mapping[str, Any]]) -> str:
    """The page as text.

    Parameters
    ----------
    clips : mapping of name to entry
        As `ifsvideo.ledger.Ledger` keeps them.
    """
    failed = sum("error" in entry for entry in clips.values())
    facts = f"{len(clips)} clip{'s' * (len(clips) != 1)}" + (f", {failed} failed" if failed else "")
    rows = "\n".join(_row(name, entry) for name, entry in clips.items())
    return filled("index.html", {"title": "What moves", "facts": facts, "rows": rows})


def _row(name: str, entry: Mapping[str, Any]) -> str:
    if "error" in entry:
        reason = f'<td colspan="5">failed: {html.escape(entry["error"])}</td>'
        return f'<tr class="failed"><th scope="row">{html.escape(name)}</th>{reason}</tr>'
    links = {_kind(file): file for file in entry["files"]}
    report = links.pop("report", None)
    title = _link(report, name) if report else html.escape(name)
    contact = _contact(entry["contact"], report)
    files = " ".join(_link(file, kind, name) for kind, file in sorted(links.items()) if kind)
    cells = (clock(entry["length_s"]), str(entry["objects"]), str(entry["events"]), contact, files)
    return f'<tr><th scope="row">{title}</th>' + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _contact(shortest: Sequence[float] | None, report: str | None) -> str:
    """The shortest time to contact, and when; a link to that moment."""
    if shortest is None:
        return "–"
    time_s, contact_s = shortest
    moment = f"at {clock(time_s)}"
    if report:
        moment = f'<a href="{html.escape(beside(report))}#t={time_s:g}">{moment}</a>'
    return f"{contact_s:.1f} s {moment}"


def _kind(file: str) -> str:
    """What a file is; empty for what is not linked."""
    return next((kind for ending, kind in _KINDS.items() if file.endswith(ending)), file)


def _link(file: str, text: str, of: str = "") -> str:
    named = f' aria-label="{html.escape(f"{text} of {of}")}"' if of else ""
    return f'<a href="{html.escape(beside(file))}"{named}>{html.escape(text)}</a>'

"""Fills the page's template: what comes from outside is escaped, what is many numbers is packed."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

_SCRIPT = ("data", "player", "drawing", "timeline", "table", "plots", "approach", "pairs", "main")
"""Parts of the one script, in their order; they share their names, and the last begins everything."""
_PLACE = re.compile(r"<!--(\w+)-->|/\*(\w+)\*/")


def fill(name: str, facts: str, data: Mapping[str, Any], video: str, *, sound: bool = False) -> str:
    """The page as text.

    Parameters
    ----------
    name : str
        Of the input, for people.
    facts : str
        A line about it.
    data : mapping
        For the script, as JSON.
    video : str
        Address of the video (`embedded` or `beside`), empty where there is none.
    sound : bool
        Whether it has sound; the script finds out by its being muted or not.
    """
    muted = "" if sound else " muted"
    player = (
        f'<video id="video" src="{html.escape(video)}" controls{muted} playsinline preload="auto"></video>'
    )
    parts = {
        "title": html.escape(name),
        "facts": html.escape(facts),
        "script": "".join(_part(f"script/{name}.js") for name in _SCRIPT),
        "data": as_script(data),
        "video": player if video else "",
    }
    return filled("page.html", parts)


def filled(template: str, parts: Mapping[str, str]) -> str:
    """A template with its places filled by HTML, and the style."""
    parts = {"style": _part("page.css"), **parts}
    # In one go over the template, so that nothing that is filled in is looked through again.
    return _PLACE.sub(lambda place: parts[place[1] or place[2]], _part(template))


def as_script(data: Mapping[str, Any]) -> str:
    """JSON that cannot end the script element that holds it, whatever its texts say."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def embedded(content: bytes, kind: str) -> str:
    """An address that holds the thing itself."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def beside(name: str) -> str:
    """Address of a file in the page's folder."""
    return "./" + quote(name)


def packed(values: NDArray[Any], kind: str, scale: float = 1.0) -> str:
    """Numbers as base64 of little-endian integers: scaled, rounded, and cut to what the type holds.

    Parameters
    ----------
    values : array
        NaN becomes the type's greatest value, which then stands for "nothing".
    kind : str
        ``"u1"``, ``"u2"``, ``"i2"`` or ``"u4"``.
    scale : float
    """
    limits = np.iinfo(kind)
    scaled = np.round(np.asarray(values, np.float64) * scale)
    held = np.where(np.isnan(scaled), limits.max, np.clip(scaled, limits.min, limits.max - 1))
    return base64.b64encode(held.astype(f"<{kind}").tobytes()).decode("ascii")


def _part(name: str) -> str:
    return (files("ifsvideo.report") / name).read_text(encoding="utf-8")

"""Loaders of the point data sets: tracks with a true label each."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from ifsvideo.errors import InputError, UsageError
from ifsvideo.tracking.files import load_tracks
from ifsvideo.types import Tracks

_KINDS = (
    ("checkerboard", r"\d+[RT]|three-cars"),
    ("traffic", r"cars|truck|kanatani[12](?!\d)"),
    ("articulated", r"arm|articulated|head|kanatani3(?!\d)|people|two_cranes"),
)
"""Kinds of Hopkins-155, by the start of the name."""
_OWN = "tracks"
"""Kind of a user's own sequences."""


@dataclass(frozen=True)
class LabelledSequence:
    """Tracks whose motions are known.

    Attributes
    ----------
    name : str
    kind : str
        What a table groups by.
    tracks : Tracks
    truth : (P,) int64
        Group of each track from 1; 0 is not counted.
    """

    name: str
    kind: str
    tracks: Tracks
    truth: NDArray[np.int64]

    def __post_init__(self) -> None:
        if self.truth.shape != (self.tracks.points,):
            raise ValueError(f"expected labels of shape ({self.tracks.points},), got {self.truth.shape}")
        if not (self.truth > 0).any():
            raise ValueError("no point carries a true label")

    @property
    def motions(self) -> int:
        """Number of true groups, background included."""
        return len(np.unique(self.truth[self.truth > 0]))


def hopkins_kind(name: str) -> str:
    """Kind of a Hopkins-155 sequence: checkerboard, traffic, articulated, or "other" for a foreign name."""
    return next((kind for kind, pattern in _KINDS if re.match(pattern, name)), "other")


def load(dataset: str, folder: Path, only: str = "*") -> list[LabelledSequence]:
    """Load the sequences of a data set whose name fits a pattern, ordered by name.

    Parameters
    ----------
    dataset : {"hopkins155", "kt3dmoseg", "tracks"}
    folder : Path
        Where the data set lies.
    only : str
        Shell pattern of the names.

    Raises
    ------
    InputError
        If the folder or a file cannot be read, or the folder holds no sequence.
    UsageError
        If no name fits the pattern.
    """
    layout = _LAYOUTS[dataset]
    files = _named_files(folder, layout)
    chosen = [name for name in sorted(files) if fnmatchcase(name, only)]
    if not chosen:
        raise UsageError(f"{folder}: no sequence is called {only}; there are {', '.join(sorted(files))}")
    return [_load_one(name, files[name], layout) for name in chosen]


def frames_of(folder: Path, name: str) -> Path:
    """Where the frames of a sequence of ``kt3dmoseg`` lie, if they are there."""
    return folder / "OriginalSequences" / name


@dataclass(frozen=True)
class _Layout:
    """How a data set lies in its folder: patterns of its files, their reader, and what helps a bad file."""

    patterns: tuple[str, ...]
    reader: Callable[[str, Path], LabelledSequence]
    remedy: str


def _named_files(folder: Path, layout: _Layout) -> dict[str, Path]:
    """Name and file of each sequence; any name that occurs is taken."""
    expected = " or ".join(layout.patterns)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that holds {expected}")
    named: dict[str, Path] = {}
    for file in sorted(file for pattern in layout.patterns for file in folder.glob(pattern)):
        name = re.sub(r"(_truth|_Tracks)$", "", file.stem)
        if name in named:
            raise InputError(f"{file}: is called {name} as {named[name]} is; rename one of them")
        named[name] = file
    if not named:
        raise InputError(f"{folder}: holds no {expected}; give the data set's top folder")
    return named


def _load_one(name: str, file: Path, layout: _Layout) -> LabelledSequence:
    """Read one file; whatever is wrong with it becomes an `InputError` that names it."""
    try:
        return layout.reader(name, file)
    except InputError:  # says all that there is to say
        raise
    except KeyError as fault:
        raise InputError(f"{file}: has no field {fault}; {layout.remedy}") from fault
    except Exception as fault:  # a damaged file makes its reader raise nearly anything
        reason = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        raise InputError(f"{file}: cannot be read ({reason}); {layout.remedy}") from fault


def _read_hopkins(name: str, file: Path) -> LabelledSequence:
    """``NAME/NAME_truth.mat``: y (3, P, F) homogeneous pixels, s (P, 1) groups, width, height."""
    fields = loadmat(file)
    size = (int(fields["width"].item()), int(fields["height"].item()))
    tracks = Tracks.from_array(_frames_first(fields["y"]), size=size)
    return LabelledSequence(name, hopkins_kind(name), tracks, fields["s"].ravel().astype(np.int64))


def _read_kt3dmoseg(name: str, file: Path) -> LabelledSequence:
    """``NAME_Tracks.mat``: the struct Data with ySparse (3, P, F), visibleSparse (P, F), GtLabel (P, 1)."""
    data = loadmat(file)["Data"][0, 0]
    fields = {field: data[field] for field in data.dtype.names}
    xy = _frames_first(fields["ySparse"])
    visible = None
    if "visibleSparse" in fields:
        visible = fields["visibleSparse"].reshape(xy.shape[1], -1).T != 0
    tracks = Tracks.from_array(xy, visible, size=_frame_size(frames_of(file.parent, name)))
    return LabelledSequence(name, "driving", tracks, fields["GtLabel"].ravel().astype(np.int64))


def _read_own(name: str, file: Path) -> LabelledSequence:
    """Anybody's tracks: ``.npz`` with xy, optional visible, and labels (P,); or a ``.mat`` of either data
    set."""
    tracks = load_tracks(file)
    if file.suffix == ".mat":
        reader = _read_hopkins if "y" in loadmat(file, variable_names=["y"]) else _read_kt3dmoseg
        return replace(reader(name, file), kind=_OWN)
    with np.load(file) as content:
        labels = content["labels"]
    if not np.issubdtype(labels.dtype, np.integer) or (labels < 0).any():
        raise ValueError("labels are not integers from 0")
    return LabelledSequence(name, _OWN, tracks, labels.astype(np.int64))


def _frames_first(homogeneous: NDArray[Any]) -> NDArray[np.float64]:
    """(3, P, F) homogeneous coordinates as (F, P, 2); a .mat file drops a last axis of one."""
    points = homogeneous.reshape(*homogeneous.shape[:2], -1)
    return np.ascontiguousarray(points[:2].transpose(2, 1, 0), dtype=np.float64)


def _frame_size(folder: Path) -> tuple[int, int] | None:
    """Width and height of the pictures in a folder, None where there are none."""
    pictures = sorted(file for file in folder.glob("*") if file.suffix.lower() in (".png", ".jpg", ".jpeg"))
    if not pictures:
        return None
    height, width = imageio.imread(pictures[0]).shape[:2]
    return int(width), int(height)


_FETCH = "fetch the data set's own file again"
_LAYOUTS = {
    "hopkins155": _Layout(("*/*_truth.mat",), _read_hopkins, _FETCH),
    "kt3dmoseg": _Layout(("*_Tracks.mat",), _read_kt3dmoseg, _FETCH),
    "tracks": _Layout(
        ("*.npz", "*.mat", "*/*.npz", "*/*.mat"),
        _read_own,
        "give .npz with xy (F, P, 2) and labels (P,), from 1 and 0 where not known, or a data set's .mat",
    ),
}

"""Every track in one NumPy archive, to be read by others, or by ifsvideo again."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.atomic import Outputs, output_error
from ifsvideo.types import UNDECIDED, Image, Scene, VideoInfo

_MOST_CELLS = 2**26
"""Most frames x tracks that are written as full arrays; ``xy`` then takes 512 MB when it is read."""
_ROW = np.dtype([("ids", np.int64), ("xy", np.float32, (2,)), ("labels", np.int32)])


class TracksSink:
    """Writes ``ids`` (P,), ``xy`` (F, P, 2), ``visible`` and ``labels`` (F, P), ``size`` (2,) and ``fps``.

    ``xy`` is NaN and ``labels`` -1 where a track is not seen. A long clip has so many short tracks that such
    arrays are all but empty and larger than memory; above 2**26 frames x tracks there is instead a row for
    every track and frame in which it is seen: ``frame``, ``track``, ``xy`` (N, 2), ``labels`` (N,), and
    ``frames``. `ifsvideo.load_tracks` reads both.

    While the run lasts the rows lie in a hidden file beside the output, not in memory.

    Parameters
    ----------
    path : Path
    info : VideoInfo
    outputs : Outputs
        Group with which the file is placed.

    Raises
    ------
    OutputError
        Here and later, if it cannot be written.
    """

    wants_image = False

    def __init__(self, path: Path, info: VideoInfo, outputs: Outputs, most_cells: int = _MOST_CELLS) -> None:
        self._path = path
        self._info = info
        self._most_cells = most_cells
        self._target = outputs.add(path)
        self._spool = outputs.add_scratch(self._target)
        self._rows = outputs.enter(self._spool.open("wb"))
        self._counts: list[int] = []
        self._last = np.empty(0, np.int64)
        self._seen: list[NDArray[np.int64]] = []

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        rows = np.empty(len(scene.ids), _ROW)
        rows["ids"], rows["xy"], rows["labels"] = scene.ids, scene.xy, scene.labels
        try:
            self._rows.write(rows.tobytes())
        except OSError as error:
            raise output_error(self._path, error) from None
        self._counts.append(len(rows))
        self._seen.append(np.setdiff1d(scene.ids, self._last, assume_unique=True))
        self._last = scene.ids

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""
        ids = np.unique(np.concatenate([np.empty(0, np.int64), *self._seen]))
        dense = len(self._counts) * len(ids) <= self._most_cells
        try:
            self._rows.close()
            with zipfile.ZipFile(self._target, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
                if dense:
                    self._write_dense(archive, ids)
                else:
                    self._write_rows(archive)
                _write(archive, "size", np.array([self._info.width, self._info.height]))
                _write(archive, "fps", np.array(float(self._info.fps)))
        except OSError as error:
            raise output_error(self._path, error) from None

    def _write_dense(self, archive: zipfile.ZipFile, ids: NDArray[np.int64]) -> None:
        _write(archive, "ids", ids)
        shape = len(self._counts), len(ids)
        for name, dtype, tail, missing, value in (
            ("xy", np.float32, (2,), np.nan, lambda rows: rows["xy"]),
            ("visible", np.bool_, (), False, lambda rows: True),
            ("labels", np.int32, (), UNDECIDED, lambda rows: rows["labels"]),
        ):
            with _member(archive, name, (*shape, *tail), np.dtype(dtype)) as member:
                for rows in self._read():
                    frame = np.full((len(ids), *tail), missing, dtype)
                    frame[np.searchsorted(ids, rows["ids"])] = value(rows)
                    member.write(frame.tobytes())

    def _write_rows(self, archive: zipfile.ZipFile) -> None:
        total = sum(self._counts)
        _write(archive, "frames", np.array(len(self._counts)))
        with _member(archive, "frame", (total,), np.dtype(np.int32)) as member:
            for frame, count in enumerate(self._counts):
                member.write(np.full(count, frame, np.int32).tobytes())
        for name, field, tail in (("track", "ids", ()), ("xy", "xy", (2,)), ("labels", "labels", ())):
            dtype = _ROW[field].base
            with _member(archive, name, (total, *tail), dtype) as member:
                for rows in self._read():
                    member.write(np.ascontiguousarray(rows[field]).tobytes())

    def _read(self) -> Iterator[NDArray[Any]]:
        """The rows of each frame, from the hidden file."""
        with self._spool.open("rb") as file:
            for count in self._counts:
                yield np.fromfile(file, _ROW, count)


def _member(
    archive: zipfile.ZipFile, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]
) -> AbstractContextManager[Any]:
    """An array in the archive, open for its values in the order of C, its header written."""
    member = archive.open(f"{name}.npy", "w", force_zip64=True)
    description = np.lib.format.dtype_to_descr(dtype)
    header = {"descr": description, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(member, header)
    return member


def _write(archive: zipfile.ZipFile, name: str, array: NDArray[Any]) -> None:
    with _member(archive, name, array.shape, array.dtype) as member:
        member.write(np.ascontiguousarray(array).tobytes())

"""Settings from a TOML file: sections and names are the fields of the dataclasses in `ifsvideo.config`."""

from __future__ import annotations

import dataclasses
import tomllib
import types
import typing
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

from ifsvideo.config import Config
from ifsvideo.errors import UsageError

_Section = TypeVar("_Section")


def load_config(path: str | Path) -> Config:
    """Read settings; what the file does not name keeps its default.

    Parameters
    ----------
    path : str or Path
        For example::

            seed = 3
            [tracking]
            max_points = 2000

    Raises
    ------
    UsageError
        If the file cannot be read, is no TOML, has an unknown name (the message tells the nearest known one),
        or a value of the wrong type or out of range.
    """
    try:
        with Path(path).open("rb") as file:
            values = tomllib.load(file)
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror}); name a TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: is not valid TOML ({error}); correct it") from None
    try:
        return _build(Config, values, "")
    except (UsageError, ValueError) as error:
        raise UsageError(f"{path}: {error}") from None


def _build(section: type[_Section], values: Mapping[str, Any], prefix: str) -> _Section:
    """A dataclass from a mapping that names some of its fields."""
    hints = typing.get_type_hints(section)
    names = [field.name for field in dataclasses.fields(section) if field.init]  # type: ignore[arg-type]
    arguments = {}
    for name, value in values.items():
        if name not in names:
            raise UsageError(_unknown(prefix + name, [prefix + known for known in names]))
        arguments[name] = _convert(value, hints[name], prefix + name)
    return section(**arguments)


def _unknown(name: str, known: Iterable[str]) -> str:
    nearest = get_close_matches(name, list(known), n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(known)}"
    return f"unknown name {name}; {hint}"


def _convert(value: Any, kind: Any, name: str) -> Any:
    """The value as the type of its field, or an error; an int serves as a float, nothing else is bent."""
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        if not isinstance(value, dict):
            raise UsageError(f"{name} is a section; write [{name}] above its settings")
        return _build(kind, value, f"{name}.")
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        if value in arguments:
            return value
        raise UsageError(f"{name} must be one of {', '.join(map(repr, arguments))}, got {value!r}")
    if origin in (typing.Union, types.UnionType):
        return _first_that_fits(value, arguments, name)
    if origin is tuple and isinstance(value, list):
        kinds = _item_kinds(arguments, len(value), name)
        return tuple(_convert(item, each, name) for item, each in zip(value, kinds, strict=True))
    if isinstance(kind, type) and isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    raise UsageError(f"{name} must be {_in_words(kind)}, got {value!r}")


def _first_that_fits(value: Any, kinds: Iterable[Any], name: str) -> Any:
    possible = [kind for kind in kinds if kind is not types.NoneType]
    for kind in possible[:-1]:
        try:
            return _convert(value, kind, name)
        except UsageError:
            continue
    return _convert(value, possible[-1], name)


def _item_kinds(arguments: tuple[Any, ...], count: int, name: str) -> list[Any]:
    """Types of the items of a tuple field; ``tuple[X, ...]`` takes any number of them."""
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        return [arguments[0]] * count
    if len(arguments) != count:
        raise UsageError(f"{name} must have {len(arguments)} items, got {count}")
    return list(arguments)


def _in_words(kind: Any) -> str:
    words = {bool: "true or false", int: "a whole number", float: "a number", str: "a text in quotes"}
    return words.get(kind, "a list" if typing.get_origin(kind) is tuple else str(kind))

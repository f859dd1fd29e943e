"""The command line as data: options, and what they mean together."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from pathlib import Path
from typing import NoReturn, TypeVar, get_args, get_type_hints

from ifsvideo import __version__
from ifsvideo.clip import is_tracks_file
from ifsvideo.config import Config, OverlayConfig
from ifsvideo.config_file import load_config
from ifsvideo.errors import UsageError
from ifsvideo.ignore import Area, parse_area
from ifsvideo.lens import check_k1
from ifsvideo.output.products import BESIDE, Products
from ifsvideo.video import ANIMATIONS, FORMATS, parse_time

_Value = TypeVar("_Value")

_OPTIONS = {"summary": "json"}
"""Options of further outputs, where they are not called as `Products` calls these."""

_EXAMPLES = """\
examples:
  ifsvideo clip.mp4 -o out.mp4            the overlay, and out.csv beside it
  ifsvideo clip.mp4 --start 10 --end 25 --ignore 0,620,1280,100
                                          15 seconds, not looking at the bonnet
  ifsvideo *.mp4 -o results/ --jobs 2     many clips, and a page that links what was found
"""
_STATUS = """\
exit status: 0 done; 1 fault of the program; 2 wrong use; 3 input cannot be read; 4 output cannot be written;
5 some of several inputs failed; 130, 143 interrupted
"""


@dataclass(frozen=True)
class Job:
    """One input, the chapters that are joined to it, and what is written of it."""

    source: Path
    output: Path | None
    labels: Path
    products: Products
    chapters: tuple[Path, ...] = ()

    @property
    def whole(self) -> Path | list[Path]:
        """The input as `Pipeline.run` takes it: with the chapters that follow it, where there are any."""
        return [self.source, *self.chapters] if self.chapters else self.source


@dataclass(frozen=True)
class Arguments:
    """What the command line asked for; ``folder`` is that of the results of several inputs."""

    jobs: tuple[Job, ...]
    folder: Path | None
    workers: int
    config: Config
    fps: Fraction | None
    start: float
    end: float | None
    preview: int | None
    ignore: tuple[Area, ...]
    motions: int | None
    quiet: bool


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; see ifsvideo --help")

    def format_help(self) -> str:
        return f"{_EXAMPLES}\n{super().format_help()}"


def parse(argv: Sequence[str] | None = None) -> Arguments:
    """Read the command line.

    Raises
    ------
    UsageError
        If it makes no sense. ``--help`` and ``--version`` raise SystemExit.
    """
    told = _parser().parse_args(argv)
    config = _config(told)
    sources = told.input[:1] if told.join else told.input
    folder = _folder(told.output, sources)
    ending = ".mov" if config.overlay.transparent else ".mp4"
    return Arguments(
        jobs=_wanted(told, _jobs(told, sources, folder, ending)),
        folder=folder,
        workers=told.jobs,
        config=config,
        fps=told.fps,
        start=told.start,
        end=told.end,
        preview=told.preview,
        ignore=tuple(told.ignore),
        motions=told.motions,
        quiet=told.quiet,
    )


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="ifsvideo",
        usage="ifsvideo INPUT [INPUT ...] [-o OUTPUT] [options]",
        description="Tells what moves by itself in a video whose camera moves too.",
        epilog=_STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
        allow_abbrev=False,
    )
    _add_files(parser)
    _add_products(parser)
    _add_reading(parser)
    _add_finding(parser)
    _add_showing(parser)
    _add_running(parser)
    return parser


def _add_files(parser: argparse.ArgumentParser) -> None:
    files = parser.add_argument_group("files")
    files.add_argument(
        "input",
        nargs="+",
        type=Path,
        metavar="INPUT",
        help="video (-: from standard input), folder of images, or tracks (.npz, .mat)",
    )
    files.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="overlay: .mp4, .mov, .mkv, .gif or .webp (default: INPUT.ifs.mp4 beside the input); or a "
        "folder: overlay, labels, report and summary of each input, and an index.html",
    )
    files.add_argument("--no-video", action="store_true", help="labels only, no overlay")
    files.add_argument(
        "--labels", type=Path, metavar="FILE", help="label of every point (default: .csv beside the overlay)"
    )


def _add_products(parser: argparse.ArgumentParser) -> None:
    products = parser.add_argument_group(
        "further outputs",
        "Without FILE or DIR, which several inputs and -o DIR demand, they go beside the overlay: out.mp4,\n"
        "out.objects.csv, out.masks. Such options stand behind the inputs.",
    )
    for option, place, text in (
        ("--report", "FILE", ".html: page with the video, a timeline and table of objects, and plots"),
        (
            "--objects",
            "FILE",
            ".csv: box, velocity, growth and time to contact of every object in every frame",
        ),
        ("--json", "FILE", ".json: summary with objects, events, settings, versions, timings and warnings"),
        ("--clips", "DIR", "the seconds round each event, cut out of the video"),
        ("--masks", "DIR", "a mask for every frame: PNGs whose pixels are the objects' numbers"),
        ("--mot", "FILE", ".txt: the boxes as MOTChallenge rows"),
        ("--tracks", "FILE", ".npz: every track; can be the input of another run"),
    ):
        products.add_argument(option, nargs="?", const=True, type=Path, metavar=place, help=text)


def _add_reading(parser: argparse.ArgumentParser) -> None:
    reading = parser.add_argument_group("reading")
    reading.add_argument(
        "--fps",
        type=_option(_rate),
        metavar="N",
        help="frames per second of a folder or of tracks (default: 10), or in place of a video's own",
    )
    reading.add_argument(
        "--start",
        type=_option(parse_time),
        default=0.0,
        metavar="TIME",
        help="begin here: seconds, or 1:02.5",
    )
    reading.add_argument("--end", type=_option(parse_time), metavar="TIME", help="stop before this time")
    reading.add_argument(
        "--preview", type=_option(_whole), metavar="N", help="every N-th second only, for a quick look"
    )
    reading.add_argument(
        "--join", action="store_true", help="the inputs are chapters of one recording, in this order"
    )
    reading.add_argument(
        "--ignore",
        type=_option(parse_area),
        action="append",
        default=[],
        metavar="AREA",
        help="do not look at x,y,w,h (pixels), or at what is black in a mask image; may be repeated",
    )


def _add_finding(parser: argparse.ArgumentParser) -> None:
    finding = parser.add_argument_group("finding")
    finding.add_argument(
        "--max-points", type=_option(_whole), metavar="N", help="points tracked at once (default: 1000)"
    )
    finding.add_argument(
        "--scale",
        type=_option(_number),
        metavar="S",
        help="track in S times the size, such as 0.5 (default: 1)",
    )
    finding.add_argument(
        "--motions",
        type=_option(_whole),
        metavar="K",
        help="number of motions, background included (default: found)",
    )
    finding.add_argument(
        "--distortion",
        type=_option(_k1),
        metavar="K1",
        help="radial distortion of the lens: it shows at r (1 + K1 r^2) what a pinhole camera shows at r, in "
        "half diagonals from the picture's centre; -0.148 to 1, negative for a wide lens (default: 0)",
    )
    finding.add_argument(
        "--seed", type=_option(_natural), metavar="N", help="same seed, same labels (default: 0)"
    )
    finding.add_argument("--config", type=Path, metavar="FILE", help="TOML file of settings")


def _add_showing(parser: argparse.ArgumentParser) -> None:
    showing = parser.add_argument_group("showing")
    showing.add_argument(
        "--style",
        choices=get_args(get_type_hints(OverlayConfig)["style"]),
        help="what is drawn; spotlight: movers in colour, all else grey (default: full)",
    )
    showing.add_argument(
        "--layout",
        choices=get_args(get_type_hints(OverlayConfig)["layout"]),
        help="the overlay alone, or with the plain picture (default: overlay)",
    )
    showing.add_argument("--title", metavar="TEXT", help="words on the first seconds")
    showing.add_argument("--slow", type=_option(_number), metavar="N", help="play N times slower, silently")
    showing.add_argument(
        "--transparent", action="store_true", help="the drawing alone, to lay over a video: .mov, .webp, .gif"
    )
    showing.add_argument(
        "--max-size", type=_option(_number), metavar="MB", help="keep a .gif or .webp smaller than this"
    )
    showing.add_argument("--no-legend", action="store_true", help="no time, frame and number on the picture")


def _add_running(parser: argparse.ArgumentParser) -> None:
    running = parser.add_argument_group("running")
    running.add_argument(
        "--jobs", type=_option(_whole), default=1, metavar="N", help="inputs run at once (default: 1)"
    )
    running.add_argument("--quiet", action="store_true", help="print nothing but errors")
    running.add_argument("--debug", action="store_true", help="show where in the program an error arose")
    running.add_argument("--version", action="version", version=f"ifsvideo {__version__}")
    running.add_argument("-h", "--help", action="help", help="show this")


def _option(convert: Callable[[str], _Value]) -> Callable[[str], _Value]:
    """A converter whose UsageError becomes argparse's message, which names the option."""

    def converted(text: str) -> _Value:
        try:
            return convert(text)
        except UsageError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return converted


def _rate(text: str) -> Fraction:
    try:
        rate = Fraction(text)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if rate <= 0:
        raise UsageError(f"{text!r} is no rate; write a positive number (30, 29.97 or 30000/1001)")
    return rate


def _whole(text: str) -> int:
    if _natural(text) < 1:
        raise UsageError(f"{text!r} is not a whole number of at least 1")
    return int(text)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{text!r} is no number") from None


def _k1(text: str) -> float:
    try:
        k1 = float(text)
    except ValueError:
        raise UsageError(f"{text!r} is no number; write one such as -0.1") from None
    check_k1(k1)
    return k1


def _natural(text: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise UsageError(f"{text!r} is not a whole number")
    return int(text)


def _config(told: argparse.Namespace) -> Config:
    """Settings of the file, and over them those of the command line."""
    config = load_config(told.config) if told.config else Config()
    if told.max_points is not None:
        config = replace(config, tracking=replace(config.tracking, max_points=told.max_points))
    if told.scale is not None:
        config = replace(config, tracking=replace(config.tracking, scale=told.scale))
    if told.distortion is not None:
        config = replace(config, segmentation=replace(config.segmentation, distortion=told.distortion))
    if told.seed is not None:
        config = replace(config, seed=told.seed)
    return replace(config, overlay=_overlay(told, config.overlay))


def _overlay(told: argparse.Namespace, config: OverlayConfig) -> OverlayConfig:
    wishes = {"style": told.style, "layout": told.layout, "title": told.title, "slow": told.slow}
    wishes["max_size_mb"] = told.max_size
    wishes["transparent"] = told.transparent or None
    wishes["legend"] = False if told.no_legend else None
    return replace(config, **{name: wish for name, wish in wishes.items() if wish is not None})


def _products(told: argparse.Namespace, overlay: Path) -> Products:
    """Places of the further outputs; where none is told, beside the overlay."""
    wanted = {item.name: getattr(told, _OPTIONS.get(item.name, item.name)) for item in fields(Products)}
    places = {
        name: overlay.with_suffix(BESIDE[name]) if place is True else place for name, place in wanted.items()
    }
    return Products(**places)


def _folder(output: str | None, sources: Sequence[Path]) -> Path | None:
    """The folder that -o names; None where it names a file, or nothing."""
    if not output:
        return None
    place = Path(output)
    like_a_file = place.suffix.lower() in (*FORMATS, *ANIMATIONS)
    if output.endswith(("/", os.sep)) or (place.is_dir() and not like_a_file):
        return place
    if len(sources) == 1:
        return None
    if like_a_file:
        raise UsageError(f"-o {output} would name one file for several inputs; name a folder: results/")
    return place


def _wanted(told: argparse.Namespace, jobs: tuple[Job, ...]) -> tuple[Job, ...]:
    """The jobs without what is not wanted, and with the chapters that are joined."""
    if Path("-") in told.input and (told.output is None or len(told.input) > 1):
        raise UsageError("standard input goes alone, and has no name; name the output (-o FILE)")
    if told.no_video:
        jobs = tuple(replace(job, output=None) for job in jobs)
    return (replace(jobs[0], chapters=tuple(told.input[1:])),) if told.join else jobs


def _jobs(
    told: argparse.Namespace, sources: Sequence[Path], folder: Path | None, ending: str
) -> tuple[Job, ...]:
    """What is written of each input."""
    if len(sources) == 1 and folder is None:
        return (_job(told, sources[0], ending),)
    for option in ("labels", *(_OPTIONS.get(item.name, item.name) for item in fields(Products))):
        place = getattr(told, option)
        if isinstance(place, Path):
            remedy = "leave it out" if option == "labels" else f"write --{option} alone, behind the inputs"
            raise UsageError(f"--{option} {place} would name one place for every input; {remedy}")
    jobs = tuple(_job_in(told, folder, source, ending) for source in sources)
    places = [job.labels for job in jobs]
    twice = next((place for place in places if places.count(place) > 1), None)
    if twice is not None:
        raise UsageError(f"{twice}: two inputs would be written there; run them one by one with -o")
    return jobs


def _job(told: argparse.Namespace, source: Path, ending: str) -> Job:
    """What is written of the only input."""
    if told.output is not None and not Path(told.output).name:
        raise UsageError("-o needs the name of a file, such as out.mp4")
    overlay = _named(None, source, ending) if told.output is None else Path(told.output)
    silent = told.output is None and is_tracks_file(source)
    return Job(
        source,
        None if silent else overlay,
        told.labels or overlay.with_suffix(".csv"),
        _products(told, overlay),
    )


def _job_in(told: argparse.Namespace, folder: Path | None, source: Path, ending: str) -> Job:
    """What is written of one input of several: in a folder of results report and summary, too."""
    if source == Path("-"):
        raise UsageError("standard input has no name; name the output (-o FILE)")
    overlay = _named(folder, source, ending)
    products = _products(told, overlay)
    if folder is not None:
        always = {name: overlay.with_suffix(BESIDE[name]) for name in ("report", "summary")}
        products = replace(products, **always)
    if source.is_dir() or is_tracks_file(source):  # there is no video to cut clips out of
        products = replace(products, clips=None)
    return Job(source, None if is_tracks_file(source) else overlay, overlay.with_suffix(".csv"), products)


def _named(folder: Path | None, source: Path, ending: str) -> Path:
    """Where the overlay of an input goes, unless it is told: into the folder, or beside it."""
    place = source if source.name else source.resolve()
    return (folder or place.parent) / f"{place.name if place.is_dir() else place.stem}.ifs{ending}"

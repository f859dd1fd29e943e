"""Styles, layouts, titles, transparency, and animations that keep a size."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from ifsvideo.arguments import parse
from ifsvideo.config import OverlayConfig
from ifsvideo.errors import OutputError, UsageError
from ifsvideo.output.alpha import alone, blend
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.layout import Composition
from ifsvideo.output.overlay import OverlayRenderer
from ifsvideo.output.overlay_video import OverlaySink, check_wishes
from ifsvideo.output.styles import look_of
from ifsvideo.types import Scene, VideoInfo
from ifsvideo.video.animation import ladder

from .conftest import decoded, pictures

INFO = VideoInfo(160, 120, Fraction(20), start=0.0)
SQUARE = np.array([[40, 40], [80, 40], [80, 80], [40, 80]], np.float32)
QUIET = OverlayConfig(legend=False)


def scene(frame: int = 3) -> Scene:
    """An object's corners, which come from the left, and two points of the ground."""
    xy = np.vstack([SQUARE + np.array([frame - 3, 0]), [[120, 20], [140, 100]]]).astype(np.float32)
    steps = np.linspace(-24, 0, 13)[:, None, None] * np.array([1, 0])
    trails = (xy + steps).astype(np.float32)
    return Scene(frame, frame / 20, np.arange(6), xy, np.array([1, 1, 1, 1, 0, 0], np.int32), trails)


def red() -> np.ndarray:
    return np.full((120, 160, 3), (200, 60, 60), np.uint8)


def written(path: Path, config: OverlayConfig, frames: int = 12) -> tuple[str, ...]:
    """Write a small overlay; what it warns of."""
    with Outputs() as outputs:
        sink = OverlaySink(path, INFO, OverlayRenderer(config), outputs, None, config)
        for frame, image in enumerate(pictures(frames)):
            sink.add(scene(frame), image)
        sink.finish()
    return sink.warnings


def drawn(style: str) -> np.ndarray:
    return OverlayRenderer(replace(QUIET, style=style)).draw(red(), scene())


def test_spotlight_leaves_colour_to_movers_only():
    out = drawn("spotlight").astype(int)
    assert np.ptp(out[20, 120]) == 0, "the ground is grey, and its points are not drawn"
    assert out[20, 120, 0] < 60
    np.testing.assert_array_equal(out[60, 60], red()[60, 60])


def test_styles_draw_their_part():
    plain = {style: drawn(style) for style in ("dots", "trails", "hulls")}
    ground = {style: image[5, 5].astype(int) for style, image in plain.items()}

    def marked(style: str, x: int, y: int) -> bool:
        return bool(np.abs(plain[style][y, x] - ground[style]).max() > 25)

    assert [marked(style, 60, 60) for style in plain] == [False, False, True]
    assert [marked(style, 80, 40) for style in plain][:2] == [True, True]
    assert [marked(style, 25, 40) for style in plain] == [False, True, False]
    assert [marked(style, 120, 20) for style in plain] == [True, False, False]


def test_a_style_gives_way_to_what_is_told():
    assert look_of(OverlayConfig(style="trails")).trail_s == 1.0
    assert look_of(OverlayConfig(style="trails", trail_s=0.5)).trail_s == 0.5
    assert look_of(OverlayConfig(picture_colour=0.0)).picture_colour == 0.0


def composed(config: OverlayConfig, frame: int = 3) -> tuple[np.ndarray, VideoInfo]:
    composition = Composition(OverlayRenderer(config), config, INFO)
    return composition.draw(red(), scene(frame)), composition.info


@pytest.mark.parametrize("layout", ["side-by-side", "stacked"])
def test_plain_and_drawn_are_both_whole(layout):
    config = replace(QUIET, layout=layout)
    out, info = composed(config)
    assert out.shape[:2] == (info.height, info.width)
    assert info.width % 2 == info.height % 2 == 0
    alone_drawn = OverlayRenderer(config).draw(red(), scene())
    np.testing.assert_array_equal(out[:120, :160], red())
    np.testing.assert_array_equal(out[-120:, -160:], alone_drawn)


def test_before_after_is_plain_on_the_left_of_a_line_that_moves():
    config = OverlayConfig(layout="before-after")
    shares = []
    for frame in (0, 25, 50):
        out, info = composed(config, frame)
        assert info == INFO
        shares.append(float((out == red()).all(axis=2).mean()))
        assert (out[:8, :8] == red()[:8, :8]).all() == (shares[-1] > 0.1), "no legend is cut through"
    assert shares[0] > 0.9 > shares[1] > shares[2]


def test_title_stands_for_its_time_and_fits():
    words = replace(QUIET, title="Straße  &\nwhat moves on it, told at length " * 4, title_s=2.0)
    without = composed(QUIET)[0]
    changed = (composed(words)[0] != without).any(axis=2)
    assert changed[60:].sum() > 500
    assert not changed[:60].any()
    assert changed.any(axis=0)[:3].sum() == 0
    np.testing.assert_array_equal(composed(words, 41)[0], composed(QUIET, 41)[0])
    assert (composed(replace(words, title_s=0.0), 400)[0] != composed(QUIET, 400)[0]).any()


def test_slow_lowers_the_rate():
    assert composed(replace(QUIET, slow=2.5))[1].fps == 8


def test_what_is_drawn_is_parted_from_what_it_is_drawn_on():
    plate = np.zeros((4, 5, 4), np.uint8)
    plate[1:3, 1:4] = (200, 100, 50, 128)

    def paint(ground: np.ndarray) -> np.ndarray:
        canvas = ground.copy()
        blend(canvas, 0, 0, plate)
        return canvas

    found = alone(paint, (4, 5, 3)).astype(int)
    assert np.abs(found - plate).max() <= 2
    twice = plate.copy()
    blend(twice, 0, 0, plate)
    assert twice[1, 1, 3] == pytest.approx(255 * (1 - (127 / 255) ** 2), abs=1)
    assert np.abs(twice[1, 1, :3].astype(int) - (200, 100, 50)).max() <= 1


def test_transparent_holds_the_drawing_alone_and_a_spotlight_the_movers():
    full = OverlayRenderer(replace(QUIET, transparent=True)).draw(red(), scene())
    assert full.shape == (120, 160, 4)
    assert full[5, 5, 3] == 0
    assert 20 < full[60, 60, 3] < 90
    lit = OverlayRenderer(replace(QUIET, transparent=True, style="spotlight")).draw(red(), scene())
    np.testing.assert_allclose(lit[60, 60], (200, 60, 60, 255), atol=2)
    assert lit[5, 5, 3] == 0


@pytest.mark.parametrize("ending", [".gif", ".webp"])
def test_animations_play_for_ever_in_time(tmp_path, ending):
    place = tmp_path / f"a{ending}"
    assert written(place, OverlayConfig()) == ()
    with Pillow.open(place) as animation:
        assert (animation.n_frames, animation.size, animation.info["loop"]) == (12, (160, 120), 0)
        animation.load()
        assert animation.info["duration"] == 50
    assert [path.name for path in tmp_path.iterdir()] == [place.name]


def test_colours_of_a_gif_are_near_those_of_the_picture(tmp_path):
    written(tmp_path / "a.gif", QUIET)
    with Pillow.open(tmp_path / "a.gif") as animation:
        animation.seek(5)
        shown = np.asarray(animation.convert("RGB")).astype(int)
    wanted = OverlayRenderer(QUIET).draw(pictures(12)[5], scene(5)).astype(int)
    assert np.abs(shown - wanted).mean() < 12


@pytest.mark.parametrize("ending", [".gif", ".webp", ".mov"])
def test_transparency_arrives(tmp_path, ending):
    written(tmp_path / f"a{ending}", OverlayConfig(transparent=True, legend=False))
    if ending == ".mov":
        assert decoded(tmp_path / "a.mov") == (12, (160, 120), 20)
        assert b"rle " in (tmp_path / "a.mov").read_bytes()
        return
    with Pillow.open(tmp_path / f"a{ending}") as animation:
        animation.seek(6)
        pixels = np.asarray(animation.convert("RGBA"))
    assert pixels[5, 5, 3] == 0
    assert (pixels[..., 3] > 200).sum() > 50
    assert pixels[80, 80, 3] > 200


@pytest.mark.parametrize(("name", "part"), [("a.gif", 0.5), ("a.webp", 0.7)])
def test_a_size_is_kept_and_what_it_costs_is_told(tmp_path, name, part):
    place = tmp_path / name
    written(place, QUIET)
    limit = place.stat().st_size * part / 1e6
    (warning,) = written(place, replace(QUIET, max_size_mb=limit))
    assert place.stat().st_size <= limit * 1e6
    assert name in warning
    assert "to keep" in warning


def test_a_size_that_cannot_be_kept_leaves_what_was_there(tmp_path):
    (tmp_path / "a.gif").write_text("older")
    with pytest.raises(OutputError, match=r"a\.gif: takes .* even at its smallest, more than the 0\.01 MB"):
        written(tmp_path / "a.gif", OverlayConfig(max_size_mb=0.01))
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]
    assert (tmp_path / "a.gif").read_text() == "older"


def test_what_is_given_up_in_which_order():
    gif = ladder(640, 360, Fraction(60), gif=True)
    assert gif[0].every == 2, "browsers play more than 50 a second slowly"
    assert [rung.every for rung in gif[:6]] == [2, 3, 4, 5, 6, 6]
    assert all(rung.width == 640 for rung in gif[:5])
    assert min(rung.width for rung in gif) >= 240
    assert [rung.level for rung in gif[-3:]] == [0, 1, 2]
    webp = ladder(640, 360, Fraction(60), gif=False)
    assert [(rung.every, rung.level) for rung in webp[:4]] == [(1, 0), (1, 1), (1, 2), (2, 2)]
    assert webp[-1].width < 270
    assert len(ladder(160, 120, Fraction(8), gif=True)) == 3


@pytest.mark.parametrize(
    ("name", "config", "complaint"),
    [
        (
            "a.mp4",
            OverlayConfig(transparent=True),
            "knows no transparency; name an output in .mov, .gif, .webp",
        ),
        ("a.mov", OverlayConfig(max_size_mb=3), "a size is kept for .gif and .webp only"),
    ],
)
def test_what_a_file_cannot_do_is_refused(name, config, complaint):
    with pytest.raises(UsageError, match=complaint):
        check_wishes(Path(name), config)


def test_wishes_that_exclude_each_other_are_refused():
    with pytest.raises(UsageError, match="stacked shows it"):
        OverlayConfig(transparent=True, layout="stacked")
    with pytest.raises(UsageError, match=r"overlay\.slow must be 1 to 100, got 0\.5"):
        OverlayConfig(slow=0.5)


def test_a_renderer_of_ones_own_without_alpha_is_told_so():
    composition = Composition(OverlayRenderer(), OverlayConfig(transparent=True), INFO)
    with pytest.raises(UsageError, match=r"\(120, 160, 4\) is asked for"):
        composition.draw(red(), scene())


def test_options_reach_the_configuration():
    line = "a.mp4 -o a.gif --style hulls --layout stacked --title Hello --slow 2 --max-size 1.5 --no-legend"
    told = parse(line.split()).config.overlay
    assert told == OverlayConfig(
        style="hulls", layout="stacked", title="Hello", slow=2.0, max_size_mb=1.5, legend=False
    )
    assert parse(["a.mp4", "-o", "a.webp", "--transparent"]).config.overlay.transparent

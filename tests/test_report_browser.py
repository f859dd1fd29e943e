"""The page in a real browser: what is clicked, typed and seen. Skipped where there is no Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from ifsvideo.benchmark import browser as driven
from ifsvideo.benchmark.browser import Browser

from .conftest import tone
from .reports import Mover, make_report

pytestmark = pytest.mark.skipif(not driven.HERE, reason="no chromium and chromedriver here")

TWO = [Mover((60, 60), (2, 0), first=4, last=30), Mover((200, 160), (0, -0.5), first=10, last=50, growth=0.4)]
NUMBERS = "return [...document.querySelectorAll('#objects tbody tr')].map(row => Number(row.dataset.number))"
_PIXELS = """
const c = document.getElementById('drawing'), copy = new OffscreenCanvas(c.width, c.height);
const pen = copy.getContext('2d', {willReadFrequently: true});
pen.drawImage(c, 0, 0);
"""
INKED = f"""{_PIXELS}
const p = pen.getImageData(0, 0, c.width, c.height).data;
let n = 0; for (let i = 3; i < p.length; i += 4) n += p[i] > 0; return n
"""


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with driven.browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    crowd = [
        Mover((20 + 5 * k, 20 + 3 * k), (0.5 * (k % 5 - 2), 0.2), first=k % 7, last=20 + k % 11)
        for k in range(60)
    ]
    return {
        "two": make_report(folder / "two & <b>.html", TWO, 60, name='two & <b> "quoted".mp4'),
        "loud": make_report(folder / "loud.html", TWO, 60, sound=tone(folder / "tone.m4a", 3.0)),
        "none": make_report(folder / "none.html", [], 12),
        "crowd": make_report(folder / "crowd.html", crowd, 32),
        "tracks": make_report(folder / "tracks.html", TWO, 60, pictures=False),
    }


@pytest.fixture
def page(window: Browser, pages: dict[str, Path]) -> Iterator[Browser]:
    """The page of two objects, loaded; no complaint of the console may be left in the end."""
    show(window, pages["two"])
    yield window
    assert window.complaints() == []


def show(window: Browser, page: Path) -> None:
    window.complaints()
    window.open(page.as_uri())
    window.until("const v = document.getElementById('video'); return !v || v.readyState >= 2 && !v.seeking")


def time_of(window: Browser) -> float:
    window.until("return !document.getElementById('video').seeking")
    return float(window.run("return document.getElementById('video').currentTime"))


def test_a_click_on_the_timeline_jumps_there(page):
    page.click("#timeline", 0.5, 0.9)
    assert time_of(page) == pytest.approx(1.5, abs=0.06)
    assert page.until("return document.getElementById('clock').textContent").startswith("0:01.")
    page.click("#lanes .object[data-number='2']", 0.9)
    assert 2.2 < time_of(page) < 2.6
    assert page.run("return document.querySelector('tr.chosen').dataset.number") == "2"
    shown = page.run("return document.getElementById('timeline').getAttribute('aria-valuetext')")
    assert shown.startswith("0:02.")


def test_the_picture_that_is_jumped_to_is_the_one_that_is_told(page):
    for frame in (0, 7, 31, 59):
        page.run("document.getElementById('timeline').focus()")
        page.click("#timeline", (frame + 0.4) / 60, 0.9)
        assert int(time_of(page) * 20) == frame
        assert page.run("return document.getElementById('clock').textContent") == f"0:0{frame / 20:.2f}"


def test_sorting_sorts_and_says_so(page):
    assert page.run(NUMBERS) == [1, 2]
    page.click("th[data-key=seen] button")
    assert page.run(NUMBERS) == [1, 2]
    page.click("th[data-key=seen] button")
    assert page.run(NUMBERS) == [2, 1]
    heads = "return [...document.querySelectorAll('th[aria-sort]')]"
    assert page.run(f"{heads}.map(t => [t.dataset.key, t.ariaSort])") == [["seen", "descending"]]


def test_filters_leave_what_fits(page):
    page.click("#least")
    page.run("document.getElementById('least').value = ''")
    page.keys("1.5")
    assert page.run(NUMBERS) == [2]
    assert page.run("return document.getElementById('count').textContent") == "1 of 2"
    page.click("#find")
    page.keys("1")
    assert page.run(NUMBERS) == []
    assert page.run("return document.getElementById('none').textContent") == "No object fits the filter."


def test_objects_are_switched_on_and_off_in_the_picture(page):
    page.click("#timeline", 0.4, 0.9)
    time_of(page)
    both = page.run(INKED)
    page.click("#objects tbody tr:nth-child(1) input")
    one = page.run(INKED)
    page.click("#objects tbody tr:nth-child(2) input")
    assert both > one > 200
    assert page.run(INKED) == 0
    page.click("#all")
    assert page.run(INKED) == both
    page.click("#outlines")
    page.click("#boxes")
    assert 0 < page.run(INKED) < both


def test_what_is_drawn_lies_on_the_object(page):
    page.click("#timeline", 20.5 / 60, 0.9)
    time_of(page)
    colour = page.run(
        f"{_PIXELS} return [...pen.getImageData(100 / 320 * c.width, 60 / 240 * c.height, 1, 1).data]"
    )
    assert colour[3] > 30, "object 1 is at 100, 60 in frame 20"
    assert colour[0] > colour[2], "and orange"


def test_keys_alone_do_it(page):
    page.run("document.getElementById('timeline').focus()")
    page.keys("\ue014")  # right
    assert time_of(page) == pytest.approx(1.0, abs=0.06)
    page.keys(".")
    assert time_of(page) == pytest.approx(1.05, abs=0.06)
    page.keys("\ue010")  # end
    assert time_of(page) == pytest.approx(2.975, abs=0.03)
    page.keys("\ue011")
    page.keys(" ")
    page.until("return document.getElementById('video').currentTime > 0.1")
    assert page.run("return document.getElementById('play').textContent") == "Pause"
    page.keys(" ")
    page.run("document.querySelector('tbody th button').focus()")
    page.keys("\ue004" + "\ue007")  # tab to the time at which it appears, enter
    assert time_of(page) == pytest.approx(0.225, abs=0.03)


def test_everything_that_is_operated_has_a_name(page):
    nameless = """
    return [...document.querySelectorAll('button, input, select, [role=slider], [role=img], [role=region]')]
      .filter(e => !(e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.textContent.trim()
        || (e.labels && e.labels.length && e.labels[0].textContent.trim()))).map(e => e.outerHTML)
    """
    assert page.run(nameless) == []
    tree = page.devtools("Accessibility.getFullAXTree")["nodes"]
    roles = [node["role"]["value"] for node in tree if not node.get("ignored")]
    for role in ("slider", "table", "columnheader", "rowheader", "main", "banner", "searchbox", "status"):
        assert role in roles, role


def test_plots_follow_the_choice(page):
    label = "return document.getElementById('growth-plot').getAttribute('aria-label')"
    before = page.run(label)
    page.click("tbody tr:nth-child(2) th button")
    assert page.run(label) != before
    assert page.run("return document.querySelectorAll('#growth-plot .curve').length") == 1
    curve = "return document.querySelector('#stretch-plot .curve').getAttribute('d')"
    alone = page.run(curve)
    page.run(
        "const s = document.getElementById('second'); s.value = '1'; s.dispatchEvent(new Event('change'))"
    )
    assert page.run(curve) != alone
    page.click("#growth-plot", 0.5)
    assert 0.5 < time_of(page) < 2.6


def test_dots_lie_within_the_timeline(page):
    outside = """
    const all = document.getElementById('lanes').getBoundingClientRect();
    const box = e => e.getBoundingClientRect(), dots = [...document.querySelectorAll('#lanes .event')];
    return dots.filter(e => box(e).left < all.left || box(e).right > all.right).length
    """
    assert page.run("return document.querySelectorAll('#lanes .event').length") >= 2
    assert page.run(outside) == 0


def test_an_address_can_name_a_moment(window, pages):
    window.open("about:blank")
    window.open(pages["two"].as_uri() + "#t=1.25")
    window.until("return document.getElementById('clock').textContent === '0:01.25'")
    assert time_of(window) == pytest.approx(1.275, abs=0.02)
    window.run("location.hash = '#t=2'")
    window.until("return document.getElementById('clock').textContent === '0:02.00'")


def test_names_from_outside_are_text(page):
    assert page.run("return document.querySelector('h1').textContent") == 'two & <b> "quoted".mp4'
    assert page.run("return document.querySelectorAll('h1 b').length") == 0


def test_sound_is_heard_and_switched_off(window, pages):
    show(window, pages["loud"])
    window.click("#play")
    window.until("return document.getElementById('video').webkitAudioDecodedByteCount > 0")
    muted = "return document.getElementById('video').muted"
    assert window.run(muted) is False
    window.click("#sound")
    assert window.run(muted) is True
    assert window.complaints() == []
    show(window, pages["two"])
    assert window.run("return document.getElementById('sounding').offsetWidth") == 0


def test_no_object(window, pages):
    show(window, pages["none"])
    assert window.run(NUMBERS) == []
    assert (
        window.run("return document.getElementById('none').textContent")
        == "Nothing was found that moves by itself."
    )
    assert window.run("return document.getElementById('approach').hidden")
    assert window.run("return document.getElementById('between').hidden")
    window.click("#timeline", 6.5 / 12, 0.5)
    assert time_of(window) == pytest.approx(0.325, abs=0.03)
    assert window.complaints() == []


def test_sixty_objects(window, pages):
    show(window, pages["crowd"])
    assert len(window.run(NUMBERS)) == 60
    window.click("th[data-key=last] button")
    last = window.run(
        "return [...document.querySelectorAll('tbody tr td:nth-of-type(4)')].map(c => c.textContent)"
    )
    assert last == sorted(last)
    window.click("#timeline", 0.4, 0.5)
    time_of(window)
    assert window.run(INKED) > 1000
    assert window.complaints() == []


def test_tracks_have_a_clock_in_place_of_the_video(window, pages):
    show(window, pages["tracks"])
    window.click("#timeline", 30.5 / 60, 0.9)
    assert window.run("return document.getElementById('clock').textContent") == "0:01.50"
    assert window.run(INKED) > 200
    window.click("#play")
    window.until("return document.getElementById('clock').textContent > '0:01.60'")
    assert window.complaints() == []


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 1280), ("light", 390), ("dark", 390)])
def test_nothing_is_cut_off_and_both_themes_are_there(page, theme, width):
    page.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
    page.devtools(
        "Emulation.setDeviceMetricsOverride", width=width, height=844, deviceScaleFactor=1, mobile=width < 500
    )
    try:
        page.until("return document.getElementById('drawing').width > 100")
        assert page.run("return document.documentElement.scrollWidth") <= width
        ground = page.run("return getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")
        assert (sum(ground) > 384) == (theme == "light")
    finally:
        page.devtools("Emulation.clearDeviceMetricsOverride")
        page.devtools("Emulation.setEmulatedMedia", features=[])

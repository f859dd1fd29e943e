"""A headless Chromium, driven through chromedriver's own HTTP interface (W3C WebDriver)."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

from ifsvideo.errors import IfsVideoError

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
HERE = bool(CHROMIUM and DRIVER)
"""Whether there is a browser to drive."""
_FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-dev-shm-usage --window-size=1280,1000 "
    "--autoplay-policy=no-user-gesture-required"
)


class Browser:
    """One window.

    Parameters
    ----------
    server : str
        Address of the chromedriver.
    profile : Path
        New and empty folder for the browser's own files.
    """

    def __init__(self, server: str, profile: Path) -> None:
        self._server = server
        options = {"binary": CHROMIUM, "args": [*_FLAGS.split(), f"--user-data-dir={profile}"]}
        wishes = {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        told = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": wishes}})
        self._session = f"/session/{told['sessionId']}"

    def open(self, address: str) -> None:
        """Load a page, till its load event."""
        self._ask("POST", f"{self._session}/url", {"url": address})

    def run(self, script: str, *arguments: Any) -> Any:
        """Value of a function body in the page; a promise is waited for."""
        body = {"script": script, "args": arguments}
        return self._ask("POST", f"{self._session}/execute/sync", body)

    def until(self, script: str, seconds: float = 10.0) -> Any:
        """Run a script till its value is true; that value."""
        deadline = time.monotonic() + seconds
        while not (value := self.run(script)):
            if time.monotonic() > deadline:
                raise IfsVideoError(f"the browser waited {seconds:g} s in vain for: {script}")
            time.sleep(0.02)
        return value

    def click(self, selector: str, x: float = 0.5, y: float = 0.5) -> None:
        """Press the mouse on an element, at a share of its width and height."""
        box = self.run(
            "const e = document.querySelector(arguments[0]); e.scrollIntoView({block: 'center'});"
            "const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]",
            selector,
        )
        place = {"x": round(box[0] + x * box[2]), "y": round(box[1] + y * box[3])}
        moves = [{"type": "pointerMove", "origin": "viewport", **place}]
        moves += [{"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp")]
        self._ask("POST", f"{self._session}/actions", {"actions": [_device("pointer", moves)]})

    def keys(self, text: str) -> None:
        """Type on whatever has the focus."""
        strokes = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self._ask("POST", f"{self._session}/actions", {"actions": [_device("key", strokes)]})

    def devtools(self, command: str, **parameters: Any) -> Any:
        """A command of the DevTools protocol."""
        return self._ask("POST", f"{self._session}/goog/cdp/execute", {"cmd": command, "params": parameters})

    def complaints(self) -> list[str]:
        """What the console has shown as warning or error since it was last asked."""
        entries = self._ask("POST", f"{self._session}/se/log", {"type": "browser"})
        return [entry["message"] for entry in entries if entry["level"] in ("WARNING", "SEVERE")]

    def screenshot(self, path: Path) -> None:
        """The whole page as PNG."""
        told = self.devtools("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(told["data"]))

    def close(self) -> None:
        """End the browser."""
        self._ask("DELETE", self._session)

    def _ask(self, method: str, path: str, body: Any = None) -> Any:
        content = None if body is None else json.dumps(body).encode()
        request = Request(self._server + path, content, {"Content-Type": "application/json"}, method=method)
        try:
            with urlopen(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except URLError as error:
            detail = error.read().decode() if isinstance(error, HTTPError) else ""
            raise IfsVideoError(f"the browser failed at {method} {path}: {error} {detail}") from None


def _device(kind: str, actions: list[dict[str, Any]]) -> dict[str, Any]:
    return {"type": kind, "id": kind, "actions": actions}


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """A browser whose files lie in ``folder``; it and its driver end with the context."""
    with (folder / "driver.log").open("w+") as log:
        assert DRIVER is not None
        driver = subprocess.Popen([DRIVER, "--port=0"], stdout=log, stderr=subprocess.STDOUT)
        try:
            window = Browser(f"http://127.0.0.1:{_port(folder / 'driver.log')}", folder / "profile")
            try:
                yield window
            finally:
                window.close()
        finally:
            driver.terminate()
            driver.wait()


def _port(log: Path) -> int:
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        for line in log.read_text().splitlines():
            if "started successfully on port" in line:
                return int(line.rstrip(".").rsplit(" ", 1)[1])
        time.sleep(0.05)
    raise IfsVideoError(f"chromedriver did not start: {log.read_text()}")

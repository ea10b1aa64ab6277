"""A real browser: Chromium without a window, driven by its DevTools protocol."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any, Final, Self
from urllib.request import Request, urlopen

from websockets.sync.client import connect

from quadriga.shared.runtime.clock import monotonic, sleep
from tests.permitted import permitted

CHROMIUM: Final = shutil.which("chromium") or shutil.which("chromium-browser")
WHY_NOT: Final = "no Chromium on this machine: apt-get install chromium"
WAIT: Final = 30.0  # s
_LARGEST: Final = 64 << 20  # bytes of a screenshot


class Page:
    """One page of the browser, until it is closed.

    Attributes:
        complaints: errors that its scripts have raised or logged.
    """

    def __init__(self, port: int, url: str, script: str) -> None:
        """Open `url`; `script` runs before the page's own."""
        self._port = port
        made = Request(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT")
        target = json.loads(urlopen(made, timeout=WAIT).read())
        self._id = target["id"]
        self._link = connect(target["webSocketDebuggerUrl"], max_size=_LARGEST)
        self._numbers = count(1)
        self.complaints: list[str] = []
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        if script:
            self.call("Page.addScriptToEvaluateOnNewDocument", source=script)
        self.call("Page.navigate", url=url)
        self.await_true("document.readyState === 'complete' && location.href !== 'about:blank'")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol; what it gives."""
        number = next(self._numbers)
        self._link.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            told = json.loads(self._link.recv(WAIT))
            if told.get("id") == number:
                assert "error" not in told, told
                result: dict[str, Any] = told["result"]
                return result
            self._note(told)

    def evaluate(self, expression: str) -> Any:
        """The value of an expression of JavaScript."""
        result = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def await_true(self, expression: str, wait: float = WAIT) -> None:
        """Wait until an expression is true."""
        deadline = monotonic() + wait
        while not self.evaluate(expression):
            assert monotonic() < deadline, f"never {expression}: {self.text()}"
            sleep(0.02)

    def text(self) -> str:
        """All that can be read on it."""
        return str(self.evaluate("document.body ? document.body.innerText : ''"))

    def point(self, selector: str) -> dict[str, float]:
        """The middle of an element."""
        box = self.evaluate(
            f"(() => {{ const e = document.querySelector({selector!r});"
            " e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect();"
            " return {x: b.x + b.width / 2, y: b.y + b.height / 2}; })()"
        )
        return {name: float(value) for name, value in box.items()}

    def mouse(self, kind: str, at: dict[str, float]) -> None:
        """`mousePressed`, `mouseMoved` or `mouseReleased` of the left button."""
        buttons = 0 if kind == "mouseReleased" else 1
        self.call(
            "Input.dispatchMouseEvent",
            type=kind,
            button="left",
            buttons=buttons,
            clickCount=1,
            **at,
        )

    def click(self, selector: str) -> None:
        """Press and release the mouse on an element."""
        at = self.point(selector)
        self.mouse("mousePressed", at)
        self.mouse("mouseReleased", at)

    def key(self, kind: str, code: str) -> None:
        """`keyDown` or `keyUp` of a key, such as KeyW."""
        self.call("Input.dispatchKeyEvent", type=kind, code=code, key=code.removeprefix("Key"))

    def screenshot(self, path: Path) -> None:
        """Save what is to be seen as PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def close(self) -> None:
        """Close the tab."""
        self._link.close()
        urlopen(f"http://127.0.0.1:{self._port}/json/close/{self._id}", timeout=WAIT).read()

    def _note(self, told: dict[str, Any]) -> None:
        method, parameters = told.get("method"), told.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(parameters["exceptionDetails"])[:500])
        elif method == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.complaints.append(str(parameters["entry"]))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Browser:
    """A running browser.

    Args:
        port: where it speaks the protocol.
    """

    def __init__(self, port: int) -> None:
        self._port = port

    def open(self, url: str, script: str = "") -> Page:
        """A new page; `script` runs before its own."""
        return Page(self._port, url, script)


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """A browser within the block, its profile in `folder`.

    Where permitted it goes before ordinary processes, as on a computer of its own: beside tests
    that compute, a page would be silent for seconds, and have the controls taken from it.
    """
    assert CHROMIUM is not None, WHY_NOT
    command = [
        *(("chrt", "--rr", "1") if permitted() else ()),
        CHROMIUM,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--use-gl=swiftshader",
        "--enable-unsafe-swiftshader",
        "--no-first-run",
        "--window-size=1280,800",
        "--remote-debugging-port=0",
        f"--user-data-dir={folder}",
        "about:blank",
    ]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            file, deadline = folder / "DevToolsActivePort", monotonic() + WAIT
            while not (file.is_file() and file.read_text(encoding="utf-8").count("\n")):
                assert process.poll() is None
                assert monotonic() < deadline
                sleep(0.05)
            yield Browser(int(file.read_text(encoding="utf-8").splitlines()[0]))
        finally:
            process.terminate()
            try:
                process.wait(WAIT)
            except subprocess.TimeoutExpired:
                process.kill()

"""The view in a real browser: it draws a recording as it plays, and the driver's page frames it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from quadriga.drive.controls import DriveControls
from quadriga.drive.server import DriveServer
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.load import load
from quadriga.shared.members import OPERATOR
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint
from tests.browser import CHROMIUM, WHY_NOT, Browser, Page, browser
from tests.quadriga.view.test_view import viewing

pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason=WHY_NOT)]
WAIT = 90.0  # s; a busy machine without a graphics card draws a scene in seconds
ROBOTS = {"x": 200, "y": 160, "width": 560, "height": 480, "scale": 1}  # of the page, pixels
SHOWN = "!!document.querySelector('canvas') && document.body.innerText.includes('Unitree A1')"
AT_ITS_END = "document.body.innerText.includes('6.00 s · ')"
PLAY = "[...document.querySelectorAll('button')].find(b => b.innerText === 'play').click()"


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as running:
        yield running


def picture(page: Page) -> str:
    """What is drawn where the robots are."""
    return str(page.call("Page.captureScreenshot", clip=ROBOTS)["data"])


def await_picture(page: Page, *, other: bool, seen: str, apart: float = 0.3) -> str:
    """Wait until the picture differs from one that was seen, or twice in a row does not change."""
    deadline = monotonic() + WAIT
    while ((now := picture(page)) != seen) is not other:
        assert monotonic() < deadline, f"the scene {'stands still' if other else 'never rests'}"
        if not other:
            seen = now
        sleep(apart)
    return now


def test_a_recording_plays(known_run: Path, chromium: Browser) -> None:
    with viewing(str(known_run)) as (_, url), chromium.open(url) as page:
        page.await_true(SHOWN, WAIT)
        page.await_true(AT_ITS_END, WAIT)
        still = await_picture(page, other=False, seen=picture(page))
        page.evaluate(PLAY)
        page.await_true(f"!{AT_ITS_END}", WAIT)
        await_picture(page, other=True, seen=still, apart=0.05)
        page.await_true(AT_ITS_END, WAIT)
        assert not page.complaints


def test_the_page_to_drive_from_frames_it(known_run: Path, chromium: Browser) -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    with (
        viewing(str(known_run)) as (_, url),
        Bus.open(config.bus, "team", OPERATOR) as operator,
        DriveServer(DriveControls(config, operator, drivable=False), 0, view=url) as server,
        chromium.open(server.url) as page,
    ):
        page.await_true("!document.getElementById('view').hidden", WAIT)
        assert page.evaluate("document.getElementById('no-view').hidden")
        deadline = monotonic() + WAIT
        while not is_framed(page, url):
            assert monotonic() < deadline, "the frame stays empty"
            sleep(0.2)
        assert not page.complaints


def is_framed(page: Page, url: str) -> bool:
    """Whether the page's only frame is at `url` and shows the robots."""
    (framed,) = page.call("Page.getFrameTree")["frameTree"]["childFrames"]
    if framed["frame"]["url"].rstrip("/") != url.rstrip("/"):
        return False
    world = page.call("Page.createIsolatedWorld", frameId=framed["frame"]["id"])
    found = page.call(
        "Runtime.evaluate",
        expression=SHOWN,
        contextId=world["executionContextId"],
        returnByValue=True,
    )
    return found["result"].get("value") is True

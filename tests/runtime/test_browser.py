"""A team is driven and stopped from a real browser, whose mouse, keys and gamepad are simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from quadriga.drive.driver_words import WHERE
from quadriga.drive.find import open_link
from quadriga.recordings.traces import read_traces
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.codes import FALL
from quadriga.shared.messages import Reference, Status
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import REFERENCE, STATUS
from quadriga.team.launch import Launch
from tests.browser import CHROMIUM, WHY_NOT, Browser, Page, browser
from tests.listening import WAIT
from tests.runtime.conftest import FOREVER, Make, Team, Watcher

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.usefixtures("_realtime", "_compiled"),
    pytest.mark.skipif(CHROMIUM is None, reason=WHY_NOT),
]
# On a busy machine a page may have been silent for too long: then it takes the controls again.
STAYS_IN_CHARGE = "news && !news.driver && drive.say({kind: 'take'})"
# Likewise a release may have come before all robots had said that they were stopped.
IF_STILL_STOPPED = "document.querySelector('#reset button').click()"
CLICK_IF_TAKEN = """
news.driver === 'page 1' && (document.getElementById('take').click(), true)
"""
TOLD_WHO = """
news.driver === 'page 1' && document.body.innerText.includes('page 1 has the controls')
"""
# A gamepad that the test holds: its buttons and axes are `window.stick`.
GAMEPAD = """
window.stick = {connected: true, axes: [0, 0, 0, 0],
              buttons: Array.from({length: 17}, () => ({pressed: false, value: 0}))};
navigator.getGamepads = () => [window.stick, null, null, null];
"""


@pytest.fixture
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as running:
        yield running


def await_message(bus: Bus, key: str, kind: type, wanted: Callable[[object], bool]) -> None:
    deadline, last = monotonic() + WAIT, object()
    while monotonic() < deadline:
        packet = bus.get(1.0)
        if packet is not None and packet[0] == key:
            last = decode(packet[1], kind)
            if wanted(last):
                return
    raise AssertionError(f"never on {key}; last {last}")


def asks(bus: Bus, page: Page, **least: float) -> None:
    """Wait until a reference asks for no less than that, by sign; `page` drives meanwhile."""

    def wanted(message: object) -> bool:
        page.evaluate(STAYS_IN_CHARGE)
        assert isinstance(message, Reference)
        values = {name: getattr(message, name) for name in least}
        return all(abs(v) >= abs(least[n]) and v * least[n] > 0 for n, v in values.items())

    await_message(bus, REFERENCE.key("team"), Reference, wanted)


def is_in(
    bus: Bus, mode: str, reason: str = "", page: Page | None = None, does: str = STAYS_IN_CHARGE
) -> None:
    """Wait until the robot is in a mode for a reason that begins so; `page` does that meanwhile."""

    def wanted(message: object) -> bool:
        assert isinstance(message, Status)
        found = message.mode == mode and message.reason.startswith(reason)
        if page is not None and not found:
            page.evaluate(does)
        return found

    await_message(bus, STATUS.key("team", "r1"), Status, wanted)


def wants_controls(second: Page, page: Page) -> None:
    """Ask for the controls on another page while `page` has them, and be told who has."""
    deadline = monotonic() + WAIT
    while not second.evaluate(CLICK_IF_TAKEN):
        assert monotonic() < deadline, second.text()
        page.evaluate(STAYS_IN_CHARGE)
    while not second.evaluate(TOLD_WHO):
        assert monotonic() < deadline, second.text()
        assert second.evaluate("news.driver") != "page 2"
        page.evaluate(STAYS_IN_CHARGE)


def url_of(team: Team) -> str:
    team.await_log("operator", "page to drive from: http://")
    with open_link(team.config.team.name) as link:
        return str(link.ask(WHERE)["url"])


def test_a_team_is_driven_stopped_and_released_from_a_page(
    make_team: Make, watcher: Watcher, chromium: Browser, tmp_path: Path
) -> None:
    team = make_team(
        team__robots=1,
        reference__driver="hand",
        world__mode="realtime",
        world__duration=FOREVER,
        recorder__enabled=True,
    )
    with team.launch(standing=False) as running:
        drive(team, running, watcher(team), chromium, tmp_path)
        running.watch(lambda: True)
    traces = read_traces(team.recording())
    assert FALL not in {event.code for event in traces.events}
    team.replay()


def drive(team: Team, running: Launch, bus: Bus, chromium: Browser, folder: Path) -> None:
    with chromium.open(url_of(team), GAMEPAD) as page:
        is_in(bus, "stand", "stopped:driver: nobody drives")
        page.await_true("document.body.innerText.includes('nobody drives')")
        page.click("#take")
        page.await_true("drives() || drive.say({kind: 'take'}) && false")
        # The keyboard.
        page.key("keyDown", "KeyW")
        is_in(bus, "walk", page=page)
        asks(bus, page, vx=0.3)
        page.key("keyUp", "KeyW")
        is_in(bus, "stand", "stopped:driver: page 1")
        # The gamepad.
        page.evaluate("stick.buttons[5].pressed = true; stick.axes[1] = stick.axes[2] = -0.5")
        asks(bus, page, vx=0.3, wz=0.3)
        # A second page hides the first, and cannot drive once that is back.
        with chromium.open(url_of(team)) as second:
            is_in(bus, "stand", "stopped:driver: page 1")
            page.call("Page.bringToFront")
            page.click("#take")
            asks(bus, page, vx=0.3, wz=0.3)
            wants_controls(second, page)
            asks(bus, page, vx=0.3, wz=0.3)
            assert not second.complaints
        page.evaluate("stick.buttons[5].pressed = false; stick.axes[1] = stick.axes[2] = 0")
        is_in(bus, "stand")
        # A slider, with the button that holds.
        page.evaluate("document.getElementById('vx').value = 0.25")
        page.mouse("mousePressed", page.point("#hold"))
        asks(bus, page, vx=0.2)
        # The stop button, while it walks.
        page.screenshot(folder / "page.png")
        page.evaluate("document.getElementById('estop').onpointerdown()")
        is_in(bus, "estop", "estop:page")
        page.await_true("document.getElementById('answer').innerText.startsWith('all stopped')")
        page.mouse("mouseReleased", page.point("#hold"))
        page.evaluate("document.getElementById('by').value = 'ann'")
        page.click("#reset button")
        is_in(bus, "stand", "reset:ann", page, IF_STILL_STOPPED)
        page.mouse("mousePressed", page.point("#hold"))
        page.evaluate("document.getElementById('go-on').click()")
        asks(bus, page, vx=0.2)
        assert not page.complaints
    # The tab is closed.
    is_in(bus, "stand", "stopped:driver: page 1")
    assert running.alive

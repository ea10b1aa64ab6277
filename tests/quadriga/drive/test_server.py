"""Drivers over the page's connections and the Unix socket, on a bus with a team that answers."""

from __future__ import annotations

import asyncio
import json
import socket
import stat
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from typing import Any, cast
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from quadriga.drive.attend import Attendant
from quadriga.drive.client import ControlLink
from quadriga.drive.controls import DriveControls
from quadriga.drive.driver_words import DriverWord
from quadriga.drive.server import DriveServer
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.codes import ESTOPPED
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import OPERATOR, SIM
from quadriga.shared.messages import EStop, Event, Reset, Resume, SafeStop, Status
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import ESTOP, EVENT, RESET, RESUME, STATUS, STOP
from quadriga.team.endpoint import free_endpoint

WAIT = 10.0  # s
_NONE = np.zeros(0)


@pytest.fixture(scope="module")
def config() -> Config:
    return load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})


@pytest.fixture(scope="module")
def buses(config: Config) -> Iterator[tuple[Bus, Bus]]:
    """Of the plant, which hears all words, and of the operator."""
    with (
        Bus.open(config.bus, "team", SIM) as sim,
        Bus.open(config.bus, "team", OPERATOR) as operator,
    ):
        for topic in (ESTOP, STOP, RESET, RESUME):
            sim.subscribe(topic.key("team"))
        sim.declare(HERE)
        assert operator.wait_for(HERE, {SIM}, WAIT, lambda: False)
        yield sim, operator


@contextmanager
def serving(
    config: Config, operator: Bus, folder: Path, *, drivable: bool = True
) -> Iterator[tuple[DriveServer, Path]]:
    path = folder / "team-1.sock"
    controls = DriveControls(config, operator, drivable=drivable)
    with DriveServer(controls, 0, path, view="http://127.0.0.1:8080") as server:
        yield server, path
    assert not path.exists()


def address(server: DriveServer, path: str) -> str:
    return server.url.replace("http://", "ws://").replace("/?", f"{path}?")


def news(link: Connection, **wanted: Any) -> dict[str, Any]:
    """The first news that say so."""
    deadline = monotonic() + WAIT
    while monotonic() < deadline:
        told: dict[str, Any] = json.loads(link.recv(WAIT))
        if wanted.items() <= told.items():
            return told
    raise AssertionError(wanted)


def drive(link: Connection, *, held: bool = True) -> None:
    link.send(
        json.dumps({"kind": "drive", "held": held, "vx": 0.4, "vy": 0, "wz": 0, "height": 0.26})
    )


class _Heard:
    """Controls of a team that stops at once; `heard` has the kinds of what is said."""

    robots, plant_each = (), False

    def __init__(self) -> None:
        self.heard: list[str] = []

    def hear(self, _driver: str, said: DriverWord) -> None:
        self.heard.append(said.kind)

    def leave(self, driver: str) -> None: ...

    def statuses(self) -> dict[str, Status]:
        return {}

    def events(self) -> tuple[Event, ...]:
        return (Event.of(0, ESTOPPED, "", ""),)


def test_a_flood_of_drivers_does_not_delay_a_stop() -> None:
    """They have begun before it, and each has more to say than is heard in a second."""
    controls, flooders = _Heard(), 30
    attendant = Attendant(cast(DriveControls, controls))

    async def says(kind: str, times: int) -> AsyncIterator[str]:
        for _ in range(times):
            yield json.dumps({"kind": kind})

    async def send(_text: str) -> None: ...

    async def press() -> None:
        floods = [
            asyncio.ensure_future(attendant.attend("page", says("take", 1000), send))
            for _ in range(flooders)
        ]
        await asyncio.sleep(0.05)
        heard = len(controls.heard)
        await attendant.attend("stop button", says("estop", 1), send)
        assert controls.heard[heard] == "estop"
        for flood in floods:
            flood.cancel()

    asyncio.run(press())
    assert flooders < len(controls.heard) < 500 * flooders, "what they say waits"


def test_only_this_computers_own_page_with_its_token_is_served(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with serving(config, buses[1], tmp_path) as (server, path):
        with socket.create_connection(("127.0.0.1", urlsplit(server.url).port)) as link:
            link.sendall(b"GET / HT")  # a browser that has changed its mind
        page = urlopen(server.url).read().decode()
        assert 'data-src="http://127.0.0.1:8080"' in page
        script = server.url.partition("?")[0] + "drive.js"
        assert b"getGamepads" in urlopen(script).read()
        foreign = [
            (server.url.partition("?")[0], {}),
            (server.url[:-3] + "xyz", {}),
            (server.url, {"Host": "evil.example"}),
            (server.url, {"Origin": "http://evil.example"}),
        ]
        for url, headers in foreign:
            with pytest.raises(HTTPError, match="403"):
                urlopen(Request(url, headers=headers))
        with pytest.raises(HTTPError, match="404"):
            urlopen(server.url.replace("/?", "/secret?"))
        for where in ("/drive", "/stop"):
            with pytest.raises(InvalidStatus, match="403"):
                connect(address(server, where), origin=Origin("http://evil.example"))
            with pytest.raises(InvalidStatus, match="403"):
                connect(address(server, where).partition("?")[0])
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert not caplog.records, "a terminal would show them, with a traceback"


def test_one_page_drives_another_cannot_and_who_is_gone_drives_no_more(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path
) -> None:
    with (
        serving(config, buses[1], tmp_path) as (server, _),
        connect(address(server, "/drive")) as second,
    ):
        with connect(address(server, "/drive")) as first:
            me = news(first)["you"]
            first.send(json.dumps({"kind": "take"}))
            drive(first)
            assert news(second, driver=me, stands="")["you"] != me
            for _ in range(8):  # it is heard all the time
                second.send(json.dumps({"kind": "take"}))
                drive(second)
                drive(first)
                sleep(0.05)
            assert news(second)["driver"] == me
            drive(first, held=False)
            assert news(second, stands=f"{me} does not hold on")
            drive(first)
        assert news(second, driver="", stands=f"{me} is gone")
        second.send(json.dumps({"kind": "take"}))
        told = news(second, stands=f"{(mine := news(second)['you'])} does not hold on")
        assert told["driver"] == mine
        assert news(second, driver="", stands=f"{mine} is silent")


def test_who_is_not_driven_by_hand_cannot_be_taken_but_stopped(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path
) -> None:
    sim, operator = buses
    with (
        serving(config, operator, tmp_path, drivable=False) as (server, path),
        ControlLink(path) as link,
    ):
        link.say("take")
        told = link.ask("news")
        assert (told["driver"], told["drivable"]) == ("", False)
        assert link.ask("where") == {"kind": "where", "url": server.url}
        link.say("stand", text="lunch")
        link.say("go-on")
        link.say("reset", text="ann")
        link.say("reset")  # by nobody
        kinds = {"stop": SafeStop, "resume": Resume, "reset": Reset}
        heard = [sim.get(WAIT) for _ in kinds]
        assert [p and decode(p[1], kinds[p[0].partition("/")[2]]) for p in heard] == [
            SafeStop(0, 0, "lunch", False),
            Resume(0, 0),
            Reset(0, 0, "ann"),
        ]
        assert sim.get(0.1) is None
        assert "expected" in link.ask("fly")["text"]


def test_who_does_not_drive_may_stop_the_team_and_not_set_it_going(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path
) -> None:
    sim, operator = buses
    with (
        serving(config, operator, tmp_path) as (server, path),
        ControlLink(path) as other,
        connect(address(server, "/drive")) as page,
    ):
        page.send(json.dumps({"kind": "take"}))
        drive(page)
        assert news(page, stands="")
        other.say("go-on")
        other.say("reset", text="ann")
        other.say("stand", text="dog")
        packet = sim.get(WAIT)
        assert packet is not None
        assert packet[0] == STOP.key("team"), "nothing came before it"
        page.send(json.dumps({"kind": "go-on"}))
        packet = sim.get(WAIT)
        assert packet is not None
        assert packet[0] == RESUME.key("team")


@pytest.mark.parametrize("answers", [True, False])
def test_what_came_of_an_emergency_stop_is_told(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path, answers: bool
) -> None:
    sim, operator = buses
    puts = [sim.publisher(STATUS.key("team", "r1")), sim.publisher(EVENT.key("team"))]
    status = Status(5, 0, "estop", "estop:dog", "kalman", {}, {}, _NONE, _NONE)
    words = [encode(status), encode(Event.of(5, ESTOPPED, "", "dog"))]
    heard, over = list[str](), Flag()

    def stop() -> None:
        while not over.is_set():
            packet = sim.get(0.05)
            if packet is not None and packet[0] == ESTOP.key("team"):
                heard.append(decode(packet[1], EStop).reason)
                for put, word in zip(puts, words, strict=True):
                    if answers:
                        put(word)

    thread = Thread(target=stop)
    thread.start()
    try:
        with serving(config, operator, tmp_path) as (server, path):
            with ControlLink(path) as link:
                link.say("estop", text="dog", number=3)
                assert link.answer() == {"kind": "heard", "number": 3}
                told = link.answer()
            with connect(address(server, "/stop")) as page:
                page.send(json.dumps({"kind": "estop", "number": 4}))
                assert json.loads(page.recv(WAIT)) == {"kind": "heard", "number": 4}
                also = json.loads(page.recv(WAIT))
    finally:
        over.set()
        thread.join()
    missing = [] if answers else ["r1", "plant"]
    assert (told["kind"], told["number"], told["missing"]) == ("stopped", 3, missing)
    assert (also["number"], also["missing"]) == (4, missing)
    assert heard[0] == "dog"
    assert len(heard) == 2


def test_a_place_where_no_socket_can_be_leaves_the_page(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    controls = DriveControls(config, buses[1], drivable=True)
    with DriveServer(controls, 0, tmp_path / ("long" * 40) / "team-1.sock") as server:
        assert urlopen(server.url).status == 200
    assert "no socket for programs of this machine" in capsys.readouterr().err


def test_a_port_that_is_taken_is_one_clear_error(
    config: Config, buses: tuple[Bus, Bus], tmp_path: Path
) -> None:
    with serving(config, buses[1], tmp_path) as (server, _):
        port = int(server.url.split(":")[2].partition("/")[0])
        controls = DriveControls(config, buses[1], drivable=True)
        with pytest.raises(BusError, match=r"page to drive from: got .*in use.*page_port"):
            DriveServer(controls, port)

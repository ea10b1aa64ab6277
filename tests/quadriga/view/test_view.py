"""`quadriga view` as a process: its page is looked at through the socket that a browser opens."""

from __future__ import annotations

import io
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby, takewhile
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from rich.console import Console
from websockets.exceptions import InvalidStatus

from quadriga.commands.parser import main
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.link.ticks import TickBatch
from quadriga.shared.members import SIM
from quadriga.shared.messages import Command, Message, State
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import log_ns, monotonic, sleep
from quadriga.shared.topics import TICKS, TICKS_MS
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import QUADRIGA
from quadriga.team.spectator import view_beside
from quadriga.view.port import check_port, choose_port, is_at_display, url_of
from tests.golden.scenario import RECORDING
from tests.listening import await_listener
from tests.quadriga.conftest import packets, run_config
from tests.quadriga.view.page import WAIT, Page, labelled, named, updates


@contextmanager
def viewing(*options: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A view's process and its URL."""
    command, pipe = [*QUADRIGA, "view", "--port", "0", *options], subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert "http://127.0.0.1:" in line
            yield process, line.split()[-1]
        finally:
            process.kill()


def end(process: subprocess.Popen[str], number: signal.Signals) -> None:
    """Ask it to leave; it does so without an error and without a word more."""
    process.send_signal(number)
    assert process.communicate(timeout=WAIT) == ("", "")
    assert process.returncode == 0


def test_a_page_of_another_origin_is_refused() -> None:
    with viewing(str(RECORDING)) as (_, url):
        own = url.removeprefix("http://")
        assert b"<html" in urlopen(url).read()
        framed_by = urlopen(url).headers["Content-Security-Policy"]
        assert framed_by == "frame-ancestors 'self' http://127.0.0.1:* http://localhost:*"
        for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
            with pytest.raises(HTTPError, match="403"):
                urlopen(Request(url, headers=headers))
        for origin in ("http://evil.example", "http://127.0.0.1:1", "null", f"https://{own}"):
            with pytest.raises(InvalidStatus, match="403"):
                Page(url, origin)
        with Page(url, url) as page:
            page.await_message(labelled("pause"))


@pytest.mark.parametrize("sent", [b"", b"GET / HT", b"\x16\x03\x01\n\r\n\r\n"])
def test_a_connection_without_a_request_is_nobodys_concern(sent: bytes) -> None:
    """Browsers open some in advance and never use them; port scanners send what they like."""
    with viewing(str(RECORDING)) as (process, url):
        host, _, port = url.removeprefix("http://").strip("/").partition(":")
        with socket.create_connection((host, int(port))) as link:
            link.sendall(sent)
            assert b"<html" in urlopen(url).read()
            end(process, signal.SIGTERM)


def test_a_recording_plays_and_pauses() -> None:
    with viewing(str(RECORDING)) as (process, url), Page(url) as page:
        trunk = page.await_message(named("/team/links/0", "BatchedMeshes"))["props"]
        assert trunk["vertices"]
        page.await_message(named("/team/links/0", "Update"))
        page.await_message(named("/team/paths", "Update"))
        page.await_message(named("/team", "SetPosition"))
        heading = page.await_message(lambda sent: "dead reckoning" in str(sent.get("updates")))
        assert "2 × Unitree A1" in heading["updates"]["content"]
        push = page.await_message(labelled("go to"))["props"]["options"]
        assert push[0].startswith("0.30 s push r2")
        # It has played since before the page was there; after 0.6 s it is at its end.
        playing, at_its_end = labelled("pause"), labelled("play")
        button = page.await_message(lambda sent: playing(sent) or at_its_end(sent))["uuid"]
        ends = updates(button, label="play")
        page.await_message(lambda sent: at_its_end(sent) or ends(sent))
        page.forget()
        page.click(button)
        page.await_message(updates(button, label="pause"))
        page.await_message(named("/team/links/0", "Update"))
        end(process, signal.SIGINT)


def traffic(config: Config, before: int) -> Iterator[tuple[str, Message]]:
    """What a team sends before a tick; states and commands in batches of ticks."""
    sent = takewhile(lambda packet: packet[1].tick < before, packets(config, 0.3))
    batch = TickBatch(robot_names(config.team.robots))
    for turn, several in groupby(sent, lambda packet: packet[1].tick // TICKS_MS):
        for key, message in several:
            robot = key.split("/")[1]
            if isinstance(message, State):
                batch.add_state(robot, message.tick, message.row, log_ns())
            elif isinstance(message, Command):
                batch.add_command(robot, message.tick, message.row, log_ns())
            else:
                yield key, message
        if (gathered := batch.take(TICKS_MS * turn)) is not None:
            yield TICKS.key("team", SIM), gathered


def test_a_running_team_is_shown_and_hears_nothing(tmp_path: Path) -> None:
    bus = BusConfig(endpoint=free_endpoint(), plaintext=True)
    config = replace(run_config(), bus=bus)
    file = tmp_path / "config.toml"
    file.write_text(to_toml(config), encoding="utf-8")
    with (
        viewing("--config", str(file)) as (process, url),
        Bus.open(bus, "team", "sim") as team,
        Page(url) as page,
    ):
        page.await_message(lambda sent: "nobody is heard yet" in str(sent.get("updates")))
        put = {}
        for key, _ in traffic(config, 401):
            if key not in put:
                await_listener(team, key)
                put[key] = team.publisher(key)
        team.subscribe("team/**")
        for key, message in traffic(config, 600):
            put[key](encode(message))
        page.await_message(lambda sent: "simulator's truth" in str(sent.get("updates")))
        page.await_message(lambda sent: "r1/command" in str(sent.get("updates")))
        page.await_message(named("/team/links/0", "Update"))
        assert not team.drain()
        end(process, signal.SIGTERM)


def test_a_view_leaves_once_its_team_has(tmp_path: Path) -> None:
    bus = BusConfig(endpoint=free_endpoint(), plaintext=True)
    file = tmp_path / "config.toml"
    file.write_text(to_toml(replace(run_config(), bus=bus)), encoding="utf-8")
    with viewing("--once", "--config", str(file)) as (process, _):
        with Bus.open(bus, "team", "sim") as team:
            await_listener(team, "team/sim/truth", there=True)
            team.declare(HERE)
            sleep(1.0)
            assert process.poll() is None
        assert process.wait(WAIT) == 0


def line_of(capsys: pytest.CaptureFixture[str], typed: Sequence[str], status: int = 2) -> str:
    """The one line that a command complains with."""
    assert main(typed) == status
    captured = capsys.readouterr()
    assert not captured.out
    (line,) = captured.err.splitlines()
    return line


def test_mistakes_cost_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "no such file" in line_of(capsys, ["view", str(tmp_path / "no.mcap")]).lower()
    assert "none of the configuration" in line_of(capsys, ["view", str(RECORDING), "--robots", "2"])
    assert "--once: got a recording, too" in line_of(capsys, ["view", str(RECORDING), "--once"])
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        line = line_of(capsys, ["view", str(RECORDING), "--port", port])
        assert f"--port: got {port}" in line
        assert "a port that is free" in line
        assert f"--view: got {port}" in line_of(capsys, ["walk", "--view", port])
    assert "--port" in line_of(capsys, ["view", "--port", "70000"])
    assert "--host: got 'nowhere.invalid'" in line_of(capsys, ["view", "--host", "nowhere.invalid"])
    monkeypatch.setitem(sys.modules, "viser", None)
    assert "the package viser" in line_of(capsys, ["view"])


def test_a_walk_is_shown_if_asked_for_or_in_a_terminal_with_a_display(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    port = check_port(0)
    assert choose_port(port, wanted=False) == port
    assert choose_port(0, wanted=False)
    assert choose_port(None, wanted=True)
    assert choose_port(None, wanted=False) is None
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    outside, inside = os.openpty()
    with os.fdopen(outside, "r"), os.fdopen(inside, "w") as terminal:
        monkeypatch.setattr(sys, "stdout", terminal)
        assert not is_at_display()
        monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
        assert is_at_display()
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    assert not is_at_display()


def test_a_view_that_fails_is_told_of_and_hurts_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "config.toml").write_text("[team]\nrobots = 99\n", encoding="utf-8")
    port = check_port(0)
    with view_beside(tmp_path, port, Console(width=400)):
        await_end_of_child()
    said = capsys.readouterr().out
    assert url_of(port) in said
    assert "the view ended before the walk, exit status 2" in said
    assert "team.robots" in said


def test_a_view_leaves_with_its_walk(tmp_path: Path) -> None:
    bus = BusConfig(endpoint=free_endpoint(), plaintext=True)
    (tmp_path / "config.toml").write_text(to_toml(replace(Config(), bus=bus)), encoding="utf-8")
    port, log = check_port(0), tmp_path / "logs" / "view.log"
    with view_beside(tmp_path, port, Console(quiet=True)):
        await_text(log, url_of(port))
    assert check_port(port) == port


def await_end_of_child() -> None:
    """Wait until the only process that this one has started has ended, without reaping it."""
    os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOWAIT)


def await_text(path: Path, text: str) -> None:
    deadline = monotonic() + WAIT
    while text not in path.read_text(encoding="utf-8"):
        assert monotonic() < deadline, path.read_text(encoding="utf-8")
        sleep(0.02)

"""A recording played by a process of its own, heard by another session, steered by a terminal."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import termios
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.playback.timeline import Timeline, parse_remap, rename
from quadriga.shared.bus.session import HERE, Bus, Packet
from quadriga.shared.codec import envelope
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.members import SIM
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT
from tests.quadriga.lockstep_run import TICKS, config, write_lockstep

Start = Callable[..., "subprocess.Popen[bytes]"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_lockstep(tmp_path_factory.mktemp("play") / "run.mcap", config())


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def join(endpoint: str) -> Iterator[Callable[..., Bus]]:
    """A function that puts a bus on the player's network that hears the whole of a team.

    By the name of the sim server it is there first, and a player waits for the link to it.
    """
    buses = []

    def opened(team: str = "team", name: str = SIM) -> Bus:
        bus = Bus.open(BusConfig(endpoint=endpoint), team, name)
        buses.append(bus)
        bus.subscribe(f"{team}/**")
        return bus

    yield opened
    for bus in buses:
        bus.close()


@pytest.fixture
def start(file: Path, endpoint: str) -> Iterator[Start]:
    """A function that starts a player; it is dead when the test is over."""
    started: list[subprocess.Popen[bytes]] = []

    def run(*options: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "quadriga", "play", str(file), "--endpoint", endpoint]
        # A session of its own with the terminal as its own, as a shell would start it.
        own = None if stdin == subprocess.DEVNULL else lambda: os.login_tty(stdin)
        pipe = subprocess.PIPE if own is None else None
        process = subprocess.Popen(
            [*command, *options], stdin=stdin, stdout=pipe, stderr=pipe, preexec_fn=own
        )
        started.append(process)
        return process

    yield run
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


def heard(bus: Bus, ended: Callable[[], bool]) -> list[Packet]:
    """What arrives until something has happened and silence follows."""
    packets, deadline = [], monotonic() + WAIT
    while monotonic() < deadline:
        packet = bus.get(0.3)
        if packet is not None:
            packets.append(packet)
        elif ended():
            return packets
    pytest.fail("it never ended")


def by_key(packets: list[Packet]) -> dict[str, list[bytes]]:
    found: dict[str, list[bytes]] = {}
    for key, payload in packets:
        found.setdefault(key, []).append(payload)
    return found


def tick_of(packets: list[Packet]) -> int:
    """The newest tick of a state among some packets."""
    return max(e[0] for key, p in packets if key.endswith("/state") and (e := envelope(p)))


def stands_at(bus: Bus, tick: int) -> bool:
    """Whether the playback comes to this tick and no further."""
    packets: list[Packet] = []
    while not packets or tick_of(packets) < tick:
        packet = bus.get(WAIT)
        if packet is None:
            return False
        packets += [packet] if packet[0].endswith("/state") else []
    return tick_of([*packets, *heard(bus, lambda: True)]) == tick


def test_every_message_is_heard_as_recorded_at_its_pace(
    file: Path, start: Start, join: Callable[..., Bus]
) -> None:
    bus = join()
    player = start("-r", "0.25")
    first = bus.get(WAIT)
    assert first is not None
    packets = [first, *heard(bus, lambda: player.poll() is not None)]
    recorded = [(entry.key, entry.payload) for entry in Recording(file).entries()]
    assert by_key(packets) == by_key(recorded)
    out, _ = player.communicate()
    assert player.returncode == 0
    assert f"played {len(recorded)} messages as team 'team' in" in out.decode()
    spent = float(out.decode().split(" in ")[1].split()[0])
    assert spent > 0.9 * TICKS / 1000 / 0.25


def test_topics_start_loop_and_another_name(
    file: Path, start: Start, join: Callable[..., Bus]
) -> None:
    bus = join("ghost")
    player = start(
        "-r",
        "5",
        "--start",
        "0.2",
        "--loop",
        "--topics",
        "r1/*",
        "team/sim/t*",
        "--remap",
        "team/r1:ghost/r7",
        "team:ghost",
    )
    packets: list[Packet] = []
    while len([key for key, _ in packets if key == "ghost/sim/truth"]) < 25:
        packet = bus.get(WAIT)
        assert packet is not None
        packets.append(packet)
    player.send_signal(signal.SIGTERM)
    _, err = player.communicate(timeout=WAIT)
    assert (player.returncode, err) == (130, b"quadriga: interrupted\n")
    assert {key for key, _ in packets} == {"ghost/r7/state", "ghost/r7/command", "ghost/sim/truth"}
    ticks = [e[0] for key, p in packets if key == "ghost/sim/truth" and (e := envelope(p))]
    assert ticks[:10] == list(range(200, 300, 10))
    assert ticks[10:20] == list(range(200, 300, 10))


def test_space_pauses_the_arrow_steps_and_q_quits(start: Start, join: Callable[..., Bus]) -> None:
    bus = join()
    terminal, inside = pty.openpty()
    before = termios.tcgetattr(inside)
    player = start("--paused", "-r", "0.02", stdin=inside)
    assert stands_at(bus, 0), "paused at the start"
    os.write(terminal, b"\x1b[C")
    assert stands_at(bus, 40), "one planning step further"
    os.write(terminal, b"x\x1b[C\x1b[C")
    assert stands_at(bus, 120)
    os.write(terminal, b" ")
    moving = [packet for _ in range(40) if (packet := bus.get(WAIT)) is not None]
    assert 120 < tick_of(moving) < 200
    os.write(terminal, b" ")
    assert tick_of([*moving, *heard(bus, lambda: True)]) < TICKS - 1, "paused again"
    shown = os.read(terminal, 1 << 16).decode()
    assert "paused" in shown
    assert "0.02 ×" in shown
    os.write(terminal, b"q")
    assert player.wait(WAIT) == 0
    assert termios.tcgetattr(inside) == before, "the terminal is as it was"
    os.close(terminal)
    os.close(inside)


def test_two_teams_of_one_name_never_mix(start: Start, join: Callable[..., Bus]) -> None:
    player = start("-r", "0.05", "--loop")
    bus = join(name="listener")
    assert bus.get(WAIT) is not None
    other = start("-r", "0.05", "--loop")
    _, err = other.communicate(timeout=WAIT)
    assert other.returncode == 2
    assert b"got player of a live team of that name" in err
    assert b"--remap team:ghost" in err
    join(name="r2").declare(HERE)
    _, err = player.communicate(timeout=WAIT)
    assert player.returncode == 2
    assert b"got r2 of a live team of that name" in err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--topics", "none/*"], "no key that fits none/*, expected some of team/r1/command"),
        (["--remap", "team/r1:other/r1"], "keys of the teams other, team, expected one team"),
        (["--remap", "team"], "FROM:TO"),
        (["--remap", "team:a b"], "FROM:TO"),
        (["-r", "0"], "--rate: got 0"),
        (["-r", "nan"], "--rate: got nan"),
        (["--start", "9"], "--start: got 9 s, expected at most 0.299 s"),
        (["--endpoint", "pigeon/roof"], "bus.endpoint 'pigeon/roof'"),
    ],
)
def test_mistakes(
    capsys: pytest.CaptureFixture[str], file: Path, options: list[str], message: str
) -> None:
    assert main(["play", str(file), *options]) == 2
    out, err = capsys.readouterr()
    assert message in err
    assert (out, err.count("\n")) == ("", 1)


def test_the_timeline_knows_its_length_on_both_clocks(file: Path) -> None:
    world = Timeline(Recording(file), ["*"], [], "world")
    assert (world.first, world.last, world.step) == (0.0, TICKS - 1, 40)
    cues = list(world.cues(100.0))
    assert [cue.at for cue in cues] == sorted(cue.at for cue in cues)
    assert cues[0].at == 100.0
    log = Timeline(Recording(file), ["*"], [], "log")
    times = [entry.log_time_ns for entry in Recording(file).entries()]
    assert log.last == pytest.approx((times[-1] - times[0]) / 1e6)
    assert len(list(log.cues(0.0))) == log.messages == len(times)


def test_without_the_worlds_messages_the_log_paces(tmp_path: Path) -> None:
    path = write_lockstep(
        tmp_path / "run.mcap", config(), lambda _, key, p: p if key.endswith("command") else None
    )
    timeline = Timeline(Recording(path), ["*"], [], "world")
    assert timeline.last > 0.0
    assert timeline.last == list(timeline.cues(0.0))[-1].at


def test_only_whole_parts_of_keys_are_replaced() -> None:
    remaps = [parse_remap("team/r1:ghost/r9"), parse_remap("team:ghost")]
    assert rename("team/r1/state", remaps) == "ghost/r9/state"
    assert rename("team/r10/state", remaps) == "ghost/r10/state"
    assert rename("teams/r1/state", remaps) == "teams/r1/state"
    for wrong in ("team:", ":team", "a:b/*", "a:/b", "a:b/", "a:b//c"):
        with pytest.raises(ConfigError, match="FROM:TO"):
            parse_remap(wrong)

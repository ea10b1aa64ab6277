"""A process freezes, dies or is told to stop: the others notice, say so and leave."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace

import pytest

from quadriga.recordings.summary import summarise
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Clock, EStop, Event, Status
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import CLOCK, COMMAND, EVENT
from quadriga.team import launch
from tests.runtime.awaiting import TEAM, await_tick
from tests.runtime.conftest import BEGUN, WAIT, Make, run_alone

FOREVER = 600.0  # s of world time
Watcher = Callable[..., Bus]


def never() -> bool:
    return False


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_a_frozen_robot_is_named_and_the_walk_ends(make_team: Make, mode: str) -> None:
    team = make_team(world__mode=mode, world__duration=FOREVER, world__command_timeout=3.0)
    rows = [replace(row, grace=1.0 if row.name == "r2" else row.grace) for row in team.rows()]
    with launch.Launch(rows, team.folder / "logs") as running:
        team.await_log("sim", BEGUN)
        os.kill(running.pids["r2"], signal.SIGSTOP)
        with pytest.raises(ProcessError, match="r2 silent for"):
            running.watch(never)
    ends = [line for line in team.log("sim").splitlines() if "command-lost" in line]
    assert len(ends) == 1
    assert "command-lost  r2 silent for" in ends[0]


def test_in_real_time_the_world_waits_for_no_frozen_listener(
    make_team: Make, watcher: Watcher
) -> None:
    """Its buffers are full some seconds after it froze, and what must not be lost waits 5 s."""
    pushes = ",".join(f"r1:5:90:{second}:0.1" for second in range(1, 120))
    team = make_team(world__mode="realtime", world__duration=FOREVER, world__push=pushes)
    echo = (*launch.QUADRIGA, "echo", "**", "--config", str(team.folder / "config.toml"))
    with team.launch() as running, subprocess.Popen(echo, stdout=subprocess.PIPE) as listener:
        try:
            assert listener.stdout is not None
            listener.stdout.readline()
            bus = watcher(team)
            await_tick(bus, 10)
            listener.send_signal(signal.SIGSTOP)
            received, longest, last = 0, 0.0, monotonic()
            while received < 5:  # one push a second
                packet = bus.get(WAIT)
                assert packet is not None
                longest, last = max(longest, monotonic() - last), monotonic()
                if packet[0] == EVENT.key(TEAM):
                    event = decode(packet[1], Event)
                    assert event.kind != "stop", event.detail
                    received += event.kind == "push"
        finally:
            listener.kill()
        running.watch(lambda: True)
    assert longest < 2.0


@pytest.mark.parametrize("name", ["sim", "r2", "operator"])
def test_kill_9_of_one_stops_the_walk_and_names_it(make_team: Make, name: str) -> None:
    team = make_team(world__duration=FOREVER)
    with team.launch() as running:
        pids = running.pids
        team.await_log("sim", BEGUN)
        os.kill(pids[name], signal.SIGKILL)
        if name == "r2":  # the world notices by itself, if the launcher does not stop it before
            team.await_log("sim", "command-lost  r2 gone")
        with pytest.raises(ProcessError, match=f"process {name}: got signal 9"):
            running.watch(never)
    assert not [pid for pid in pids.values() if os.path.exists(f"/proc/{pid}")]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_sim_server_ends_the_walk_for_all(
    make_team: Make, number: signal.Signals
) -> None:
    team = make_team(world__duration=FOREVER)
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        os.kill(running.pids["sim"], number)
        running.watch(never)  # all leave by themselves, with exit status 0
    assert team.log("sim").splitlines()[-1].endswith("signal  signal")


@pytest.mark.usefixtures("_compiled")
def test_an_end_that_somebody_else_announces_ends_nothing(
    make_team: Make, watcher: Watcher
) -> None:
    """Without certificates whoever reaches the team's bus may say so, and of a tick that is right.

    Nobody leaves while time goes on, and the operator goes on asking.
    """
    team = make_team(world__duration=4.0, gait__stand_ms=500, recorder__enabled=True)
    with team.launch(standing=False) as running:
        bus = watcher(team, CLOCK)
        say = bus.publisher(EVENT.key("team"))
        said, deadline = list[int](), monotonic() + WAIT
        while len(said) < 20 and monotonic() < deadline:
            packet = bus.get(1.0)
            tick = decode(packet[1], Clock).tick if packet is not None else 0
            if tick >= 1000 + 100 * len(said):
                say(encode(Event.of(tick, "signal", "", "forged")))
                said.append(tick)
        running.watch(never)
    summary = summarise(team.folder)
    assert len(said) == 20
    assert summary["end"].startswith("end of world.duration")
    assert (summary["fallen"], summary["stop_reasons"], summary["gaps"]) == ([], {}, 0)
    ticks = [entry.tick for entry in team.recording().entries({COMMAND.name})]
    assert max(ticks) >= 3999


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.usefixtures("_compiled")
def test_a_stopped_agent_leaves_cleanly_and_the_walk_stops(
    make_team: Make, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    monkeypatch.setattr(launch, "_EARLY", 0.3)
    team = make_team(team__robots=1, world__duration=FOREVER)
    with team.launch(standing=False) as running:
        team.await_log("sim", BEGUN)
        os.kill(running.pids["r1"], number)
        with pytest.raises(ProcessError, match="process r1: got an end while the team walked"):
            running.watch(never)
    said = team.log("r1").splitlines()
    assert said[-1] == "quadriga: r1: the team walks"
    assert all(line.startswith("quadriga: r1") for line in said)


@pytest.mark.usefixtures("_compiled")
def test_an_emergency_stop_damps_every_robot(make_team: Make, watcher: Watcher) -> None:
    team = make_team(world__duration=FOREVER)
    with team.launch(standing=False) as running:
        team.await_log("sim", BEGUN)
        bus = watcher(team)
        stop = launch.ProcessSpec(
            "estop",
            (
                *launch.QUADRIGA,
                "estop",
                "--reason",
                "smoke",
                "--config",
                str(team.folder / "config.toml"),
            ),
            5.0,
        )
        assert run_alone(stop) == (0, "")
        modes: dict[str, str] = {}
        deadline = monotonic() + WAIT
        while len(modes) < 2 and monotonic() < deadline:
            packet = bus.get(1.0)
            if packet is not None and packet[0].endswith("/status"):
                status = decode(packet[1], Status)
                if status.mode == "estop":
                    modes[packet[0]] = status.reason
            elif packet is not None and packet[0].endswith("/estop"):
                assert decode(packet[1], EStop).reason == "smoke"
        assert modes == {f"team/{robot}/status": "estop:smoke" for robot in ("r1", "r2")}
        running.watch(lambda: True)


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_the_world_obeys_an_emergency_stop_whatever_the_agents_do(
    make_team: Make, mode: str
) -> None:
    """These stand on: they have never heard of an emergency stop."""
    team = make_team(world__duration=FOREVER, world__mode=mode)
    file = str(team.folder / "config.toml")
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        command = (*launch.QUADRIGA, "estop", "--reason", "smoke", "--config", file)
        status, errors = run_alone(launch.ProcessSpec("estop", command, 5.0))
        assert status == 2, "no agent says that it has stopped"
        assert "no word of r1, r2 after 0.5 s; r1: says nothing, r2: says nothing" in errors
        team.await_log("sim", "estop  smoke: every joint is damped")
        team.await_log("sim", "lies r1")
        team.await_log("sim", "lies r2")
        running.watch(lambda: True)
    assert "fall of" not in team.log("sim")


@pytest.mark.usefixtures("_compiled")
def test_an_emergency_stop_waits_for_nobody(make_team: Make, watcher: Watcher) -> None:
    """Also where it is meant for a robot that is not there, which then is named."""
    team = make_team(world__duration=FOREVER)
    larger = replace(team.config, team=replace(team.config.team, robots=3))
    file = team.folder / "larger.toml"
    file.write_text(to_toml(larger), encoding="utf-8")
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        bus = watcher(team)
        stop = subprocess.Popen(
            [*launch.QUADRIGA, "estop", "--config", str(file)], stderr=subprocess.PIPE, text=True
        )
        deadline, received = monotonic() + WAIT, False
        while not received and monotonic() < deadline:
            packet = bus.get(1.0)
            received = packet is not None and packet[0].endswith("/estop")
        assert received
        assert stop.poll() is None, "it still looks for r3"
        _, errors = stop.communicate(timeout=WAIT)
        running.watch(lambda: True)
    assert stop.returncode == 2
    assert "no r3 on the bus after 5 s" in errors
    assert "sent to r1, r2, sim at once" in errors


@pytest.mark.parametrize("verb", [("sim",), ("operate",), ("record", "-o", "RUN")])
def test_a_process_alone_names_the_absent(make_team: Make, verb: tuple[str, ...]) -> None:
    team = make_team(bus__barrier_timeout=0.5)
    file = team.folder / "config.toml"
    file.write_text(to_toml(team.config), encoding="utf-8")
    words = [str(team.folder / "alone.mcap") if word == "RUN" else word for word in verb]
    row = launch.ProcessSpec("alone", (*launch.QUADRIGA, *words, "--config", str(file)), 5.0)
    status, errors = run_alone(row)
    assert status == 2
    others = {"sim": "operator, r1, r2", "operate": "r1, r2, sim"}
    absent = others.get(verb[0], "operator, r1, r2, sim")
    assert f"no {absent} at stage 'here' after 0.5 s" in errors
    said_before = [line for line in errors.splitlines() if "waits until all are there" in line]
    assert errors.count("\n") == 1 + len(said_before)


def test_a_process_that_waits_for_the_others_can_be_stopped(make_team: Make) -> None:
    team = make_team()
    with team.launch() as running:
        sleep(0.2)
        os.kill(running.pids["operator"], signal.SIGKILL)
        with pytest.raises(ProcessError, match="process operator: got signal 9"):
            running.watch(never)
        others = list(running._running.values())
    ends = [process.returncode for process in others]
    assert len(ends) == 3
    assert not {None, -signal.SIGKILL} & set(ends)  # SIGTERM was enough

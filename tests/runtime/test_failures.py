"""A process freezes, dies or is told to stop: the others notice, say so and leave."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from dataclasses import replace

import pytest
from rich.console import Console

from quadriga.commands.parser import main
from quadriga.recordings.check import check
from quadriga.recordings.summary import summarise, summary_of
from quadriga.recordings.traces import read_traces
from quadriga.shared.codec import decode, encode
from quadriga.shared.codes import LEAD_GONE, LINK_LOST
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Event, Status
from quadriga.shared.recording.metadata import END
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import CLOCK, COMMAND, EVENT, STATE, TRUTH
from quadriga.team import launch
from quadriga.team.launch import Launch
from quadriga.team.run_report import report_folder
from tests.listening import WAIT
from tests.runtime.conftest import (
    BEGUN,
    FOREVER,
    Make,
    Team,
    Watcher,
    await_packet,
    await_tick,
    router,
    run_command,
)


def never() -> bool:
    return False


IN_BOTH_MODES = pytest.mark.parametrize(
    "mode", ["lockstep", pytest.param("realtime", marks=pytest.mark.nightly)]
)


@IN_BOTH_MODES
def test_a_frozen_robot_is_named_and_the_walk_ends(make_team: Make, mode: str) -> None:
    team = make_team(world__mode=mode, world__duration=FOREVER, world__command_timeout=3.0)
    rows = [replace(row, grace=1.0 if row.name == "r2" else row.grace) for row in team.rows()]
    with Launch(rows, team.folder / "logs") as running:
        team.await_log("sim", BEGUN)
        os.kill(running.pids["r2"], signal.SIGSTOP)
        with pytest.raises(ProcessError, match="r2 silent for"):
            running.watch(never)
    (end,) = [line for line in team.log("sim").splitlines() if "command-lost" in line]
    assert "command-lost  r2 silent for" in end


@pytest.mark.nightly
def test_in_real_time_the_world_waits_for_no_frozen_listener(
    make_team: Make, watcher: Watcher
) -> None:
    """Its buffers are full some seconds after it froze, and what must not be lost waits 5 s."""
    pushes = ",".join(f"r1:5:90:{second}:0.1" for second in range(1, 120))
    team = make_team(world__mode="realtime", world__duration=FOREVER, world__push=pushes)
    echo = (*launch.QUADRIGA, "echo", "**", "--config", team.file)
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
                if packet[0] == EVENT.key("team"):
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


def statuses(running: Launch) -> dict[str, int]:
    """Exit status of each process, once it has ended by itself."""
    return {name: process.wait(WAIT) for name, process in running._running.items()}


def check_recording(team: Team, code: str, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The recording is whole, says how it ended, and all that read it say so."""
    recording, path = team.recording(), str(team.folder / "run.mcap")
    recording.require_whole()
    assert recording.notes[END]["code"] == code
    assert "end" in {finding.name for finding in check(recording.path) if not finding.passed}
    assert main(["info", "--check", path]) == 1
    assert main(["info", path]) == 0
    assert capsys.readouterr().out.count(f"{what}: none any more after") == 2
    assert summary_of(read_traces(recording))["end_code"] == code
    with pytest.raises(ProcessError, match="the walk: got an end at"):
        report_folder(team.folder, pictures=False, console=Console(quiet=True))


@pytest.mark.usefixtures("_compiled")
def test_kill_9_of_who_drives_time(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str]
) -> None:
    team = make_team(recorder__enabled=True, world__duration=FOREVER)
    with team.launch(standing=False) as running:
        await_tick(watcher(team, TRUTH), 500)
        os.kill(running.pids["sim"], signal.SIGKILL)
        ended = statuses(running)
    others = ("r1", "r2", "operator", "recorder")
    assert ended == {"sim": -signal.SIGKILL, **dict.fromkeys(others, 1)}
    for name in others:
        last = team.log(name).splitlines()[-1]
        assert f"process sim of team 'team', seen by {name}: got none any more after" in last
    check_recording(team, LEAD_GONE, "process sim of team 'team', seen by recorder", capsys)
    for robot in ("r1", "r2"):  # what the plant could no longer tell, its agents have told
        said = re.search(r"after (\d+\.\d{3}) s", team.log(robot))
        assert said is not None
        for topic in (STATE, COMMAND):
            entries = team.recording().entries(keys={topic.key("team", robot)})
            assert [entry.tick for entry in entries] == [*range(1 + round(1000 * float(said[1])))]


@pytest.mark.usefixtures("_compiled")
@IN_BOTH_MODES
def test_kill_9_of_the_router(
    make_team: Make, watcher: Watcher, capsys: pytest.CaptureFixture[str], mode: str
) -> None:
    keys = {"bus__mode": "client", "world__mode": mode}
    team = make_team(recorder__enabled=True, world__duration=FOREVER, **keys)
    endpoint = team.config.bus.endpoint
    with router(endpoint) as process, team.launch(standing=False) as running:
        await_tick(watcher(team, TRUTH), 500)
        process.kill()
        ended = statuses(running)
    assert ended == dict.fromkeys(("sim", "r1", "r2", "operator", "recorder"), 1)
    for name in ended:
        link = f"link of {name} to the router at {endpoint}: got none any more after"
        assert link in team.log(name).splitlines()[-1]
    check_recording(team, LINK_LOST, f"link of recorder to the router at {endpoint}", capsys)


def test_a_stopped_sim_server_ends_the_walk_for_all(make_team: Make) -> None:
    team = make_team(world__duration=FOREVER)
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        os.kill(running.pids["sim"], signal.SIGTERM)
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
        for number in range(20):
            tick = await_tick(bus, 1000 + 100 * number, CLOCK)
            say(encode(Event.of(tick, "signal", "", "forged")))
        running.watch(never)
    summary = summarise(team.folder)
    assert summary["end"].startswith("end of world.duration")
    assert (summary["fallen"], summary["stop_reasons"], summary["gaps"]) == ([], {}, 0)
    assert max(entry.tick for entry in team.recording().entries({COMMAND.name})) >= 3999


@pytest.mark.usefixtures("_compiled")
def test_a_stopped_agent_leaves_cleanly_and_the_walk_stops(
    make_team: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "_EARLY", 0.3)
    team = make_team(team__robots=1, world__duration=FOREVER)
    with team.launch(standing=False) as running:
        team.await_log("sim", BEGUN)
        os.kill(running.pids["r1"], signal.SIGINT)
        with pytest.raises(ProcessError, match="process r1: got an end while the team walked"):
            running.watch(never)
    said = team.log("r1").splitlines()
    assert said[-1] == "quadriga: r1: the team walks"
    assert all(line.startswith("quadriga: r1") for line in said)


@pytest.mark.usefixtures("_compiled")
def test_an_emergency_stop_damps_every_robot(make_team: Make, watcher: Watcher) -> None:
    team = make_team(world__duration=FOREVER)
    modes: dict[str, str] = {}

    def all_stopped(key: str, payload: bytes) -> bool:
        if key.endswith("/status") and (status := decode(payload, Status)).mode == "estop":
            modes[key] = status.reason
        return len(modes) == 2

    with team.launch(standing=False) as running:
        team.await_log("sim", BEGUN)
        bus = watcher(team)
        assert run_command("estop", "--reason", "smoke", "--config", team.file) == (0, "")
        await_packet(bus, all_stopped)
        assert modes == {f"team/{robot}/status": "estop:smoke" for robot in ("r1", "r2")}
        running.watch(lambda: True)


@IN_BOTH_MODES
def test_the_world_obeys_an_emergency_stop_whatever_the_agents_do(
    make_team: Make, mode: str
) -> None:
    """These stand on: they have never heard of an emergency stop."""
    team = make_team(world__duration=FOREVER, world__mode=mode)
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        status, errors = run_command("estop", "--reason", "smoke", "--config", team.file)
        assert status == 2, "no agent says that it has stopped"
        assert "no word of r1, r2 after 0.5 s; r1: says nothing, r2: says nothing" in errors
        for text in ("estop  smoke: every joint is damped", "lies r1", "lies r2"):
            team.await_log("sim", text)
        running.watch(lambda: True)
    assert "fall of" not in team.log("sim")


def test_an_emergency_stop_waits_for_nobody(make_team: Make, watcher: Watcher) -> None:
    """Also where it is meant for a robot that is not there, which then is named."""
    team = make_team(world__duration=FOREVER)
    larger = replace(team.config, team=replace(team.config.team, robots=3))
    (team.folder / "larger").mkdir()
    file = Team(larger, team.folder / "larger").file
    with team.launch() as running:
        team.await_log("sim", BEGUN)
        bus = watcher(team)
        estop = (*launch.QUADRIGA, "estop", "--config", file)
        with subprocess.Popen(estop, stderr=subprocess.PIPE, text=True) as stop:
            await_packet(bus, lambda key, _: key.endswith("/estop"))
            assert stop.poll() is None, "it still looks for r3"
            _, errors = stop.communicate(timeout=WAIT)
        running.watch(lambda: True)
    assert stop.returncode == 2
    assert "no r3 on the bus after 5 s" in errors
    assert "sent to r1, r2, sim at once" in errors


@pytest.mark.parametrize(
    ("verb", "absent"),
    [
        (("sim",), "operator, r1, r2"),
        (("operate",), "r1, r2, sim"),
        (("record", "-o", "alone.mcap"), "operator, r1, r2, sim"),
    ],
)
def test_a_process_alone_names_the_absent(
    make_team: Make, verb: tuple[str, ...], absent: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    team = make_team(bus__barrier_timeout=0.5)
    monkeypatch.chdir(team.folder)
    status, errors = run_command(*verb, "--config", team.file)
    assert status == 2
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

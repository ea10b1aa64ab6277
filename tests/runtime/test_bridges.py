"""The whole path of a real robot, on simulated ones that speak its protocol, in real time."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from quadriga.shared import members
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.messages import EStop, Event, Measurement
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import ESTOP
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import QUADRIGA
from tests.bridges.test_udp_driver import HOST, free_port
from tests.listening import WAIT, await_true

# A machine that runs other tests stalls longer than a robot's may.
PATIENT: dict[str, Any] = {
    "runtime.priority": "ordinary",  # else two of them leave nothing to the other processes
    "bridge.hold_ms": 200,
    "bridge.damp_ms": 1000,
    "bridge.report_max_ms": 1000,
    "bridge.report_share": 0.05,
    "bridge.stand_s": 2.0,
    "bridge.passive_s": 1.0,
    "bridge.speed_share": 1.5,
}

pytestmark = pytest.mark.usefixtures("_compiled")


@pytest.fixture
def config(request: pytest.FixtureRequest) -> Config:
    """A robot on this machine's loopback."""
    return load(
        overrides=PATIENT
        | {
            "team.robot": request.param,
            "team.robots": 1,
            "team.plant": "robots",
            "team.plant_per_robot": True,
            "world.mode": "realtime",
            "world.duration": 2.0,
            "planner.kind": "none",
            "bus.endpoint": free_endpoint(),
            "bridge.endpoint": f"{HOST}:{free_port()}",
            "bridge.listen": f"{HOST}:{free_port()}",
            "bridge.interface": "lo",
            "bridge.domain": 150 + os.getpid() % 40,  # tests run side by side
        }
    )


@pytest.fixture
def file(config: Config, tmp_path: Path) -> Path:
    path = tmp_path / "team.toml"
    path.write_text(to_toml(config), encoding="utf-8")
    return path


@pytest.fixture
def robots(config: Config, file: Path, tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The simulated robots, on the network."""
    log = tmp_path / "robots.log"
    with log.open("wb") as out:
        command = [*QUADRIGA, "sim", "--as", config.team.robot, "--config", str(file)]
        command += ["--parent", str(os.getpid())]
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    said = partial(log.read_text, encoding="utf-8")
    await_true(lambda: "on the network" in said() or process.poll() is not None, said)
    assert process.poll() is None, said()
    yield process
    process.kill()
    process.wait()


def walk(file: Path, out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [*QUADRIGA, "walk", "--config", str(file), "--out", str(out), "--no-report", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=2 * WAIT, check=False)


def modes_of(recording: Recording) -> list[str]:
    return [e.detail for e in recording.messages(Event) if e.code == "bridge-mode"]


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
@pytest.mark.parametrize("link", ["local", "bus"])
@pytest.mark.parametrize("config", ["a1"], indirect=True)
def test_a_robot_stands_up_walks_and_lies_down_through_its_own_protocol(
    file: Path, robots: subprocess.Popen[bytes], tmp_path: Path, link: str
) -> None:
    out = tmp_path / "run"
    done = walk(file, out, "--armed", "--set", f"plant.link={link}")
    said = (out / "logs" / "plant_r1.log").read_text(encoding="utf-8")
    ways = ["r1: standing-up", "r1: stand", "r1: walk"]
    # Where a busy machine gives it too little time it stops, with a reason: a good end, too.
    stopped = "r1: estop " in said or "r1 stopped" in done.stdout
    ways += [] if "r1: estop " in said else ["r1: lying-down", "r1: releasing", "r1: passive"]
    assert [way for way in ways if way in said] == ways, said
    assert stopped or done.returncode == 0, done.stdout + done.stderr
    recording = Recording(out / "run.mcap")
    told = [mode.partition(",")[0] for mode in modes_of(recording)]
    assert told[:3] == ["standing-up", "stand", "walk"]
    after = ["lying-down", "releasing", "passive"]  # as long as there is a recorder
    assert stopped or told[3:] == after[: len(told) - 3]
    if not stopped:
        assert max(m.y[1] for m in recording.messages(Measurement, "r1")) > 0.3, "it walks"
    assert replay_all(out) == ""
    robots.terminate()
    assert robots.wait(WAIT) == 0


def replay_all(out: Path) -> str:
    """What differs when all agents are replayed, up to an input that the recorder lost."""
    command = [*QUADRIGA, "replay", str(out), "--all"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=WAIT, check=False)
    said = done.stdout + done.stderr
    whole = "equal to the byte" in said and "differ" not in said
    lost = done.returncode == 1 and "input missing from the recording" in said
    return "" if whole and (done.returncode == 0 or lost) else said


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
@pytest.mark.usefixtures("robots")
@pytest.mark.parametrize("config", ["go2"], indirect=True)
def test_a_bridge_hears_the_emergency_stop_whatever_its_agent_does(
    config: Config, file: Path, tmp_path: Path
) -> None:
    out, log = tmp_path / "run", tmp_path / "robots.log"
    command = [*QUADRIGA, "walk", "--config", str(file), "--out", str(out), "--no-report"]
    command += ["--armed", "--seconds", "60"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as walking:
        said = out / "logs" / "plant_r1.log"
        await_true(lambda: said.is_file() and "r1: walk" in said.read_text(encoding="utf-8"))
        agent = process_of(out, "r1")
        with Bus.open(config.bus, config.team.name, members.ESTOP) as bus:
            put = bus.publisher(ESTOP.key(config.team.name))
            await_true(lambda: "r1" in bus.members_at(HERE))
            os.kill(agent, signal.SIGSTOP)
            put(encode(EStop(0, 0, "dog")))  # long before the agent's silence stops the robot
        await_true(lambda: "r1: estop " in said.read_text(encoding="utf-8"))
        await_true(lambda: motors_of(log)[-1] == "motors off")
        os.kill(agent, signal.SIGKILL)
        walking.terminate()
    assert "r1: estop estop:dog" in said.read_text(encoding="utf-8")


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
@pytest.mark.usefixtures("robots")
@pytest.mark.parametrize("config", ["a1"], indirect=True)
def test_who_presses_the_emergency_stop_while_a_robot_stands_up_hears_that_it_is_damped(
    file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    command = [
        *QUADRIGA,
        "walk",
        "--config",
        str(file),
        "--out",
        str(out),
        "--armed",
        "--no-report",
    ]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as walking:
        said = out / "logs" / "plant_r1.log"
        await_true(lambda: said.is_file() and "standing-up" in said.read_text(encoding="utf-8"))
        pressed = [*QUADRIGA, "estop", "--config", str(file)]
        done = subprocess.run(pressed, capture_output=True, text=True, timeout=WAIT, check=False)
        assert (done.returncode, "stopped r1" in done.stdout) == (0, True), done.stderr
        assert walking.wait(WAIT) == 1


@pytest.mark.parametrize("config", ["a1"], indirect=True)
def test_a_robot_that_is_off_is_one_clear_error(file: Path, tmp_path: Path) -> None:
    done = walk(file, tmp_path / "run", "--armed")
    assert done.returncode == 1
    assert "robot r1: reports: got 0 in 1 s, expected at least" in done.stderr
    assert "Traceback" not in done.stderr


def process_of(run: Path, name: str) -> int:
    """The process of a walk whose output is in the log of this name."""
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if os.readlink(folder / "fd" / "1") == str(run / "logs" / f"{name}.log"):
                return int(folder.name)
    return 0


def watchdogs() -> set[str]:
    """Watchdogs that run, by their process."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if b"quadriga.bridges.watchdog" in (folder / "cmdline").read_bytes():
                found.add(folder.name)
    return found


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
@pytest.mark.usefixtures("robots")
@pytest.mark.parametrize(
    ("config", "number"), [("a1", signal.SIGKILL), ("go2", signal.SIGSTOP)], indirect=["config"]
)
def test_a_bridge_that_dies_or_hangs_leaves_a_robot_that_is_damped_and_then_passive(
    file: Path, tmp_path: Path, number: signal.Signals
) -> None:
    out, log, before = tmp_path / "run", tmp_path / "robots.log", watchdogs()
    command = [*QUADRIGA, "walk", "--config", str(file), "--out", str(out), "--no-report"]
    command += ["--armed", "--seconds", "60"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as walking:
        said = out / "logs" / "plant_r1.log"
        await_true(lambda: said.is_file() and "r1: walk" in said.read_text(encoding="utf-8"))
        assert motors_of(log)[-1] == "motors driven"
        bridge = process_of(out, "plant_r1")
        os.kill(bridge, number)
        await_true(lambda: motors_of(log)[-1] == "motors off")
        assert motors_of(log)[-3:] == ["motors driven", "motors damped", "motors off"]
        await_true(lambda: watchdogs() <= before)  # it leaves by itself
        if number is signal.SIGSTOP:
            os.kill(bridge, signal.SIGCONT)
            await_true(lambda: "r1: estop " in said.read_text(encoding="utf-8"))
        walking.terminate()


def motors_of(log: Path) -> list[str]:
    """What the simulated robots have said of the motors of r1."""
    said = (line.partition("r1 ")[2] for line in log.read_text(encoding="utf-8").splitlines())
    return [text for text in said if text.startswith("motors ")]

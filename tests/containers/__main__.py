"""`make test-containers`: a team in real containers, one agent of which is killed.

It builds the image, makes the certificates, starts the services of docker-compose.yml, waits until
the engine finds all of them healthy, kills the agent of r2 in the midst of the walk, which ends
then, reads the recording, and takes everything down. The exit status is 0 if all went as it
should, 1 if not, 2 if there is no engine.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

from quadriga.recordings.check import check, format_findings
from quadriga.recordings.traces import read_traces
from quadriga.shared import codes
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from tests.containers.engine import CommandError, Containers, find_engine

ROBOTS: Final = 2
KILLED: Final = "r2"
SERVICES: Final = ("router", "doctor", "recorder", "sim", "r1", "r2", "operator")
TEAM: Final = """
[bus]
mode = "client"
endpoint = "tls/router:7447"
certificates = "/secrets"
barrier_timeout = 300.0

[world]
duration = {seconds}

[identification]
seconds = 60.0
"""
_PATIENCE: Final = 240.0  # s, far more than any step takes on a busy machine
_LOOK: Final = 2.0  # s; each look starts processes beside those that walk, so few look at once
_BEGUN = monotonic()


class Failure(Exception):
    """Something was not as it should be."""


def say(text: str) -> None:
    print(f"{monotonic() - _BEGUN:6.1f} s  {text}", flush=True)


def expect(condition: bool, text: str) -> None:
    """Fail with this text if something is not so."""
    if not condition:
        raise Failure(text)


def wait_until(condition: Callable[[], str], what: str) -> None:
    """Wait until `condition()` names nothing that is missing."""
    deadline = monotonic() + _PATIENCE
    while missing := condition():
        expect(monotonic() < deadline, f"not {what} after {_PATIENCE:g} s: {missing}")
        sleep(_LOOK)
    say(what)


def unwell(team: Containers) -> str:
    """The first service that is not healthy, and why."""
    found = next((name for name in SERVICES if not team.is_healthy(name)), None)
    return f"{found}: {team.health(found)}" if found else ""


def unaware(team: Containers) -> str:
    """The first of those that walk that does not say yet that it cannot hear the killed one."""
    names = [name for name in SERVICES if name not in (KILLED, "router", "doctor")]
    said = ((name, team.health(name)) for name in names)
    return next((f"{name}: {text}" for name, text in said if f"hear {KILLED}" not in text), "")


def walk(team: Containers, folder: Path) -> None:
    """Walk in containers, kill an agent, and judge what was recorded."""
    team.build()
    say("image built")
    team.up(*SERVICES)
    say("certificates made, predictor fitted, all started")
    wait_until(lambda: unwell(team), "all services are healthy")
    team.kill(KILLED)
    for name in SERVICES:
        if name not in ("router", "doctor"):
            team.wait(name, _PATIENCE)
    say("the walk is over, all have left")
    expect(f"{KILLED} gone" in team.log("sim"), team.log("sim"))
    statuses = {name: team.status(name) for name in ("r1", "operator")}
    expect(not any(statuses.values()), f"{statuses}")
    team.copy("recorder", "/work/runs", folder)
    judge(folder)


def judge(folder: Path) -> None:
    """Hold the recording against the rules: nobody fell, the end names who was killed."""
    (run,) = folder.iterdir()
    findings = check(run / "run.mcap")
    said = "\n".join(format_findings(findings))
    expect(all(finding.passed for finding in findings if finding.name != "gaps"), said)
    events = {event.code for event in read_traces(Recording(run / "run.mcap")).events}
    expect(codes.FALL not in events, "a robot fell")
    expect(codes.COMMAND_LOST in events, f"{events}")
    wanted = {"run.mcap", "summary.json", "report.html", "walk.png"}
    expect(wanted <= {path.name for path in run.iterdir()}, "the report is not whole")
    say(f"the recording is whole, nobody fell; events: {', '.join(sorted(events))}")


def main() -> int:
    """Run it; the exit status."""
    parser = argparse.ArgumentParser(prog="make test-containers", description=__doc__)
    parser.add_argument("--seconds", type=float, default=40.0, help="of the walk")
    arguments = parser.parse_args()
    interrupt_on_sigterm()  # whoever ends it leaves nothing behind either
    engine = find_engine()
    if engine is None:
        print(
            "test-containers: neither Docker with Compose nor Podman with podman-compose runs here",
            file=sys.stderr,
        )
        return 2
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = TEAM.format(seconds=arguments.seconds)
        (folder / "team.toml").write_text(text, encoding="utf-8")
        (folder / "runs").mkdir()
        variables = {"TEAM": str(folder / "team.toml"), "TEAM_SIZE": str(ROBOTS)}
        team, status = Containers(engine, variables), 1
        try:
            walk(team, folder / "runs")
            status = 0
        except (Failure, CommandError) as error:
            print(f"test-containers: {error}", file=sys.stderr)
            _show_logs(team)
        finally:
            team.down()
    if left := team.left():
        print(f"test-containers: left behind: {', '.join(left)}", file=sys.stderr)
        return 1
    say(f"all is taken down; {'passed' if status == 0 else 'failed'}")
    return status


def _show_logs(team: Containers) -> None:
    for service in SERVICES:
        try:
            print(f"--- {service}\n{team.log(service)[-1500:]}", file=sys.stderr)
        except (CommandError, IndexError):
            print(f"--- {service}: no container", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())

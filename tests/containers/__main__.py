"""`make test-containers`: a team in real containers, one agent of which is killed.

It builds the image, makes the certificates, starts the services of docker-compose.yml, waits until
the engine finds all of them healthy, kills the agent of r2 in the midst of the walk, which ends
then, reads the recording, and takes everything down. The exit status is 0 if all went as it
should, 1 if not, 2 if there is no engine.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from quadriga.recordings.check import check, format_findings
from quadriga.recordings.traces import read_traces
from quadriga.shared import codes
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.signals import interrupt_on_sigterm

TOP: Final = Path(__file__).parents[2]
PROJECT: Final = "quadriga-test"
IMAGE: Final = "quadriga:test"  # not the user's own
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
# What runs containers: its command, and the one that reads docker-compose.yml.
ENGINES: Final = {"docker": ("docker", "compose"), "podman": ("podman-compose",)}
_PATIENCE: Final = 240.0  # s, far more than any step takes on a busy machine
_LOOK: Final = 2.0  # s; each look starts processes beside those that walk, so few look at once
_LAST: Final = 2000  # characters of what a command that failed has said
_BEGUN = monotonic()


class Failure(Exception):
    """Something was not as it should be."""


def find_engine() -> str:
    """The first engine that runs here and has its Compose; "" if there is none."""
    for engine, compose in ENGINES.items():
        if shutil.which(engine) and shutil.which(compose[0]):
            asked = ([engine, "info"], [*compose, "version"])
            if all(subprocess.run(c, capture_output=True).returncode == 0 for c in asked):
                return engine
    return ""


class Containers:
    """The services of docker-compose.yml as a project of their own.

    Args:
        engine: what runs them.
        variables: what docker-compose.yml is told by the environment.
    """

    def __init__(self, engine: str, variables: Mapping[str, str]) -> None:
        self._engine = engine
        self._environment = {**os.environ, "IMAGE": IMAGE, **variables}
        self._names: dict[str, str] = {}

    def build(self) -> None:
        """Build the image; BUILD_OPTIONS of the environment are the engine's own."""
        given = self._environment
        options = shlex.split(given.get("BUILD_OPTIONS", ""))
        for name in ("BASE", "GL"):
            if given.get(name):
                options += ["--build-arg", f"{name}={given[name]}"]
        self.run("build", *options, "-t", IMAGE, "-f", "deploy/Dockerfile", ".")

    def compose(self, *words: str) -> None:
        """Have Compose do something with the project."""
        self._call([*ENGINES[self._engine], "-f", "docker-compose.yml", "-p", PROJECT, *words])

    def down(self) -> None:
        """Stop and remove all that this project has, and its image."""
        self.compose("down", "-v", "-t", "30")
        if self.run("images", "-q", IMAGE).strip():
            self.run("rmi", IMAGE)

    def is_healthy(self, service: str) -> bool:
        """Whether the engine finds a service healthy, by the check of docker-compose.yml."""
        name = self.container(service)
        if self._engine == "docker":
            return self.run("inspect", "-f", "{{.State.Health.Status}}", name).strip() == "healthy"
        command = ["podman", "healthcheck", "run", name]  # no systemd need run its timers
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    def log(self, service: str) -> str:
        """What a service has said."""
        command = [self._engine, "logs", self.container(service)]
        out, both = subprocess.PIPE, subprocess.STDOUT
        return subprocess.run(command, text=True, check=False, stdout=out, stderr=both).stdout

    def container(self, service: str) -> str:
        """The name of a service's container."""
        if service not in self._names:
            labels = {"project": PROJECT, "service": service}
            filters = [f"--filter=label=com.docker.compose.{k}={v}" for k, v in labels.items()]
            found = self.run("ps", "-a", *filters, "--format", "{{.Names}}").split()
            self._names[service] = found[0] if found else "none"
        return self._names[service]

    def run(self, *words: str, timeout: float | None = None) -> str:
        """What a command of the engine says.

        Raises:
            Failure: it failed, or took longer than `timeout` seconds.
        """
        return self._call([self._engine, *words], timeout)

    def _call(self, command: list[str], timeout: float | None = None) -> str:
        try:
            done = subprocess.run(
                command,
                cwd=TOP,
                env=self._environment,
                timeout=timeout,
                capture_output=True,
                text=True,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise Failure(f"{shlex.join(command)}: not done after {timeout:g} s") from None
        if done.returncode:
            said = f"{done.stdout}{done.stderr}"[-_LAST:]
            raise Failure(f"{shlex.join(command)}: exit status {done.returncode}\n{said}")
        return str(done.stdout)


def say(text: str) -> None:
    print(f"{monotonic() - _BEGUN:6.1f} s  {text}", flush=True)


def expect(condition: bool, text: str) -> None:
    """Fail with this text if something is not so."""
    if not condition:
        raise Failure(text)


def walk(team: Containers, folder: Path) -> None:
    """Walk in containers, kill an agent, and judge what was recorded."""
    team.build()
    say("image built")
    team.compose("up", "-d", "--no-build", *SERVICES)
    say("certificates made, predictor fitted, all started")
    deadline = monotonic() + _PATIENCE
    while unwell := [name for name in SERVICES if not team.is_healthy(name)]:
        expect(monotonic() < deadline, f"not healthy after {_PATIENCE:g} s: {', '.join(unwell)}")
        sleep(_LOOK)
    say("all services are healthy")
    team.run("kill", "--signal", "KILL", team.container(KILLED))
    for name in SERVICES:
        if name not in ("router", "doctor"):
            team.run("wait", team.container(name), timeout=_PATIENCE)
    say("the walk is over, all have left")
    expect(f"{KILLED} gone" in team.log("sim"), team.log("sim"))
    for name in ("r1", "operator"):
        status = team.run("inspect", "-f", "{{.State.ExitCode}}", team.container(name)).strip()
        expect(status == "0", f"{name}: exit status {status}")
    team.run("cp", f"{team.container('recorder')}:/work/runs/.", str(folder))
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
    if not engine:
        expected = "neither Docker with Compose nor Podman with podman-compose runs here"
        print(f"test-containers: {expected}", file=sys.stderr)
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
        except Failure as error:
            print(f"test-containers: {error}", file=sys.stderr)
            for service in SERVICES:
                print(f"--- {service}\n{team.log(service)[-1500:]}", file=sys.stderr)
        finally:
            team.down()
    say(f"all is taken down; {'passed' if status == 0 else 'failed'}")
    return status


if __name__ == "__main__":
    sys.exit(main())

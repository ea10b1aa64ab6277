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
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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
_LABEL: Final = "com.docker.compose"
_LAST: Final = 2000  # characters of what a command that failed has said
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


@dataclass(frozen=True, slots=True)
class Engine:
    """What runs containers.

    Attributes:
        name: its command.
        compose: the command that reads docker-compose.yml.
    """

    name: str
    compose: tuple[str, ...]


ENGINES: Final = (Engine("docker", ("docker", "compose")), Engine("podman", ("podman-compose",)))


def find_engine() -> Engine | None:
    """The first engine that runs here and has its Compose."""
    for engine in ENGINES:
        if shutil.which(engine.name) and shutil.which(engine.compose[0]):
            asked = ([engine.name, "info"], [*engine.compose, "version"])
            if all(
                subprocess.run(c, capture_output=True, check=False).returncode == 0 for c in asked
            ):
                return engine
    return None


class CommandError(Exception):
    """An engine's command failed."""


class Containers:
    """The services of docker-compose.yml as a project of their own.

    Args:
        engine: what runs them.
        variables: what docker-compose.yml is told by the environment.
    """

    def __init__(self, engine: Engine, variables: Mapping[str, str]) -> None:
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
        self._run("build", *options, "-t", IMAGE, "-f", "deploy/Dockerfile", ".", shown=True)

    def up(self, *services: str) -> None:
        """Start services, and do not wait for them."""
        self._compose("up", "-d", "--no-build", *services)

    def down(self) -> None:
        """Stop and remove all that this project has, and its image."""
        self._compose("down", "-v", "-t", "30")
        if self._run("images", "-q", IMAGE).strip():
            self._run("rmi", IMAGE)

    def left(self) -> list[str]:
        """What is left of this project."""
        mine = ("--filter", f"label={_LABEL}.project={PROJECT}")
        kinds = (("ps", "-a", "-q"), ("volume", "ls", "-q"), ("network", "ls", "-q"))
        return [line for kind in kinds for line in self._run(*kind, *mine).split()]

    def is_healthy(self, service: str) -> bool:
        """Whether the engine finds a service healthy, by the check of docker-compose.yml."""
        name = self.container(service)
        if self._engine.name == "docker":
            return self._run("inspect", "-f", "{{.State.Health.Status}}", name).strip() == "healthy"
        command = ["podman", "healthcheck", "run", name]  # no systemd need run its timers
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    def health(self, service: str) -> str:
        """What the check of a service that runs says."""
        command = [self._engine.name, "exec", self.container(service), "healthy", service]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return (done.stdout + done.stderr).strip()

    def status(self, service: str) -> int:
        """The last exit status of a service's container."""
        return int(self._run("inspect", "-f", "{{.State.ExitCode}}", self.container(service)))

    def kill(self, service: str) -> None:
        """Have a service's container vanish without a word."""
        self._run("kill", "--signal", "KILL", self.container(service))

    def log(self, service: str) -> str:
        """What a service has said."""
        done = subprocess.run(
            [self._engine.name, "logs", self.container(service)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        return done.stdout

    def copy(self, service: str, source: str, target: Path) -> None:
        """Copy a folder's content out of a service's container."""
        self._run("cp", f"{self.container(service)}:{source}/.", str(target))

    def wait(self, service: str, timeout: float) -> None:
        """Wait until a service's container has ended.

        Raises:
            CommandError: it runs still after `timeout` seconds.
        """
        self._call([self._engine.name, "wait", self.container(service)], timeout=timeout)

    def container(self, service: str) -> str:
        """The name of a service's container."""
        if service not in self._names:
            self._names[service] = self._find(service)
        return self._names[service]

    def _find(self, service: str) -> str:
        labels = {"project": PROJECT, "service": service}
        filters = [
            word
            for key, value in labels.items()
            for word in ("--filter", f"label={_LABEL}.{key}={value}")
        ]
        return self._run("ps", "-a", *filters, "--format", "{{.Names}}").split()[0]

    def _compose(self, *words: str) -> str:
        return self._call(
            [*self._engine.compose, "-f", "docker-compose.yml", "-p", PROJECT, *words]
        )

    def _run(self, *words: str, shown: bool = False) -> str:
        return self._call([self._engine.name, *words], shown=shown)

    def _call(
        self, command: list[str], *, shown: bool = False, timeout: float | None = None
    ) -> str:
        """Run a command in the top folder; what it says.

        Raises:
            CommandError: it failed, or took longer than `timeout` seconds.
        """
        try:
            done = subprocess.run(
                command,
                cwd=TOP,
                env=self._environment,
                stdout=sys.stderr if shown else subprocess.PIPE,
                stderr=None if shown else subprocess.PIPE,
                text=True,
                check=False,
                timeout=timeout,
            )
        except subprocess.TimeoutExpired:
            raise CommandError(f"{shlex.join(command)}: not done after {timeout:g} s") from None
        if done.returncode:
            said = f"{done.stdout or ''}{done.stderr or ''}"[-_LAST:]
            raise CommandError(f"{shlex.join(command)}: exit status {done.returncode}\n{said}")
        return done.stdout or ""


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

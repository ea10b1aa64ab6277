"""Docker or Podman, whichever is here, and the containers of one project of docker-compose.yml."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

TOP: Final = Path(__file__).parents[2]
PROJECT: Final = "quadriga-test"
IMAGE: Final = "quadriga:test"  # not the user's own
_LABEL: Final = "com.docker.compose"
_LAST: Final = 2000  # characters of what a command that failed has said


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

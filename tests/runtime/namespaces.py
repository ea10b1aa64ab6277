"""Several computers on one network, in namespaces of this one: needs root and iproute2."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Final

_SWITCH: Final = "switch"
_MASK: Final = 24


def why_not() -> str:
    """Why no namespaces can be made here; "" if they can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if shutil.which("ip") is None:
        return "network namespaces need iproute2"
    probe = _name("probe")
    made = subprocess.run(
        ["ip", "netns", "add", probe], capture_output=True, text=True, check=False
    )
    if made.returncode:
        return f"network namespaces cannot be made here: {made.stderr.strip()}"
    _ip("netns", "del", probe)
    return ""


@contextmanager
def computers(names: Sequence[str]) -> Iterator[dict[str, str]]:
    """Namespaces that reach each other over a bridge, and nothing else; their addresses by name."""
    with ExitStack() as stack:
        switch = _add(stack, _SWITCH)
        _ip("-n", switch, "link", "add", "bridge", "type", "bridge")
        _ip("-n", switch, "link", "set", "bridge", "up")
        addresses = {}
        for number, name in enumerate(names, 1):
            own, addresses[name] = _add(stack, name), f"10.77.0.{number}"
            port = f"port{number}"
            link = f"link add eth0 netns {own} type veth peer name {port} netns {switch}"
            _ip(*link.split())
            _ip("-n", switch, "link", "set", port, "master", "bridge", "up")
            _ip("-n", own, "addr", "add", f"{addresses[name]}/{_MASK}", "dev", "eth0")
            _ip("-n", own, "link", "set", "eth0", "up")
        yield addresses


def on(name: str, command: Sequence[str]) -> tuple[str, ...]:
    """The command line that runs a command on one of these computers, as the same process."""
    return ("ip", "netns", "exec", _name(name), *command)


def _add(stack: ExitStack, name: str) -> str:
    """A new namespace, which the stack removes; what it is called by the system."""
    namespace = _name(name)
    _ip("netns", "add", namespace)
    stack.callback(_ip, "netns", "del", namespace)
    _ip("-n", namespace, "link", "set", "lo", "up")
    return namespace


def _name(name: str) -> str:
    return f"quadriga-{os.getpid()}-{name}"


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)

"""How far apart the plants of two robots begin the same tick, in real time.

They are processes with clocks of their own, as on two computers: where the user may make time
namespaces, that of the second is 1000 s ahead. The wall clock, which both see, is the judge.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.children import SPAWN, child, running
from quadriga.shared.bus.discovery import join
from quadriga.shared.bus.session import HERE, POLL, READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.members import OPERATOR, has_lead
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.runtime.clock import sleep
from quadriga.team.endpoint import free_endpoint

_AHEAD: Final = ("unshare", "--time", "--monotonic", "1000", "--fork", "--kill-child")
_PLANT: Final = (sys.executable, "-m", "benchmarks.metronome")
_PATIENCE: Final = 60.0  # s, beyond the walk


def measure(seconds: float, busy: int, priority: str) -> dict[str, Any]:
    """Median, p99 and greatest distance of a tick's beginnings, µs.

    Args:
        seconds: of the walk.
        busy: processes beside it that keep a core busy.
        priority: `runtime.priority` of the plants.

    Raises:
        ChildProcessError: a plant failed.
    """
    config = load(
        None,
        {
            "team.robots": 2,
            "team.yokes": "none",
            "team.plants": "each",
            "world.mode": "realtime",
            "world.seconds": seconds,
            "planner.kind": "none",
            "recorder.enabled": False,
            "bus.endpoint": free_endpoint(),
            "runtime.priority": priority,
        },
    )
    names, ended = robot_names(2), SPAWN.Event()
    others = [child(_member, config, name) for name in (*names, OPERATOR)]
    loads = [child(_burn, ended) for _ in range(busy)]
    apart = may_set_clocks()
    with tempfile.TemporaryDirectory() as folder, running(*others, *loads):
        file = Path(folder) / "config.toml"
        file.write_text(to_toml(config), encoding="utf-8")
        outs = [Path(folder) / f"{name}.npz" for name in names]
        commands = [
            (*(_AHEAD if apart and k else ()), *_PLANT, str(file), name, str(out))
            for k, (name, out) in enumerate(zip(names, outs, strict=True))
        ]
        _run_together(commands, seconds + _PATIENCE)
        ended.set()
        found = [np.load(out) for out in outs]
        clocks = "1000 s apart" if apart else "the same"
        return {"clocks": clocks, "busy": busy, "priority": priority, **_compare(found)}


def may_set_clocks() -> bool:
    """Whether this user may start processes with another monotonic clock."""
    if shutil.which(_AHEAD[0]) is None:
        return False
    return subprocess.run([*_AHEAD, "true"], capture_output=True, check=False).returncode == 0


def _compare(found: list[Any]) -> dict[str, Any]:
    ticks = min(len(each["begun"]) for each in found)
    first, second = (each["begun"][:ticks] for each in found)
    apart = 1e-3 * np.abs(second - first)
    median, p99 = np.percentile(apart, (50, 99))
    return {
        "ticks": ticks,
        "median_us": float(median),
        "p99_us": float(p99),
        "max_us": float(np.max(apart)),
        "within_1_ms": float(np.mean(apart <= 1000.0)),
        "stated_us": 1e3 * float(np.max(found[1]["errors"])),
        "gap_ms": [
            float(f(np.diff(each["begun"]))) * 1e-6 for each in found for f in (np.min, np.max)
        ],
    }


def _run_together(commands: Sequence[Sequence[str]], patience: float) -> None:
    with ExitStack() as stack:
        plants = [
            stack.enter_context(subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
            for command in commands
        ]
        try:
            for plant in plants:
                _, said = plant.communicate(timeout=patience)
                if plant.returncode:
                    raise ChildProcessError(f"a plant of the benchmark failed: {said[-500:]}")
        except subprocess.TimeoutExpired:
            raise ChildProcessError("a plant of the benchmark does not end") from None
        finally:
            for plant in plants:
                plant.kill()


def _member(config: Config, name: str) -> None:
    """Any other process of the team: it is there until the walk is over."""
    with Bus.open(config.bus, config.team.name, name) as bus:
        if join(bus, config, lambda: False):
            bus.declare(READY)
        while has_lead(bus.members_at(HERE)):
            sleep(POLL)


def _burn(ended: Event) -> None:
    """Keep a core busy."""
    while not ended.is_set():
        sum(range(100_000))

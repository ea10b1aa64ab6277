"""Time from the command of a walk to its first tick, with everything compiled and fitted before.

In turns with it the time of an interpreter that imports what an agent's process needs.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.recording.metadata import RECORDING
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, wall_ns
from quadriga.shared.topics import STATE
from quadriga.team.endpoint import free_endpoint

_IMPORTS = "import quadriga.commands.parser, quadriga.agents.process"


def measure(config: Config, walks: int) -> dict[str, Any]:
    """Starts of a team's walks, each of which ends at once.

    Args:
        config: the team's configuration; its predictor, if it needs one, has been fitted.
        walks: how many are started.
    """
    starts, imports = [], []
    for _ in range(walks):
        starts.append(_start(config))
        imports.append(_import())
    return {
        "robots": config.team.robots,
        "seconds": starts,
        "imports": imports,
        "median": median(starts),
        "ratio": median(start / alone for start, alone in zip(starts, imports, strict=True)),
    }


def _start(config: Config) -> float:
    """From the command to the first recorded state, s."""
    with tempfile.TemporaryDirectory() as scratch:
        file, folder = Path(scratch, "config.toml"), Path(scratch, "run")
        own = replace(config, bus=replace(config.bus, endpoint=free_endpoint()))
        file.write_text(to_toml(own), encoding="utf-8")
        words = ("--config", str(file), "--out", str(folder))
        bare = ("--no-report", "--no-render", "--no-view")
        begun = wall_ns()
        _run("-m", "quadriga", "walk", *words, *bare)
        first = next(iter(Recording(folder / RECORDING).entries({STATE.name})))
        return 1e-9 * (first.log_time_ns - begun)


def _import() -> float:
    begun = monotonic()
    _run("-c", _IMPORTS)
    return monotonic() - begun


def _run(*words: str) -> None:
    """Run this interpreter.

    Raises:
        ChildProcessError: it has failed.
    """
    done = subprocess.run(
        (sys.executable, *words), check=False, capture_output=True, text=True, errors="replace"
    )
    if done.returncode:
        raise ChildProcessError(f"{' '.join(words[:3])} failed: {done.stderr.strip()}")

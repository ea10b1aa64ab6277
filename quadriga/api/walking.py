"""A whole team, started and walked by one call."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from quadriga.api.configuration import read_layers
from quadriga.api.run import Run
from quadriga.progress import quiet_console
from quadriga.shared.config.load import build
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.metadata import RECORDING
from quadriga.team.endpoint import with_free_endpoint
from quadriga.team.run_folder import make_run_dir
from quadriga.team.walk import INTERRUPTED, Report, check_walk
from quadriga.team.walk import walk as walk_team


def walk(
    scenario: str | None = None,
    *,
    seed: int | None = None,
    robots: int | None = None,
    seconds: float | None = None,
    set: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    config: str | Path | Config | None = None,
    report: str = "page",
) -> Run:
    """Start a team's processes, walk to the end, stop them, and return what was recorded.

    It does what `quadriga walk` does, says nothing meanwhile, and leaves the same run folder. That
    a robot falls is no error: `run.summary["fallen"]` names it. A predictor that there is none of
    yet is made first, which takes minutes once. Several walks may go at once, in threads too; an
    interrupt ends that of the main thread alone.

    Example:
        >>> run = quadriga.walk("hard-blocks", seed=7, seconds=10, set={"planner.preset": "fast"})
        >>> print(run.summary["fallen"], run.folder)

    Args:
        scenario: the name of a scenario, see `quadriga walk --list`, or a TOML file.
        seed: of the world (`world.seed`).
        robots: how many (`team.robots`).
        seconds: of world time (`world.duration`).
        set: values of any keys by `section.key`, see docs/configuration.md; they win.
        out: the run folder, without a recording; None: `runs/<date>-<time>`.
        config: a TOML file, or a configuration of `quadriga.load_config`.
        report: what to make of the recording: `"table"`, also `"page"` with its figures, or also
            `"pictures"`; the last two take some seconds.

    Raises:
        ConfigError: a key, a value or a file is wrong, or the folder holds a recording.
        PredictorError: no predictor was accepted by its gates.
        BusError, ProcessError: a process failed or left too early, or the walk came to no end.
        RecordingError: nothing could be recorded.
        KeyboardInterrupt: this process was interrupted; no process of the team is left.
    """
    named = {"world.seed": seed, "team.robots": robots, "world.duration": seconds}
    keys = {name: value for name, value in named.items() if value is not None} | dict(set or {})
    wanted = _read_report(report)
    base = config if isinstance(config, Config) or config is None else Path(config)
    given = read_layers(base, scenario, keys)
    in_force = with_free_endpoint(build(given), given)
    if not in_force.recorder.enabled:
        cause = "a Run is read from its recording"
        raise ConfigError("recorder.enabled", "false", "true", cause)
    check_walk(in_force)
    folder = make_run_dir(None) if out is None else Path(out)
    with threadpool_limits():  # BLAS has the caller's number of threads after it
        status = walk_team(in_force, folder, report=wanted, console=quiet_console())
    if status == INTERRUPTED:
        raise KeyboardInterrupt
    return Run(folder / RECORDING)


def _read_report(report: str) -> Report:
    try:
        return Report(report)
    except ValueError:
        known = ", ".join(repr(kind.value) for kind in Report)
        raise ConfigError("report", repr(report), f"one of {known}") from None

"""Trials once more over the bus: the command of each, and their recordings on demand."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.campaign.job import origin
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.campaign.outcome import TrialOutcome
from quadriga.experiments.campaign.plan import seeded
from quadriga.experiments.campaign.predictors import prepared
from quadriga.experiments.campaign.run import config_file
from quadriga.experiments.trial.trial import figures
from quadriga.experiments.trial.trial_walk import over_the_bus
from quadriga.recordings.summary import RECORDING
from quadriga.replay.recorded_predictor import copy_predictor
from quadriga.report.page import PAGE
from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError, ProcessError
from quadriga.team.run_report import report_folder

RECORDINGS: Final = "recordings"


def command(folder: Path, row: TrialOutcome) -> str:
    """What walks a trial again over the bus and records it."""
    return shlex.join(
        [
            "quadriga",
            "walk",
            "--config",
            str(config_file(folder, row.group)),
            "--seed",
            str(row.seed),
            "--out",
            str(_run_dir(folder, row)),
        ]
    )


def recorded(folder: Path, row: TrialOutcome) -> Path | None:
    """The page of a trial's recording, as a path from `folder`, if it has been recorded."""
    run_dir = _run_dir(folder, row)
    return (run_dir / PAGE).relative_to(folder) if (run_dir / PAGE).is_file() else None


def record(
    folder: Path, manifest: Manifest, rows: Sequence[TrialOutcome], console: Console
) -> None:
    """Walk trials again over the bus, unless they are recorded; each with its page.

    Raises:
        ConfigError: predictor, code or libraries are no longer those they were walked with.
        ProcessError: a process failed, or the walk came to something else.
    """
    manifest.check_versions(origin(), folder)
    shas = {entry.group: entry.predictor_sha256 for entry in manifest.groups}
    for number, row in enumerate(rows, 1):
        run_dir = _run_dir(folder, row)
        if (run_dir / PAGE).is_file():
            continue
        config = seeded(load(config_file(folder, row.group)), row.seed)
        (fitted,) = prepared([config], console).values()
        if fitted.sha256 != shas[row.group]:
            raise ConfigError(
                f"predictor of {row.group.name}",
                fitted.sha256[:12] or "none",
                shas[row.group][:12] or "none",
                "the cache was emptied",
            )
        console.print(f"recording {number}/{len(rows)}: {run_dir}", markup=False, highlight=False)
        (run_dir / RECORDING).unlink(missing_ok=True)  # of a walk that was interrupted
        walk = figures(over_the_bus(config, run_dir, fitted.path, fitted.sha256))
        if fitted.path is not None:
            copy_predictor(fitted.path, run_dir)
        found = min(walk.fallen.values(), default=None), walk.distance
        told = row.time_to_fall_s, row.distance_m
        if found != told:
            raise ProcessError(
                f"{run_dir}",
                "time to fall and distance {} s, {} m".format(*found),
                "{} s, {} m, as in the campaign".format(*told),
                "another trace than it was walked with?",
            )
        report_folder(run_dir, pictures=False, console=Console(quiet=True))


def _run_dir(folder: Path, row: TrialOutcome) -> Path:
    return folder / RECORDINGS / f"{row.group.name}-{row.seed}"

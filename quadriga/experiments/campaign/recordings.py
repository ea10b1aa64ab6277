"""Recordings of a campaign's trials: walked over the bus, which comes to the same."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.campaign.configs import config_file
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.plan import Group, with_seed
from quadriga.experiments.predictors import Fitted, prepare_predictors
from quadriga.experiments.trial.figures_of_merit import Figures, compute_figures
from quadriga.experiments.trial.origin import code_and_libraries, foreign_origin
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.experiments.trial.over_bus import walk_over_bus
from quadriga.recordings.summary import RECORDING
from quadriga.replay.recorded_predictor import copy_predictor
from quadriga.report.page import PAGE
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, ProcessError
from quadriga.team.run_folder import CONFIG
from quadriga.team.run_report import report_folder

RECORDINGS: Final = "recordings"


def build_command(folder: Path, row: TrialOutcome) -> str:
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
            str(run_dir_of(folder, row.group, row.seed)),
        ]
    )


def find_recording(folder: Path, row: TrialOutcome) -> Path | None:
    """The page of a trial's recording, as a path from `folder`, if it has been recorded."""
    page = run_dir_of(folder, row.group, row.seed) / PAGE
    return page.relative_to(folder) if page.is_file() else None


def record_trials(
    folder: Path, manifest: Manifest, rows: Sequence[TrialOutcome], console: Console
) -> None:
    """Walk trials again over the bus, unless they are recorded; each with its page.

    Raises:
        ConfigError: predictor, code or libraries are no longer those they were walked with.
        ProcessError: a process failed, or the walk came to something else.
    """
    manifest.check_versions(code_and_libraries(), folder)
    digests = {entry.group: entry.predictor_sha256 for entry in manifest.groups}
    plugins = {entry.group: entry.plugin for entry in manifest.groups}
    for number, row in enumerate(rows, 1):
        run_dir = run_dir_of(folder, row.group, row.seed)
        if (run_dir / PAGE).is_file():
            continue
        config = with_seed(load(config_file(folder, row.group)), row.seed)
        plugin = foreign_origin(config)
        if plugin != plugins[row.group]:
            raise ConfigError(
                f"planner or controller of {row.group.name}",
                plugin,
                plugins[row.group],
                "install the version that the trials were walked with",
            )
        (fitted,) = prepare_predictors([config], console).values()
        if fitted.sha256 != digests[row.group]:
            raise ConfigError(
                f"predictor of {row.group.name}",
                fitted.sha256[:12] or "none",
                digests[row.group][:12] or "none",
                "the cache was emptied",
            )
        console.print(f"recording {number}/{len(rows)}: {run_dir}", markup=False, highlight=False)
        _check_same(record_trial(config, run_dir, fitted), row, run_dir)


def record_trial(config: Config, run_dir: Path, fitted: Fitted) -> Figures:
    """The figures of a walk over the bus, which leaves its recording and its page.

    Raises:
        ProcessError: a process failed.
    """
    for name in (RECORDING, CONFIG):  # of a walk that was interrupted
        (run_dir / name).unlink(missing_ok=True)
    walk = walk_over_bus(config, run_dir, fitted.path, fitted.sha256)
    if fitted.path is not None:
        copy_predictor(fitted.path, run_dir)
    # The end of a walk whose controller failed is no other failure.
    with suppress(ProcessError) if walk.failed else nullcontext():
        report_folder(run_dir, pictures=False, console=Console(quiet=True))
    return compute_figures(walk)


def run_dir_of(folder: Path, group: Group, seed: int) -> Path:
    """Where a trial of a campaign is recorded."""
    return folder / RECORDINGS / f"{group.name}-{seed}"


def _check_same(figures: Figures, row: TrialOutcome, run_dir: Path) -> None:
    again = min(figures.fallen.values(), default=None), figures.distance
    before = row.time_to_fall_s, row.distance_m
    if again != before:
        raise ProcessError(
            f"{run_dir}",
            "time to fall and distance {} s, {} m".format(*again),
            "{} s, {} m, as in the campaign".format(*before),
            "another trace than it was walked with?",
        )

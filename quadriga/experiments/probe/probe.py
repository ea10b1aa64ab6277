"""A probe: true responses measured, predictors held against them, all of it written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.experiments.probe.cache import ensure_responses
from quadriga.experiments.probe.measured_response import write_measured_response
from quadriga.experiments.probe.outcome import ProbeOutcome, build_outcome
from quadriga.experiments.probe.probe_figure import draw_probe
from quadriga.experiments.probe.probe_tables import build_details, build_overall
from quadriga.experiments.probe.probed import Probed
from quadriga.identification.fit_report import write_json
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.atomic import write_text

FIGURES: Final = "probe.json"
PAGE: Final = "probe.md"
RESPONSES: Final = "responses.npz"  # what `identification.response` names
_PICTURE: Final = "probe.png"


def probe(
    config: Config, probed: Sequence[Probed], repetitions: int, jobs: int, console: Console
) -> ProbeOutcome:
    """Hold predictors against the responses in worlds of `repetitions` seeds from the given one on.

    Args:
        config: of the team; its planner does not matter but for what a predictor depends on.
        probed: at least one predictor of this team.
        repetitions: worlds to measure in.
        jobs: processes to use.
        console: for the progress bar.

    Raises:
        PredictorError: robots fall, so that a pulse was measured in no world.
        ProcessError: a worker died.
    """
    seeds = range(config.world.seed, config.world.seed + repetitions)
    worlds = [replace(config, world=replace(config.world, seed=seed)) for seed in seeds]
    return build_outcome(config, ensure_responses(worlds, jobs, console), list(probed))


def write_outcome(outcome: ProbeOutcome, folder: Path) -> None:
    """Write a probe's figures as JSON, its tables as Markdown, its picture and the response."""
    write_json(folder / FIGURES, outcome.to_dict())
    write_measured_response(folder / RESPONSES, outcome.responses, outcome.config)
    draw_probe(outcome, folder / _PICTURE)
    sheets = [build_overall(outcome), *build_details(outcome)]
    parts = ["# Probe\n", *(sheet.to_markdown() for sheet in sheets)]
    parts.append(f"![Responses over time, and errors by phase]({_PICTURE})\n")
    write_text(folder / PAGE, "\n".join(parts))

"""The command `campaign`. It imports what it needs: every process reads the command line."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, Final

from rich.console import Console

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

if TYPE_CHECKING:
    from quadriga.experiments.campaign.plan import CampaignPlan

SEEDS: Final = "0:20"  # of a campaign that names none


def campaign(arguments: argparse.Namespace, _config: Config, _given: dict[str, Any]) -> int:
    """Walk what is missing of a campaign, then report on all of it."""
    from quadriga.commands.campaign_options import dask_of
    from quadriga.experiments.campaign.report import report
    from quadriga.experiments.campaign.run import run
    from quadriga.team.run_folder import make_run_dir

    console = Console(stderr=True)
    worst = arguments.record_worst
    if worst < 0:
        raise ConfigError("--record-worst", str(worst), "at least 0")
    if arguments.scenario is not None:
        raise ConfigError(
            "--scenario", repr(arguments.scenario), "the names of scenarios without an option"
        )
    if arguments.report is not None:
        _check_only_report(arguments)
        out = arguments.report
    else:
        dask = dask_of(arguments, "scenarios")
        plan = _plan(arguments)
        out = arguments.out or make_run_dir(None)
        run(plan, out, jobs=arguments.jobs, dask=dask, typed=arguments.typed, console=console)
    print(report(out, baseline=arguments.baseline, record_worst=worst, console=console))
    return 0


def _check_only_report(arguments: argparse.Namespace) -> None:
    given = {
        "scenarios": arguments.scenarios, "--planners": arguments.planners,
        "--variants": arguments.variants, "--seeds": arguments.seeds, "--sweep": arguments.sweep,
        "--dask": arguments.dask, "--out": arguments.out, "--config": arguments.config,
        **arguments.overrides,
    }  # fmt: skip
    for name, value in given.items():
        if value:
            shown = ", ".join(value) if isinstance(value, list) else value
            raise ConfigError("--report", f"{name} {shown}", "none: it walks nothing")


def _plan(arguments: argparse.Namespace) -> CampaignPlan:
    from quadriga.experiments.campaign.choice import sweep_of, variants_of
    from quadriga.experiments.campaign.plan import build_plan
    from quadriga.experiments.trial.variants import seeds_of

    options = arguments.planners or ([] if arguments.variants else ["none,distributed"])
    seeds = SEEDS if arguments.seeds is None else arguments.seeds
    return build_plan(
        arguments.scenarios,
        variants_of(options, arguments.variants),
        tuple(map(sweep_of, arguments.sweep)),
        seeds_of("--seeds", seeds),
        arguments.baseline,
        arguments.config,
        arguments.overrides,
    )

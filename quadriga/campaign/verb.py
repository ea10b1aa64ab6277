"""The command `campaign`. It imports what it needs: every process reads the command line."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from rich.console import Console

from shared.config import Config
from shared.errors import ConfigError

if TYPE_CHECKING:
    from quadriga.campaign.plan import Plan


def campaign(arguments: argparse.Namespace, _config: Config, _given: dict[str, Any]) -> int:
    """Walk what is missing of a campaign, then report on all of it."""
    from quadriga.campaign.options import dask_of
    from quadriga.campaign.report import report
    from quadriga.campaign.run import run
    from quadriga.run_folder import make_run_dir

    console = Console(stderr=True)
    worst = arguments.record_worst
    if worst < 0:
        raise ConfigError("--record-worst", str(worst), "at least 0")
    if arguments.scenario is not None:
        raise ConfigError(
            "--scenario", repr(arguments.scenario), "the names of scenarios without an option"
        )
    if arguments.report is not None:
        if arguments.scenarios:
            raise ConfigError("--report", f"scenarios {', '.join(arguments.scenarios)}",
                              "none: it walks nothing")  # fmt: skip
        out = arguments.report
    else:
        dask = dask_of(arguments, "scenarios")
        plan = _plan(arguments)
        out = arguments.out or make_run_dir(None)
        run(plan, out, jobs=arguments.jobs, dask=dask, typed=arguments.typed, console=console)
    print(report(out, baseline=arguments.baseline, record_worst=worst, console=console))
    return 0


def _plan(arguments: argparse.Namespace) -> Plan:
    from quadriga.campaign.choice import sweep_of, variants_of
    from quadriga.campaign.plan import build_plan
    from quadriga.variants import seeds_of

    options = arguments.planners or ([] if arguments.variants else ["none,distributed"])
    return build_plan(
        arguments.scenarios, variants_of(options, arguments.variants),
        tuple(map(sweep_of, arguments.sweep)), seeds_of("--seeds", arguments.seeds),
        arguments.baseline, arguments.config, arguments.overrides,
    )  # fmt: skip

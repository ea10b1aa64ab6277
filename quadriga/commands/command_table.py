"""All commands, in the groups and the order of `quadriga --help`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from quadriga.commands import (
    agent,
    bench_stop,
    bridge,
    campaign,
    certs,
    collect,
    completion,
    config,
    doctor,
    drive,
    echo,
    estop,
    experiments,
    export,
    fault,
    fit,
    info,
    operate,
    plan,
    play,
    prepare,
    probe,
    record,
    recover,
    replay,
    report,
    reset,
    resume,
    router,
    sim,
    status,
    stop,
    view,
    walk,
)
from quadriga.commands.command import AddCommand

# What each adds is its module's `add`: a command, its options and its call.
GROUPS: Final[Mapping[str, tuple[Callable[[AddCommand], None], ...]]] = MappingProxyType(
    {
        "walk and watch": (
            walk.add, view.add, drive.add, status.add, echo.add, doctor.add,
        ),
        "stop and go on": (estop.add, stop.add, reset.add, resume.add),
        "look into recordings": (
            report.add, info.add, replay.add, play.add, export.add, recover.add,
        ),
        "experiments": (
            campaign.add, experiments.add, fault.add, bench_stop.add, probe.add,
        ),
        "data and predictors": (prepare.add, collect.add, fit.add),
        "processes of a team, one by one": (
            sim.add, bridge.add, agent.add, plan.add, operate.add, record.add, router.add,
        ),
        "certificates, configuration, shell": (certs.add, config.add, completion.add),
    }
)  # fmt: skip

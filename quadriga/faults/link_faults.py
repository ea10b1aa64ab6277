"""Faults of a robot's link: packets are lost, late, swapped, doubled, damaged, or all gone.

Each agent is at a place of its own, and what it sends and hears goes through an emulated network
with real TCP: everything (`link-…`), or all but the states and commands of its robot, which take a
cable (`radio-…`), as where the agent's computer is beside its robot. There TCP may send again after
20 ms, as deploy/laptop has it, and not after 200 ms.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from quadriga.faults.fault import Draw, FaultScene, SetStage, Stage, TeamFault
from quadriga.faults.network.emulated import EmulatedNetwork
from quadriga.faults.network.layout import NetworkLayout
from quadriga.faults.network.link import LinkFaults
from quadriga.faults.network.order import RadioOrder
from quadriga.shared.config.sections import Config
from quadriga.sim_server.world.faults import DELAYED, GARBAGE, INTERMITTENT, OFF, SLOW

_GONE: Final = LinkFaults(loss=1.0)
_RTO_MIN_MS: Final = 20
_LOG: Final = Path("logs", "air.log")

# Name, what it does each way, for how many seconds, and in words.
_KINDS: Final = (
    *((f"loss-{p}", LinkFaults(loss=0.01 * p), None, f"{p} % lost, each way") for p in (1, 5, 20)),
    *(
        (f"delay-{ms}", LinkFaults(delay=0.5 * ms), None, f"a round trip of {ms} ms")
        for ms in (5, 20, 50)
    ),
    (
        "loss-20-delay-50",
        LinkFaults(loss=0.2, delay=25.0),
        None,
        "20 % lost each way, and a round trip of 50 ms",
    ),
    ("reorder", LinkFaults(reorder=0.2), None, "a fifth after the next"),
    ("duplicate", LinkFaults(duplicate=0.2), None, "a fifth twice"),
    ("garbage", LinkFaults(garbage=0.2), None, "a fifth damaged"),
    *((f"down-{ms}", _GONE, 1e-3 * ms, f"nothing arrives for {ms} ms") for ms in (100, 300, 1000)),
    ("partition", _GONE, None, "nothing arrives any more"),
)

# The words in which sensors and motors fail, those of PX4's failure injection, as far as they mean
# something for a link, and which kind each is. A link has no value that could be stuck or wrong.
LINK_WORDS: Final = {
    OFF: "partition",
    GARBAGE: "garbage",
    SLOW: "loss-20-delay-50",  # TCP gets little through, and late
    DELAYED: "delay-50",
    INTERMITTENT: "loss-20",
}
LINKS: Final = ("link", "radio")


def _stage(
    faults: LinkFaults, seconds: float | None, *, wired: bool, rto_min_ms: int = 0
) -> SetStage:
    @contextmanager
    def stage(config: Config, draw: Draw, folder: Path) -> Iterator[Stage]:
        layout = NetworkLayout.of_team(config, os.getpid(), wired=wired, rto_min_ms=rto_min_ms)
        with EmulatedNetwork(layout, draw.seed, folder / _LOG) as network:

            def strike(_scene: FaultScene) -> None:
                network.order(RadioOrder(draw.robot, faults, seconds))

            own = layout.with_endpoints(config)
            yield Stage(own, strike, network.wrap, draw.robot, lasts=seconds)

    return stage


def _link(kind: str, faults: LinkFaults, seconds: float | None, what: str) -> TeamFault:
    def lasting(longer: float | None) -> SetStage:
        return _stage(faults, longer, wired=False)

    return TeamFault(
        f"link-{kind}",
        f"an agent's packets: {what}",
        lasting(seconds),
        lasting=lasting if seconds is None else None,
    )


def _radio(kind: str, faults: LinkFaults, seconds: float | None, what: str) -> TeamFault:
    def lasting(longer: float | None) -> SetStage:
        return _stage(faults, longer, wired=True, rto_min_ms=_RTO_MIN_MS)

    return TeamFault(
        f"radio-{kind}",
        f"the same beside a cable to its robot: {what}",
        lasting(seconds),
        lasting=lasting if seconds is None else None,
    )


LINK_FAULTS: Final = (
    *(_link(*kind) for kind in _KINDS),
    *(_radio(*kind) for kind in _KINDS),
    TeamFault(
        "radio-loss-20-rto-200",
        "20 % lost, each way, and TCP repeats as late as systems have it",
        _stage(LinkFaults(loss=0.2), None, wired=True),
    ),
)
"""In the order of the table."""

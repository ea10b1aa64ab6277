"""One robot's side of `benchmarks.air`: sends what an agent sends on the air, and hears the other.

Started at its place of an emulated network. It prints what it has heard: the stamps of plans and
measurements with when they arrived, ns of the clock that both places share.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.shared.bus.session import HERE, READY, Arrival, Bus
from quadriga.shared.codec import encode, envelope
from quadriga.shared.config.sections import Config
from quadriga.shared.members import SIM
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.runtime.clock import monotonic_ns, sleep
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import die_with_parent
from quadriga.shared.topics import MEASUREMENT, PLAN, SAMPLE_MS

_PATIENCE: Final = 60.0  # s, for the other to be there: the air may lose a lot


def main() -> None:
    """Send and hear for a while."""
    parser = argparse.ArgumentParser()
    for name in ("me", "other", "endpoint", "listen"):
        parser.add_argument(name)
    parser.add_argument("seconds", type=float)
    parser.add_argument("parent", type=int)
    given = parser.parse_args()
    die_with_parent(given.parent)
    config = Config()
    bus = replace(config.bus, endpoint=given.endpoint, listen=given.listen, plaintext=True)
    with Bus.open(bus, config.team.name, given.me) as joined:
        heard = {
            topic: joined.collect(topic.key(joined.team, given.other))
            for topic in (PLAN, MEASUREMENT)
        }
        joined.declare(HERE)
        joined.wait_for(HERE, [given.other], _PATIENCE, lambda: False)
        take_priority("realtime")
        print(READY, flush=True)
        input()  # until the air is as it is to be
        begun, ended = _send(config, joined, given.me, given.seconds)
        sleep(0.5)
        arrivals = {topic.name: _stamps(take()) for topic, take in heard.items()}
    print(json.dumps({"begun": begun, "ended": ended, **arrivals}), flush=True)


def _send(config: Config, bus: Bus, me: str, seconds: float) -> tuple[int, int]:
    """Send plans and measurements at their rates; when it began and ended, ns."""
    horizon, applied = config.planner.N, config.planner.applied
    plan_put = bus.publisher(PLAN.key(bus.team, me), waits=False)
    sample_put = bus.publisher(MEASUREMENT.key(bus.team, me), waits=False)
    u, y = np.zeros((horizon, 12)), np.zeros((horizon, 6))
    begun = monotonic_ns()
    for sample in range(round(1e3 * seconds / SAMPLE_MS)):
        sleep(1e-9 * (begun - monotonic_ns()) + 1e-3 * SAMPLE_MS * sample)
        tick, now = SAMPLE_MS * sample, monotonic_ns()
        sample_put(encode(Measurement(tick, now, np.zeros(12), np.zeros(6), np.zeros(4))))
        if sample % applied == 0:
            plan_put(encode(Plan(tick, now, sample // applied, u, y, "solved", {SIM: 0}, 0)))
    return begun, monotonic_ns()


def _stamps(arrivals: list[Arrival]) -> list[tuple[int, int]]:
    """When each message arrived, and its stamp, ns."""
    heads = ((arrived, envelope(payload)) for arrived, _, payload in arrivals)
    return [(arrived, head[1]) for arrived, head in heads if head is not None]


if __name__ == "__main__":
    main()

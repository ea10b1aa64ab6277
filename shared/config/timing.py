"""How often each topic is sent, and how old it may grow, where the configuration says it."""

from __future__ import annotations

from typing import Final

from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.topics import COMMAND, PLAN, SAMPLE_MS, STATE, STATUS, STATUS_MS, TABLE, TRUTH

PEER_TIMEOUT: Final = 5.0  # s wall: so long an agent in lock-step waits for a peer's message


def periods(config: Config) -> dict[str, int]:
    """World time between two messages of a topic by its name, ms; 0: sent on event.

    In real time an agent that was late says its status later. Robots behind bridges speak
    by clocks of their own: all that is sure is a state at every sample.
    """
    configured = {
        PLAN: SAMPLE_MS * config.planner.applied,
        STATUS: STATUS_MS if config.world.mode == "lockstep" else 0,
        TRUTH: 1 if config.estimator.kind == "truth" else SAMPLE_MS,
    }
    if config.team.plant == BRIDGED:
        configured |= {STATE: SAMPLE_MS, COMMAND: SAMPLE_MS}
    return {topic.name: configured.get(topic, topic.period_ms) for topic in TABLE}


def max_ages(config: Config) -> dict[str, int]:
    """Longest gap, and greatest age in use, that is nothing unusual, by topic, ms; 0: none.

    A plan is used until who made it is given up. Those of peers are of the step before; those of
    a central planner come its latency after their data.
    """
    planner = config.planner
    late = max(1, planner.latency_ms) if find_kind(planner.kind).central else 0
    steps = 1 + planner.max_peer_age + planner.hold_steps
    ages = {topic.name: topic.max_age_ms for topic in TABLE}
    return ages | {PLAN.name: steps * SAMPLE_MS * planner.applied + late}

"""How often each topic is sent, and how old it may grow, where the configuration says it."""

from __future__ import annotations

from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.topics import (
    CLOCK,
    COMMAND,
    CONFIGURED,
    PLAN,
    SAMPLE_MS,
    STATE,
    STATUS,
    STATUS_MS,
    TABLE,
    TRUTH,
)


def periods(config: Config) -> dict[str, int]:
    """World time between two messages of a topic by its name, ms; 0: sent on event.

    In real time an agent that was late says its status later. Several plants in lock-step follow
    every tick of the clock; an operator needs no more than every tenth. Robots behind bridges speak
    by clocks of their own: all that is sure is a state at every sample.
    """
    lockstep = config.world.mode == "lockstep"
    configured = {
        CLOCK: 1 if lockstep and config.team.plant_per_robot else SAMPLE_MS,
        PLAN: SAMPLE_MS * config.planner.applied,
        STATUS: STATUS_MS if lockstep else 0,
        TRUTH: 1 if config.estimator.kind == "truth" else SAMPLE_MS,
    }
    found = {
        topic.name: configured[topic] if topic.period_ms == CONFIGURED else topic.period_ms
        for topic in TABLE
    }
    if config.team.plant == BRIDGED:
        found |= dict.fromkeys((STATE.name, COMMAND.name), SAMPLE_MS)
    return found


def max_ages(config: Config) -> dict[str, int]:
    """Longest gap, and greatest age in use, that is nothing unusual, by topic, ms; 0: none.

    A plan is used until who made it is given up. Those of peers are of the step before; those of
    a central planner come its latency after their data.
    """
    planner = config.planner
    late = max(1, planner.latency_ms) if find_kind(planner.kind).central else 0
    steps = 1 + planner.max_peer_age + planner.hold_steps
    configured = {PLAN: steps * SAMPLE_MS * planner.applied + late}
    return {
        topic.name: configured[topic] if topic.max_age_ms == CONFIGURED else topic.max_age_ms
        for topic in TABLE
    }

"""A rehearsal: an agent walks a robot that merely stands, so that everything has run once.

First calls compile, load and allocate; they must not fall into the first steps of a real robot.
"""

from __future__ import annotations

import numpy as np

from agents.agent import Agent, Inputs
from agents.planner.horizon import step_ms
from shared.codec import decode, encode
from shared.config import Config
from shared.messages import Reference, State
from shared.robot import GRAVITY, N_JOINTS, N_LEGS, TOTAL_MASS, q_stand


def rehearse(config: Config, agent: Agent) -> None:
    """Step `agent` through standing, the first walking ticks and two planning steps."""
    memory = agent.initial()
    last = config.gait.stand_ms + 10 * config.planner.T_ini + 2 * step_ms(config)
    reference = Reference(0, 0, 0.0, 0.0, 0.0, config.reference.height)
    for tick in range(last + 1):
        memory, _ = agent.step(memory, Inputs(standing(tick), references=(reference,)))


def standing(tick: int) -> State:
    """What a robot that stands still on flat ground measures.

    It goes through the codec, because compiled functions tell arrays of the wire, which cannot be
    written, from others.
    """
    zero = np.zeros(N_JOINTS)
    state = State(
        tick, tick * 1_000_000, q_stand(), zero, zero, np.array([1.0, 0.0, 0.0, 0.0]),
        np.zeros(3), np.array([0.0, 0.0, GRAVITY]), np.full(N_LEGS, TOTAL_MASS * GRAVITY / N_LEGS),
    )  # fmt: skip
    return decode(encode(state), State)

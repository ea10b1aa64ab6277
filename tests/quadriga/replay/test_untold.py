"""What a killed agent sent, but could not tell the inputs of, is compared with nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quadriga.agents.agent import Agent, Inputs, Outputs
from quadriga.plant.commands import damp_joints
from quadriga.replay.agent_log import AgentLog
from quadriga.replay.comparison import Comparison, ReplayedStep
from quadriga.shared.codec import encode
from quadriga.shared.messages import Command
from tests.a1 import standing
from tests.agents.lone_robot import ALONE

AGENT = Agent(ALONE, "r1", None)


def test_what_it_sent_then_is_compared_with_nothing() -> None:
    log = AgentLog(last=3, told=1)
    sent = {tick: damp_joints(tick) for tick in (0, 1, 2, 3)}
    for tick, command in sent.items():
        log.sent["command", tick, 0].append(encode(command))
    comparison = Comparison(log)
    for tick in (0, 1):
        comparison.add(step_of(sent[tick]))
    comparison.add(step_of(replace(damp_joints(2), kd=np.ones(12))), told=False)
    comparison.pass_untold(log)
    verdict = comparison.finish()
    assert verdict.equal == {"command": 2}
    assert verdict.untold == {"command": 2}, "one that differs, one that there is not"
    assert verdict.exact


def step_of(command: Command) -> ReplayedStep:
    outputs = Outputs(command, None, None, "walk", "", {}, {}, None)
    return ReplayedStep(AGENT.initial(), Inputs(standing(command.tick)), outputs)

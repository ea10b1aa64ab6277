"""How a plan fades out beyond the range of the data: what is applied, followed and published."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from quadriga.agents.planner.planner import PlanResult
from quadriga.agents.planner.qp_solver import SOLVED
from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.messages import Plan
from quadriga.shared.robots.conventions import Array

FADED: Final = "faded"  # status of a plan that is applied in part


def fade_factor(config: PlannerConfig, error: Array) -> float:
    """Share of a plan to apply: 1 inside the range of the data, falling to 0 at twice that range.

    An error that is no number is out of every range.

    Args:
        config: the range.
        error: present outputs less the desired ones, shape (6,).
    """
    share = 2.0 - float(np.maximum.reduce(np.abs(error) / _ranges(config.trust_range)))
    return min(1.0, share) if share > 0.0 else 0.0  # 0 if it is NaN


@lru_cache
def _ranges(fade: tuple[float, ...]) -> Array:
    """Of the six outputs, (6,)."""
    return np.array(fade)[[0, 1, 1, 2, 2, 3]]


def outputs_to_follow(result: PlanResult, factor: float, y_des: Array) -> Array:
    """The planned outputs, as far as the plan is applied; for the rest the desired ones. (N, 6).

    The outputs under nominal forces alone are of no use here: nobody wants the robot to do that.
    """
    if result.status != SOLVED:
        return y_des
    return result.y if factor == 1.0 else y_des + factor * (result.y - y_des)


def plan_message(result: PlanResult, factor: float, serial: tuple[int, int], tick: int) -> Plan:
    """The plan as published: peers are told what is applied.

    Args:
        result: of the planner.
        factor: share of its deviation that is applied.
        serial: planning step and exchange.
        tick: of the plan's first sample.
    """
    status = FADED if result.status == SOLVED and factor < 1.0 else result.status
    u = result.u - (1.0 - factor) * result.du
    y = result.y_nominal + factor * (result.y - result.y_nominal)
    step, exchange = serial
    return Plan(tick, tick * 1_000_000, step, u, y, status, result.used, exchange)

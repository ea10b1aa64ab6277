"""Which plan is in force: one always is, if the configuration permits its latency."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.planning.active_plan import ActivePlan, add_plan, setpoint_at
from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError


@pytest.mark.parametrize(("latency_ms", "N", "applied"), [(80, 12, 4), (81, 12, 4), (0, 4, 4)])
def test_the_latest_permitted_plan_is_in_force_until_the_next(
    latency_ms: int, N: int, applied: int
) -> None:
    keys = {"planner.latency_ms": latency_ms, "planner.N": N, "planner.applied": applied}
    every, plan = 10 * applied, (np.ones((N, 12)), np.zeros((N, 6)))
    plans: tuple[ActivePlan, ...] = ()
    gaps = 0
    for tick in range(30 * every):
        if tick % every == 0:
            plans = add_plan(plans, ActivePlan(tick + latency_ms, tick, *plan))
        gaps += tick >= latency_ms and setpoint_at(plans, tick).y_ref is None
    if gaps:
        with pytest.raises(ConfigError, match=r"planner\.latency_ms"):
            load(None, keys)
    else:
        load(None, keys)

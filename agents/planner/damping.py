"""How much of its last plan an agent keeps, so that the iteration of best responses converges."""

from __future__ import annotations

from typing import Final

from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind

_BY_SIZE: Final = -1.0  # value of planner.damping
_FREE: Final = {"usual": 3}  # robots whose plans converge undamped, by planner.preset
_FREE_ELSE: Final = 2


def kept_share(config: Config) -> float:
    """d, the share of its own last plan that an agent's best response keeps.

    If the size of the team chooses it: where n robots act on each other alike, with effects c of
    their own, the undamped map has the eigenvalues c and −c (n − 1). Keeping d, the largest in size
    is least at d = c (n − 2) / (2 + c (n − 2)), with c = 1/2 at (n − 2) / (n + 2). The gate on the
    radius tells whether that is enough. Few robots converge without and are not damped.
    """
    planner, n = config.planner, config.team.robots
    if planner.damping != _BY_SIZE:
        return planner.damping
    return 0.0 if n <= _FREE.get(planner.preset, _FREE_ELSE) else (n - 2) / (n + 2)


def kept_by_agent(config: Config) -> float:
    """`kept_share` of an agent of the configured kind.

    One that plans as if it were alone answers nobody: no iteration is there to be damped, and the
    size of the team is nothing to it.
    """
    answers = find_kind(config.planner.kind).needs_peers
    return kept_share(config) if answers else max(0.0, config.planner.damping)

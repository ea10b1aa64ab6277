"""The table of what can be made to go wrong in a team that walks in the simulated world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from quadriga.faults.attack_faults import ATTACK_FAULTS
from quadriga.faults.component_faults import COMPONENT_FAULTS
from quadriga.faults.fault import TeamFault
from quadriga.faults.link_faults import LINK_FAULTS
from quadriga.faults.process_faults import PROCESS_FAULTS
from quadriga.shared.errors import ConfigError, did_you_mean

ALL: Final = "all"
FAULTS: Final = (*PROCESS_FAULTS, *COMPONENT_FAULTS, *LINK_FAULTS, *ATTACK_FAULTS)
"""In the order of the table."""
BY_NAME: Final = {fault.name: fault for fault in FAULTS}


def select_faults(names: Sequence[str]) -> list[TeamFault]:
    """Faults by their names, or all, in the order of the table.

    Raises:
        ConfigError: there is no such fault.
    """
    for name in names:
        if name != ALL and name not in BY_NAME:
            hint = did_you_mean(name, BY_NAME)
            raise ConfigError("fault", repr(name), f"all, {', '.join(BY_NAME)}", hint)
    return [fault for fault in FAULTS if ALL in names or fault.name in names]

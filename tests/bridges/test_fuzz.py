"""Damaged packets end in no exception and no torque; `make fuzz` sends a million."""

from __future__ import annotations

import pytest

from quadriga.bridges.supervisor import BridgeMode
from tests.bridges.fuzz import KINDS, fuzz


@pytest.mark.parametrize("kind", KINDS)
def test_no_packet_is_an_exception_or_a_torque_beyond_limits(kind: str) -> None:
    counts = fuzz(kind, 3000, seed=7)
    assert counts["commands"] == 3000
    assert 1000 < counts["accepted"] < 2400, "forged ones are obeyed, damaged ones are not"
    for mode in BridgeMode:
        assert mode is BridgeMode.DRY or counts[mode] >= 3, counts

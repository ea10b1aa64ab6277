"""Who looks around in the network finds no process of a team: it is told where to go."""

from __future__ import annotations

from typing import Final

import pytest
import zenoh

from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.runtime.clock import sleep
from quadriga.team.endpoint import free_endpoint

_LOOK: Final = 1.0  # s, that who looks around waits for answers


def found() -> set[str]:
    """Identities of the Zenoh processes that answer who asks all of the network."""
    scout = zenoh.scout(what="peer|router")
    sleep(_LOOK)
    return {str(hello.zid) for hello in iter(scout.try_recv, None)}


def test_a_stock_client_finds_no_process_of_a_team() -> None:
    stock = zenoh.Config()
    stock.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    with zenoh.open(stock) as session:
        if str(session.zid()) not in found():
            pytest.skip("no multicast on this machine: not even a stock process is found")
    before = found()
    with Bus.open(BusConfig(endpoint=free_endpoint()), "team", "sim"):
        assert not found() - before

"""An anemometer: sends the wind every 100 ms of world time until the walk is over.

Run it beside a walk: `python -m quadriga_wind --config runs/wind/config.toml`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from quadriga.shared.bus.session import HERE, POLL, Bus
from quadriga.shared.codec import decode, encode, envelope
from quadriga.shared.config.load import load
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.members import has_lead
from quadriga.shared.messages import Event
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.topics import EVENT, TRUTH

from . import WIND, Wind


def main(file: Path) -> int:
    """Follow the world's time, which the truth has in its envelope."""
    while not file.is_file():
        sleep(POLL)
    config = load(file)
    team, next_tick = config.team.name, 0
    with Bus.open(config.bus, team, "anemometer") as bus:
        put = bus.publisher(WIND.key(team))
        bus.subscribe(TRUTH.key(team))
        bus.subscribe(EVENT.key(team))
        while not has_lead(bus.members_at(HERE)):  # the team may still compile, or collect data
            sleep(POLL)
        while has_lead(bus.members_at(HERE)):
            key, payload = bus.get(POLL) or ("", b"")
            if key == EVENT.key(team) and decode(payload, Event).kind == "stop":
                return 0
            tick, stamp_ns = envelope(payload) or (-1, -1)
            if key == TRUTH.key(team) and tick >= next_tick:
                gust = np.array([2.0 + np.sin(1e-3 * tick), 0.0, 0.0])
                put(encode(Wind(tick, stamp_ns, gust, "mast")))
                next_tick = tick - tick % WIND.period_ms + WIND.period_ms
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(Path(sys.argv[-1])))
    except QuadrigaError as error:
        sys.exit(f"quadriga_wind: {error}")

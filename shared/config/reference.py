"""Section of what the operator asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from quadriga.shared.config.key import key

CONFIGURED: Final = "configured"
BY_HAND: Final = "hand"


@dataclass(frozen=True, slots=True)
class ReferenceConfig:
    """The reference of the operator once the team walks."""

    vx: float = key(0.5, "m/s", "forward speed", low=-1.0, high=1.2)
    vy: float = key(0.0, "m/s", "leftward speed", low=-0.5, high=0.5)
    wz: float = key(0.0, "rad/s", "yaw rate", low=-1.0, high=1.0)
    height: float = key(0.26, "m", "trunk height above the ground", low=0.2, high=0.32)
    ramp: float = key(1.0, "s", "time from standing to full speed", low=0.0, high=20.0)
    trace: str = key(
        "",
        "-",
        "CSV with columns t [s], vx, vy, wz that replaces these three, repeated as long as the "
        "walk lasts: a path with a '/', whose lines are read at once and stored here, separated "
        "by ';'; or the name of a file beside the scenarios",
    )
    driver: str = key(
        CONFIGURED,
        "-",
        "who asks: configured: these keys; hand: whoever takes the controls, and until then the "
        "team stands, see docs/driving.md",
        choices=(CONFIGURED, BY_HAND),
    )
    page_port: int = key(
        0,
        "-",
        "hand: port on the loopback of the page to drive from; 0: any that is free",
        low=0,
        high=65535,
    )
    trace_shift: float = key(
        0.0,
        "s",
        "the trace begins at a time from 0 to this, drawn from world.seed",
        low=0.0,
        high=3600.0,
    )

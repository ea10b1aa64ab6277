"""A router's own probe: a process that does one of each kind of thing that no rule permits it."""

from __future__ import annotations

from typing import Any, Final

from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.members import PROBE
from quadriga.shared.security.access import ALLOWED, DEAF, DENIED
from quadriga.shared.wire.topics import RECEIVED

# What the router calls each kind when it refuses it, and the key, behind `<team>/`. Tokens,
# questions and answers on their way to a client cannot be probed: they go only to who has asked for
# them or offered to answer, and that is refused before.
COMING: Final = {
    "put": f"{PROBE}/{DENIED}",
    "delete": f"{PROBE}/{ALLOWED}",
    "declare subscriber": f"{PROBE}/listened",
    "declare queryable": f"{PROBE}/offered",
    "query": f"{PROBE}/asked",
    "reply": f"{PROBE}/forged",
    "liveliness token": f"stranger/{PROBE}/token",
    "declare liveliness subscriber": f"{PROBE}/watched/by/somebody",
    "liveliness query": f"{PROBE}/counted/by/somebody",
}
_UNHEARD: Final = f"{PROBE}/{DEAF}"  # behind `<team>/`
_UNDER_ANY: Final = "_anyke"  # Zenoh's word for: who answers may do so under another key
_TIMEOUT: Final = 1.0  # s, of questions that nobody answers


class Trespasser(Bus):
    """The probe's connection."""

    def trespass(self) -> None:
        """Do all of `COMING` that needs nobody else, and wait for what `Lure` does."""
        key = {kind: f"{self.team}/{name}" for kind, name in COMING.items()}
        session, alive = self._session, self._session.liveliness()
        self.publisher(key["put"])(b"denied")
        session.delete(key["delete"])
        self.subscribe(key["declare subscriber"])
        self.answer(key["declare queryable"], bytes)
        self.ask(key["query"], _TIMEOUT)
        self._declarations += [
            alive.declare_token(key["liveliness token"]),
            alive.declare_subscriber(key["declare liveliness subscriber"], _ignore),
        ]
        alive.get(key["liveliness query"], timeout=_TIMEOUT)
        self.subscribe(f"{self.team}/{_UNHEARD}")  # which is permitted: the rest is not
        question = f"{self.team}/{PROBE}er/{RECEIVED}"

        def forge(query: Any) -> None:
            query.reply(key["reply"] if _UNDER_ANY in str(query.selector) else question, b"")

        self._declarations += [
            session.declare_queryable(question, forge),
            session.declare_publisher(f"{_outside(self.team)}/listener"),
            session.declare_querier(f"{_outside(self.team)}/answerer"),
        ]


class Lure:
    """What a router itself declares and sends that the trespasser must not hear.

    Args:
        bus: the router's.
    """

    def __init__(self, bus: Bus) -> None:
        self._put = bus.publisher(f"{bus.team}/{_UNHEARD}")
        self._bus = bus
        bus.subscribe(f"{_outside(bus.team)}/listener")
        bus.answer(f"{_outside(bus.team)}/answerer", bytes)

    def cast(self) -> None:
        """Send it; nothing is sent before the router knows that the trespasser listens."""
        self._put(b"unheard")
        self._bus.ask(f"{self._bus.team}/{PROBE}er/{RECEIVED}?{_UNDER_ANY}", _TIMEOUT)


def going(team: str) -> dict[str, str]:
    """By kind the keys of what must not go to the trespasser."""
    return {
        "put": f"{team}/{_UNHEARD}",
        "declare subscriber": f"{_outside(team)}/listener",
        "declare queryable": f"{_outside(team)}/answerer",
    }


def _outside(team: str) -> str:
    """Keys of no team: of its own everybody may know who listens."""
    return f"not-{team}/{PROBE}"


def _ignore(_: object) -> None:
    pass

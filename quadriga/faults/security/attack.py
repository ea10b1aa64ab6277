"""What an attacker does, and what it tells of it, as the files between it and who starts it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import blake2b
from typing import Any, NamedTuple


@dataclass(frozen=True, slots=True)
class Knock:
    """Connections that go no further than the handshake of TLS.

    Attributes:
        host: of the router.
        port: of it.
        times: how many, one after another.
        certificate: a file; "" without one.
        key: its private key, a file.
    """

    host: str
    port: int
    times: int
    certificate: str = ""
    key: str = ""


@dataclass(frozen=True, slots=True)
class StockClient:
    """A stock client of Zenoh.

    Attributes:
        settings: Zenoh's.
        shots: what it sends: keys, and payloads as hexadecimal digits.
        times: how often it sends each.
        replays: it hears this key expression and sends again what it has heard; "" nothing.
        asks: a question behind all that it has sent: the answers tell that it has arrived.
    """

    settings: Mapping[str, Any]
    shots: tuple[tuple[str, str], ...] = ()
    times: int = 1
    replays: str = ""
    asks: str = ""


@dataclass(frozen=True, slots=True)
class Attack:
    """All that one attacker does, in this order.

    Attributes:
        knocks: its attempts to connect by TLS alone.
        clients: its clients.
    """

    knocks: tuple[Knock, ...] = ()
    clients: tuple[StockClient, ...] = ()

    def to_json(self) -> str:
        """As the attacker's process reads it."""
        return json.dumps(asdict(self))


class Shot(NamedTuple):
    """What an attacker has sent on one key.

    Attributes:
        key: on which.
        digest: of the payload, see `digest_of`.
        times: how many.
        heard: whether somebody else had sent the same before.
    """

    key: str
    digest: str
    times: int
    heard: bool


class AttackReport(NamedTuple):
    """What an attacker has done.

    Attributes:
        connects: its attempts to connect without a certificate that is accepted.
        shots: what it has sent.
    """

    connects: int
    shots: tuple[Shot, ...]

    @classmethod
    def from_json(cls, text: str) -> AttackReport:
        """As the attacker's process has written it."""
        connects, shots = json.loads(text)
        return cls(connects, tuple(Shot(*shot) for shot in shots))

    @property
    def total(self) -> int:
        """All that it has tried."""
        return self.connects + sum(shot.times for shot in self.shots)


def digest_of(payload: bytes) -> str:
    """What tells one payload from others."""
    return blake2b(payload, digest_size=8).hexdigest()

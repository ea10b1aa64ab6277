"""SHELL of an attacker: a stock Zenoh client in a process of its own, on nothing of this project.

That is why it imports Zenoh, as only `shared.bus.zenoh_bus` does beside it: what protects a team
must hold against a client that somebody else has written.
"""

from __future__ import annotations

import json
import os
import socket
import ssl
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import zenoh

from quadriga.faults.security.attack import digest_of
from quadriga.shared.runtime.clock import monotonic, sleep

_BETWEEN: Final = 0.002  # s, between two messages: a flood of the processor is another fault
_LISTENS: Final = 0.5  # s, before it sends again what it has heard
_MOST_HEARD: Final = 300  # messages that it sends again
_ANSWER: Final = 2.0  # s, of a router
_ENTERS: Final = 0.5  # s, in which it is let in
_IDLE: Final = 19
_Shots = Counter[tuple[str, bytes, bool]]  # key, payload, whether it was heard before


def main(path: str) -> None:
    """Do what the file says, and print what was done."""
    os.nice(_IDLE)  # it competes with the team by messages, not for this computer's processors
    attack: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8"))
    connects, shots = 0, _Shots()
    for knock in attack["knocks"]:
        connects += sum(_knock(knock) for _ in range(knock["times"]))
    for client in attack["clients"]:
        connects += _intrude(client, shots)
    told = [(key, digest_of(load), n, heard) for (key, load, heard), n in shots.items()]
    print(json.dumps((connects, told)))


def _knock(given: dict[str, Any]) -> int:
    """Connect once and wait for the verdict; 1."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if given["certificate"]:
        context.load_cert_chain(given["certificate"], given["key"])
    with (
        suppress(OSError),  # of ssl's own kind too: the refusal
        socket.create_connection((given["host"], given["port"]), _ANSWER) as link,
        context.wrap_socket(link) as secured,
    ):
        secured.recv(1)
    return 1


def _intrude(given: dict[str, Any], shots: _Shots) -> int:
    """Connect and send; 1 if it was not let in, else 0.

    Zenoh may say that it is in although it is not.
    """
    config = zenoh.Config()
    for key, value in given["settings"].items():
        config.insert_json5(key, json.dumps(value))
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        return 1
    with session:
        if not _is_in(session):
            return 1
        sent = [(key, bytes.fromhex(payload), False) for key, payload in given["shots"]]
        if given["replays"]:
            sent += _hear(session, given["replays"])
        for _ in range(given["times"]):
            for key, payload, heard in sent:
                session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK)
                shots[key, payload, heard] += 1
                sleep(_BETWEEN)
        if given["asks"]:
            for _ in session.get(given["asks"], timeout=_ANSWER):
                pass
    return 0


def _is_in(session: zenoh.Session) -> bool:
    """Whether it is linked to a router, which it may be a little later than it is open."""
    deadline = monotonic() + _ENTERS
    while not session.info.routers_zid():
        if monotonic() > deadline:
            return False
        sleep(_BETWEEN)
    return True


def _hear(session: zenoh.Session, key: str) -> list[tuple[str, bytes, bool]]:
    """The first that others send on a key expression."""
    heard: list[tuple[str, bytes, bool]] = []

    def take(sample: zenoh.Sample) -> None:
        if len(heard) < _MOST_HEARD:
            heard.append((str(sample.key_expr), sample.payload.to_bytes(), True))

    ear = session.declare_subscriber(key, zenoh.handlers.Callback(take, indirect=False))
    sleep(_LISTENS)
    ear.undeclare()  # type: ignore[no-untyped-call]
    return list(heard)


if __name__ == "__main__":
    main(sys.argv[1])

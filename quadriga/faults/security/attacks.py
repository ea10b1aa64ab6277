"""What each attacker of the table does: plans for the process of the module `attacker`."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.certs.folder import CertificateFolder
from quadriga.certs.secured import certificates_of
from quadriga.faults.fault import Draw
from quadriga.faults.security.attack import Attack, Knock, StockClient
from quadriga.shared.config.endpoints import host_and_port
from quadriga.shared.config.sections import Config
from quadriga.shared.members import LAUNCHER, OBSERVER, OPERATOR, RECORDER, RESUME, SIM
from quadriga.shared.robot.conventions import N_JOINTS, robot_names
from quadriga.shared.runtime.clock import utc_now
from quadriga.shared.security.caps import largest
from quadriga.shared.security.tls import TlsFiles, tls_files, tls_settings
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.codes import SIGNAL
from quadriga.shared.wire.messages import Command, EStop, Event, Message, Reference
from quadriga.shared.wire.messages import Resume as Go
from quadriga.shared.wire.topic import Topic
from quadriga.shared.wire.topics import (
    AGENT_EVENT,
    COMMAND,
    ESTOP,
    EVENT,
    INPUTS,
    MEASUREMENT,
    PLAN,
    RECEIVED,
    REFERENCE,
    REFUSED,
    STATE,
    STATUS,
)
from quadriga.shared.wire.topics import RESUME as GO_ON

_TRIES: Final = 20  # of each message, and of each connection
_FLOOD: Final = 30  # connections of a stranger: Zenoh refuses ten in a second, one by one
_OWN: Final = (COMMAND, MEASUREMENT, PLAN, STATUS, INPUTS, AGENT_EVENT)  # topics of a robot
_HUGE: Final = 1 << 19  # bytes, less than what Zenoh itself takes for no message
_FAR: Final = 1 << 41  # a tick that would end every walk
_STOP: Final = EStop(0, 0, "forged")
_Shots = tuple[tuple[str, str], ...]


def expired_certificate(config: Config, draw: Draw) -> Attack:
    """Somebody has an old certificate of who may let a team go on."""
    certificates = certificates_of(config)
    certificates.renew([RESUME], (), utc_now() - timedelta(days=10), 1.0)
    files = tls_files(config.bus.certificates, RESUME)
    return _try_to_come_in(config, files, _shots(config, (GO_ON, "", Go(0, 0))))


def forged_certificate(config: Config, draw: Draw) -> Attack:
    """Somebody has made an authority of his own, and by it the certificate of a robot."""
    folder = Path(config.bus.certificates).parent / "theirs"
    theirs = CertificateFolder(folder, (draw.robot,))
    theirs.make(config.team.name, (), utc_now(), 1.0)
    shots = _shots(config, (COMMAND, draw.robot, _limp(draw)))
    return _try_to_come_in(config, tls_files(str(folder), draw.robot), shots)


def stranger(config: Config, draw: Draw) -> Attack:
    """Somebody has nothing."""
    return _try_to_come_in(config, None, (), _FLOOD)


def forged_messages(config: Config, draw: Draw) -> Attack:
    """Certificates that were stolen send what their owners may not."""
    robot, team = draw.robot, config.team.name
    stop = Event.of(_FAR, SIGNAL, "", "told to stop")
    fast = Reference(0, 0, 2.0, 0.0, 0.0, 0.3)
    limp = _limp(draw)
    thefts: list[tuple[str, _Shots]] = [
        (OPERATOR, _shots(config, (COMMAND, robot, limp), (EVENT, "", stop))),
        (robot, (*_shots(config, (REFERENCE, "", fast)), (f"{team}/of/strangers", "00"))),
        (SIM, _shots(config, (COMMAND, robot, limp))),
        (RECORDER, _shots(config, (ESTOP, "", _STOP))),
        (OBSERVER, _shots(config, (REFERENCE, "", fast))),
        (LAUNCHER, ((REFUSED.key(team), "00" * 50),)),
    ]
    for peer in robot_names(config.team.robots):
        if peer != robot:
            lies = ((STATE.key(team, robot), "00" * 500),)
            thefts.append((peer, (*_shots(config, (COMMAND, robot, limp)), *lies)))
            thefts.append((robot, ((PLAN.key(team, peer), "00" * 500),)))
    return Attack(clients=tuple(_thief(config, who, shots) for who, shots in thefts))


def replayed_messages(config: Config, draw: Draw) -> Attack:
    """A stolen certificate of who hears everything."""
    settings = client_settings(config, tls_files(config.bus.certificates, OBSERVER))
    everything = f"{config.team.name}/**"
    return Attack(clients=(StockClient(settings, replays=everything, asks=_question(config)),))


def malformed_messages(config: Config, draw: Draw) -> Attack:
    """A stolen certificate of a robot; what it sends the router lets through, and nobody reads."""
    chance = np.random.default_rng((draw.seed, 2))
    good = encode(_limp(draw))
    nan = encode(Command(draw.tick, 0, *np.full((5, N_JOINTS), np.nan)))
    wrong = encode(Reference(0, 0, 2.0, 0.0, 0.0, 0.3))
    garbage = (b"", bytes(500), chance.bytes(500), good[:-1], nan, wrong, b"\xdf\xff\xff\xff\xff")
    keys = [topic.key(config.team.name, draw.robot) for topic in _OWN]
    shots = tuple((key, payload.hex()) for key in keys for payload in garbage)
    return Attack(clients=(_thief(config, draw.robot, shots, times=3),))


def oversized_messages(config: Config, draw: Draw) -> Attack:
    """A stolen certificate of a robot; each message is larger than any of its key may be."""
    shots = list[tuple[str, str]]()
    for topic in _OWN:
        key, least = topic.key(config.team.name, draw.robot), largest(topic.type) + 1
        if least < _HUGE:  # of others no message is too large that Zenoh takes for one
            shots += [(key, bytes(size).hex()) for size in (least, _HUGE)]
    return Attack(clients=(_thief(config, draw.robot, tuple(shots), times=5),))


def _try_to_come_in(
    config: Config, files: TlsFiles | None, shots: _Shots, times: int = _TRIES
) -> Attack:
    """Attempts to connect, and one of a stock client that stops the team if it is let in."""
    host, port = host_and_port(config.bus.endpoint)
    certificate, key = (str(files.certificate), str(files.key)) if files else ("", "")
    shots += _shots(config, (ESTOP, "", _STOP))
    client = StockClient(client_settings(config, files), shots, _TRIES, asks=_question(config))
    return Attack((Knock(host, port, times, certificate, key),), (client,))


def _thief(config: Config, identity: str, shots: _Shots, times: int = _TRIES) -> StockClient:
    settings = client_settings(config, tls_files(config.bus.certificates, identity))
    return StockClient(settings, shots, times, asks=_question(config))


def client_settings(config: Config, files: TlsFiles | None) -> dict[str, Any]:
    """Zenoh's settings of a stock client that tries once to connect to a team's router.

    Args:
        config: of the team.
        files: whose certificate it shows; None: nobody's.
    """
    authority = tls_files(config.bus.certificates, OBSERVER).authority
    given: dict[str, Any] = {
        "mode": "client",
        "connect/endpoints": [config.bus.endpoint],
        "scouting/multicast/enabled": False,
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": True,
    }
    own = dict(tls_settings(files, listens=False)) if files else {}
    return given | own | {"transport/link/tls/root_ca_certificate": str(authority)}


def _question(config: Config) -> str:
    return f"{config.team.name}/*/{RECEIVED}"


def _shots(config: Config, *given: tuple[Topic, str, Message]) -> _Shots:
    return tuple((t.key(config.team.name, robot), encode(m).hex()) for t, robot, m in given)


def _limp(draw: Draw) -> Command:
    """A command by which a robot would fall."""
    return Command(draw.tick + 1, (draw.tick + 1) * 1_000_000, *np.zeros((5, N_JOINTS)))

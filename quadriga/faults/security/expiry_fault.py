"""An agent's certificate expires while the team walks: its link is closed.

What else could be done is worse. A link that outlives its certificate would let a thief stay as
long as he likes. So the robot loses its agent as if that were killed: the world, or its bridge,
leads it down, the others stand, and nobody lets it in before its certificate is renewed. The doctor
warns two weeks before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from quadriga.certs.secured import certificates_of, secure
from quadriga.faults.aftermath import read_log
from quadriga.faults.fault import Draw, FaultScene, Stage, TeamFault
from quadriga.faults.outcome import describe_outcome, moment_at
from quadriga.recordings.summary import RECORDING
from quadriga.recordings.traces import read_traces
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.members import ROUTER
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import sleep, utc_now, wall_ns
from quadriga.shared.security.audit_line import AuditLine, parse_refusals
from quadriga.shared.security.certificate import read_certificate
from quadriga.shared.security.refusals import EXPIRED
from quadriga.shared.security.roll import split_common_name
from quadriga.shared.security.tls import tls_files

_LIVES_S: Final = 40.0  # wall time: a team starts within this, and walks when it is over
_AFTER_S: Final = 6.0  # world time that is walked after it at least
_DAY_S: Final = 86_400.0
# What differs because the certificate expires when it does, not at the moment that was drawn.
_OF_MOMENT: Final = ("tick", "detect_ms", "stand_ms", "lost_messages")


@contextmanager
def _stage(config: Config, draw: Draw, folder: Path) -> Iterator[Stage]:
    with TemporaryDirectory(prefix="quadriga-certs-") as private:
        config = secure(config, Path(private), utc_now())
        certificates_of(config).renew([draw.robot], (), utc_now(), _LIVES_S / _DAY_S)
        certificate = tls_files(config.bus.certificates, draw.robot).certificate
        strike = _Expiry(round(1e9 * read_certificate(certificate).expires.timestamp()))
        seconds = max(config.world.seconds, _LIVES_S + _AFTER_S)
        world = replace(config.world, seconds=seconds)
        yield Stage(replace(config, world=world), strike, robot=draw.robot, late=True)
        strike.conclude(folder)


class _Expiry:
    """Wait until a certificate expires, ns since 1970."""

    def __init__(self, at_ns: int) -> None:
        self._at_ns = at_ns
        self._scene: FaultScene | None = None

    def __call__(self, scene: FaultScene) -> None:
        self._scene = scene
        scene.struck.add(scene.draw.robot)  # it may wait for the router for ever
        sleep(1e-9 * (self._at_ns - wall_ns()))
        scene.announce()

    def conclude(self, folder: Path) -> None:
        """Tell by the recording when it was noticed, and whether the link was closed."""
        scene = self._scene
        if scene is None:
            return
        with suppress(RecordingError):
            recording = Recording(folder / RECORDING)
            moment = moment_at(recording, scene.draw.robot, self._at_ns)
            row = describe_outcome(scene.config, read_traces(recording), recording, moment)
            scene.facts.update({name: row[name] for name in _OF_MOMENT})
            audit = parse_refusals(read_log(folder, ROUTER))
            scene.facts.update(_count_closed(audit, scene.draw.robot))


def _count_closed(audit: Iterable[AuditLine], robot: str) -> dict[str, Any]:
    """As of an attack: one link that may not stay. It is told again when Zenoh tries again."""
    closed = 0
    for line in audit:
        own = split_common_name(line.who)[0] == robot
        closed += line.times if own and line.reason == EXPIRED else 0
    refused = min(closed, 1)
    return {"forged": 1, "refused": refused, "told": closed, "passed": 1 - refused}


EXPIRY_FAULT: Final = TeamFault(
    "certificate-expires", "an agent's certificate expires while the team walks", _stage
)

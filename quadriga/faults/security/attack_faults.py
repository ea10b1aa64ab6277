"""Faults that somebody makes: a stranger, and who has stolen a certificate, at a secured router."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, TypeAlias

from quadriga.certs.secured import secure
from quadriga.faults.aftermath import read_log
from quadriga.faults.fault import Draw, FaultScene, SetStage, Stage, TeamFault
from quadriga.faults.security import attacks
from quadriga.faults.security.attack import Attack, AttackReport
from quadriga.faults.security.attack_outcome import describe_attack
from quadriga.faults.security.expiry_fault import EXPIRY_FAULT
from quadriga.recordings.summary import RECORDING
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError, RecordingError
from quadriga.shared.members import ROUTER
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import utc_now
from quadriga.shared.runtime.installed import PYTHON
from quadriga.shared.security.audit_line import parse_refusals

_LASTS_S: Final = 4.0  # world time that the attack takes on a busy computer
_WAIT_S: Final = 60.0  # wall time after which it is given up

_Plan: TypeAlias = Callable[[Config, Draw], Attack]


def _stage(plan: _Plan, *, of_robot: bool = False) -> SetStage:
    """A team behind a router with certificates, and an attacker at the fault's moment.

    It attacks the robot that is drawn if it is `of_robot`, by its certificate or by its name.
    """

    @contextmanager
    def stage(config: Config, draw: Draw, folder: Path) -> Iterator[Stage]:
        with TemporaryDirectory(prefix="quadriga-certs-") as private:
            secured = secure(config, Path(private) / "certs", utc_now())
            strike = _AttackStrike(plan(secured, draw), Path(private))
            world = replace(secured.world, seconds=secured.world.seconds + _LASTS_S)
            robot = draw.robot if of_robot else ""
            yield Stage(replace(secured, world=world), strike, robot=robot, lasts=0.0)
            strike.conclude(folder)

    return stage


class _AttackStrike:
    """Run an attacker to its end, and tell afterwards what came of it."""

    def __init__(self, attack: Attack, private: Path) -> None:
        self._attack, self._private = attack, private
        self._scene: FaultScene | None = None
        self._report = AttackReport(0, ())

    def __call__(self, scene: FaultScene) -> None:
        self._scene = scene
        plan = self._private / "attack.json"
        plan.write_text(self._attack.to_json(), encoding="utf-8")
        command = [*PYTHON, "-m", "quadriga.faults.security.attacker", str(plan)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=_WAIT_S, check=False
            )
        except subprocess.TimeoutExpired:
            raise ProcessError("the attacker", f"no end after {_WAIT_S:g} s", "one") from None
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:]
            raise ProcessError("the attacker", f"exit status {done.returncode}", "0", *last)
        self._report = AttackReport.from_json(done.stdout)

    def conclude(self, folder: Path) -> None:
        """Tell what came of it; whether the recording can be read is told elsewhere."""
        if self._scene is None:
            return
        with suppress(RecordingError):
            entries = Recording(folder / RECORDING).entries()
            audit = parse_refusals(read_log(folder, ROUTER))
            self._scene.facts.update(describe_attack(entries, audit, self._report))


ATTACK_FAULTS: Final = (
    EXPIRY_FAULT,
    TeamFault(
        "certificate-expired",
        "somebody connects with a certificate that has expired",
        _stage(attacks.expired_certificate),
    ),
    TeamFault(
        "certificate-forged",
        "somebody connects with a robot's certificate of another authority",
        _stage(attacks.forged_certificate, of_robot=True),
    ),
    TeamFault(
        "message-forged",
        "stolen certificates of other roles command, stop, plan and lie",
        _stage(attacks.forged_messages, of_robot=True),
    ),
    TeamFault(
        "message-replayed",
        "a stolen certificate of who looks on sends again all that it has heard",
        _stage(attacks.replayed_messages),
    ),
    TeamFault(
        "message-malformed",
        "a robot's stolen certificate sends what is no message under its own keys",
        _stage(attacks.malformed_messages, of_robot=True),
    ),
    TeamFault(
        "message-oversized",
        "a robot's stolen certificate sends messages of up to 512 KiB under its own keys",
        _stage(attacks.oversized_messages, of_robot=True),
    ),
    TeamFault(
        "stranger",
        "somebody without a certificate floods the router with connections",
        _stage(attacks.stranger),
    ),
)
"""In the order of the table."""

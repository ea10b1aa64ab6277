"""SHELL: what is seen of a team after a fault, while it still is there."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.doctor.examine import examine
from quadriga.faults.fault import FaultScene
from quadriga.shared.bus.diagnostics import BAD
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.members import ROUTER, has_lead
from quadriga.shared.runtime.clock import monotonic, sleep

_LOOK_S: Final = 0.02
_START_S: Final = 120.0  # wall time for a team to start
_SLACK_S: Final = 60.0  # wall time for a walk beyond that of the world
_LEAVE_S: Final = 25.0  # for the others to leave after the world
_LINK: Final = "link"


def consult_doctor(scene: FaultScene) -> None:
    """Note what `quadriga doctor` finds wrong, by process, and with the way to the team.

    Of a walk that has ended before the doctor had looked, nothing is noted.
    """
    try:
        report = examine(scene.config, here=False)
    except (BusError, ConfigError) as error:
        scene.facts["doctor"] = {_LINK: error.got}
        return
    if not _has_world(scene):
        return
    found = {
        member.name: ", ".join(d.code for d in member.diagnoses if d.verdict == BAD)
        for member in report.members or ()
    }
    if report.link.verdict == BAD:
        found = {_LINK: report.link.text}  # of those it cannot reach it cannot tell anything
    scene.facts["doctor"] = {name: codes for name, codes in found.items() if codes}


def await_end(scene: FaultScene, begun: float | None = None) -> None:
    """Wait until the world has ended and all that can have left.

    Args:
        scene: the team.
        begun: when the fault came, by the clock: where it has taken the world away, how long the
            others took to leave is noted, and what they said.
    """
    launch, lost_world = scene.launch, bool(scene.struck) and not _has_world(scene)
    deadline = monotonic() + _START_S + scene.config.world.duration + _SLACK_S
    while _has_world(scene) and monotonic() < deadline:
        sleep(_LOOK_S)
    # All others leave by themselves once the world has ended.
    deadline = monotonic() + _LEAVE_S
    others = launch.alive - scene.struck - {ROUTER}
    while (left := launch.alive - scene.struck - {ROUTER}) and monotonic() < deadline:
        sleep(_LOOK_S)
    if lost_world and begun is not None:
        scene.facts |= {
            "left_ms": None if left else round(1000 * (monotonic() - begun)),
            "said": {name: _last_line(scene.folder, name) for name in sorted(others)},
        }


def _has_world(scene: FaultScene) -> bool:
    return has_lead(scene.launch.alive - scene.struck)


def read_log(folder: Path, name: str) -> list[str]:
    """The lines that a process of a walk in `folder` has said."""
    log = folder / "logs" / f"{name}.log"
    return log.read_text(encoding="utf-8", errors="replace").splitlines()


def _last_line(folder: Path, name: str) -> str:
    lines = read_log(folder, name)
    return lines[-1].replace(f"{folder}/", "") if lines else ""

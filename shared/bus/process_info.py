"""What this process answers to whoever asks who it is."""

from __future__ import annotations

import os
import socket
from dataclasses import replace
from typing import Final

from quadriga.shared.about import ABOUT, STARTED, About, scheduling_of, stage_of
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import agreed_keys
from quadriga.shared.members import RECORDER
from quadriga.shared.runtime.clock import wall_ns
from quadriga.shared.runtime.installed import (
    PROJECT,
    code_digest,
    package_versions,
    project_version,
)
from quadriga.shared.runtime.scheduling import REALTIME, has_priority
from quadriga.shared.schema import message_forms

_NO_LIBRARY: Final = ("machine", PROJECT)


class ProcessInfo:
    """Answers from now on, also while this process waits or walks, with how it is at that moment.

    Args:
        bus: this process's.
        config: the configuration that it has.
        predictor_sha256: digest of the predictor that it has; "": none.

    Attributes:
        met: whether this process has seen that all are here.
        start_ns: when tick 0 begins by the system clock, of the plant that drives time for others.
    """

    def __init__(self, bus: Bus, config: Config, predictor_sha256: str = "") -> None:
        self._bus = bus
        # A recorder never asks for it; in lock-step nobody needs it.
        paced = config.world.mode == "realtime" and bus.name != RECORDER
        self._wanted = paced and config.runtime.priority == REALTIME
        self._fixed = describe_process(config, bus.name, predictor_sha256)
        self.met, self.start_ns = False, 0
        bus.answer(ABOUT.key(bus.team, bus.name), lambda: encode(self.about))

    @property
    def about(self) -> About:
        """What this process says of itself now."""
        stage = stage_of(self._bus.reached, met=self.met)
        return replace(
            self._fixed,
            stage=stage,
            scheduling=scheduling_of(wanted=self._wanted, granted=has_priority(), stage=stage),
            sees=tuple(sorted(self._bus.members_at(HERE))),
            wall_ns=wall_ns(),
            start_ns=self.start_ns,
        )


def describe_process(config: Config, name: str, predictor_sha256: str = "") -> About:
    """What does not change of what a process says of itself."""
    versions = package_versions()
    return About(
        tick=0,
        stamp_ns=0,
        name=name,
        host=socket.gethostname(),
        pid=os.getpid(),
        version=project_version(),
        code=code_digest(),
        libraries=tuple(f"{k} {v}" for k, v in versions.items() if k not in _NO_LIBRARY),
        config=agreed_keys(config),
        messages=message_forms(),
        predictor=predictor_sha256,
        stage=STARTED,
        scheduling=scheduling_of(wanted=False, granted=False, stage=STARTED),
        sees=(),
        wall_ns=0,
        start_ns=0,
    )

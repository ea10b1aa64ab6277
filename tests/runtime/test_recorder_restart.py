"""A recorder of a team that walks is killed and started again: it goes on in another file."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from quadriga.recordings.check import check
from quadriga.shared.bus.session import Bus
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import EVENT, STATUS, TRUTH
from tests.runtime.conftest import WAIT, Make
from tests.runtime.frozen import await_tick

pytestmark = pytest.mark.usefixtures("_alone", "_compiled")

Watcher = Callable[..., Bus]


def await_file(path: Path) -> None:
    deadline = monotonic() + WAIT
    while not (path.exists() and path.stat().st_size > 1 << 16):
        assert monotonic() < deadline
        sleep(0.05)


def test_a_recorder_that_is_started_again_goes_on_in_another_file(
    make_team: Make, watcher: Watcher
) -> None:
    team = make_team(world__mode="realtime", world__duration=600.0, recorder__enabled=True)
    with team.launch(standing=False) as running:
        await_tick(watcher(team, EVENT, STATUS, TRUTH), 1500)
        os.kill(running.pids["recorder"], signal.SIGKILL)
        running.restart("recorder")
        await_file(team.folder / "run.2.mcap")
        running.watch(lambda: True)
    first, second = team.folder / "run.mcap", team.folder / "run.2.mcap"
    assert not Recording(first).complete
    found = {finding.name: finding for finding in check(second)}
    assert found["continued"].first[0].got.endswith("of run.mcap")
    assert found["whole"].passed

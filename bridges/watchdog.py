"""SHELL beside a bridge: it damps the robot's motors when the bridge dies or hangs.

A robot goes on with the last command for ever, so the last one must be harmless. The watchdog is a
process of its own with a way of its own to the robot. It hears from the bridge all the time; when
it does not, it damps the motors, switches them off and ends.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from dataclasses import asdict
from typing import Final

import numpy as np

from quadriga.bridges.drivers import RobotDriver, open_driver
from quadriga.bridges.postures import damped, passive
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import BridgeError
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.runtime.installed import PYTHON
from quadriga.shared.runtime.scheduling import take_priority

ALIVE: Final = b"."
GOODBYE: Final = b"q"
BEAT_MS: Final = 5  # between two signs of life
_READY: Final = b"ready\n"
_OFF_MS: Final = 500  # of packets that switch the motors off


class Watchdog:
    """The bridge's end: it starts the watchdog, and tells it all the time that it is alive.

    Raises:
        BridgeError: the watchdog did not start.
    """

    def __init__(self, kind: str, config: BridgeConfig) -> None:
        command = [*PYTHON, "-m", "quadriga.bridges.watchdog", kind, json.dumps(asdict(config))]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        if self._process.stdout is None or self._process.stdin is None:
            raise ValueError("pipes are asked for above")
        self._pipe = self._process.stdin
        if self._process.stdout.readline() != _READY:
            raise BridgeError("the bridge's watchdog", "an end", "a process that waits")

    def beat(self) -> bool:
        """A sign of life; False if the watchdog is not there any more."""
        return self._say(ALIVE)

    def dismiss(self) -> None:
        """End the watchdog: the robot is safe, or nobody was in charge of it."""
        self._say(GOODBYE)
        self._pipe.close()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _say(self, text: bytes) -> bool:
        try:
            os.write(self._pipe.fileno(), text)
        except OSError:
            return False
        return True


def watch(driver: RobotDriver, config: BridgeConfig, pipe: int) -> None:
    """Wait at the pipe until the bridge says goodbye, or is silent; then bring the robot to rest.

    Before its first sign of life the bridge is in charge of nothing, and may end as it likes.
    """
    heard = os.read(pipe, 1)
    if heard != ALIVE:
        return
    while select.select([pipe], [], [], config.damp_ms / 1000.0)[0]:
        heard = os.read(pipe, 4096)
        if GOODBYE in heard:
            return
        if not heard:  # its end is closed: it has died
            break
    os.close(pipe)  # a bridge that is there again learns that its watchdog has acted
    nowhere, rate = np.zeros(N_JOINTS), Rate(0.001 * driver.period_ms)
    damping, off = damped(nowhere, driver.servo), passive(nowhere)
    for targets, ms in ((damping, 1000.0 * config.passive_s), (off, _OFF_MS)):
        for _ in range(round(ms / driver.period_ms)):
            driver.send(targets)
            rate.wait()


def main(kind: str, text: str) -> None:
    """Be the watchdog; its standard input comes from the bridge."""
    # Whoever interrupts the bridge does not mean its watchdog, which ends by itself.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    config = BridgeConfig(**json.loads(text))
    driver = open_driver(kind, config, sends_only=True)
    take_priority("realtime")
    os.write(sys.stdout.fileno(), _READY)
    try:
        watch(driver, config, sys.stdin.fileno())
    finally:
        driver.close()


if __name__ == "__main__":
    main(*sys.argv[1:])

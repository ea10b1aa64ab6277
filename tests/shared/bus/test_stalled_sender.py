"""In real time nothing is lost while the thread that sends a process's messages does not run."""

from __future__ import annotations

import os
import sys
import threading
from multiprocessing.synchronize import Event

import pytest

from benchmarks.children import SPAWN, child, running
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.members import SIM
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint

WAIT = 30.0  # s
KEY = "team/sim/ticks"
PAYLOAD = bytes(9500)  # of what goes over a robot's link in 10 ticks, nearly
COUNT = 40  # 0.4 s of it


def starved(config: Config, told: Event, sent: Event, heard: Event) -> None:
    """Send while the threads that carry it out hardly ever get a processor."""
    with Bus.open(config.bus, "team", SIM) as bus:
        put = bus.publisher(KEY, waits=False)
        bus.declare(HERE)
        assert told.wait(WAIT)
        schedule_others(os.SCHED_IDLE)
        for _ in range(COUNT):
            put(PAYLOAD)
            sleep(0.01)
        schedule_others(os.SCHED_OTHER)
        sent.set()
        heard.wait(WAIT)


def schedule_others(policy: int) -> None:
    """How all threads of this process but the one that asks are scheduled."""
    for thread in map(int, os.listdir("/proc/self/task")):
        if thread != threading.get_native_id():
            os.sched_setscheduler(thread, policy, os.sched_param(0))


def busy(sent: Event) -> None:
    """Take a processor."""
    while not sent.is_set():
        sum(range(10_000))


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux's classes of scheduling")
def test_nothing_is_lost_while_the_thread_that_sends_is_starved() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    told, sent, heard = SPAWN.Event(), SPAWN.Event(), SPAWN.Event()
    others = [child(busy, sent) for _ in range(2 * (os.cpu_count() or 1))]
    with running(child(starved, config, told, sent, heard), *others):
        with Bus.open(config.bus, "team", "recorder") as bus:
            bus.subscribe(KEY)
            bus.declare(HERE)
            bus.wait_for(HERE, [SIM], WAIT, lambda: False)
            sleep(1.0)  # until the subscription is known there
            told.set()
            count, deadline = 0, monotonic() + WAIT
            while count < COUNT and monotonic() < deadline:
                count += bus.get(0.2) is not None
        heard.set()
    assert count == COUNT

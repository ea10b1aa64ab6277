"""A member of a team receives in one thread, which stays known to Python; a router in more."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from threading import get_ident, local

import pytest

from quadriga.shared.bus import zenoh_threads
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.load import load
from quadriga.shared.runtime.clock import sleep
from quadriga.team.endpoint import free_endpoint

PROGRAM = """
import os, sys, time
from pathlib import Path
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.load import load

endpoint, who, wanted = sys.argv[1:]
config = load(None, {"bus.endpoint": endpoint}).bus
opened = Bus.route(endpoint, "team") if who == "router" else Bus.open(config, "team", who)
with opened:
    opened.declare(HERE)
    opened.wait_for(HERE, {"r1"}, 20.0, lambda: False)
    # Those that receive begin with the first link. Zenoh names threads by their work and a number,
    # rx-0 for example, and a thread bears its name once it has run: the second is for one too many,
    # the rest for one that is late, or was begun to open a link and ends after 10 s.
    time.sleep(1.0)
    deadline = time.monotonic() + 30.0
    while True:
        names = [(task / "comm").read_text().strip() for task in Path("/proc/self/task").iterdir()]
        kinds = {name.partition("-")[0] for name in names if "-" in name} & {"acc", "net", "rx"}
        found = f"{','.join(sorted(kinds))} {sum(name.startswith('rx-') for name in names)}"
        if found == wanted or time.monotonic() > deadline:
            break
        time.sleep(0.05)
    print(found, os.environ.get("ZENOH_RUNTIME"))
"""


@pytest.mark.skipif(
    not Path("/proc/self/task").exists(), reason="it looks at threads as Linux does"
)
@pytest.mark.parametrize(
    ("who", "given", "threads"),
    [
        ("sim", None, "rx 1"),
        ("router", None, "acc,net,rx 2"),
        ("sim", "(rx: (worker_threads: 3))", "acc,net,rx 3"),
    ],
)
def test_which_threads_receive(who: str, given: str | None, threads: str) -> None:
    endpoint = free_endpoint()
    environment = {name: text for name, text in os.environ.items() if name != "ZENOH_RUNTIME"}
    if given is not None:
        environment["ZENOH_RUNTIME"] = given
    command = [sys.executable, "-c", PROGRAM, endpoint, who, threads]
    config = load(None, {"bus.endpoint": endpoint}).bus
    if who == "router":
        config = replace(config, mode="client")
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process,
        Bus.open(config, "team", "r1", lambda: False) as other,
    ):
        other.declare(HERE)
        said, _ = process.communicate(timeout=60.0)
    assert said == f"{threads} {given}\n"


def test_the_thread_that_receives_stays_known_to_python() -> None:
    """What is local to a thread lives as long as Python's state of it.

    Another test of this process may have had Zenoh begin more than one such thread.
    """
    config, known = load(None, {"bus.endpoint": free_endpoint()}).bus, local()
    zenoh_threads._attached.clear()  # this thread may have the number of another test's

    def count() -> bytes:
        known.calls = getattr(known, "calls", 0) + 1
        return b"%d %d" % (get_ident(), known.calls)

    with Bus.open(config, "team", "sim") as sim, Bus.open(config, "team", "r1") as r1:
        sim.answer("team/calls", count)
        sim.declare(HERE)
        assert r1.wait_for(HERE, {"sim"}, 20.0, lambda: False)
        told: dict[bytes, list[int]] = {}
        for _ in range(20):
            answers = r1.ask("team/calls", 20.0)
            while not answers.over:
                sleep(0.001)
            for _, _, payload in answers.take():
                thread, _, calls = payload.partition(b" ")
                told.setdefault(thread, []).append(int(calls))
    assert len(told) <= 4
    assert all(calls == [*range(1, len(calls) + 1)] for calls in told.values())

"""The recorder's throughput with real publishers over Zenoh: messages/s, gaps, share of a core.

Publishers are processes that send commands of a growing tick in real time, each on keys of its own,
and never wait; `quadriga record --now` records them. Gaps are counted in the file.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.children import SPAWN, child, running
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import RecordingError
from quadriga.shared.members import SIM
from quadriga.shared.messages import Reference
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.process_use import read_use
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import QUADRIGA

KEYS = 10  # of each publisher
PROBE = "probe"  # sent until the recorder has heard every publisher
PATIENCE = 60.0  # s, for every publisher to be heard, and for the recorder to close its file
BURST = 0.001  # s, period at which due messages are sent, as a world of many robots does


def publish(
    config: Config, name: str, rate: float, seconds: float, go: Event, ended: Event, sent: Any
) -> None:
    """Send small messages on `KEYS` keys, `rate` a second in all, for `seconds`."""
    with Bus.open(config.bus, config.team.name, name) as bus:
        if name == SIM:
            bus.declare(HERE)
            bus.declare(READY)
        probe = bus.publisher(f"{config.team.name}/{name}/{PROBE}")
        puts = [bus.publisher(f"{config.team.name}/{name}-{k}/bench") for k in range(KEYS)]
        while not go.wait(0.05):
            probe(b"")
        begun, count = monotonic(), 0
        while (since := monotonic() - begun) < seconds:
            while count < rate * since:
                tick = count // KEYS
                puts[count % KEYS](encode(Reference(tick, 1_000_000 * tick, 0.5, 0.0, 0.0, 0.26)))
                count += 1
            sleep(BURST)
        sent.value = count
        ended.wait()


def processor_time(pid: int) -> float:
    """Seconds of processor time that a process has taken so far.

    Raises:
        ChildProcessError: it has ended.
    """
    if (use := read_use(pid)) is None:
        raise ChildProcessError("the recorder ended before its time")
    return use.cpu_s


def measure(rate: float, seconds: float, publishers: int, folder: Path) -> dict[str, float]:
    """Publish and record once; the figures."""
    config = load(None, {"bus.endpoint": free_endpoint(), "team.name": "bench"})
    (folder / "bench.toml").write_text(to_toml(config), encoding="utf-8")
    go, ended = SPAWN.Event(), SPAWN.Event()
    names = [SIM, *(f"p{k}" for k in range(1, publishers))]
    counts = [SPAWN.Value("q", 0) for _ in names]
    senders = [
        child(publish, config, name, rate / publishers, seconds, go, ended, count)
        for name, count in zip(names, counts, strict=True)
    ]
    file = folder / "bench.mcap"
    with running(*senders), recording(file, folder / "bench.toml") as pid:
        await_probes(file, publishers)
        before = processor_time(pid)
        go.set()
        sleep(seconds + 1.0)
        used = processor_time(pid) - before
        ended.set()
    return {
        **figures(file, sum(count.value for count in counts)),
        "core": used / seconds,
        "asked_per_s": rate,
        "load": os.getloadavg()[0],
    }


@contextmanager
def recording(file: Path, config: Path) -> Iterator[int]:
    """Run a recorder and yield its process id; at the end of the block it closes the file."""
    words = ["record", "--now", "-o", str(file), "--config", str(config)]
    command = [*QUADRIGA, *words, "--parent", str(os.getpid())]
    recorder = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        yield recorder.pid
    finally:
        recorder.send_signal(signal.SIGINT)
        try:
            recorder.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            recorder.kill()
            recorder.wait()


def await_probes(file: Path, publishers: int) -> None:
    """Wait until the recorder hears every publisher.

    Raises:
        ChildProcessError: the recorder does not hear all, since it or a publisher has failed.
    """
    deadline = monotonic() + PATIENCE
    while (connected := count_publishers(file)) < publishers:
        if monotonic() > deadline:
            raise ChildProcessError(
                f"the recorder heard {connected} of {publishers} publishers within {PATIENCE:g} s"
            )
        sleep(0.1)


def count_publishers(file: Path) -> int:
    """How many publishers the recorder hears."""
    try:
        return len({entry.key for entry in Recording(file).entries()})
    except RecordingError:
        return 0


def figures(file: Path, sent: int) -> dict[str, float]:
    """Figures of the recorded file."""
    ticks: defaultdict[str, list[int]] = defaultdict(list)
    times = []
    for key, tick, log_time, _ in Recording(file).entries():
        if key.endswith(PROBE):
            continue
        ticks[key].append(tick)
        times.append(log_time)
    gaps = sum(int((np.diff(of_key) != 1).sum()) + of_key[0] for of_key in ticks.values())
    return {
        "sent": sent,
        "recorded": len(times),
        "gaps": gaps,
        "per_s": (len(times) - 1) / max(1e-9 * (times[-1] - times[0]), 1e-9),
        "bytes": file.stat().st_size,
    }

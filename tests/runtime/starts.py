"""Walks that are started and stopped at random moments: does any process outlive its walk?

`python -m tests.runtime.starts` starts `quadriga walk` 200 times, in both modes, and stops it by
SIGINT, SIGTERM or SIGKILL after 0 to 6 s, or not at all. After each it looks for processes that the
walk has left behind: their environment carries a mark of this run. It prints how the walks ended,
and ends with 1 if there was an orphan, a walk that would not end, or an exit status that means
something else than what was done.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Final, NamedTuple

from quadriga.shared.runtime.clock import monotonic, sleep

_MARK: Final = "QUADRIGA_STARTS"
_LONGEST: Final = 6.0  # s until a walk is stopped
_PATIENCE: Final = 60.0  # s until one must have ended
_LEAVE: Final = 15.0  # s for the others to notice that their launcher was killed
_SAID: Final = 2000  # letters
_STOPS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, None)
_EXPECTED: Final = {
    signal.SIGINT: {0, 130},  # 0: it was over before
    signal.SIGTERM: {0, 130, -signal.SIGTERM},  # the last: before Python had begun
    signal.SIGKILL: {0, -signal.SIGKILL},
    None: {0},
}


class Attempt(NamedTuple):
    """One start and its end.

    Attributes:
        stop: the signal, or None.
        after: when it was sent, s.
        status: exit status; None of a walk that would not end.
        orphans: command lines of processes that outlived it.
        said: what it printed last.
    """

    stop: signal.Signals | None
    after: float
    status: int | None
    orphans: list[str]
    said: str

    @property
    def wrong(self) -> bool:
        """Whether it did not end as it should."""
        allowed = _EXPECTED[self.stop] | ({-signal.SIGINT} if self.stop == signal.SIGINT else set())
        return bool(self.orphans) or self.status not in allowed


def attempt(number: int, chance: random.Random) -> Attempt:
    """Start a walk, stop it, and look for orphans."""
    mode, stop = chance.choice(["lockstep", "realtime"]), chance.choice(_STOPS)
    after = chance.uniform(0.0, _LONGEST)
    mark = f"{os.getpid()}-{number}"
    with tempfile.TemporaryDirectory() as scratch:
        command = [sys.executable, "-m", "quadriga", "walk", "--planner", "none", "--robots", "2"]
        command += ["--seconds", "1", "--mode", mode, "--no-report", "--out", f"{scratch}/run"]
        command += ["--set", "runtime.check_cpu=false"]
        with Path(scratch, "log").open("wb") as log:
            marked = {**os.environ, _MARK: mark}
            walk = subprocess.Popen(
                command, stdout=log, stderr=log, env=marked, start_new_session=True
            )
        if stop is not None:
            try:
                walk.wait(after)
            except subprocess.TimeoutExpired:
                walk.send_signal(stop)
        status: int | None
        try:
            status = walk.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            status = None
        orphans = _await_no_orphans(mark)
        said = Path(scratch, "log").read_text(encoding="utf-8", errors="replace")
    return Attempt(stop, after, status, orphans, said[-_SAID:])


def _await_no_orphans(mark: str) -> list[str]:
    """Command lines of marked processes that are still there after a while; they are killed."""
    deadline = monotonic() + _LEAVE
    while (left := _marked(mark)) and monotonic() < deadline:
        sleep(0.05)
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    return list(left.values())


def _marked(mark: str) -> dict[int, str]:
    found = dict[int, str]()
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            environment = (folder / "environ").read_bytes()
            words = (folder / "cmdline").read_bytes()
        except OSError:  # it has left, or is somebody else's
            continue
        if f"{_MARK}={mark}".encode() in environment.split(b"\0") and words:
            found[int(folder.name)] = words.replace(b"\0", b" ").decode(errors="replace").strip()
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    chance, ends = random.Random(given.seed), Counter[str]()
    wrong = 0
    for number in range(1, given.times + 1):
        found = attempt(number, chance)
        name = "not stopped" if found.stop is None else found.stop.name
        ends[f"{name}: status {found.status}"] += 1
        if found.wrong:
            wrong += 1
            print(f"{number}: {name} after {found.after:.2f} s: status {found.status}", flush=True)
            for line in found.orphans:
                print(f"  orphan: {line}", flush=True)
            print(found.said, flush=True)
    for text, times in sorted(ends.items()):
        print(f"{times:4} {text}")
    print(f"{given.times} starts, {wrong} that did not end as they should")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

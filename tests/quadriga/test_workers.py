"""Calls side by side: what they give, and that an interrupt at any moment ends them."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from quadriga.workers import run_each

# The interrupt comes a moment after the last call is submitted.
INTERRUPTED = """
import signal, sys
from quadriga.workers import run_each
def interrupt(*_):
    signal.raise_signal(signal.SIGINT)
class Arguments(list):
    def __iter__(self):
        yield from list.__iter__(self)
        signal.setitimer(signal.ITIMER_REAL, float(sys.argv[1]))
if __name__ == "__main__":
    signal.signal(signal.SIGALRM, interrupt)
    try:
        for _ in run_each(len, Arguments([[1]] * 20_000), 1):
            pass
    except KeyboardInterrupt:
        print("interrupted")
"""


def test_every_argument_comes_with_its_own_answer() -> None:
    found = dict(run_each(abs, range(-50, 0), 2))
    assert found == {value: -value for value in range(-50, 0)}


def test_an_interrupt_at_any_moment_ends_the_calls(tmp_path: Path) -> None:
    script = tmp_path / "calls.py"
    script.write_text(INTERRUPTED, encoding="utf-8")
    for delay in (0.002, 0.006, 0.01, 0.02, 0.03):
        done = subprocess.run(
            [sys.executable, str(script), str(delay)],
            capture_output=True,
            text=True,
            timeout=60.0,
            check=True,
            env={"PYTHONPATH": str(Path(__file__).parents[2])},
        )
        assert done.stdout == "interrupted\n", done.stderr


def test_a_script_without_a_guard_is_not_run_again_by_each_worker(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "from quadriga.workers import run_each\nprint('begun')\n"
        "print(sorted(dict(run_each(abs, [-1, -2], 2)).values()))\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
        env={"PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert (done.stdout, done.stderr) == ("begun\n[1, 2]\n", "")


def test_several_threads_may_ask_for_workers_at_once() -> None:
    script = sys.modules["__main__"]
    with ThreadPoolExecutor(3) as threads:
        found = list(threads.map(lambda value: dict(run_each(abs, [value], 1)), (-1, -2, -3)))
    assert found == [{-1: 1}, {-2: 2}, {-3: 3}]
    assert sys.modules["__main__"] is script

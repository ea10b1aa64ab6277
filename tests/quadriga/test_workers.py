"""Calls side by side: what they give, and that an interrupt at any moment ends them."""

from __future__ import annotations

import subprocess
import sys
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

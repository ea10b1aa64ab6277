"""Priority over ordinary processes, for all threads, where the system permits it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.scheduling import VARIABLE, valid_priority
from tests.permitted import permitted

_BEGIN = """
import os, subprocess, sys, threading
from quadriga.shared.runtime import scheduling
given, how = sys.argv[1:]
threading.Thread(target=threading.Event().wait, daemon=True).start()
"""
_TAKE = """
if how == "deny":
    os.setuid(65534)
taken = scheduling.take_priority(given)
if how == "leave":
    scheduling.leave_priority()
policies = {os.sched_getscheduler(int(task)) for task in os.listdir("/proc/self/task")}
print(taken, *policies)
"""
_NICE = """
scheduling.precede_ordinary(given)
print(*{os.getpriority(os.PRIO_PROCESS, int(task)) for task in os.listdir("/proc/self/task")})
print(os.sched_getscheduler(0))
"""
_FIRST = """
scheduling.go_first(alone=how == "alone")
print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, flush=True)
ask = "import os; print(os.sched_getscheduler(0))"
subprocess.run([sys.executable, "-c", ask], check=True)
"""
RR, OTHER = str(os.SCHED_RR), str(os.SCHED_OTHER)
needs_the_right = pytest.mark.skipif(not permitted(), reason="this user may take no precedence")


@pytest.fixture(autouse=True)
def _no_word_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


def said(script: str, given: str = "realtime", how: str = "") -> tuple[list[str], str]:
    """What a process of two threads prints: words, and complaints."""
    command = [sys.executable, "-c", _BEGIN + script, given, how]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return done.stdout.split(), done.stderr


@needs_the_right
@pytest.mark.parametrize(("how", "policy"), [("", RR), ("leave", OTHER)])
def test_all_threads_are_scheduled_in_real_time_until_it_leaves(how: str, policy: str) -> None:
    assert said(_TAKE, how=how) == (["True", policy], "")


@pytest.mark.parametrize("priority", ["realtime", "ordinary"])
def test_the_environment_overrides_the_configuration(
    priority: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "ordinary")
    assert said(_TAKE, priority) == (["False", OTHER], "")
    monkeypatch.setenv(VARIABLE, "Realtime")
    with pytest.raises(ConfigError, match=r"QUADRIGA_PRIORITY .* 'Realtime', expected realtime or"):
        valid_priority(priority)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become a user without the right")
def test_without_the_right_it_runs_all_the_same() -> None:
    found, message = said(_TAKE, how="deny")
    assert found == ["False", OTHER]
    assert message.startswith("no real-time scheduling (Operation not permitted)")
    assert "`USER - rtprio 1` in /etc/security/limits.d" in message


@needs_the_right
@pytest.mark.parametrize(("priority", "change"), [("realtime", -15), ("ordinary", 0)])
def test_who_precedes_ordinary_processes_stays_behind_those_that_walk(
    priority: str, change: int
) -> None:
    nice = str(change or os.getpriority(os.PRIO_PROCESS, 0))
    assert said(_NICE, priority)[0] == [nice, OTHER]


@needs_the_right
@pytest.mark.parametrize(("how", "child"), [("alone", OTHER), ("all", RR)])
def test_who_goes_first_alone_starts_ordinary_processes(how: str, child: str) -> None:
    assert said(_FIRST, how=how)[0] == [RR, child]

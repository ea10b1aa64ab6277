"""Priority over ordinary processes, for all threads, where the system permits it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.scheduling import VARIABLE, valid_priority
from tests.permitted import permitted

_SCRIPT = """
import os, sys, threading
from quadriga.shared.runtime.scheduling import leave_priority, take_priority
if sys.argv[2] == "deny":
    os.setuid(65534)
threading.Thread(target=threading.Event().wait, daemon=True).start()
taken = take_priority(sys.argv[1])
if sys.argv[2] == "leave":
    leave_priority()
policies = {os.sched_getscheduler(int(task)) for task in os.listdir("/proc/self/task")}
print(taken, policies == {os.SCHED_RR}, policies == {os.SCHED_OTHER})
"""


@pytest.fixture(autouse=True)
def _no_word_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


def answer(priority: str, permission: str) -> tuple[list[str], str]:
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, priority, permission],
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.split(), done.stderr


@pytest.mark.skipif(not permitted(), reason="this user may not schedule in real time")
def test_all_threads_are_scheduled_in_real_time() -> None:
    assert answer("realtime", "") == (["True", "True", "False"], "")


@pytest.mark.skipif(not permitted(), reason="this user may not schedule in real time")
def test_who_leaves_is_ordinary_again() -> None:
    assert answer("realtime", "leave") == (["True", "False", "True"], "")


@pytest.mark.parametrize("priority", ["realtime", "ordinary"])
def test_the_environment_overrides_the_configuration(
    priority: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "ordinary")
    assert answer(priority, "") == (["False", "False", "True"], "")


def test_a_priority_of_the_environment_that_there_is_not_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(VARIABLE, "Realtime")
    with pytest.raises(ConfigError, match=r"QUADRIGA_PRIORITY .* 'Realtime', expected realtime or"):
        valid_priority("ordinary")
    monkeypatch.setenv(VARIABLE, "ordinary")
    assert valid_priority("realtime") == "ordinary"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become a user without the right")
def test_without_the_right_it_runs_all_the_same() -> None:
    found, message = answer("realtime", "deny")
    assert found == ["False", "False", "True"]
    assert message.startswith("no real-time scheduling (Operation not permitted)")
    assert "`USER - rtprio 1` in /etc/security/limits.d" in message


_NICE = """
import os, sys, threading
from quadriga.shared.runtime.scheduling import precede_ordinary
threading.Thread(target=threading.Event().wait, daemon=True).start()
precede_ordinary(sys.argv[1])
print(*{os.getpriority(os.PRIO_PROCESS, int(task)) for task in os.listdir("/proc/self/task")})
print(os.sched_getscheduler(0) == os.SCHED_OTHER)
"""


@pytest.mark.skipif(not permitted(), reason="this user may not take precedence")
@pytest.mark.parametrize(("priority", "change"), [("realtime", -15), ("ordinary", 0)])
def test_who_precedes_ordinary_processes_stays_behind_those_that_walk(
    priority: str, change: int
) -> None:
    words = [sys.executable, "-c", _NICE, priority]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    assert done.stdout.split() == [str(change or os.getpriority(os.PRIO_PROCESS, 0)), "True"]


_FIRST = """
import os, subprocess, sys
from quadriga.shared.runtime.scheduling import go_first
go_first(alone=sys.argv[1] == "alone")
print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR)
ask = "import os; print(os.sched_getscheduler(0) == os.SCHED_RR)"
subprocess.run([sys.executable, "-c", ask], check=True)
"""


@pytest.mark.skipif(not permitted(), reason="this user may not schedule in real time")
@pytest.mark.parametrize("alone", [True, False])
def test_who_goes_first_alone_starts_ordinary_processes(alone: bool) -> None:
    words = [sys.executable, "-uc", _FIRST, "alone" if alone else "all"]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["True", str(not alone)]

"""How examples are drawn, and what the tests have to say besides passing."""

from __future__ import annotations

import itertools
import os
import resource
from collections import defaultdict
from collections.abc import Iterator
from fcntl import LOCK_EX, flock
from pathlib import Path
from typing import Final

import pytest
from hypothesis import HealthCheck, settings

from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.scheduling import VARIABLE

# The same examples each time, so that a change is judged by itself and not by chance; and no
# verdict on speed, which on a busy machine is not the code's. HYPOTHESIS_PROFILE=search draws anew.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("search", settings.get_profile("same"), derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))


@pytest.fixture(scope="session", autouse=True)
def _own_runtime_folder(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Teams of other tests, and of this machine's user, are not found."""
    os.environ["XDG_RUNTIME_DIR"] = str(tmp_path_factory.mktemp("runtime"))


@pytest.fixture(scope="session", autouse=True)
def _ordinary() -> None:
    """Two workers share the cores: who merely computes lets the other's team run, too."""
    os.environ[VARIABLE] = "ordinary"
    if _may_hurry():
        os.nice(_PATIENT)


def _may_hurry() -> bool:
    """Whether what was made slower may be made faster again."""
    return os.geteuid() == 0 or resource.getrlimit(resource.RLIMIT_NICE)[0] >= _NICE_MOST


@pytest.fixture
def _alone(
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> Iterator[None]:
    """One at a time of the tests whose team has to keep real time; it precedes all else."""
    with (tmp_path_factory.getbasetemp().parent / "alone.lock").open("w") as file:
        begun = monotonic()
        flock(file, LOCK_EX)
        request.node.user_properties.append((_WAITED, monotonic() - begun))
        monkeypatch.delenv(VARIABLE)
        if not _may_hurry():
            yield
            return
        os.nice(-_PATIENT)
        yield
        os.nice(_PATIENT)


_PATIENT: Final = 10  # nicer are tests, and all they start, than those in real time
_NICE_MOST: Final = 20  # of RLIMIT_NICE, where a niceness of 0 is permitted again
_WAITED: Final = "waited"  # s, of a test for its turn to keep real time
_LONG_RUN: Final = 300.0  # s of tests; of a shorter run nobody asks which files take long
_SLOWEST: Final = 40  # files that are named

# Folders whose tests start processes and take long, and the one whose teams keep real time.
_LONG: Final = ("docs", "manual", "plugins", "quadriga/experiments", "deploy")
_REAL_TIME: Final = "runtime"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long comes first: then at the end no worker waits long for another one's file.

    Between two files whose teams keep real time, one at a time, come two whose tests do not. Such a
    test is run once more if it fails: a computer that others use may keep a team from its work for
    longer than a robot can bear. The summary shows every test that was, and how it failed.
    """
    for item in items:
        if _alone.__name__ in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.flaky(reruns=1))
    here = Path(__file__).parent
    long = [here / name for name in _LONG]
    items.sort(key=lambda item: not any(map(item.path.is_relative_to, long)))
    files: dict[Path, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path, []).append(item)
    real_time = [path for path in files if path.is_relative_to(here / _REAL_TIME)]
    others = [path for path in files if path not in real_time]
    order = []
    for n, path in enumerate(real_time):
        order += [path, *others[2 * n : 2 * n + 2]]
    order += others[2 * len(real_time) :]
    items[:] = [item for path in order for item in files[path]]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How well the golden recording was reproduced, what was run again, and what takes the time."""
    stats, waited = terminalreporter.stats, 0.0
    for report in stats.get("rerun", ()):
        terminalreporter.write_line(f"run once more: {report.nodeid}, since")
        terminalreporter.write_line(report.longreprtext)
    seconds: dict[str, float] = defaultdict(float)
    for report in itertools.chain.from_iterable(stats.values()):
        if not isinstance(report, pytest.TestReport):
            continue
        seconds[report.nodeid.partition("::")[0]] += report.duration
        for name, told in report.user_properties if report.when == "teardown" else ():
            if name == _WAITED and isinstance(told, float):
                waited += told
            if name == "golden":
                terminalreporter.write_line(f"golden recording, {told}")
    total = sum(seconds.values())
    if total >= _LONG_RUN:
        slowest = sorted(seconds.items(), key=lambda item: -item[1])[:_SLOWEST]
        shares = ", ".join(f"{file} {time:.0f}" for file, time in slowest)
        terminalreporter.write_line(
            f"{total:.0f} s of tests, {waited:.0f} of them waits for a turn"
        )
        terminalreporter.write_line(shares)

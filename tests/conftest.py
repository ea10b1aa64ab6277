"""How examples are drawn, and what the tests have to say besides passing."""

from __future__ import annotations

import itertools
import os
from collections import defaultdict
from collections.abc import Generator, Iterator
from fcntl import LOCK_EX, LOCK_SH, LOCK_UN, flock
from pathlib import Path
from typing import IO, Final

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
    """Workers share the cores: what merely computes is not scheduled in real time."""
    os.environ[VARIABLE] = "ordinary"


@pytest.fixture(autouse=True)
def _beside_others(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[IO[str], IO[str]]]:
    """Tests run beside each other, but none beside one that has to be alone.

    All hold the lock `running` together; who wants it for itself keeps the others at the `gate`.
    """
    folder = tmp_path_factory.getbasetemp().parent
    with (folder / "gate.lock").open("w") as gate, (folder / "running.lock").open("w") as running:
        flock(gate, LOCK_EX)
        flock(running, LOCK_SH)
        flock(gate, LOCK_UN)
        yield gate, running


@pytest.fixture
def _alone(
    _beside_others: tuple[IO[str], IO[str]],
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    """The team of such a test has to keep real time: no other test runs beside it."""
    gate, running = _beside_others
    begun = monotonic()
    flock(running, LOCK_UN)  # or two that want to be alone would wait for each other
    flock(gate, LOCK_EX)
    flock(running, LOCK_EX)
    request.node.user_properties.append((_WAITED, monotonic() - begun))
    monkeypatch.delenv(VARIABLE)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, object, object]:
    """What a test and the processes that it waited for computed is told beside how long it took."""
    _begun[item.nodeid] = _computed()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Generator[None, object, object]:
    result = yield
    item.user_properties.append((_COMPUTED, _computed() - _begun.pop(item.nodeid)))
    return result


def _computed() -> float:
    """Seconds of processor time of this worker and of those of its processes that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


_begun: dict[str, float] = {}
_COMPUTED: Final = "computed"  # s, of a test
_WAITED: Final = "waited"  # s, of a test for its turn to keep real time
_LONG_RUN: Final = 300.0  # s of tests; of a shorter run nobody asks which files take long
_SLOWEST: Final = 40  # files that are named

# Folders whose tests start processes and take long, and the one with tests that have to be alone.
_FIRST: Final = ("docs", "manual", "plugins", "quadriga/experiments", "deploy")
_LAST: Final = "runtime"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long comes first, what has to be alone last: no worker waits long for the other.

    A test whose team keeps real time is run once more if it fails: a computer that others use may
    keep a team from its work for longer than a robot can bear. The summary shows every test that
    was, and how it failed.
    """
    for item in items:
        if _has_to_be_alone(item):
            item.add_marker(pytest.mark.flaky(reruns=1))
    here = Path(__file__).parent
    first, last = [here / name for name in _FIRST], here / _LAST
    alone = {item.path for item in items if _has_to_be_alone(item)}
    items.sort(
        key=lambda item: (
            item.path in alone,
            item.path.is_relative_to(last),
            not any(map(item.path.is_relative_to, first)),
        )
    )


def _has_to_be_alone(item: pytest.Item) -> bool:
    return _alone.__name__ in getattr(item, "fixturenames", ())


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How well the golden recording was reproduced, what was run again, and what takes the time."""
    stats, waited = terminalreporter.stats, 0.0
    computed: dict[str, float] = defaultdict(float)
    for report in stats.get("rerun", ()):
        terminalreporter.write_line(f"run once more: {report.nodeid}, since")
        terminalreporter.write_line(report.longreprtext)
    seconds: dict[str, float] = defaultdict(float)
    for report in itertools.chain.from_iterable(stats.values()):
        if not isinstance(report, pytest.TestReport):
            continue
        file = report.nodeid.partition("::")[0]
        seconds[file] += report.duration
        for name, told in report.user_properties if report.when == "teardown" else ():
            if name == _WAITED and isinstance(told, float):
                waited += told
            if name == _COMPUTED and isinstance(told, float):
                computed[file] += told
            if name == "golden":
                terminalreporter.write_line(f"golden recording, {told}")
    total = sum(seconds.values())
    if total >= _LONG_RUN:
        terminalreporter.write_line(
            f"{total:.0f} s of tests, {waited:.0f} of them waits for a turn; "
            f"{sum(computed.values()):.0f} s of processor time"
        )
        for what, shares in (("", seconds), ("processor time: ", computed)):
            most = sorted(shares.items(), key=lambda item: -item[1])[:_SLOWEST]
            told = ", ".join(f"{file} {time:.0f}" for file, time in most)
            terminalreporter.write_line(what + told)

"""How examples are drawn, and what all tests have around them."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

from quadriga.shared.runtime.scheduling import VARIABLE

# The same examples each time, so that a change is judged by itself and not by chance; and no
# verdict on speed, which on a busy machine is not the code's. HYPOTHESIS_PROFILE=search draws anew.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("search", settings.get_profile("same"), derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))


@pytest.fixture(scope="session", autouse=True)
def _apart(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Teams of this machine's user are not found; workers that share cores take no priority."""
    os.environ["XDG_RUNTIME_DIR"] = str(tmp_path_factory.mktemp("runtime"))
    os.environ[VARIABLE] = "ordinary"


@pytest.fixture
def _realtime(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The team keeps real time as on a robot: in `make nightly`, where no test runs beside it."""
    assert request.node.get_closest_marker("nightly")
    monkeypatch.delenv(VARIABLE)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Teams of processes take long: they come first, or one worker would end after the others."""
    items.sort(key=lambda item: not item.nodeid.startswith("tests/runtime/"))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How well the golden recording was reproduced."""
    for report in terminalreporter.stats.get("passed", ()):
        for name, told in report.user_properties:
            if name == "golden":
                terminalreporter.write_line(f"golden recording, {told}")

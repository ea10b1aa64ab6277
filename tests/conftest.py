"""What the tests have to say besides passing, and what they do not depend on."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

# How fast a busy machine draws and runs an example is nowhere the subject.
settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How well the golden recording was reproduced: to the byte, or only nearly."""
    for report in terminalreporter.stats.get("passed", []):
        for name, text in report.user_properties:
            if name == "golden" and report.when == "call":
                terminalreporter.write_line(f"golden recording, {text}")

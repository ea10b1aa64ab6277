"""What the tests have to say besides passing."""

from __future__ import annotations

import pytest


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How well the golden recording was reproduced: to the byte, or only nearly."""
    for report in terminalreporter.stats.get("passed", []):
        for name, text in report.user_properties:
            if name == "golden" and report.when == "call":
                terminalreporter.write_line(f"golden recording, {text}")

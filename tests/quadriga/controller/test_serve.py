"""A program that nobody has started for a robot says so in one line."""

from __future__ import annotations

import pytest

from quadriga.controller import build_command, serve


def test_who_is_started_by_hand_gets_one_line_and_a_status(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("QUADRIGA_ROBOT", raising=False)
    with pytest.raises(SystemExit, match="1"):
        serve(lambda state, _: build_command(state))
    said = capsys.readouterr().err
    assert said.startswith("quadriga: QUADRIGA_ROBOT: got nothing in the environment")
    assert said.count("\n") == 1

"""An emergency stop by the operators of this machine: all of them, or the long way."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Thread

import pytest

from quadriga.drive.client import socket_path
from quadriga.drive.find import open_link
from quadriga.drive.quick_stop import stop_quickly
from quadriga.shared.errors import ConfigError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    made = tmp_path / "quadriga"
    made.mkdir(mode=0o700)
    return made


@contextmanager
def operator(folder: Path, team: str, *answers: object) -> Iterator[list[dict[str, object]]]:
    """Something that listens as an operator does, and what it has heard; without answers: hung."""
    heard = list[dict[str, object]]()
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(socket_path(folder, team, 7)))
        server.listen()

        def serve() -> None:
            link, _ = server.accept()
            with link, link.makefile("rw", encoding="utf-8") as lines:
                for line in lines:
                    heard.append(json.loads(line))
                    for answer in answers:
                        if answer is None:
                            return
                        lines.write(json.dumps(answer) + "\n")
                        lines.flush()

        thread = Thread(target=serve)
        thread.start()
        try:
            yield heard
        finally:
            thread.join()


HEARD = {"kind": "heard", "number": 0}
FINE = {"kind": "stopped", "ms": 7, "missing": []}


def test_all_teams_of_this_machine_are_stopped(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with ExitStack() as stack:
        heard = [stack.enter_context(operator(folder, name, HEARD, FINE)) for name in ("a", "b-c")]
        assert stop_quickly(["--reason", "dog"]) == (0, ())
    assert heard == [[{"kind": "estop", "text": "dog"}]] * 2
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("team 'a' stopped within 7 ms: every joint is damped")
    assert said[1].startswith("team 'b-c' stopped within 7 ms")


def test_who_has_not_stopped_is_named_and_the_status_tells(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with operator(folder, "team", HEARD, {**FINE, "missing": ["r2", "plant"]}) as heard:
        assert stop_quickly([]) == (2, ())
    assert heard == [{"kind": "estop", "text": "operator"}]
    assert "of team 'team': no word of r2, plant after 7 ms" in capsys.readouterr().err


@pytest.mark.parametrize(
    "answers",
    [[None], [], [HEARD], [HEARD, None], [{}], [[]], [{"kind": "stopped", "missing": "r1"}]],
)
def test_a_team_whose_operator_does_not_answer_is_left_to_the_long_way(
    folder: Path, answers: list[object], capsys: pytest.CaptureFixture[str]
) -> None:
    with operator(folder, "a", HEARD, FINE) as heard, operator(folder, "b", *answers):
        assert stop_quickly([]) == (None, ("--team", "b"))
    assert heard == [{"kind": "estop", "text": "operator"}]
    said = capsys.readouterr()
    assert said.out.startswith("team 'a' stopped within 7 ms")
    assert "of team 'b': its operator does not answer: over the bus now" in said.err


def test_other_options_and_no_team_at_all_are_left_to_the_long_way(folder: Path) -> None:
    left = folder / "left-9.sock"
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(left))
    for options in ([], ["--config", "team.toml"], ["--armed"], ["--reason"]):
        assert stop_quickly(options) == (None, ())
    with pytest.raises(ConfigError, match="no operator on this machine"):
        open_link()
    assert not left.exists(), "nobody listens there any more"


def test_a_link_to_one_team_must_be_to_one(folder: Path) -> None:
    with (
        operator(folder, "a", FINE),
        operator(folder, "b", FINE),
        pytest.raises(ConfigError, match="one of a, b, by --team"),
    ):
        open_link()

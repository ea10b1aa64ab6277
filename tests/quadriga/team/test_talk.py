"""A word that a person says to a team is said again, the same to the byte, but not for ever."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from quadriga.commands.parser import main
from quadriga.shared import members, messages
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.codes import STOP_ASKED
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.members import SIM
from quadriga.shared.messages import SafeStop, Status
from quadriga.shared.topics import EVENT, STATUS, STOP
from quadriga.team import safe_stop
from quadriga.team.endpoint import free_endpoint
from quadriga.team.talk import TeamTalk

WORD = SafeStop(5, 0, "dog", False)


def test_a_word_is_repeated_for_a_second_and_to_those_who_turn_up_later() -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    with Bus.open(config.bus, "team", SIM) as plant, TeamTalk(config, members.STOP) as talk:
        plant.subscribe(STOP.key("team"))
        plant.declare(HERE)
        say = talk.publisher(STOP)
        assert talk.follow(lambda: talk.look() == {SIM}, 20.0)
        say(WORD)
        assert not talk.follow(lambda: False, 1.5)
        heard = [payload for _, payload in plant.drain()]
        assert set(heard) == {encode(WORD)}
        assert 3 <= len(heard) <= 12
        with Bus.open(config.bus, "team", "r1") as late:
            late.subscribe(STOP.key("team"))
            late.declare(HERE)
            assert talk.follow(lambda: bool(late.drain()), 20.0)
        assert not talk.follow(lambda: False, 0.3)
        assert len(plant.drain()) == 1, "once for who is new"


def test_a_word_reaches_a_recorder_that_finds_its_speaker_once_all_is_done() -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    with Bus.open(config.bus, "team", SIM) as plant, TeamTalk(config, members.STOP) as talk:
        plant.declare(HERE)
        assert talk.follow(lambda: talk.look() == {SIM}, 20.0)
        talk.publisher(STOP)(WORD)
        with Bus.open(config.bus, "team", members.RECORDER) as recorder:
            recorder.subscribe(STOP.key("team"))
            recorder.declare(HERE)
            talk.close()
            assert {payload for _, payload in recorder.drain()} == {encode(WORD)}


@contextmanager
def robot_that_is(mode: str, config: Config, *, deaf: bool = False) -> Iterator[None]:
    """A plant and an agent that say how the robot is, and hear whatever is said, or nothing."""
    nothing, over = np.zeros(0), Event()
    status = Status(5, 5_000_000, mode, "", "kalman", {}, {}, nothing, nothing)
    with Bus.open(config.bus, "team", SIM) as plant, Bus.open(config.bus, "team", "r1") as agent:
        put, announce = (
            agent.publisher(STATUS.key("team", "r1")),
            plant.publisher(EVENT.key("team")),
        )
        plant.subscribe(STOP.key("team"))

        def say_so() -> None:
            while not over.wait(0.05):
                put(encode(status))
                if plant.drain() and not deaf:
                    announce(encode(messages.Event.of(5, STOP_ASKED, "", "operator")))

        thread = Thread(target=say_so)
        thread.start()
        for bus in (plant, agent):
            bus.declare(HERE)
        try:
            yield
        finally:
            over.set()
            thread.join()


@pytest.mark.parametrize(
    ("words", "mode", "asked"),
    [
        (("stop", "--stand"), "stand", ["asked r1; waiting until all stand, at most 5 s"]),
        (("resume",), "walk", ["asked r1; waiting until all walk, at most "]),
        (
            ("reset", "--by", "ann"),
            "walk",
            [
                "release sent to r1; waiting until all stand, at most 15 s",
                "asked r1 to go on; waiting until all walk, at most ",
            ],
        ),
    ],
)
def test_a_person_is_told_what_is_done_before_what_comes_of_it(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    mode: str,
    asked: list[str],
) -> None:
    """On stderr, which is no terminal here; stdout has the result alone."""
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    file = tmp_path / "team.toml"
    file.write_text(to_toml(config), encoding="utf-8")
    with robot_that_is(mode, config):
        assert main([*words, "--config", str(file)]) == 0
    out, err = capsys.readouterr()
    assert out == f"r1: {mode}\n"
    begins = [f"connecting to team 'team' at {config.bus.endpoint}", *asked]
    told = err.splitlines()
    assert len(told) == len(begins)
    for line, begin in zip(told, begins, strict=True):
        assert line.startswith(f"quadriga: {begin}")


def test_a_stop_that_nobody_acknowledges_has_not_stopped_a_team_that_stands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A router may have denied it; the robots stand for a reason of their own, and will walk on."""
    monkeypatch.setattr(safe_stop, "_PATIENCE", 0.5)
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    with robot_that_is("stand", config, deaf=True):
        done, said = safe_stop.stop_safely(config, "dog", ends=False)
    assert not done
    assert said.startswith("r1: stand\n")

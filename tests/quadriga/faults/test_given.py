"""Faults of the table at a robot and a moment that somebody has chosen."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.faults.catalogue import BY_NAME, find_fault, select_faults
from quadriga.faults.fault import Draw
from quadriga.faults.link_faults import LINK_WORDS, LINKS
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.sim_server.world.faults import KINDS


@pytest.mark.parametrize(
    ("text", "base", "given"),
    [
        ("r2/agent killed 4", "agent-killed", ("r2", 4000)),
        ("agent-killed 4", "agent-killed", ("", 4000)),
        ("agent killed 4", "agent-killed", ("", 4000)),
        ("operator frozen 3.5", "operator-frozen", ("", 3500)),
        ("r1/link delay-50 3", "link-delay-50", ("r1", 3000)),
        ("r1/radio down-300 3", "radio-down-300", ("r1", 3000)),
        ("r1/link off 3", "link-partition", ("r1", 3000)),
        ("r1/radio slow 3", "radio-loss-20-delay-50", ("r1", 3000)),
        ("r1/link delayed 3", "link-delay-50", ("r1", 3000)),
        ("r1/link intermittent 3", "link-loss-20", ("r1", 3000)),
        ("r1/link garbage 3", "link-garbage", ("r1", 3000)),
        ("disk full 2", "disk-full", ("", 2000)),
        ("flood 2", "flood", ("", 2000)),
        ("imu-stuck 3", "imu-stuck", ("", 3000)),
    ],
)
def test_robot_and_moment_are_those_that_are_given(
    text: str, base: str, given: tuple[str, int]
) -> None:
    fault = find_fault(text, Config())
    assert (fault.name, fault.base, fault.given) == (text, base, given)
    assert fault.realtime == BY_NAME[base].realtime
    assert select_faults([text, "agent-killed"], Config()) == [BY_NAME["agent-killed"], fault]


@pytest.mark.parametrize(
    "text", ["r2/agent paused 4 1.5", "r2/link partition 4 1.5", "r2/link off 4 1.5"]
)
def test_what_stops_by_itself_may_last_as_long_as_somebody_says(text: str) -> None:
    fault = find_fault(text, Config())
    assert fault.lasting is not None
    assert fault.stage is not BY_NAME[fault.base].stage


def test_a_walk_is_longer_by_how_long_its_fault_lasts(tmp_path: Path) -> None:
    draw, config = Draw("r2", 4000, 1, chosen=True), load(None, {"world.duration": 5.0})
    with find_fault("r2/agent paused 4 1.5", config).stage(config, draw, tmp_path) as stage:
        assert stage.config.world.duration == 6.5
        assert (stage.robot, stage.detail, stage.lasts) == ("r2", "for 1.5 s", 0.0)


def test_of_a_chosen_robot_it_is_the_agent_whose_clock_goes_wrong(tmp_path: Path) -> None:
    for seed in range(5):
        draw = Draw("r2", 4000, seed, chosen=True)
        with find_fault("r2/clock step 4", Config()).stage(Config(), draw, tmp_path) as stage:
            assert stage.robot == "r2"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("r2/agent kiled --at 4", "got 'kiled' of r2/agent.*did you mean 'killed'"),
        ("r3/agent killed --at 4", "got robot 'r3', expected one of r1, r2 .in real time 2"),
        ("r2/agnt killed --at 4", "got component 'agnt'.*did you mean 'agent'"),
        ("operator frozn --at 3", "got 'frozn' of operator.*did you mean 'frozen'"),
        ("r2/agent killed", r"expected NAME or \[ROBOT/\]PART KIND, with --at S"),
        ("r2/agent killed --at 0", "got time '0'.*expected 0.001 … 3600 s"),
        ("r2/agent killed --at 3 --for 2", "--for: got 2 with agent-killed, expected --at alone"),
        ("r2/link stuck --at 3", "got 'stuck' of a link, expected one of off, garbage.*no value"),
        ("r2/radio wrong --at 3", "got 'wrong' of a radio, expected one of off, garbage"),
        ("r2/link delayd --at 3", "got 'delayd' of r2/link.*did you mean 'delayed'"),
        ("agent-kiled --at 3", "did you mean 'agent-killed'"),
        ("agent-killed --for 3", "with --at S"),
        ("--at 3", "got none"),
    ],
)
def test_what_was_got_and_what_was_expected(
    capsys: pytest.CaptureFixture[str], words: str, error: str
) -> None:
    assert main(["fault", *words.split()]) == 2
    assert re.search(error, capsys.readouterr().err)


def test_every_word_of_a_link_is_a_fault_of_the_table_and_is_listed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["fault", "--list"]) == 0
    listed = capsys.readouterr().out
    for word, kind in LINK_WORDS.items():
        assert word in KINDS
        for part in LINKS:
            assert find_fault(f"r1/{part} {word} 3", Config()).base == f"{part}-{kind}"
        assert re.search(rf"{word} .*link-{kind} .*radio-{kind}", listed)

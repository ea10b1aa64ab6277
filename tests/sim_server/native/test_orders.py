"""Lines that an operator types: what each asks for, and one clear answer to a wrong one."""

from __future__ import annotations

import re
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import JOINT_NAMES
from quadriga.sim_server.native.link import LinkFaults
from quadriga.sim_server.native.orders import (
    HELP,
    PRESS_MS,
    Act,
    Charge,
    ClearFaults,
    Disturb,
    Hang,
    Intrude,
    MarkTime,
    Press,
    Protect,
    RemoteOff,
    Switch,
    parse_order,
)

NAMES = ("r1", "r2")
BOTH = ("commands", "reports")


@pytest.mark.parametrize(
    ("line", "act"),
    [
        ("r1 loss 0.05", Disturb("loss", 0.05, BOTH)),
        ("r1 duplicate 1 commands", Disturb("duplicate", 1.0, ("commands",))),
        ("r1 reorder 0.1 reports", Disturb("reorder", 0.1, ("reports",))),
        ("r1 garbage 0", Disturb("garbage", 0.0, BOTH)),
        ("r1 delay 20", Disturb("delay", 20.0, BOTH)),
        ("r1 jitter 2.5", Disturb("jitter", 2.5, BOTH)),
        ("r1 remote L2+B", Press(frozenset({"L2", "B"}), PRESS_MS)),
        ("r1 remote start hold", Press(frozenset({"start"}), None)),
        ("r1 remote release", Press(frozenset(), None)),
        ("r1 remote on", Press(frozenset(), None)),
        ("r1 remote off", RemoteOff()),
        ("r1 battery 8", Charge(8.0)),
        ("r1 protect FR_calf_joint", Protect(JOINT_NAMES.index("FR_calf_joint"))),
        ("r1 off", Switch(False)),
        ("r1 on", Switch(True)),
        ("r1 writer", Intrude(True)),
        ("r1 writer off", Intrude(False)),
        ("r1 hang", Hang(True)),
        ("r1 lower", Hang(False)),
        ("  r1   clear ", ClearFaults()),
    ],
)
def test_each_word_is_understood(line: str, act: Act) -> None:
    order = parse_order(line, NAMES)
    assert (order.robots, order.act, order.at) == (("r1",), act, None)
    assert order.text == " ".join(line.split())
    everyone = parse_order(line.replace("r1", "4.25 all", 1), NAMES)
    assert (everyone.robots, everyone.act, everyone.at) == (NAMES, act, 4250)


def test_a_mark_needs_no_robot() -> None:
    order = parse_order("mark agent r1 killed", NAMES)
    assert (order.robots, order.act, order.text) == ((), MarkTime(), "mark agent r1 killed")


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("", "order: got nothing, expected all, r1, r2, mark or help"),
        ("r3 off", "order: got 'r3', expected all, r1, r2, mark or help"),
        ("r1", "order: got 'r1' alone, expected r1 and one of loss, duplicate, reorder,"),
        ("r1 los 0.05", "order: got 'los', expected r1 and one of .* (did you mean 'loss'?)"),
        ("r1 loss", "order: got 'loss', expected loss, a share of packets, 0 … 1, then commands,"),
        ("r1 loss 1.5", "order: got 'loss 1.5', expected loss, a share of packets, 0 … 1"),
        ("r1 loss nan", "order: got 'loss nan', expected loss, a share"),
        ("r1 loss 0.1 up", "order: got 'loss 0.1 up', expected loss, a share"),
        (
            "r1 delay -1",
            "order: got 'delay -1', expected delay, 0 … 1000 ms, then commands, reports",
        ),
        ("r1 remote L2+C", "order: got 'L2+C', expected buttons of R1, L1"),
        ("r1 remote", "order: got 'remote', expected remote BUTTONS, remote BUTTONS hold"),
        ("r1 battery full", "order: got 'battery full', expected battery and 0 … 100 %"),
        ("r1 protect knee", "order: got 'protect knee', expected protect and one of FL_hip_joint"),
        ("r1 off now", "order: got 'off now', expected off alone"),
        ("r1 writer on", "order: got 'writer on', expected writer, or writer off"),
        ("-1 r1 off", "order: got -1 s, expected 0 … 86400 s since the start"),
        ("nan r1 off", "order: got nan s, expected 0 … 86400 s since the start"),
    ],
)
def test_a_wrong_line_is_answered_by_what_was_got_and_expected(line: str, answer: str) -> None:
    pattern = re.escape(answer).replace(r"\.\*", ".*")
    with pytest.raises(ConfigError, match=f"^{pattern}") as caught:
        parse_order(line, NAMES)
    assert "\n" not in str(caught.value)


words = st.sampled_from(
    ["r1", "all", "loss", "0.1", "remote", "L2+B", "off", "nan", "1e99", "mark"]
)


@given(st.text() | st.lists(words).map(" ".join))
def test_any_text_is_an_order_or_one_clear_error(line: str) -> None:
    with suppress(ConfigError):
        order = parse_order(line, NAMES)
        assert set(order.robots) <= set(NAMES)
        assert order.text == " ".join(line.split()[order.at is not None :])


def test_every_fault_of_a_link_can_be_asked_for_and_the_help_has_every_word() -> None:
    for fault in LinkFaults.__slots__:
        act = parse_order(f"r1 {fault} 0.5", NAMES).act
        assert act == Disturb(fault, 0.5, BOTH)
    with pytest.raises(ConfigError) as caught:
        parse_order("r1 ?", NAMES)
    for word in caught.value.expected.removeprefix("r1 and one of ").split(", "):
        assert re.search(rf"\b{word}\b", HELP), word

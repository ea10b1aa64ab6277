"""What an agent took in is told where no rule tells it, and only there."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.agent import Inputs
from quadriga.agents.inbox.inbox import Inbox
from quadriga.agents.inbox.intake_log import (
    Intake,
    format_message_id,
    list_messages,
    parse_message_id,
)
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import Consumed, EStop, Measurement, Plan, Reference, Status
from tests.a1 import standing

PLAN = Plan(480, 0, 12, np.zeros((25, 12)), np.zeros((25, 6)), "solved", {}, 1)
SAMPLE = Measurement(480, 0, np.zeros(12), np.zeros(6), np.ones(4))
REFERENCE = Reference(500, 0, 0.5, 0.0, 0.0, 0.26)


def intake(mode: str) -> tuple[Inbox, Intake]:
    """Of r2 that takes in r1's plans."""
    config = load(None, {"world.mode": mode})
    arrivals = Inbox(config, "r2", ("r1",))
    return arrivals, Intake(config, arrivals)


def full(tick: int) -> Inputs:
    return Inputs(
        standing(tick), (("r1", SAMPLE),), (("r1", PLAN),), (REFERENCE,), EStop(7, 7, "tripped")
    )


@given(
    topic=st.sampled_from(["plan", "measurement", "reference", "estop", "sim/truth"]),
    sender=st.sampled_from(["r1", "r10", "planner", "operator", "anyone", "sim"]),
    first=st.integers(0, 1 << 40),
    second=st.integers(0, 9),
)
def test_references_lead_back(topic: str, sender: str, first: int, second: int) -> None:
    order = (first, second if topic == "plan" else 0)
    assert parse_message_id(format_message_id((topic, sender), order)) == ((topic, sender), order)


@given(text=st.text(max_size=20))
def test_foreign_references_are_no_error(text: str) -> None:
    found = parse_message_id(text)
    assert found is None or len(found) == 2


def test_in_real_time_all_that_was_taken_in_is_listed() -> None:
    _, box = intake("realtime")
    assert box.record(540, full(541), NOTHING) == Consumed(
        541,
        541_000_000,
        0,
        0,
        ("plan:r1:12.1", "measurement:r1:480", "reference:operator:500", "estop:anyone:7"),
        (),
    )
    assert len(list_messages(full(541))) == 4


def test_a_step_that_took_in_the_next_state_alone_needs_no_record() -> None:
    _, box = intake("realtime")
    assert box.record(-1, Inputs(standing(0)), NOTHING) is None
    passed = box.record(0, Inputs(standing(3)), NOTHING)
    assert passed is not None
    assert (passed.number, passed.passed, passed.taken) == (0, 2, ())
    again = box.record(3, full(4), NOTHING)
    assert again is not None
    assert again.number == 1


def test_statuses_of_others_are_listed_in_real_time() -> None:
    said = Status(500, 0, "walk", "", "", {}, {}, np.zeros(0), np.zeros(0))
    _, box = intake("realtime")
    told = Inputs(standing(504), statuses=(("r1", said),))
    found = box.record(503, told, NOTHING)
    assert found is not None
    assert found.taken == ("status:r1:500",)
    assert [parse_message_id(text) for text in found.taken] == list_messages(told)


def test_lock_step_tells_only_the_unusual() -> None:
    arrivals, box = intake("lockstep")
    arrivals.take("team/r1/plan", encode(PLAN))
    arrivals.take("team/r1/measurement", encode(SAMPLE))
    expected = Expected((12, 1), 480)
    usual = arrivals.pop_inputs(standing(520), expected)
    assert len(list_messages(usual)) == 2
    assert box.record(519, usual, expected) is None
    # The same message once more would be a late one: it had been due before.
    late = box.record(520, Inputs(standing(521), plans=(("r1", PLAN),)), NOTHING)
    assert late is not None
    assert late.taken == ("plan:r1:12.1",)
    owed = box.record(521, Inputs(standing(522)), Expected((13, 0)))
    assert owed is not None
    assert (owed.taken, owed.owed) == ((), ("plan/r1",))
    assert box.record(522, Inputs(standing(523)), NOTHING) is None
    stopped = box.record(523, Inputs(standing(524), estop=EStop(0, 0, "")), NOTHING)
    assert stopped is not None
    assert stopped.taken == ("estop:anyone:0",)
    assert box.record(524, Inputs(standing(526)), NOTHING) is not None

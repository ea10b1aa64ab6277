"""The golden walk is walked again by the present code: a change of behaviour must be stated."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.predictor.gates import load_checked
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, Message, State
from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.runtime.arithmetic import arithmetic
from tests.golden import scenario
from tests.golden.compare import TOLERANCE, differences, first_difference, judge
from tests.golden.renew import ARITHMETIC
from tests.golden.rerun import recorded, rerun

CONFIG = scenario.config()
ROBOTS = ("r1", "r2")
Sent = list[tuple[str, bytes]]


@pytest.fixture(scope="module")
def entries() -> list[ChunkEntry]:
    return list(Recording(scenario.RECORDING).entries())


def heard_again(entries: list[ChunkEntry], robot: str, config: Config = CONFIG) -> Sent:
    return rerun(entries, config, robot, load_checked(scenario.PREDICTOR, CONFIG)[0])


@pytest.mark.parametrize("robot", ROBOTS)
def test_agents_do_what_they_did(
    entries: list[ChunkEntry], robot: str, record_property: Callable[[str, object], None]
) -> None:
    made_by = json.loads(Recording(scenario.RECORDING).metadata[ARITHMETIC])
    verdict = judge(
        robot,
        recorded(entries, CONFIG, robot),
        heard_again(entries, robot),
        differences(arithmetic(), made_by),
    )
    assert verdict.ok, f"\n{verdict.text}"
    record_property("golden", verdict.text)


def changed(
    entries: list[ChunkEntry], key: str, tick: int, change: Callable[[State], Message]
) -> list[ChunkEntry]:
    """The same recording with one other message."""
    return [
        entry._replace(payload=encode(change(decode(entry.payload, State))))
        if (entry.key, entry.tick) == (key, tick)
        else entry
        for entry in entries
    ]


def flip_last_bit(state: State) -> State:
    bits = state.v_joint.copy().view(np.int64)
    bits[4] ^= 1
    return replace(state, v_joint=bits.view(np.float64))


def test_one_bit_of_one_sensor_is_found_at_its_tick(entries: list[ChunkEntry]) -> None:
    before = heard_again(entries, "r2")
    after = heard_again(changed(entries, "team/r2/state", 433, flip_last_bit), "r2")
    found = first_difference(before, after)
    assert found is not None
    assert (found.tick, found.name) == (433, "team/r2/command")
    assert found.field.startswith("tau[")
    assert heard_again(entries, "r2") == before, "nothing is remembered from one run to the next"


def test_what_another_machine_may_do_to_the_last_bits_is_let_through_and_told() -> None:
    def command(torque: float) -> Sent:
        zero, tau = np.zeros(12), np.full(12, 2.0)
        tau[3] = torque
        return [("team/r1/command", encode(Command(7, 7_000_000, tau, zero, zero, zero, zero)))]

    near, far = command(2.0 + TOLERANCE), command(2.0 + 3.0 * TOLERANCE)
    assert not judge("r1", command(2.0), near, []).ok, "one machine, one result"
    verdict = judge("r1", command(2.0), near, ["BLAS 'Zen' instead of 'SkylakeX'"])
    assert verdict.ok
    assert "not to the byte" in verdict.text
    assert "Zen" in verdict.text
    beyond = judge("r1", command(2.0), far, ["BLAS 'Zen' instead of 'SkylakeX'"])
    assert not beyond.ok
    assert "tick 7, team/r1/command.tau[3]: recorded 2.0, recomputed 2.00000" in beyond.text
    assert not judge("r1", command(2.0), [], ["BLAS 'Zen' instead of 'SkylakeX'"]).ok

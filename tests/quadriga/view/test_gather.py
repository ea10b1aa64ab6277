"""What is folded message by message is what a recording tells at the same instant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.shared.codec import decode
from quadriga.shared.messages import State, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import topic_of
from quadriga.view.compose import compose
from quadriga.view.gather import Gatherer
from quadriga.view.readings import read_accounts
from quadriga.view.recorded import RecordedRun
from quadriga.view.team_shape import build_team_shape
from tests.a1 import q_stand
from tests.golden.scenario import RECORDING
from tests.quadriga.conftest import run_config, truth

END = 590


def state(tick: int) -> State:
    zero = np.zeros(12)
    return State(tick, 10**6 * tick, q_stand(), zero, zero, zero[:4], zero[:3], zero[:3], zero[:4])


def test_live_and_recorded_pictures_are_the_same() -> None:
    run = RecordedRun(Recording(RECORDING))
    gatherer = Gatherer(run.shape)
    for entry in Recording(RECORDING).entries():
        topic, robot = topic_of(entry.key)
        if entry.tick <= END:
            gatherer.take(decode(entry.payload, topic.type), robot)
    live, recorded = gatherer.snapshot(), run.snapshot(END)
    assert live.tick == END
    assert live.places == recorded.places
    one, other = compose(run.shape, live), compose(run.shape, recorded)
    assert read_accounts(run.shape, live) == read_accounts(run.shape, recorded)
    for name in ("trunk", "link_positions", "planned_forces", "paths", "contact"):
        assert getattr(one, name) == pytest.approx(getattr(other, name)), name


def test_older_messages_and_those_of_strangers_change_nothing() -> None:
    config = run_config()
    gatherer = Gatherer(build_team_shape(config))
    gatherer.take(state(200), "r1")
    gatherer.take(state(150), "r1")
    gatherer.take(state(300), "r7")
    foreign = replace(truth(config, 200, 0.0), robots=("a", "b"))
    gatherer.take(foreign)
    assert gatherer.snapshot().states["r1"].tick == 200
    assert gatherer.snapshot().states.keys() == {"r1"}
    assert gatherer.snapshot().truth is None


def test_a_new_walk_of_the_team_begins_anew() -> None:
    config = run_config()
    gatherer = Gatherer(build_team_shape(config))
    gatherer.take(truth(config, 60_000, 0.0))
    gatherer.take(state(60_000), "r2")
    gatherer.take(truth(config, 10, 0.0))
    snapshot = gatherer.snapshot()
    assert snapshot.tick == 10
    assert isinstance(snapshot.truth, Truth)
    assert snapshot.truth.tick == 10
    assert not snapshot.states

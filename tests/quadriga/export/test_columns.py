"""CSV and Parquet hold every message in named columns, number for number."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from quadriga.commands.parser import main
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Message, Plan, State, Status, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import topic_of
from tests.quadriga.export.conftest import FALL, PLAN, STATUS

Sent = dict[str, list[Message]]


@pytest.fixture(scope="module")
def sent(file: Path) -> Sent:
    """Messages that can be exported, by key without the team, in the order of the file."""
    found: Sent = defaultdict(list)
    for entry in Recording(file).entries():
        try:
            message = decode(entry.payload, topic_of(entry.key)[0].type)
        except MessageError:
            continue
        found[entry.key.partition("/")[2]].append(message)
    return found


def only(messages: list[Message], kind: type[Message]) -> list[Message]:
    assert {type(message) for message in messages} == {kind}
    return messages


def test_parquet(file: Path, sent: Sent, tmp_path: Path) -> None:
    out = tmp_path / "tables"
    assert main(["export", str(file), "--to", "parquet", "-o", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {
        f"{name.replace('/', '.')}.parquet" for name in sent
    }
    states = pq.read_table(out / "r1.state.parquet")
    assert states["tick"].to_pylist() == [m.tick for m in only(sent["r1/state"], State)]
    assert states["log_time_ns"][5].as_py() > 10**18
    q = np.array([m.q_joint for m in sent["r1/state"]])  # type: ignore[attr-defined]
    np.testing.assert_array_equal(states["r1.q_joint.FR_thigh"].to_numpy(), q[:, 4])
    assert {str(t) for t in states.schema.types} == {"int64", "double"}

    truth = pq.read_table(out / "sim.truth.parquet")
    grf = np.array([m.grf for m in only(sent["sim/truth"], Truth)])  # type: ignore[attr-defined]
    np.testing.assert_array_equal(truth["r2.grf.RL.z"].to_numpy(), grf[:, 1, 2, 2])

    plans = pq.read_table(out / "r1.plan.parquet").slice(
        25 * (len(only(sent["r1/plan"], Plan)) - 1)
    )
    assert plans["sample"].to_pylist() == list(range(25))
    np.testing.assert_array_equal(plans["r1.u.RR.z"].to_numpy(), PLAN.u[:, 11])
    np.testing.assert_array_equal(plans["r1.y.roll"].to_numpy(), PLAN.y[:, 3])
    assert set(plans["r1.used.r2"].to_pylist()) == {11.0}
    assert set(plans["r1.status"].to_pylist()) == {"nominal:no data"}

    statuses = pq.read_table(out / "r1.status.parquet").to_pylist()
    assert len(statuses) == len(only(sent["r1/status"], Status))
    assert statuses[0]["r1.ages_ms.plan_r2"] is None
    last = statuses[-1]
    assert (last["r1.ages_ms.plan_r2"], last["r1.ages_ms.a_b"]) == (350.0, 2.0)
    assert (last["r1.planner_ms"], last["r1.tick_us"]) == ([0.5, 0.25], [])
    assert last["r1.reason"] == STATUS.reason
    event = pq.read_table(out / "sim.event.parquet").to_pylist()[-1]
    assert (event["tick"], event["kind"], event["robot"]) == (FALL.tick, "fall", "r2")


def test_csv_says_the_same_as_parquet(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for form in ("csv", "parquet"):
        assert main(["export", str(file), "--to", form, "-o", str(tmp_path / form)]) == 0
    output = capsys.readouterr().out
    assert "left out 1 messages of team/r1/state: not a valid message of a known topic" in output
    assert "left out 1 messages of team/some/body/else" in output
    paths = sorted((tmp_path / "csv").iterdir())
    assert len(paths) == 13
    for path in paths:
        table = pq.read_table(tmp_path / "parquet" / f"{path.stem}.parquet")
        with path.open(newline="", encoding="utf-8") as stream:
            names, *rows = list(csv.reader(stream))
        assert names == table.schema.names
        assert len(rows) == table.num_rows
        for name, column in zip(names, zip(*rows, strict=True), strict=True):
            assert [as_text(v) for v in table[name].to_pylist()] == list(column), (path, name)


def as_text(value: object) -> str:
    """How CSV shows a value."""
    if isinstance(value, list):
        return " ".join(map(repr, value))
    return "" if value is None else value if isinstance(value, str) else repr(value)

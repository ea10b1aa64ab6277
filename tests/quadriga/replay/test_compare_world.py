"""A recorded world comes out the same to the byte, and any planted change is found where it is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.commands.parser import main
from quadriga.recordings.by_tick import by_tick
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Command, State, Truth
from quadriga.shared.recording.reader import Recording
from tests.quadriga.lockstep_run import TICKS, Change, config, write_lockstep
from tests.quadriga.replay.rewritten import rewritten


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_lockstep(tmp_path_factory.mktemp("whole") / "run.mcap", config())


def compare(capsys: pytest.CaptureFixture[str], path: Path) -> tuple[int, str]:
    status = main(["replay", "--world", str(path)])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return status, out + err


def test_a_world_with_pushes_payload_and_blocks_comes_out_equal(
    capsys: pytest.CaptureFixture[str], whole: Path
) -> None:
    status, output = compare(capsys, whole)
    assert status == 0, output
    assert f"equal to the byte: {2 * TICKS + TICKS // 10} states and truths" in output
    assert "× real time" in output


def test_loose_stones_and_weak_motors_come_out_equal(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scene = config(
        world__terrain="pebbles",
        world__motor_strength="r1:any:0.05,r2:calf:0",
        world__push_force=60.0,
        world__push_every=0.1,
    )
    status, output = compare(capsys, write_lockstep(tmp_path / "run.mcap", scene))
    assert status == 0, output
    assert f"equal to the byte: {2 * TICKS + TICKS // 10} states and truths" in output


def flipped(
    kind: type[State] | type[Truth] | type[Command], at: int, name: str, place: int, bit: int = 0
) -> Change:
    """One bit of one number of one message, flipped; 0 is the last of its mantissa."""

    def change(tick: int, key: str, payload: bytes) -> bytes:
        topic = {State: "r2/state", Truth: "sim/truth", Command: "r1/command"}[kind]
        if tick != at or not key.endswith(topic):
            return payload
        message = decode(payload, kind)
        values = np.array(getattr(message, name))
        values.reshape(-1).view(np.int64)[place] ^= 1 << bit
        changed: dict[str, Any] = {name: values}
        return encode(replace(message, **changed))

    return change


DELAY = config().motors.delay_ms


@pytest.mark.parametrize(
    ("change", "tick", "found"),
    [
        (flipped(State, 177, "imu_gyro", 2), 177, "team/r2/state.imu_gyro[2]"),
        (flipped(Truth, 210, "base_pos", 4), 210, "team/sim/truth.base_pos[1, 1]"),
        # The last bit of a gain may be lost as torques are summed; motors act on it with a delay.
        (flipped(Command, 200, "kp", 0, bit=20), 201 + DELAY, "team/r1/state"),
    ],
)
def test_one_flipped_bit_is_found_at_its_tick(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, change: Change, tick: int, found: str
) -> None:
    status, output = compare(capsys, write_lockstep(tmp_path / "run.mcap", config(), change))
    assert status == 1
    assert f"first difference: tick {tick}, " in output
    assert found in output
    recorded, recomputed = output.partition("recorded ")[2].split(", recomputed ")
    assert recorded != recomputed.split(" (")[0]


def test_a_difference_names_the_versions_that_may_explain_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = write_lockstep(tmp_path / "run.mcap", config(), flipped(Truth, 0, "grf", 0))
    versions = json.loads(Recording(path).metadata["versions"]) | {"mujoco": "3.1.4"}
    elsewhere = rewritten(
        path, tmp_path / "elsewhere.mcap", metadata={"versions": json.dumps(versions)}
    )
    _, output = compare(capsys, elsewhere)
    assert "other versions, which may be why: mujoco 3.1.4 (here " in output


@pytest.mark.parametrize(
    ("lose", "message"),
    [
        (lambda tick, key: tick == 77 and "r1/c" in key, "no command of r1 at tick 77"),
        (lambda tick, key: key.endswith("command"), "no command of r1, r2 at tick 0"),
        (lambda tick, key: tick < 50, "no command of r1, r2 at tick 0"),
        (lambda tick, key: key.endswith(("event", "command")) and tick > 40, "r1, r2 at tick 41"),
        (lambda tick, key: not key.endswith("command"), "nothing that a world published"),
    ],
)
def test_a_recording_with_gaps_is_one_clear_error(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    lose: Callable[[int, str], bool],
    message: str,
) -> None:
    path = write_lockstep(
        tmp_path / "run.mcap", config(), lambda t, key, payload: None if lose(t, key) else payload
    )
    status, output = compare(capsys, path)
    assert status == 2
    assert message in output
    assert output.count("\n") == 1


def test_a_cut_recording_is_compared_up_to_the_cut(
    capsys: pytest.CaptureFixture[str], whole: Path, tmp_path: Path
) -> None:
    content = whole.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) // 2])
    status, output = compare(capsys, tmp_path / "cut.mcap")
    assert status == 2
    assert "equal to the byte: " in output
    assert "compared up to there only: " in output
    assert "the file ends at byte" in output
    assert "got a file that is cut after" in output


def test_what_is_not_lockstep_or_not_used_is_refused(
    capsys: pytest.CaptureFixture[str], whole: Path, tmp_path: Path
) -> None:
    path = write_lockstep(tmp_path / "run.mcap", config(world__mode="realtime"))
    status, output = compare(capsys, path)
    assert (status, output.count("\n")) == (2, 1)
    assert "got a walk in real time, expected one in lock-step" in output
    own = config(team__plant="puppet")
    status, output = compare(capsys, write_lockstep(tmp_path / "own.mcap", own))
    assert status == 2
    assert "team.plant_per_robot false, expected a walk in one simulated world" in output
    for option, value, told in (
        ("--seed", "4", "got world.seed, expected none of the configuration"),
        ("--from", "0.1", "--from: got --world beside it, expected one of the two"),
        ("--out", str(tmp_path), "--out: got --world beside it"),
    ):
        assert main(["replay", "--world", str(whole), option, value]) == 2
        assert told in capsys.readouterr().err
    assert main(["replay", "--world", str(tmp_path / "none.mcap")]) == 2


def test_ticks_come_in_order_with_all_their_entries(whole: Path) -> None:
    found = list(by_tick(Recording(whole), {"state", "command"}))
    assert [tick for tick, _ in found] == list(range(TICKS))
    assert all({entry.tick for entry in entries} == {tick} for tick, entries in found)
    count = sum(len(entries) for _, entries in found)
    assert count == sum(1 for _ in Recording(whole).entries({"state", "command"}))

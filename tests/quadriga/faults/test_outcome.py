"""A walk of which everything is known, with a fault at 1 s."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.faults.outcome import Moment, describe_outcome, moment_at, tick_at
from quadriga.recordings.events import read_events
from quadriga.recordings.traces import read_traces
from quadriga.shared import codes
from quadriga.shared.messages import Event, Message, State, Status
from quadriga.shared.recording.metadata import END
from quadriga.shared.recording.reader import Recording
from tests.quadriga.conftest import WALL, WALL_0, WriteRun, run_config

FAULT = 1000  # tick
CONFIG = run_config(robots=3, seconds=3.0)
ENDS = [("team/sim/event", Event.of(3000, codes.TIME_OVER, "", "end of world.duration"))]


def outcome(folder: Path, moment: Moment) -> dict[str, Any]:
    recording = Recording(folder / "run.mcap")
    return describe_outcome(CONFIG, read_traces(recording), recording, moment)


def stop_from(tick: int, mode: str, reason: str, robots: tuple[str, ...]) -> Any:
    """A change of the run: these robots are in this mode from a tick on."""

    def change(key: str, message: Message) -> Message:
        _, robot, *_ = key.split("/")
        if isinstance(message, Status) and robot in robots and message.tick >= tick:
            return replace(message, mode=mode, reason=reason)
        return message

    return change


def wall(tick: int) -> int:
    return WALL_0 + round(WALL * 1_000_000 * tick)


def test_nobody_notices_what_harms_nobody(write_run: WriteRun) -> None:
    row = outcome(write_run(CONFIG), Moment("r2", FAULT))
    assert (row["tick"], row["robots"], row["mode"]) == (FAULT, 3, "lockstep")
    assert row["falls"] == []
    assert row["falls_of_others"] == row["lost_messages"] == 0
    assert row["detect_ms"] is row["stand_ms"] is None
    assert row["recover_ms"] is None  # nobody knows: the recording lacks the walk's end
    assert row["status"] == {"r1": "walk", "r2": "walk", "r3": "walk"}
    assert row["end"] == "none announced"


def test_when_others_notice_and_stand(write_run: WriteRun) -> None:
    change = stop_from(FAULT + 400, "stand", "peer-lost:r2", ("r1", "r3"))
    row = outcome(write_run(CONFIG, change=change), Moment("r2", FAULT))
    assert (row["detect_ms"], row["stand_ms"]) == (400, 400)
    assert row["status"]["r1"] == "stand peer-lost:r2"


def test_who_only_slows_down_has_noticed_and_does_not_stand(write_run: WriteRun) -> None:
    change = stop_from(FAULT + 400, "stopping", "peer-lost:r2", ("r1", "r3"))
    row = outcome(write_run(CONFIG, change=change), Moment("r2", FAULT))
    assert (row["detect_ms"], row["stand_ms"]) == (400, None)


def test_a_team_that_walks_again_has_recovered_when_the_last_robot_does(
    write_run: WriteRun,
) -> None:
    def change(key: str, message: Message) -> Message:
        since = {"r1": FAULT + 400, "r3": FAULT + 500}.get(key.split("/")[1])
        if isinstance(message, Status) and since and since <= message.tick < since + 1000:
            return replace(message, mode="stand", reason="peer-lost:r2")
        return message

    row = outcome(write_run(CONFIG, change=change, extra=ENDS), Moment("r2", FAULT))
    assert (row["stand_ms"], row["recover_ms"]) == (500, 1500)


def test_a_team_of_which_nobody_stopped_had_nothing_to_recover_from(write_run: WriteRun) -> None:
    row = outcome(write_run(CONFIG, extra=ENDS), Moment("r2", FAULT))
    assert row["recover_ms"] == 0


def test_a_robot_that_stands_at_the_end_has_not_recovered(write_run: WriteRun) -> None:
    stands = stop_from(FAULT + 400, "stand", "peer-lost:r2", ("r1",))
    row = outcome(write_run(CONFIG, change=stands, extra=ENDS), Moment("r2", FAULT))
    assert row["recover_ms"] is None


def test_a_robot_that_says_nothing_at_the_end_has_not_recovered(write_run: WriteRun) -> None:
    def fall_silent(key: str, message: Message) -> Message | None:
        silent = isinstance(message, Status) and message.tick > FAULT and "/r2/" in key
        return None if silent else message

    row = outcome(write_run(CONFIG, change=fall_silent, extra=ENDS), Moment("r2", FAULT))
    assert row["recover_ms"] is None


def test_what_the_world_announces_is_a_notice_and_the_fault_itself_is_not(
    write_run: WriteRun,
) -> None:
    events = [
        Event.of(FAULT, codes.FAULT_BEGINS, "r2", "imu stuck"),
        Event.of(FAULT + 70, codes.MALFORMED, "r2", "3 commands dropped"),
        Event.of(FAULT + 90, codes.FALL, "r2", "tilt"),
        Event.of(FAULT + 95, codes.FALL, "r3", "tilt"),
        Event.of(FAULT + 99, codes.COMMAND_LOST, "", "r2, r3 gone"),
    ]
    folder = write_run(CONFIG, extra=[("team/sim/event", event) for event in events])
    row = outcome(folder, Moment("r2", FAULT))
    assert row["detect_ms"] == 70
    assert row["falls"] == ["r2", "r3"]
    assert row["falls_of_others"] == 1
    assert row["lost"] == ["r2", "r3"]


def test_what_the_launcher_tells_of_a_fault_is_an_event_and_changes_no_figure(
    write_run: WriteRun,
) -> None:
    told = [
        Event.of(FAULT, codes.FAULT_BEGINS, "r2", "agent-paused"),
        Event.of(FAULT + 300, codes.FAULT_ENDS, "r2", "agent-paused is over"),
        Event.of(FAULT + 400, codes.SIGNAL, "", "only who drives time ends a walk"),
    ]
    notice = ("team/sim/event", Event.of(FAULT + 70, codes.MALFORMED, "r2", "3"))
    folder = write_run(CONFIG, extra=[*(("team/injected", event) for event in told), notice])
    row = outcome(folder, Moment("r2", FAULT))
    assert (row["tick"], row["detect_ms"], row["lost_messages"]) == (FAULT, 70, 0)
    assert row["end"] == "none announced"
    found = read_traces(Recording(folder / "run.mcap")).events
    assert read_events(Recording(folder / "run.mcap"), ("r1", "r2", "r3")) == found
    ticks = [event.tick for event in found if event.tick >= FAULT]
    assert ticks == [FAULT, FAULT + 70, FAULT + 300]


def test_the_tick_of_a_signal_is_that_of_the_newest_state_by_then(write_run: WriteRun) -> None:
    folder = write_run(CONFIG)
    recording = Recording(folder / "run.mcap")
    assert tick_at(recording, wall(FAULT)) == FAULT
    assert tick_at(recording, wall(FAULT) - 1) == FAULT - 1
    # The clock was read 7 ms before the signal was sent.
    assert outcome(folder, Moment("r2", FAULT - 7, wall(FAULT)))["tick"] == FAULT


@pytest.mark.parametrize(("robot", "lost"), [("r1", 100), ("r2", 0)])
def test_messages_of_the_faulty_robot_are_not_missed(
    write_run: WriteRun, robot: str, lost: int
) -> None:
    def lose(key: str, message: Message) -> Message | None:
        gone = isinstance(message, State) and FAULT + 1000 <= message.tick < FAULT + 1100
        return None if gone and key == f"team/{robot}/state" else message

    row = outcome(write_run(CONFIG, change=lose), Moment("r2", FAULT))
    assert row["lost_messages"] == lost


def test_a_recording_that_ends_before_the_fault_has_lost_what_came_after(
    write_run: WriteRun,
) -> None:
    def cut(_key: str, message: Message) -> Message | None:
        return message if message.tick < FAULT - 50 else None

    row = outcome(write_run(CONFIG, change=cut), Moment("r2", FAULT, wall(FAULT)))
    assert row["lost_messages"] == 2 * 3 * 51


def test_what_the_recording_lacks_the_world_has_told(write_run: WriteRun) -> None:
    told = [
        Event.of(FAULT + 20, codes.FALL, "r3", "tilt"),
        Event.of(FAULT + 22, codes.COMMAND_LOST, "", "r2 gone"),
    ]
    recording = Recording(write_run(CONFIG) / "run.mcap")
    moment = Moment("r2", FAULT)
    row = describe_outcome(CONFIG, read_traces(recording), recording, moment, told)
    assert (row["detect_ms"], row["falls"], row["lost"]) == (22, ["r3"], ["r2"])
    assert row["end"] == "command-lost: r2 gone"
    assert row["recover_ms"] is None  # what the robots did then nobody has recorded


def test_a_world_that_is_gone_is_noticed_when_the_recorder_misses_it(write_run: WriteRun) -> None:
    folder = write_run(CONFIG)
    recording = Recording(folder / "run.mcap")
    moment = Moment("r2", FAULT, wall(FAULT))
    gone = {"code": codes.LEAD_GONE, "tick": "3010", "missed_ns": str(wall(FAULT) + 31_000_000)}
    traces = replace(read_traces(recording), notes={END: gone})
    assert describe_outcome(CONFIG, traces, recording, moment)["detect_ms"] == 31


def test_a_fault_whose_tick_nobody_knows_is_where_the_walk_was_by_the_clock(
    write_run: WriteRun,
) -> None:
    change = stop_from(FAULT + 200, "stand", "peer-lost:r2", ("r1", "r3"))
    recording = Recording(write_run(CONFIG, change=change) / "run.mcap")
    moment = moment_at(recording, "r2", wall(FAULT))
    assert moment == Moment("r2", FAULT, wall(FAULT))
    row = describe_outcome(CONFIG, read_traces(recording), recording, moment)
    assert (row["tick"], row["detect_ms"], row["stand_ms"]) == (FAULT, 200, 200)

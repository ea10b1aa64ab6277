"""`quadriga fault` with real processes: what it makes go wrong does, and its row says so."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.recordings.check import check
from quadriga.shared.codec import decode
from quadriga.shared.codes import FAULT_BEGINS
from quadriga.shared.messages import Event
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import INJECTED
from tests.runtime.conftest import DATA

EARLY = 37  # a world's seed with which things go wrong early in a walk
ARGUMENTS = (
    *("--set", "runtime.check_cpu=false"),
    *("--set", "world.duration=8"),  # the doctor has time to look on a busy computer, too
    *("--planner", "none", "--robots", "2", "--jobs", "2", "--set", f"world.seed={EARLY}"),
    *(word for name, value in DATA.items() for word in ("--set", f"{name}={value:g}")),
)


def injected(folder: Path) -> list[Event]:
    """What the launcher has told of its fault; no rule of recordings is against it."""
    found = check(folder / "run.mcap")
    objections = [first for finding in found for first in finding.first]
    assert not [first for first in objections if first.key == INJECTED.key("team")]
    sound = {finding.name for finding in found if finding.passed}
    assert sound >= {"whole", "schema", "log times", "order", "end"}  # whatever the fault has done
    entries = Recording(folder / "run.mcap").entries({INJECTED.name})
    return [decode(entry.payload, Event) for entry in entries]


def who_is_late(folder: Path) -> set[str]:
    """Robots whose motors followed an earlier command in more than half of all ticks."""
    end = list(Recording(folder / "run.mcap").messages(Event))[-1]
    late = re.findall(r"(r\d+) (\d+)", end.detail.partition("late ticks: ")[2])
    return {robot for robot, ticks in late if int(ticks) > end.tick / 2}


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime", "_compiled")
def test_a_killed_agent_and_a_dead_knee(tmp_path: Path) -> None:
    rows_file, folder = tmp_path / "rows.json", tmp_path / "out"
    faults = ("agent-killed", "knee-off")
    interrupted = folder / f"agent-killed-{EARLY}" / "run.mcap"  # in an earlier call
    interrupted.parent.mkdir(parents=True)
    interrupted.touch()
    main(["fault", *faults, *ARGUMENTS, "--json", str(rows_file), "--out", str(folder)])
    rows = {row["fault"]: row for row in json.loads(rows_file.read_text(encoding="utf-8"))}
    assert set(rows) == set(faults)
    killed, knee = rows["agent-killed"], rows["knee-off"]
    assert (killed["mode"], knee["mode"]) == ("realtime", "lockstep")
    for row in rows.values():
        assert row["tick"] >= 1500
        assert not {"error"} & row.keys(), row
    # Where a computer is too slow for a team, the plant leads others down, too: they are late.
    others = set(killed["lost"]) - {killed["robot"]}
    assert killed["robot"] in killed["lost"]
    assert others <= who_is_late(folder / f"agent-killed-{EARLY}")
    assert killed["falls"] == knee["lost"] == []
    assert 0 <= killed["detect_ms"] < 1000
    assert killed["recover_ms"] is None
    told = injected(folder / f"agent-killed-{EARLY}")
    assert [(event.code, event.robot) for event in told] == [(FAULT_BEGINS, killed["robot"])]
    assert abs(told[0].tick - killed["tick"]) < 1000
    assert told[0].detail == "agent-killed"
    assert killed["end"].startswith("command-lost: ")
    # Half a second without a knee: the robot falls, or limps on; nobody else is touched by it.
    assert set(knee["falls"]) <= {knee["robot"]}
    # What has been walked is not walked again.
    before = (folder / "rows.jsonl").read_text(encoding="utf-8")
    main(["fault", *faults, *ARGUMENTS, "--out", str(folder)])
    assert (folder / "rows.jsonl").read_text(encoding="utf-8") == before

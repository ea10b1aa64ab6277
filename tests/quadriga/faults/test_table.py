from io import StringIO
from pathlib import Path
from typing import Any

from rich.console import Console

from quadriga.faults.campaign import describe_row
from quadriga.faults.goals import build_goal_table
from quadriga.faults.page import PUBLISHED, to_markdown
from quadriga.faults.table import build_team_fault_tables
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import SOURCE
from quadriga.tables import Table
from quadriga.team.trial_rows import append_row, open_rows

WALKS = {"r1": "walk", "r2": "walk"}
STOOD = {"r1": "stand peer-lost:r2", "r2": "walk"}


def row(**fields: Any) -> dict[str, Any]:
    return {
        "fault": "agent-killed",
        "seed": 1,
        "mode": "realtime",
        "robot": "r2",
        "tick": 3000,
        "falls": [],
        "lost": [],
        "falls_of_others": 0,
        "detect_ms": None,
        "stand_ms": None,
        "recover_ms": 0,
        "lost_messages": 0,
        "status": WALKS,
        "end": "time-over: end of world.duration",
    } | fields


def cells(table: Table, name: str) -> dict[str, str]:
    return next(
        dict(zip(table.columns, line, strict=True)) for line in table.rows if line[0] == name
    )


def test_a_line_for_each_fault_with_what_came_of_it() -> None:
    rows = [
        row(),
        row(status=STOOD, detect_ms=60, stand_ms=300, lost_messages=4, recover_ms=None),
        row(lost=["r2"], detect_ms=80, stand_ms=400, status={"r1": STOOD["r1"], "r2": "walk"}),
        row(falls=["r1", "r2"], falls_of_others=1, end="fallen: fall of r1", detect_ms=100),
        {"fault": "agent-killed", "seed": 5, "error": "the team: got no walk"},
        row(fault="imu-stuck", mode="lockstep"),
        row(fault="r2/gyro off 4"),
    ]
    times, words = build_team_fault_tables(rows)
    assert [line[0] for line in times.rows] == ["agent-killed", "imu-stuck", "r2/gyro off 4"]
    assert cells(times, "agent-killed") == {
        "fault": "agent-killed",
        "mode": "real",
        "tries": "5",
        "void": "1",
        "fell": "1/1",
        "noticed ms": "80/100",
        "stood ms": "350/400",
        "again ms": "0/0",
        "lost": "0/4",
    }
    assert cells(times, "imu-stuck")["noticed ms"] == "–"
    killed = cells(words, "agent-killed")
    assert (killed["walked on"], killed["stopped"], killed["fell"]) == ("1", "2", "1")
    assert killed["status"] == "peer-lost (2)"


def test_the_tables_fit_a_terminal_of_120_columns() -> None:
    worst = row(fault="encoder-intermittent", detect_ms=12_000, stand_ms=4000, recover_ms=12_000)
    for table in build_team_fault_tables([worst | {"lost_messages": 10_000}]):
        console = Console(width=120, file=StringIO(), record=True)
        console.print(*table.to_rich(120))
        text = console.export_text()
        assert "characters:" not in text  # it stands as it is, neither turned nor in parts
        assert "encoder-intermittent" in text
        for cell in table.rows[0]:
            assert cell in text  # no line is broken within it


def test_what_the_doctor_said_of_most_processes() -> None:
    said = {"r1": "not-answering", "operator": "not-started"}
    _, words = build_team_fault_tables([row(doctor=said), row(doctor={"r2": "not-answering"})])
    assert cells(words, "agent-killed")["doctor"] == "agent: not-answering (2)"


def test_who_is_led_down_has_not_walked_on() -> None:
    _, words = build_team_fault_tables([row(lost=["r2"], detect_ms=15)])
    assert (cells(words, "agent-killed")["walked on"], cells(words, "agent-killed")["stopped"]) == (
        "0",
        "1",
    )
    assert "without commands: r2" in describe_row(row(lost=["r2"]))


def test_goals_and_the_worst_of_what_came() -> None:
    rows = [row(detect_ms=60), row(detect_ms=120), row(fault="agent-frozen", detect_ms=290)]
    lines = {line[0]: line[1:] for line in build_goal_table(Config(), rows).rows}
    assert lines["robots fall that the fault was not of"] == ("3", "0", "0", "yes")
    assert lines["the robot of the fault falls"] == ("3", "0", "0", "yes")
    assert lines["a kill of an agent is noticed, ms"] == ("2", "120", "100", "no")
    frozen = next(line for name, line in lines.items() if name.startswith("a frozen agent"))
    assert frozen == ("1", "290", "300", "yes")


def test_falls_miss_their_goals() -> None:
    rows = [row(falls=["r1", "r2"], falls_of_others=1), row()]
    lines = {line[0]: line[1:] for line in build_goal_table(Config(), rows).rows}
    assert lines["robots fall that the fault was not of"] == ("2", "1", "0", "no")
    assert lines["the robot of the fault falls"] == ("2", "1", "0", "no")


def test_a_fault_that_nobody_noticed_misses_its_goal() -> None:
    lines = {line[0]: line[1:] for line in build_goal_table(Config(), [row()]).rows}
    assert lines["a kill of an agent is noticed, ms"] == ("1", "–", "100", "no")


def test_the_page_is_in_step_with_the_faults_and_the_published_rows() -> None:
    page = SOURCE / "docs" / "faults.md"
    assert page.read_text(encoding="utf-8") == to_markdown(SOURCE / PUBLISHED)


def test_a_page_of_rows_that_are_not_published(tmp_path: Path) -> None:
    folder = tmp_path / "walks"
    open_rows(Config(), folder)
    append_row(row(detect_ms=60), folder)
    page = to_markdown(tmp_path)
    assert "## walks: 3 robots, planner distributed" in page
    assert "| agent-killed | real | 1 | 0 | 0/0 | 60/60 |" in page


def test_a_walk_in_one_line() -> None:
    text = describe_row(row(status=STOOD, detect_ms=60, stand_ms=300, recover_ms=9000))
    assert text == (
        "at r2, 3.00 s; fell: none; noticed after 60 ms; others stood after 300 ms; "
        "all walked again after 9000 ms; r1: stand peer-lost:r2"
    )
    assert describe_row({"fault": "x", "seed": 1, "error": "a\nb"}) == "no result: a"

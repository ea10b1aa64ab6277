"""A campaign's folder: nothing finished is lost, nothing foreign is mixed in."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.experiments.campaign.ledger import ROWS, Ledger, read_manifest, read_rows
from quadriga.experiments.plan import Group
from quadriga.experiments.trial.figures_of_merit import Figures
from quadriga.experiments.trial.outcome import build_outcome, column_names, from_cells, to_cells
from quadriga.recordings.traces import ERRORS
from quadriga.shared.errors import ConfigError
from tests.quadriga.experiments.rows import manifest, row

TEXT = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20)
NUMBER = st.none() | st.floats(allow_nan=False)


@settings(deadline=None)  # a busy machine is not the subject
@given(TEXT, TEXT, NUMBER, st.floats(allow_nan=False), st.booleans())
def test_a_row_is_read_back_as_it_was(
    name: str, reason: str, cost: float | None, wall: float, success: bool
) -> None:
    mine = row(name, stopped=reason, control_cost=cost, wall_s=wall, success=success, swept=(name,))
    assert from_cells(to_cells(mine)) == mine
    assert len(to_cells(mine)) == len(column_names(["world.payload"]))


def test_a_refused_trial_is_a_row_without_figures() -> None:
    found = build_outcome(
        Group("steps", "deepc", ("3",)), 4, ("ab", ""), "no\n data", 0.1, "code 1"
    )
    assert (found.refused, found.success, found.fell, found.rmse_z) == (
        "no data",
        False,
        False,
        None,
    )
    assert from_cells(to_cells(found)) == found


def test_rows_are_there_after_every_kill(tmp_path: Path) -> None:
    """Cut at every byte: the whole lines count, and what follows them is a line of its own."""
    with Ledger(tmp_path, manifest("none", "damped")) as ledger:
        ledger.append(row("none", 0))
        ledger.append(row("damped", 0, fell=2.5, stopped='r1: "why, so"'))
    path = tmp_path / ROWS
    whole = path.read_bytes()
    ends = [k + 1 for k, byte in enumerate(whole) if byte == ord("\n")]
    for cut in (0, 1, ends[0] - 1, ends[0], ends[0] + 1, ends[1] - 1, ends[1], ends[2] - 1):
        path.write_bytes(whole[:cut])
        kept = max(sum(end <= cut for end in ends) - 1, 0)
        assert len(read_rows(tmp_path, read_manifest(tmp_path))) == kept
        with Ledger(tmp_path, manifest("none", "damped")) as ledger:
            assert len(ledger.rows) == kept
            ledger.append(row("none", 7))
        again = read_rows(tmp_path, read_manifest(tmp_path))
        assert [r.seed for r in again] == [*[0, 0][:kept], 7]
    with path.open(encoding="utf-8", newline="") as file:
        assert next(csv.reader(file)) == column_names([])


def test_a_folder_is_one_campaigns_at_a_time(tmp_path: Path) -> None:
    with Ledger(tmp_path, manifest("none")), pytest.raises(ConfigError, match="a folder in use"):
        Ledger(tmp_path, manifest("none"))
    with Ledger(tmp_path, manifest("none")):
        pass


def test_more_seeds_and_variants_are_added_to_what_there_is(tmp_path: Path) -> None:
    with Ledger(tmp_path, manifest("none")) as ledger:
        ledger.append(row("none", 0))
    more = manifest("none", "damped")
    later = [replace(entry, seeds=(5, 12)) for entry in more.groups]
    with Ledger(tmp_path, replace(more, groups=tuple(later), typed=("again",))) as ledger:
        found = ledger.manifest
    assert found == read_manifest(tmp_path)
    assert [entry.seeds for entry in found.groups] == [(*range(10), 12), (5, 12)]
    assert list(found.variants) == ["none", "damped"]
    assert found.typed == ("quadriga campaign steps", "again")
    assert found.trials == 13


def test_what_would_not_belong_together_is_refused(tmp_path: Path) -> None:
    with Ledger(tmp_path, manifest("none")) as ledger:
        ledger.append(row("none", 0))
    before = (tmp_path / ROWS).read_bytes()
    mine = manifest("none")
    entry = mine.groups[0]
    changes: list[tuple[dict[str, Any], str]] = [
        ({"versions": "code 2"}, "trials with code and versions code 1, expected code 2"),
        ({"groups": (replace(entry, config_sha256="cd" * 32),)}, "trials of configuration abab"),
        ({"groups": (replace(entry, predictor_sha256="ef"),)}, "trials of predictor"),
        ({"groups": (replace(entry, plugin="mine 0.1 ab"),)}, "expected of mine 0.1 ab"),
        ({"sweeps": manifest("none", sweeps=("world.payload",)).sweeps}, "swept keys"),
    ]
    for change, message in changes:
        with pytest.raises(ConfigError, match="use a new folder") as error:
            Ledger(tmp_path, replace(mine, **change))
        assert message in str(error.value)
    assert (tmp_path / ROWS).read_bytes() == before
    with Ledger(tmp_path, mine) as ledger:  # which the refusals have left as it was
        assert len(ledger.rows) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("true", "perhaps"), "line 2: got 'perhaps' for true or false"),
        (lambda text: text + text.splitlines(keepends=True)[1], "line 3: got a second row of"),
        (lambda text: text.replace("scenario", "where"), "line 1: got other columns"),
        (lambda text: text + "one,two\n", "line 3: got"),
        (lambda text: text + "one\rtwo\n", "line 3: got"),
        (lambda text: text.replace(",0,,8.0", ",0,solved,8.0"), "line 2: got invalid literal"),
        (lambda text: text.replace("code 1", "code 2"), "line 2: got a trial with code and versi"),
    ],
)
def test_rows_edited_by_hand_cost_one_line(tmp_path: Path, change: Any, message: str) -> None:
    with Ledger(tmp_path, manifest("none")) as ledger:
        ledger.append(row("none", 0))
    path = tmp_path / ROWS
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        read_rows(tmp_path, read_manifest(tmp_path))
    assert message in str(error.value)


def test_a_folder_of_something_else_is_no_campaign(tmp_path: Path) -> None:
    good = json.loads(json.dumps(asdict(manifest("none"))))
    (group,) = good["groups"]
    changed = (
        {"versions": None},
        {"baseline": ["none"]},
        {"typed": [1]},
        {"variants": 5},
        {"groups": [{**group, "scenario": ["steps"]}]},
        {"groups": [{**group, "seeds": [0.5]}]},
        {"groups": [{**group, "radius": "1"}]},
        {"groups": [{**group, "seeds": [-1]}]},
        {"sweeps": [{"key": "world.friction", "name": 3}]},
    )
    wrong = [json.dumps({**good, **change}) for change in changed]
    for text in ("", "{}", '{"format": 0}', "[]", "[" * 30_000, *wrong):
        (tmp_path / "campaign.json").write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError, match=r"campaign\.json"):
            read_manifest(tmp_path)


def test_whatever_a_planner_calls_its_plans_they_are_counted() -> None:
    plans = {"solved": 3, "at a limit, x=1\n": 2}
    rmse = dict.fromkeys(ERRORS)
    figures = Figures(8.0, {}, {}, {"vx": 0.5}, rmse, None, None, None, None, None, 5, plans)
    row = build_outcome(Group("steps", "mine", ()), 0, ("ab", ""), figures, 0.1, "code 1")
    assert from_cells(to_cells(row)).count_plans() == {"solved": 3, "at a limit; x=1": 2}

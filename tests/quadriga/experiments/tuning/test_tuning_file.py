"""Files of what is tuned: the shipped ones, places of the search, and mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.experiments.tuning.tuning_file import TunedKey, Tuning, read_tuning
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

SHIPPED = sorted((Path(__file__).parents[4] / "deploy" / "tuning").glob("*.toml"))

GOOD = """
title = "Gains"
scenarios = ["flat"]
seeds = "0:4"
judged_on = "10:12"
walks = 1
population = 4
generations = 2
step = 0.2
seed = 1
[fixed]
planner.kind = "none"
[tuned]
"controller.kp_z" = { low = 100.0, high = 900.0 }
"planner.Q[3]" = { low = 1e4, high = 1e7 }
"""


def read(text: str, folder: Path) -> Tuning:
    path = folder / "gains.toml"
    path.write_text(text, encoding="utf-8")
    return read_tuning(path)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_tuning_starts_within_its_ranges(path: Path) -> None:
    tuning = read_tuning(path)
    preset = tuning.fixed.get("planner.preset", "usual")
    start = load(overrides={"planner.preset": preset})
    values = tuning.start_values(start)
    assert set(values) == {key.name for key in tuning.keys}


def test_all_tunings_have_the_same_budget() -> None:
    budgets = {
        (t.scenarios, t.seeds, t.judged_on, t.walks, t.population, t.generations, len(t.keys))
        for t in map(read_tuning, SHIPPED)
    }
    assert len(SHIPPED) == 2
    assert len(budgets) == 1


@given(st.floats(0.0, 1.0), st.booleans())
def test_places_and_values_are_each_others_inverse(x: float, logarithmic: bool) -> None:
    key = TunedKey("controller.kp_z", 2.0, 500.0, logarithmic)
    value = key.value(x)
    assert 2.0 <= value <= 500.0
    assert value == float(f"{value:.3g}")
    assert key.value(key.x(value)) == value
    assert key.x(value) == pytest.approx(x, abs=0.01)


def test_a_changed_element_leaves_the_others_of_its_list(tmp_path: Path) -> None:
    tuning, start = read(GOOD, tmp_path), Config()
    changes = tuning.changes(start, {"controller.kp_z": 300.0, "planner.Q[3]": 7e5})
    Q = list(start.planner.Q)
    Q[3] = 7e5
    assert changes == {"planner.kind": "none", "controller.kp_z": 300.0, "planner.Q": Q}


def test_no_two_generations_share_a_seed(tmp_path: Path) -> None:
    tuning = read(GOOD, tmp_path)
    assert [tuning.seeds_of(k) for k in range(2)] == [(0,), (1,)]
    assert not set(tuning.seeds) & set(tuning.judged_on)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('judged_on = "10:12"', 'judged_on = "3:5"', "3, which is one of seeds too"),
        ('seeds = "0:4"', 'seeds = "0:1"', "expected 2"),
        ("population = 4", "population = 3", "whole number ≥ 4"),
        ("walks = 1", "walks = 0", "whole number ≥ 1"),
        ("walks = 1", "walks = inf", "walks: got inf, expected a finite number"),
        ("walks = 1", f"walks = {'9' * 400}", "walks: got 9{99}.*, expected a finite number"),
        ("walks = 1", f"walks = 0x{'f' * 5000}", "walks: got a int that is too large to show"),
        ('"planner.Q[3]"', f'"planner.Q[{"9" * 5000}]"', r"section\.key\[k\]"),
        ("high = 900.0", "high = nan", "high: got nan, expected a finite number"),
        ("seed = 1", "seed = 4294967296", "whole number ≥ 0 and ≤ 4294967295"),
        ("step = 0.2", "step = 0.0", "above 0"),
        ("low = 100.0", "low = 0.0", "both above 0"),
        ("low = 100.0", "low = 1000.0", "low < high"),
        ('"planner.Q[3]" = { low = 1e4, high = 1e7 }', "", "at least two"),
        ("title", "titel", "title"),
    ],
)
def test_a_mistake_in_the_file_is_named(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=said):
        read(GOOD.replace(old, new), tmp_path)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("controller.kp_zz", "no such key"),
        ("planner.Q[9]", "an element of a list"),
        ("planner.Q", "a number"),
        ("controller.flight", "a number"),
        ("controller.kp_tilt", "within 100 … 900"),
    ],
)
def test_what_is_no_number_within_its_range_cannot_be_tuned(
    name: str, said: str, tmp_path: Path
) -> None:
    tuning = read(GOOD.replace("controller.kp_z", name), tmp_path)
    with pytest.raises(ConfigError, match=said):
        tuning.start_values(Config())

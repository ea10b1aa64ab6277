"""Rows whose every figure is known: what becomes of them in tables, and who is worst."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pytest

from quadriga.experiments.measures import format_p
from quadriga.experiments.plan import Group
from quadriga.experiments.results import ALL, Results
from quadriga.experiments.statistics import Pairs
from quadriga.experiments.summarise import (
    build_lines,
    compare_with_baseline,
    find_worst,
    tally_trials,
)
from quadriga.experiments.tables import build_falls_table, build_ratios_table, build_walks_table
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.recordings.traces import ERRORS
from quadriga.tables import Table
from tests.quadriga.experiments.rows import row

NARROW = "\N{NO-BREAK SPACE}"


def rows() -> list[TrialOutcome]:
    """Ten seeds: `none` falls in 0 … 3, `damped` in 3 and 4; its errors are half as large."""
    found = [row("none", seed, fell=2.0 + seed if seed < 4 else None) for seed in range(10)]
    found += [
        row("damped", seed, fell=5.0 if seed in (3, 4) else None, error=0.005) for seed in range(10)
    ]
    return found


def cells(table: Table, line: int = 0) -> dict[str, str]:
    pairs = zip(table.columns, table.rows[line], strict=True)
    return {name.replace(NARROW, " "): cell.replace(NARROW, " ") for name, cell in pairs}


def of(variant: str, found: Iterable[TrialOutcome]) -> list[TrialOutcome]:
    return [r for r in found if r.variant == variant]


def summarise(found: Sequence[TrialOutcome], swept: tuple[str, ...] = ()) -> Results:
    """Of rows of `none` and `damped`, ten seeds of each group."""
    groups = dict.fromkeys((r.group for r in found), 10)
    worlds = tuple(dict.fromkeys(group.world for group in groups))
    lines = build_lines(found, groups, "none", pooled=len(worlds) > 1)
    return Results("none", ("none", "damped"), worlds, swept, lines)


def test_pairs_are_of_the_same_world_and_seed() -> None:
    found = compare_with_baseline(of("damped", rows()), of("none", rows()))
    assert found is not None
    assert found.fell == Pairs(both=1, first=1, second=3, neither=5)
    assert (found.fell_alone, found.baseline_fell_alone) == ((4,), (0, 1, 2))
    assert found.upright == 5
    assert (found.ratios["roll"].pairs, found.ratios["roll"].median) == (5, 0.5)
    assert found.ratios["cost"].median == 0.25
    other_world = [row("none", seed, scenario="flat") for seed in range(10)]
    assert compare_with_baseline(of("damped", rows()), other_world) is None
    refused = [row("none", seed, refused="no data", success=False) for seed in range(10)]
    assert compare_with_baseline(of("damped", rows()), refused) is None


def test_a_tally_counts_falls_stops_and_refusals_apart() -> None:
    stop = row(
        "none", 10, success=False, stopped="r1: qp-infeasible", plans="solved=9, nominal:x=1"
    )
    refused = row("none", 11, success=False, refused="radius 0.7")
    quick = row("none", 12, error=0.03, mean_vx=0.6)
    found = tally_trials([*of("none", rows()), stop, refused, quick])
    assert (found.trials, found.successes, found.falls, found.stops) == (12, 7, 4, 1)
    assert found.refused == "radius 0.7"
    assert found.time_to_fall == 3.5
    assert (found.rmse["z"], found.rmse_max["z"]) == (0.01, 0.03)
    assert (found.slowest, found.mean_vx, found.fastest) == (0.48, 0.48, 0.6)
    assert found.plans == {"solved": 9, "nominal:x": 1}


def test_the_worst_fell_first_then_stopped_then_cost_most() -> None:
    stop = row("none", 10, success=False, stopped="r1: qp-infeasible")
    dear = row("none", 11, error=0.1)
    found = find_worst([*of("none", rows()), dear, stop], 7)
    assert [r.seed for r in found] == [0, 1, 2, 3, 10, 11, 4]


def test_the_tables_say_what_was_counted() -> None:
    results = summarise(rows())
    names = ("trials", "success", "falls", "stops", "time-to-fall", "transport", "plans")
    table = build_walks_table(results, names)
    assert [line[:2] for line in table.rows] == [("steps", "none"), ("steps", "damped")]
    none = cells(table)
    assert (none["trials"], none["success [%]"]) == ("10", "60.0 [31.3, 83.2]")
    assert (none["falls"], none["stops"], none["time to fall [s]"]) == ("4", "0", "3.50")
    assert (none["cost of transport"], none["plans"]) == ("1.25", "–")
    damped = cells(build_falls_table(results))
    assert (damped["pairs"], damped["falls"], damped["of none"]) == ("10", "2", "4")
    assert (damped["alone"], damped["none alone"]) == ("1", "3")
    assert damped["difference [points]"].startswith("-20.0 [")
    assert damped["McNemar p"] == "0.62"
    ratios = cells(build_ratios_table(results, ERRORS))
    assert ratios["RMSE roll"] == "0.500", "five pairs give no interval"
    tracking = build_walks_table(results, [f"rmse-{name}" for name in ERRORS])
    assert cells(tracking, 1)["RMSE z [mm]"] == "5.0"


def test_a_figure_is_rounded_once_whatever_its_last_bits() -> None:
    found = [row("none", s, error=1.0) for s in range(10)]
    found += [row("damped", s, error=0.70049951) for s in range(10)]
    ratios = cells(build_ratios_table(summarise(found), ERRORS))
    assert ratios["RMSE roll"] == "0.700 [0.700, 0.700]", "0.7005 first would become 0.701"
    thirds = [row("none", s, error=3.0) for s in range(10)]
    thirds += [row("damped", s, error=3.0 * (0.7685 + (s - 5) * 1e-16)) for s in range(10)]
    ratios = cells(build_ratios_table(summarise(thirds), ERRORS))
    assert ratios["RMSE roll"] == "0.768 [0.768, 0.768]", "as of 0.7685 itself"


def test_swept_values_stand_beside_each_other_and_are_pooled() -> None:
    every = [
        row(variant, seed, swept=(load,), fell=1.0 if (variant, load) == ("none", "10") else None)
        for load in ("9", "10")
        for variant in ("none", "damped")
        for seed in range(10)
    ]
    results = summarise(every, ("world.payload",))
    table = build_walks_table(results, ("trials",))
    assert [line[1:3] for line in table.rows] == [
        ("9", "none"),
        ("9", "damped"),
        ("10", "none"),
        ("10", "damped"),
        ("all", "none"),
        ("all", "damped"),
    ]
    falls = build_falls_table(results)
    assert [line[1:3] for line in falls.rows] == [
        ("9", "damped"),
        ("10", "damped"),
        ("all", "damped"),
    ]
    pooled = cells(falls, 2)
    assert (pooled["scenario"], pooled["world.payload"]) == (ALL, "all")
    assert (pooled["pairs"], pooled["none alone"]) == ("20", "10")
    assert float(pooled["McNemar p"]) == pytest.approx(2 / 2**10, rel=0.05)


def test_refused_variants_say_why() -> None:
    every = [row("none", 0), row("damped", 0, success=False, refused="radius 0.7, not below 0.5")]
    table = build_walks_table(summarise(every), ("trials", "success"))
    assert table.rows[1] == ("steps", "damped", "refused", "–")
    assert table.notes == ("damped was refused: radius 0.7, not below 0.5.",)


def test_the_radius_of_a_variant_is_shown_and_of_all_worlds_the_largest() -> None:
    every = [row("none"), row("damped"), row("damped", scenario="flat")]
    wanted = {
        Group(where, name, ()): 1 for where in ("steps", "flat") for name in ("none", "damped")
    }
    radii = {Group("steps", "damped", ()): 0.25, Group("flat", "damped", ()): 1.31}
    lines = build_lines(every, wanted, "none", pooled=True, radii=radii)
    shown = {(*line.world, line.variant): line.radius for line in lines}
    assert shown == {
        ("steps", "none"): None,
        ("steps", "damped"): 0.25,
        ("flat", "damped"): 1.31,
        (ALL, "none"): None,
        (ALL, "damped"): 1.31,
    }


def test_a_group_that_nobody_walked_has_no_line() -> None:
    wanted = {Group("steps", name, ()): 10 for name in ("none", "damped")}
    lines = build_lines([row("none", 3)], wanted, "none", pooled=False)
    assert [(line.variant, line.done, line.wanted) for line in lines] == [("none", 1, 10)]


def test_small_p_values_are_not_zero() -> None:
    assert (format_p(0.0), format_p(0.00012), format_p(1.0)) == ("< 0.0001", "0.00012", "1")

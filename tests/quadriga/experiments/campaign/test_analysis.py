"""Rows whose every figure is known: what becomes of them in tables, and who is worst."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from quadriga.experiments.campaign.analysis import against, by_group, tally, worst
from quadriga.experiments.campaign.outcome import TrialOutcome
from quadriga.experiments.campaign.sheets import (
    ALL,
    fall_sheets,
    outcome_sheets,
    p_text,
    ratio_sheets,
    tracking_sheets,
)
from quadriga.experiments.campaign.statistics import Pairs
from quadriga.tables import Table
from tests.quadriga.experiments.campaign.rows import manifest, row

NARROW = "\N{NO-BREAK SPACE}"


def rows() -> list[TrialOutcome]:
    """Ten seeds: `none` falls in 0 … 3, `damped` in 3 and 4; its errors are half as large."""
    found = [row("none", seed, fell=2.0 + seed if seed < 4 else None) for seed in range(10)]
    found += [
        row("damped", seed, fell=5.0 if seed in (3, 4) else None, error=0.005) for seed in range(10)
    ]
    return found


def cells(sheet: Table, line: int = 0) -> dict[str, str]:
    pairs = zip(sheet.columns, sheet.rows[line], strict=True)
    return {name.replace(NARROW, " "): cell.replace(NARROW, " ") for name, cell in pairs}


def of(variant: str, found: Iterable[TrialOutcome]) -> list[TrialOutcome]:
    return [r for r in found if r.variant == variant]


def test_pairs_are_of_the_same_world_and_seed() -> None:
    found = against(of("damped", rows()), of("none", rows()))
    assert found.fell == Pairs(both=1, first=1, second=3, neither=5)
    assert (found.alone, found.spared) == ((4,), (0, 1, 2))
    assert found.upright == 5
    assert found.ratios["roll"] == pytest.approx((0.5,) * 5)
    assert found.ratios["cost"] == pytest.approx((0.25,) * 5)
    other_world = [row("none", seed, scenario="flat") for seed in range(10)]
    assert against(of("damped", rows()), other_world).fell.total == 0
    refused = [row("none", seed, refused="no data", success=False) for seed in range(10)]
    assert against(of("damped", rows()), refused).fell.total == 0


def test_a_tally_counts_falls_stops_and_refusals_apart() -> None:
    stop = row(
        "none", 10, success=False, stopped="r1: qp-infeasible", plans="solved=9, nominal:x=1"
    )
    refused = row("none", 11, success=False, refused="radius 0.7")
    found = tally([*of("none", rows()), stop, refused])
    assert (found.trials, found.successes, found.falls, found.stops) == (11, 6, 4, 1)
    assert found.refused == "radius 0.7"
    assert found.time_to_fall == 3.5
    assert found.rmse["z"] == 0.01
    assert found.plans == {"solved": 9, "nominal:x": 1}


def test_the_worst_fell_first_then_stopped_then_cost_most() -> None:
    stop = row("none", 10, success=False, stopped="r1: qp-infeasible")
    dear = row("none", 11, error=0.1)
    found = worst([*of("none", rows()), dear, stop], 7)
    assert [r.seed for r in found] == [0, 1, 2, 3, 10, 11, 4]


def test_the_tables_say_what_was_counted() -> None:
    found = by_group(rows())
    mine = manifest("none", "damped")
    (sheet,) = outcome_sheets(mine, found)
    assert [line[0] for line in sheet.rows] == ["none", "damped"]
    none = cells(sheet)
    assert (none["trials"], none["success"], none["95 %"]) == ("10", "60.0 %", "31.3 … 83.2")
    assert (none["fell"], none["stopped"], none["time to fall [s]"]) == ("4", "0", "3.50")
    assert (none["cost of transport"], none["plans"]) == ("1.25", "–")
    (sheet,) = fall_sheets(mine, found, "none")
    damped = cells(sheet)
    assert (damped["pairs"], damped["fell"], damped["none fell"]) == ("10", "2", "4")
    assert (damped["fell alone"], damped["none alone"]) == ("1", "3")
    assert (damped["difference [points]"], damped["McNemar p"]) == ("-20.0", "0.62")
    (sheet,) = ratio_sheets(mine, found, "none")
    assert cells(sheet)["roll"] == "0.50", "five pairs give no interval"
    (sheet,) = tracking_sheets(mine, found)
    assert cells(sheet, 1)["z [mm]"] == "5.0"


def test_swept_values_stand_beside_each_other_and_are_pooled() -> None:
    mine = manifest("none", "damped", sweeps=("world.payload",), swept=(("9",), ("10",)))
    every = [
        row(variant, seed, swept=(load,), fell=1.0 if (variant, load) == ("none", "10") else None)
        for variant in ("none", "damped")
        for load in ("9", "10")
        for seed in range(10)
    ]
    found = by_group(every)
    (sheet,) = outcome_sheets(mine, found)
    assert [line[:2] for line in sheet.rows] == [
        ("none", "9"),
        ("damped", "9"),
        ("none", "10"),
        ("damped", "10"),
    ]
    one, together = fall_sheets(mine, found, "none")
    assert [line[:2] for line in one.rows] == [("damped", "9"), ("damped", "10")]
    assert together.title.startswith(ALL)
    pooled = cells(together)
    assert (pooled["world.payload"], pooled["pairs"], pooled["none alone"]) == ("all", "20", "10")
    assert float(pooled["McNemar p"]) == pytest.approx(2 / 2**10, rel=0.05)


def test_refused_variants_say_why() -> None:
    every = [row("none", 0), row("damped", 0, success=False, refused="radius 0.7, not below 0.5")]
    (sheet,) = outcome_sheets(manifest("none", "damped"), by_group(every))
    assert cells(sheet, 1)["success"] == "refused"
    assert "damped: refused: radius 0.7, not below 0.5." in sheet.notes


def test_small_p_values_are_not_zero() -> None:
    assert (p_text(0.0), p_text(0.00012), p_text(1.0)) == ("< 0.0001", "0.00012", "1")

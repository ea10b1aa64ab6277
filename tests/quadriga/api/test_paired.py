"""Statistics of paired trials: those of a campaign's report, from a script."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import quadriga
from quadriga.experiments.campaign.ledger import Ledger
from quadriga.experiments.statistics import Pairs, mcnemar, paired_difference
from quadriga.shared.messages import Event
from tests.quadriga.conftest import run_config, write
from tests.quadriga.experiments.rows import manifest, row


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """Ten seeds of two variants: `none` falls with the first four, `mine` with the fourth alone."""
    rows = [row("none", seed, fell=2.5 if seed < 4 else None, error=0.02) for seed in range(10)]
    rows += [row("mine", seed, fell=1.5 if seed == 3 else None) for seed in range(10)]
    with Ledger(tmp_path / "campaign", manifest("none", "mine")) as ledger:
        for one in rows:
            ledger.append(one)
    return tmp_path / "campaign"


def test_two_variants_of_a_campaign_are_compared_pair_by_pair(campaign: Path) -> None:
    trials = quadriga.read_trials(campaign)
    assert {name: len(rows) for name, rows in trials.items()} == {"none": 10, "mine": 10}
    found = quadriga.compare_paired(trials["mine"], trials["none"])
    pairs = Pairs(both=1, first=0, second=3, neither=6)
    assert (found.pairs, found.falls, found.upright) == (10, pairs, 6)
    assert found.p == mcnemar(pairs)
    assert found.fall_difference == paired_difference(pairs)
    vx = found.ratios["vx"]
    assert (vx.pairs, vx.median, vx.low, vx.high) == (6, 0.5, 0.5, 0.5)
    assert found.ratios["cost"].median == 0.25
    assert "10 pairs: 1 with falls in both, 0 in the first alone, 3 in the second" in str(found)
    assert "\n  vx 0.500 [0.500, 0.500]" in str(found)
    few = quadriga.compare_paired(trials["mine"][:5], trials["none"])
    assert (few.pairs, few.ratios["vx"].low) == (5, None)


def test_a_folder_of_one_variant_is_enough(campaign: Path, tmp_path: Path) -> None:
    with Ledger(tmp_path / "other", manifest("none")) as ledger:
        for seed in range(10):
            ledger.append(row("none", seed))
    found = quadriga.compare_paired(tmp_path / "other", quadriga.read_trials(campaign)["none"])
    assert found.ratios["vx"].median == 0.5
    with pytest.raises(quadriga.ConfigError, match="variants none, mine, expected a campaign of"):
        quadriga.compare_paired(campaign, tmp_path / "other")
    with pytest.raises(quadriga.ConfigError, match=r"campaign\.json"):
        quadriga.compare_paired(tmp_path, tmp_path / "other")


def test_runs_of_the_same_world_and_seed_are_pairs(tmp_path: Path) -> None:
    config = run_config(1, 0.5)
    fall = Event(300, 300_000_000, "fall", "r1", "tilt 1.10 rad", "fall")

    def walked(name: str, seed: int, planner: str, *, fell: bool) -> quadriga.Run:
        folder = tmp_path / f"{name}-{seed}"
        folder.mkdir()
        mine = replace(
            config,
            world=replace(config.world, seed=seed),
            planner=replace(config.planner, kind=planner),
        )
        return quadriga.open(write(folder, mine, extra=[("team/sim/event", fall)] if fell else ()))

    ours = [walked("ours", seed, "distributed", fell=False) for seed in range(3)]
    theirs = [walked("theirs", seed, "none", fell=seed > 0) for seed in range(1, 4)]
    found = quadriga.compare_paired(ours, theirs)
    assert (found.pairs, found.falls) == (2, Pairs(both=0, first=0, second=2, neither=0))
    far = replace(config, world=replace(config.world, seed=1, terrain_height=0.3))
    (tmp_path / "far").mkdir()
    with pytest.raises(quadriga.ConfigError, match="no trial of the same world and seed"):
        quadriga.compare_paired(ours, [quadriga.open(write(tmp_path / "far", far))])

"""Trials beside the results: kept whole, counted again, gone on with; and whose win."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.experiments.published import published_trials
from quadriga.experiments.published.catalogue import CHECKOUT, load_experiments
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.publish import publish
from quadriga.experiments.published.summarise_experiment import summarise_experiment
from quadriga.experiments.sweep import parse_sweep
from quadriga.shared.errors import ConfigError
from tests.quadriga.experiments.published.made import (
    DIGEST,
    checkout,
    experiment_of,
    files,
    publish_all,
    upright,
    write_runs,
)
from tests.quadriga.experiments.published.test_summarise_experiment import fate


def test_runs_win_over_what_is_published(tmp_path: Path) -> None:
    experiment, into = experiment_of("ice"), checkout(tmp_path / "here")
    write_runs(experiment, tmp_path / "old", range(4), upright)
    publish_all([experiment], tmp_path / "old", into)
    write_runs(experiment, tmp_path / "new", range(10), upright)
    (entry,) = publish_all([experiment], tmp_path / "new", into)
    assert [line.done for line in entry.results.lines] == [10, 10]
    begun = tmp_path / "begun"
    write_runs(experiment, begun, range(0), upright)
    (entry,) = publish_all([experiment], begun, into)
    assert [line.done for line in entry.results.lines] == [10, 10], "begun, but nothing walked yet"


def test_fewer_trials_win_only_if_they_are_of_other_code(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    experiment, into, runs = experiment_of("ice"), checkout(tmp_path / "here"), tmp_path / "runs"
    write_runs(experiment, runs, range(10), upright)
    publish_all([experiment], runs, into)
    first = files(into)
    write_runs(experiment, tmp_path / "few", range(4), upright)
    publish_all([experiment], tmp_path / "few", into)
    assert files(into) == first
    assert "small: what is published stays; it has more trials" in capsys.readouterr().out
    write_runs(experiment, tmp_path / "later", range(4), upright, versions="code 2")
    (entry,) = publish_all([experiment], tmp_path / "later", into)
    assert [line.done for line in entry.results.lines] == [4, 4]
    assert entry.results.versions == ("code 2",)


def test_what_nobody_asks_for_stays_as_published(tmp_path: Path) -> None:
    experiment, into, runs = experiment_of("ice"), checkout(tmp_path / "here"), tmp_path / "runs"
    write_runs(experiment, runs, range(4), upright)
    publish_all([experiment], runs, into)
    first = files(into)
    write_runs(experiment, tmp_path / "more", range(10), upright)
    digests = {experiment.name: dict.fromkeys(experiment.groups(), DIGEST)}
    publish([experiment], tmp_path / "more", into, ["another"], digests, print)
    assert files(into) == first


def test_parts_that_were_not_walked_with_the_others_are_published_no_more(tmp_path: Path) -> None:
    """Results and trials are of the same campaigns, whatever was published before."""
    parts = tuple(
        Part(name, (name,), parse_sweep("world.terrain_height=0.04,0.1"), "height [m]")
        for name in ("ice", "steps")
    )
    experiment, into = experiment_of("ice", "steps", parts=parts), checkout(tmp_path / "here")
    write_runs(experiment, tmp_path / "old", range(4), upright)
    publish_all([experiment], tmp_path / "old", into)
    write_runs(
        replace(experiment, parts=parts[:1]), tmp_path / "new", range(3), upright, versions="code 2"
    )
    (entry,) = publish_all([experiment], tmp_path / "new", into)
    campaigns = published_trials.read_published_trials(experiment, into)
    assert list(campaigns) == [parts[0]]
    assert {line.world[0] for line in entry.results.lines} == {"ice"}
    assert entry.results == summarise_experiment(experiment, list(campaigns.values()))


def test_published_trials_do_not_name_folders_of_one_machine() -> None:
    every, _ = load_experiments([])
    for experiment in every:
        if campaigns := published_trials.read_published_trials(experiment, CHECKOUT):
            assert all(not manifest.typed for manifest, _ in campaigns.values())


def test_published_trials_are_taken_up_and_gone_on_with(
    experiments: list[Experiment], tmp_path: Path
) -> None:
    into, runs, later = checkout(tmp_path / "here"), tmp_path / "runs", tmp_path / "later"
    for experiment in experiments[:2]:
        write_runs(experiment, runs, range(3), fate)
    publish_all(experiments, runs, into)
    first = files(into)
    for experiment in experiments[:2]:
        (part,) = experiment.parts
        assert published_trials.unpack_trials(experiment, part, into, later) == 12
        assert not published_trials.unpack_trials(experiment, part, into, later), "it is there"
    assert set(published_trials.read_published_trials(experiments[0], into)) == set(
        experiments[0].parts
    )
    publish_all(experiments, later, into)
    assert files(into) == first
    write_runs(experiments[0], later, range(3, 5), fate)
    (entry, *_) = publish_all(experiments, later, into)
    assert {line.done for line in entry.results.lines} == {5, 10}
    with pytest.raises(ConfigError, match="got a folder without 8 of the published trials"):
        published_trials.unpack_trials(experiments[0], experiments[0].parts[0], into, runs)


def test_the_order_of_walking_does_not_show_in_what_is_published(tmp_path: Path) -> None:
    experiment = experiment_of("ice", "steps")
    for name, seeds in (("one", range(6)), ("other", range(5, -1, -1))):
        write_runs(
            experiment,
            tmp_path / name,
            seeds,
            lambda group, seed: {
                **fate(group, seed),
                "wall_s": 0.1 + 1e6 * (seed == 0),
                "plans": "solved=3, faded=1" if seed % 2 else "faded=2",
            },
        )
        publish_all([experiment], tmp_path / name, checkout(tmp_path / f"of-{name}"))
    assert files(tmp_path / "of-one") == files(tmp_path / "of-other")


@pytest.mark.parametrize("harm", ["cut", "changed"])
def test_damaged_published_trials_are_one_error(tmp_path: Path, harm: str) -> None:
    experiment, into, runs = experiment_of("ice"), checkout(tmp_path / "here"), tmp_path / "runs"
    write_runs(experiment, runs, range(3), upright)
    publish_all([experiment], runs, into)
    packed = into / "docs/results/trials/small/trials.csv.gz"
    body = packed.read_bytes()
    packed.write_bytes(body[:-20] if harm == "cut" else body[:40] + b"\xff" * 40 + body[80:])
    with pytest.raises(ConfigError, match=r"trials\.csv\.gz: got .*expected published trials"):
        published_trials.unpack_trials(experiment, experiment.parts[0], into, tmp_path / "later")
    assert not (tmp_path / "later").exists()

"""Publishing: the same bytes again, from runs or from what was published, and nothing by hand."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib import image

from quadriga.experiments.measures import MEASURES
from quadriga.experiments.published.catalogue import CHECKOUT, load_experiments
from quadriga.experiments.published.experiment import Experiment, Requirement
from quadriga.experiments.published.page import build_overview
from quadriga.experiments.published.publish import PAGE, publish
from quadriga.experiments.published.walk_experiment import config_digests
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


def test_the_same_bytes_again_and_from_what_is_published_alone(
    experiments: list[Experiment], tmp_path: Path
) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    for experiment in experiments[:2]:
        write_runs(experiment, runs, range(7), fate)
    publish_all(experiments, runs, into)
    first = files(into)
    assert set(first) == {
        "docs/results.md",
        "docs/figures/small-success.png",
        "docs/figures/small-falls.png",
        "docs/figures/small-ratios.png",
        "docs/figures/swept-sweep.png",
        "docs/results/trials/small/campaign.json.gz",
        "docs/results/trials/small/trials.csv.gz",
        "docs/results/trials/swept/steps/campaign.json.gz",
        "docs/results/trials/swept/steps/trials.csv.gz",
    }
    publish_all(experiments, runs, into)
    assert files(into) == first
    shutil.rmtree(into / "docs" / "figures")
    (into / PAGE).unlink()
    publish_all(experiments, tmp_path / "nowhere", into)
    assert files(into) == first, "a fresh clone has no runs"
    for name in first:
        if name.endswith(".png"):
            height, width = image.imread(into / name).shape[:2]
            assert 100 < height < width < 1000
            assert len(first[name]) < 60_000


def test_the_page_says_what_came_of_it(experiments: list[Experiment], tmp_path: Path) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    for experiment in experiments[:2]:
        write_runs(experiment, runs, range(7), fate)
    publish_all(experiments, runs, into)
    page = (into / PAGE).read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert "do not edit" in page.partition("\n")[0]
    for text in (
        "`quadriga experiments small`",
        "- seeds: 0 … 9; walked: 0 … 6",
        "- trials: **28 of 40**",
        "code 1",
        "| mine: success ≥ 97 % | **missed** in 1 of 2 so far | 85.7 [48.7, 97.4] **missed** by "
        "11.3 | 100.0 [64.6, 100.0] met by 3.0 |",
        "| steps | mine | 7 | 85.7 [48.7, 97.4] | 1 |",
        "| steps | mine | 7 | 1 | 4 | 0 | 3 |",
        "| ice | mine | 7 | 0.250 [0.250, 0.250] | 0.500 [0.500, 0.500] |",
        "Swept on steps: `world.terrain_height`, height [m]: 0.04, 0.1.",
        "| steps | 0.04 | mine | 85.7",
        "![Small](figures/small-ratios.png)",
        "- trials: **0 of 20**",
    ):
        assert text in page, text
    assert "| [small](#small) | 28 of 40 | mine: success ≥ 97 % | steps: 85.7" in page
    assert "| [later](#later) | 0 of 20 | mine: success ≥ 97 % | – | open |" in page


def test_all_worlds_together_are_told_beside_the_worst(tmp_path: Path) -> None:
    asked = Requirement("success", "least", 97.0, variants=("mine",), pooled=True)
    experiment = experiment_of("steps", "ice", requirements=(asked,))
    write_runs(experiment, tmp_path / "runs", range(7), fate)
    (entry,) = publish_all([experiment], tmp_path / "runs", checkout(tmp_path / "here"))
    text = build_overview([entry]).replace("\N{NO-BREAK SPACE}", " ")
    assert "| all worlds: 92.9 [68.5, 98.7] **missed** by 4.1; steps: 85.7 [48.7, 97.4]" in text
    assert "**missed** in 2 of 3 so far" in text
    alone = replace(
        entry, experiment=replace(experiment, requirements=(replace(asked, each=False),))
    )
    assert "| 92.9 [68.5, 98.7] **missed** by 4.1 |" in build_overview([alone]).replace(
        "\N{NO-BREAK SPACE}", " "
    )


def test_a_folder_without_docs_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"docs: got no such folder, expected docs to publish in"):
        publish_all([experiment_of("ice")], tmp_path, tmp_path)
    assert list(files(tmp_path)) == []


def test_what_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    into = checkout(tmp_path / "here")
    (into / "docs" / "figures").write_text("a file", encoding="utf-8")
    with pytest.raises(ConfigError, match="a place that can be written to"):
        publish_all([experiment_of("ice")], tmp_path, into)


def test_every_measure_is_told_of_a_line_that_has_it(tmp_path: Path) -> None:
    experiment = experiment_of("steps")
    write_runs(
        experiment,
        tmp_path,
        range(10),
        lambda group, seed: {**fate(group, seed), "planner_ms_p99": 2.0, "planner_ms_p50": 1.0},
    )
    (entry,) = publish_all([experiment], tmp_path, checkout(tmp_path / "here"))
    line = entry.results.find(("steps",), "mine")
    assert line is not None
    for name, measure in MEASURES.items():
        found = measure.of(line)
        assert found is not None, name
        assert measure.format_interval(found)


def test_what_the_project_publishes_is_what_its_files_give(tmp_path: Path) -> None:
    """`make figures ARGS=--only-publish` after a change of an experiment, or of how it is told."""
    every, _ = load_experiments([])
    into = tmp_path / "clone"
    shutil.copytree(CHECKOUT / "docs", into / "docs", ignore=shutil.ignore_patterns("_build"))
    today = {one.name: config_digests(one) for one in every}
    names = [one.name for one in every]
    entries = publish(every, tmp_path / "nowhere", into, names, today, print)
    same = (into / PAGE).read_bytes() == (CHECKOUT / PAGE).read_bytes()
    assert same, "make figures ARGS=--only-publish"
    for figure in (figure for entry in entries for figure in entry.figures):
        assert (CHECKOUT / "docs" / figure).is_file()


def test_an_experiment_without_pairs_has_no_table_of_them(tmp_path: Path) -> None:
    alone = experiment_of("ice")
    alone = replace(alone, variants=alone.variants[:1])
    write_runs(alone, tmp_path, range(3), upright)
    publish_all([alone], tmp_path, checkout(tmp_path / "here"))
    page = (tmp_path / "here" / PAGE).read_text(encoding="utf-8")
    assert "### Walks" in page
    assert "### Falls" not in page
    assert not (tmp_path / "here/docs/figures/small-falls.png").exists()


def test_a_refused_variant_is_a_row_and_says_why(tmp_path: Path) -> None:
    experiment, into = experiment_of("ice"), checkout(tmp_path / "here")
    refused = {"refused": "radius 0.9, not at most 0.5", "success": False}
    write_runs(
        experiment,
        tmp_path,
        range(10),
        lambda group, _seed: refused if group.variant == "mine" else {},
    )
    publish_all([experiment], tmp_path, into)
    page = (into / PAGE).read_text(encoding="utf-8")
    assert (
        "| ice | mine | refused | – |\n\nmine was refused: radius 0.9, not at most 0.5.\n" in page
    )
    assert "| **missed** | **missed**: refused, radius 0.9, not at most 0.5 |" in page


def test_what_was_walked_with_earlier_defaults_says_so(tmp_path: Path) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    experiment = experiment_of("steps")
    write_runs(experiment, runs, range(10), upright)
    for digest, current in ((DIGEST, True), ("cd" * 32, False)):
        publish_all([experiment], runs, into, digest)
        page = (into / PAGE).read_text(encoding="utf-8")
        assert ("**earlier defaults**" in page) is not current
        assert "20\xa0of\xa020" in page

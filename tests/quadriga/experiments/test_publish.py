"""Publishing: the same bytes again, from runs or from what was published, and nothing by hand."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib import image

from quadriga.campaign.choice import sweep_of
from quadriga.experiments import published_trials
from quadriga.experiments.catalogue import CHECKOUT, load
from quadriga.experiments.experiment import Experiment, Part, Published, Requirement
from quadriga.experiments.measures import MEASURES
from quadriga.experiments.page import BEGIN, END, overview, replaced
from quadriga.experiments.publish import KEPT, PAGE, publish
from quadriga.experiments.results import to_json
from quadriga.experiments.summarise import summarise
from shared.errors import ConfigError
from tests.quadriga.experiments.made import (
    checkout,
    experiment_of,
    publish_all,
    upright,
    write_runs,
)
from tests.quadriga.experiments.test_summarise import fate


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*") if path.is_file()
    }  # fmt: skip


@pytest.fixture
def experiments() -> list[Experiment]:
    """One with everything, one that sweeps, one that nobody has walked."""
    full = experiment_of("steps", "ice", published=Published(
        ("trials", "success", "falls", "stops", "time-to-fall", "vx", "transport", "cost", "p50",
         "p99", "rmse-z"), True, ("cost", "roll", "z"), ("success", "falls", "ratios"),
    ))  # fmt: skip
    swept = Part("steps", ("steps",), sweep_of("world.terrain_height=0.04,0.1"), "height [m]")
    sweeps = experiment_of("steps", name="swept", parts=(swept,), requirements=(),
                           published=Published(("success",), False, (), ("sweep",)))  # fmt: skip
    return [full, sweeps, experiment_of("steps", name="later")]


def test_the_same_bytes_again_and_from_what_is_published_alone(
    experiments: list[Experiment], tmp_path: Path
) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    for experiment in experiments[:2]:
        write_runs(experiment, runs, range(7), fate)
    publish_all(experiments, runs, into)
    first = files(into)
    assert set(first) == {
        "README.md", "docs/results.md", "docs/results/small.json", "docs/results/swept.json",
        "docs/figures/small-success.png", "docs/figures/small-falls.png",
        "docs/figures/small-ratios.png", "docs/figures/swept-sweep.png",
        "docs/results/trials/small/campaign.json.gz", "docs/results/trials/small/trials.csv.gz",
        "docs/results/trials/swept/steps/campaign.json.gz",
        "docs/results/trials/swept/steps/trials.csv.gz",
    }  # fmt: skip
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
        "`quadriga experiments small`", "- seeds: 0 … 9; walked: 0 … 6",
        "- trials: **28 of 40**", "code 1",
        "| mine: success ≥ 97 % | **missed** in 1 of 2 so far | 85.7 [48.7, 97.4] **missed** by "
        "11.3 | 100.0 [64.6, 100.0] met by 3.0 |",
        "| steps | mine | 7 | 85.7 [48.7, 97.4] | 1 |",
        "| steps | mine | 7 | 1 | 4 | 0 | 3 |",
        "| ice | mine | 7 | 0.250 [0.250, 0.250] | 0.500 [0.500, 0.500] |",
        "Swept on steps: `world.terrain_height`, height [m]: 0.04, 0.1.",
        "| steps | 0.04 | mine | 85.7", "![Small](figures/small-ratios.png)",
        "- trials: **0 of 20**",
    ):  # fmt: skip
        assert text in page, text
    readme = (into / "README.md").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert readme.startswith(f"# Here\n\n{BEGIN}\n| experiment |")
    assert readme.endswith(f"\n{END}\n\nAfter.\n")
    assert "old" not in readme
    assert (
        "| [small](docs/results.md#small) | 28 of 40 | mine: success ≥ 97 % | steps: 85.7" in readme
    )
    assert (
        "| [later](docs/results.md#later) | 0 of 20 | mine: success ≥ 97 % | – | open |" in readme
    )


def test_all_worlds_together_are_told_beside_the_worst(tmp_path: Path) -> None:
    asked = Requirement("success", "least", 97.0, variants=("mine",), pooled=True)
    experiment = experiment_of("steps", "ice", requirements=(asked,))
    write_runs(experiment, tmp_path / "runs", range(7), fate)
    (entry,) = publish_all([experiment], tmp_path / "runs", checkout(tmp_path / "here"))
    text = overview([entry], "#").replace("\N{NO-BREAK SPACE}", " ")
    assert "| all worlds: 92.9 [68.5, 98.7] **missed** by 4.1; steps: 85.7 [48.7, 97.4]" in text
    assert "**missed** in 2 of 3 so far" in text
    alone = replace(entry, experiment=replace(experiment, requirements=(
        replace(asked, each=False),
    )))  # fmt: skip
    assert "| 92.9 [68.5, 98.7] **missed** by 4.1 |" in overview([alone], "#").replace(
        "\N{NO-BREAK SPACE}", " "
    )


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
    publish([experiment], tmp_path / "more", into, ["another"], print)
    assert files(into) == first


def test_parts_that_were_not_walked_with_the_others_are_published_no_more(tmp_path: Path) -> None:
    """Results and trials are of the same campaigns, whatever was published before."""
    parts = tuple(
        Part(name, (name,), sweep_of("world.terrain_height=0.04,0.1"), "height [m]")
        for name in ("ice", "steps")
    )
    experiment, into = experiment_of("ice", "steps", parts=parts), checkout(tmp_path / "here")
    write_runs(experiment, tmp_path / "old", range(4), upright)
    publish_all([experiment], tmp_path / "old", into)
    write_runs(replace(experiment, parts=parts[:1]), tmp_path / "new", range(3), upright,
               versions="code 2")  # fmt: skip
    publish_all([experiment], tmp_path / "new", into)
    campaigns = published_trials.kept(experiment, into)
    assert list(campaigns) == [parts[0]]
    told = (into / KEPT / "small.json").read_text(encoding="utf-8")
    assert to_json(summarise(experiment, list(campaigns.values()))) == told


@pytest.mark.parametrize("text", ["", BEGIN, f"{END}\n{BEGIN}", f"{BEGIN}{END}{BEGIN}{END}"])
def test_a_readme_without_a_place_is_one_error(tmp_path: Path, text: str) -> None:
    into = checkout(tmp_path / "here")
    (into / "README.md").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"README\.md: got no place for results, expected <!-- r"):
        publish_all([experiment_of("ice")], tmp_path, into)
    assert list(files(into)) == ["README.md"]


def test_what_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    into = checkout(tmp_path / "here")
    (into / "docs").write_text("a file", encoding="utf-8")
    with pytest.raises(ConfigError, match="a place that can be written to"):
        publish_all([experiment_of("ice")], tmp_path, into)


def test_only_what_stands_between_the_markers_is_replaced() -> None:
    assert replaced(f"a{BEGIN}x{END}b", "new") == "anewb"
    assert replaced(f"a{BEGIN}xb", "new") is None


def test_every_measure_is_told_of_a_line_that_has_it(tmp_path: Path) -> None:
    experiment = experiment_of("steps")
    write_runs(experiment, tmp_path, range(10), lambda group, seed: {
        **fate(group, seed), "planner_ms_p99": 2.0, "planner_ms_p50": 1.0,
    })  # fmt: skip
    (entry,) = publish_all([experiment], tmp_path, checkout(tmp_path / "here"))
    line = entry.results.find(("steps",), "mine")
    assert line is not None
    for name, measure in MEASURES.items():
        found = measure.of(line)
        assert found is not None, name
        assert measure.shown(found)


def test_what_the_project_publishes_is_what_its_files_give(tmp_path: Path) -> None:
    """`make figures ARGS=--only-publish` after a change of an experiment, or of how it is told."""
    every, _ = load([])
    into = tmp_path / "clone"
    shutil.copytree(CHECKOUT / "docs", into / "docs")
    shutil.copy(CHECKOUT / "README.md", into / "README.md")
    entries = publish_all(every, tmp_path / "nowhere", into)
    for name in (Path("README.md"), PAGE):
        same = (into / name).read_bytes() == (CHECKOUT / name).read_bytes()
        assert same, f"{name}: make figures ARGS=--only-publish"
    for figure in (figure for entry in entries for figure in entry.figures):
        assert (CHECKOUT / "docs" / figure).is_file()


def test_what_is_published_follows_from_the_published_trials() -> None:
    every, _ = load([])
    for experiment in every:
        if campaigns := published_trials.kept(experiment, CHECKOUT):
            told = (CHECKOUT / KEPT / f"{experiment.name}.json").read_text(encoding="utf-8")
            assert to_json(summarise(experiment, list(campaigns.values()))) == told, experiment.name
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
        assert published_trials.unpack(experiment, part, into, later) == 12
        assert not published_trials.unpack(experiment, part, into, later), "it is there"
    assert set(published_trials.kept(experiments[0], into)) == set(experiments[0].parts)
    publish_all(experiments, later, into)
    assert files(into) == first
    write_runs(experiments[0], later, range(3, 5), fate)
    (entry, *_) = publish_all(experiments, later, into)
    assert {line.done for line in entry.results.lines} == {5, 10}
    with pytest.raises(ConfigError, match="got a folder without 8 of the published trials"):
        published_trials.unpack(experiments[0], experiments[0].parts[0], into, runs)


def test_the_order_of_walking_does_not_show_in_what_is_published(tmp_path: Path) -> None:
    experiment = experiment_of("ice", "steps")
    for name, seeds in (("one", range(6)), ("other", range(5, -1, -1))):
        write_runs(experiment, tmp_path / name, seeds, lambda group, seed: {
            **fate(group, seed), "wall_s": 0.1 + 1e6 * (seed == 0),
            "plans": "solved=3, faded=1" if seed % 2 else "faded=2",
        })  # fmt: skip
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
        published_trials.unpack(experiment, experiment.parts[0], into, tmp_path / "later")
    assert not (tmp_path / "later").exists()


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
    write_runs(experiment, tmp_path, range(10), lambda group, _seed: (
        refused if group.variant == "mine" else {}
    ))  # fmt: skip
    publish_all([experiment], tmp_path, into)
    page = (into / PAGE).read_text(encoding="utf-8")
    assert (
        "| ice | mine | refused | – |\n\nmine was refused: radius 0.9, not at most 0.5.\n" in page
    )
    assert "| **missed** | **missed**: refused, radius 0.9, not at most 0.5 |" in page

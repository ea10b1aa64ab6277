"""SHELL of publishing: trials of runs, or as published before, to figures and pages."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import Final

from quadriga.experiments.campaign.ledger import explain_write_errors, read_manifest, read_rows
from quadriga.experiments.campaign.manifest import FILE
from quadriga.experiments.plan import Group
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.figures import draw_figure
from quadriga.experiments.published.page import (
    BEGIN,
    END,
    PageEntry,
    build_page,
    build_readme_table,
    replace_results,
)
from quadriga.experiments.published.published_trials import (
    Campaigns,
    has_more_published,
    pack_trials,
    read_published_trials,
)
from quadriga.experiments.published.summarise_experiment import CampaignTrials, summarise_experiment
from quadriga.experiments.results import Results
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.runtime.atomic import atomic_write, write_text

README: Final = "README.md"
PAGE: Final = Path("docs/results.md")
FIGURES: Final = Path("docs/figures")
Say = Callable[[str], None]
Digests = Mapping[str, Mapping[Group, str]]


def publish(
    experiments: Sequence[Experiment],
    runs: Path,
    into: Path,
    renewed: Container[str],
    digests: Digests,
    say: Say,
) -> list[PageEntry]:
    """Write everything that is published of these experiments.

    Args:
        experiments: all of the page.
        runs: where their campaigns' folders are, if they are.
        into: the checkout whose README and docs are written.
        renewed: names of the experiments whose runs win over what is published of them.
        digests: of each experiment's configurations, as they are today, by its name.
        say: takes what a user should know.

    Raises:
        ConfigError: a campaign's folder or published results cannot be read, something cannot be
            written, or the README has no place for results.
    """
    readme = read_readme(into)
    entries = []
    with explain_write_errors(into):
        for experiment in experiments:
            if experiment.name in renewed:
                _renew(experiment, runs, into, say)
            published = read_published_trials(experiment, into)
            results = summarise_experiment(experiment, list(published.values()))
            figures = _draw_figures(experiment, results, into)
            outdated = _is_outdated(published, digests[experiment.name])
            entries.append(PageEntry(experiment, results, figures, outdated))
        write_text(into / PAGE, build_page(entries))
        write_text(into / README, replace_results(readme, build_readme_table(entries)) or readme)
    return entries


def read_readme(into: Path) -> str:
    """The README, known to have a place for results.

    Raises:
        ConfigError: it cannot be read, or has none.
    """
    path = into / README
    remedy = "--into says of which checkout"
    with name_file_errors(ConfigError, path, "a README to publish in", remedy):
        text = path.read_text(encoding="utf-8")
    if replace_results(text, "") is None:
        raise ConfigError(
            str(path), "no place for results", f"{BEGIN} and, after it, {END}, each once"
        )
    return text


def _renew(experiment: Experiment, runs: Path, into: Path, say: Say) -> None:
    """Publish the trials of an experiment's runs, if there are any and they are not the fewer."""
    campaigns = read_campaigns(experiment, runs)
    if not summarise_experiment(experiment, list(campaigns.values())).lines:
        return
    if has_more_published(experiment, campaigns, into):
        say(
            f"{experiment.name}: what is published stays; it has more trials, of the same code, "
            f"than {runs / experiment.name}"
        )
        return
    pack_trials(experiment, campaigns, into)


def read_campaigns(experiment: Experiment, runs: Path) -> dict[Part, CampaignTrials]:
    """The campaigns that there are of an experiment.

    Raises:
        ConfigError: a folder is not what was written there.
    """
    campaigns: dict[Part, CampaignTrials] = {}
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        if (folder / FILE).is_file():
            manifest = read_manifest(folder)
            campaigns[part] = (manifest, read_rows(folder, manifest))
    return campaigns


def _is_outdated(campaigns: Campaigns, digests: Mapping[Group, str]) -> bool:
    """Whether a configuration that trials were walked with is another one today."""
    walked = [entry for manifest, _ in campaigns.values() for entry in manifest.groups]
    return any(entry.config_sha256 != digests.get(entry.group) for entry in walked)


def _draw_figures(experiment: Experiment, results: Results, into: Path) -> list[str]:
    """Figures that there is something to draw in, as paths from the page."""
    paths = []
    (into / FIGURES).mkdir(parents=True, exist_ok=True)
    for name in experiment.published.figures:
        path = into / FIGURES / f"{experiment.name}-{name}.png"
        with atomic_write(path) as partial:
            drawn = draw_figure(name, experiment, results, partial)
        if drawn:
            paths.append(path.relative_to(into / PAGE.parent).as_posix())
    return paths

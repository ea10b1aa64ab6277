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
from quadriga.experiments.published.page import PageEntry, build_page
from quadriga.experiments.published.published_trials import (
    Campaigns,
    has_more_published,
    pack_trials,
    read_published_trials,
)
from quadriga.experiments.published.summarise_experiment import CampaignTrials, summarise_experiment
from quadriga.experiments.results import Results
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.atomic import atomic_write, write_text

DOCS: Final = Path("docs")
PAGE: Final = DOCS / "results.md"
FIGURES: Final = DOCS / "figures"
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
        into: the checkout whose docs are written.
        renewed: names of the experiments whose runs win over what is published of them.
        digests: of each experiment's configurations, as they are today, by its name.
        say: takes what a user should know.

    Raises:
        ConfigError: a campaign's folder or published results cannot be read, something cannot be
            written, or there are no docs to publish in.
    """
    check_docs(into)
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
    return entries


def check_docs(into: Path) -> None:
    """See that a folder is a checkout, whose docs can be published in.

    Raises:
        ConfigError: it has none.
    """
    folder = into / DOCS
    if not folder.is_dir():
        cause = "--into says of which checkout"
        raise ConfigError(str(folder), "no such folder", "docs to publish in", cause)


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

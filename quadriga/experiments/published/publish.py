"""SHELL of publishing: results from runs, or as published before, to data, figures and pages."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from pathlib import Path
from typing import Final

from quadriga.experiments.campaign.ledger import read_manifest, read_rows, write_text
from quadriga.experiments.campaign.manifest import FILE
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.figures import draw
from quadriga.experiments.published.page import BEGIN, END, PageEntry, fragment, page, replaced
from quadriga.experiments.published.published_trials import keep, outnumbered
from quadriga.experiments.published.results import Results, from_json, to_json
from quadriga.experiments.published.summarise import Walked, fitting, summarise
from quadriga.shared.errors import ConfigError

README: Final = "README.md"
PAGE: Final = Path("docs/results.md")
KEPT: Final = Path("docs/results")
FIGURES: Final = Path("docs/figures")
Say = Callable[[str], None]


def publish(
    experiments: Sequence[Experiment], runs: Path, into: Path, renewed: Container[str], say: Say
) -> list[PageEntry]:
    """Write everything that is published of these experiments.

    Args:
        experiments: all of the page.
        runs: where their campaigns' folders are, if they are.
        into: the checkout whose README and docs are written.
        renewed: names of the experiments whose runs win over what is published of them.
        say: takes what a user should know.

    Raises:
        ConfigError: a campaign's folder or published results cannot be read, something cannot be
            written, or the README has no place for results.
    """
    readme = checked(into)
    entries = []
    try:
        for experiment in experiments:
            if experiment.name in renewed:
                renew(experiment, runs, into, say)
            results = published(experiment, into)
            entries.append(PageEntry(experiment, results, _drawn(experiment, results, into)))
        write_text(into / PAGE, page(entries))
        write_text(into / README, replaced(readme, fragment(entries)) or readme)
    except OSError as error:
        raise ConfigError(
            str(error.filename or into),
            error.strerror or str(error),
            "a place that can be written to",
        ) from None
    return entries


def checked(into: Path) -> str:
    """The README, known to have a place for results.

    Raises:
        ConfigError: it cannot be read, or has none.
    """
    path = into / README
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "bytes that are not UTF-8"
        raise ConfigError(
            str(path), reason, "a README to publish in", "--into says of which checkout"
        ) from None
    if replaced(text, "") is None:
        raise ConfigError(
            str(path), "no place for results", f"{BEGIN} and, after it, {END}, each once"
        )
    return text


def renew(experiment: Experiment, runs: Path, into: Path, say: Say) -> None:
    """Publish what came of an experiment's runs, if there are any and they are not the fewer.

    Raises:
        ConfigError: a folder or a file is not what was written there.
        OSError: a file cannot be written.
    """
    campaigns = walked(experiment, runs)
    found = summarise(experiment, list(campaigns.values()))
    if not found.lines:
        return
    if outnumbered(experiment, campaigns, into):
        say(
            f"{experiment.name}: what is published stays; it has more trials, of the same code, "
            f"than {runs / experiment.name}"
        )
        return
    kept = into / KEPT / f"{experiment.name}.json"
    kept.parent.mkdir(parents=True, exist_ok=True)
    write_text(kept, to_json(found))
    keep(experiment, campaigns, into)


def published(experiment: Experiment, into: Path) -> Results:
    """What is published of an experiment, with the digits that it is published with.

    Raises:
        ConfigError: the file is not what was written there.
    """
    kept = into / KEPT / f"{experiment.name}.json"
    if not kept.is_file():
        return Results()
    return fitting(experiment, from_json(kept.read_bytes().decode(errors="replace"), str(kept)))


def walked(experiment: Experiment, runs: Path) -> dict[Part, Walked]:
    """The campaigns that there are of an experiment.

    Raises:
        ConfigError: a folder is not what was written there.
    """
    found: dict[Part, Walked] = {}
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        if (folder / FILE).is_file():
            manifest = read_manifest(folder)
            found[part] = (manifest, read_rows(folder, manifest))
    return found


def _drawn(experiment: Experiment, results: Results, into: Path) -> list[str]:
    """Figures that there is something to draw in, as paths from the page."""
    found = []
    (into / FIGURES).mkdir(parents=True, exist_ok=True)
    for name in experiment.published.figures:
        path = into / FIGURES / f"{experiment.name}-{name}.png"
        partial = path.with_name(f"{path.name}.partial")
        if draw(name, experiment, results, partial):
            partial.replace(path)
            found.append(path.relative_to(into / PAGE.parent).as_posix())
    return found

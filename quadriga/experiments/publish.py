"""SHELL of publishing: results from runs, or as published before, to data, figures and pages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from quadriga.campaign.ledger import read_manifest, read_rows, write_text
from quadriga.campaign.manifest import FILE
from quadriga.experiments import published_trials
from quadriga.experiments.experiment import Experiment
from quadriga.experiments.figures import draw
from quadriga.experiments.page import BEGIN, END, Entry, fragment, page, replaced
from quadriga.experiments.results import Results, from_json, to_json
from quadriga.experiments.summarise import fitting, summarise
from shared.errors import ConfigError

README: Final = "README.md"
PAGE: Final = Path("docs/results.md")
KEPT: Final = Path("docs/results")
FIGURES: Final = Path("docs/figures")


def publish(experiments: Sequence[Experiment], runs: Path, into: Path) -> list[Entry]:
    """Write everything that is published of these experiments.

    Args:
        experiments: all of the page.
        runs: where their campaigns' folders are, if they are; they win over what is published.
        into: the checkout whose README and docs are written.

    Raises:
        ConfigError: a campaign's folder or published results cannot be read, something cannot be
            written, or the README has no place for results.
    """
    readme = checked(into)
    entries = []
    try:
        for experiment in experiments:
            results = results_of(experiment, runs, into)
            entries.append(Entry(experiment, results, _drawn(experiment, results, into)))
        write_text(into / PAGE, page(entries))
        write_text(into / README, replaced(readme, fragment(entries)) or readme)
    except OSError as error:
        raise ConfigError(str(error.filename or into), error.strerror or str(error),
                          "a place that can be written to") from None  # fmt: skip
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
        raise ConfigError(str(path), reason, "a README to publish in",
                          "--into says of which checkout") from None  # fmt: skip
    if replaced(text, "") is None:
        raise ConfigError(str(path), "no place for results", f"{BEGIN} and, after it, {END}, "
                          "each once")  # fmt: skip
    return text


def results_of(experiment: Experiment, runs: Path, into: Path) -> Results:
    """What came of an experiment: of its runs, which are then published; else as published.

    Raises:
        ConfigError: a folder or a file is not what was written there.
    """
    kept = into / KEPT / f"{experiment.name}.json"
    found = walked(experiment, runs)
    if found.lines:
        text = to_json(found)
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_text(kept, text)
        published_trials.keep(experiment, runs, into)
        return from_json(text, str(kept))  # with the digits that the next clone will have
    if not kept.is_file():
        return Results()
    return fitting(experiment, from_json(kept.read_bytes().decode(errors="replace"), str(kept)))


def walked(experiment: Experiment, runs: Path) -> Results:
    """What came of an experiment's runs.

    Raises:
        ConfigError: a folder is not what was written there.
    """
    campaigns = []
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        if (folder / FILE).is_file():
            manifest = read_manifest(folder)
            campaigns.append((manifest, read_rows(folder, manifest)))
    return summarise(experiment, campaigns)


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

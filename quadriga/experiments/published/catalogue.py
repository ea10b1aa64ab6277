"""Where experiments are kept: `deploy/experiments`, beside the code that they are walked with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.published.experiment_file import read_experiment
from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.shared.runtime.places import EXPERIMENTS, SOURCE

CHECKOUT: Final = SOURCE
FOLDER: Final = EXPERIMENTS
# In this order on the page: what was promised, then what explains it, then how far it goes.
_ORDER: Final = (
    "paper", "as-written", "hard", "edge", "distribution", "low-level", "realism", "ideas",
    "beyond", "ten", "sweeps",
)  # fmt: skip
_SUFFIX: Final = ".toml"


def list_names() -> tuple[str, ...]:
    """The experiments there are, in the order of the page; new ones at its end."""
    names = sorted(file.stem for file in FOLDER.glob(f"*{_SUFFIX}"))
    return tuple(sorted(names, key=lambda n: _ORDER.index(n) if n in _ORDER else len(_ORDER)))


def load_experiments(given: Sequence[str]) -> tuple[list[Experiment], list[str]]:
    """Every experiment of the page, and the names of those asked for, in the order asked for.

    Args:
        given: names, or TOML files that are published too; nothing asks for all.

    Raises:
        ConfigError: there is no such experiment, a file is wrong, or one stands in for another.
    """
    known = list_names()
    files = {name: FOLDER / f"{name}{_SUFFIX}" for name in known}
    asked: dict[str, None] = {}
    for word in given or known:
        if word.endswith(_SUFFIX):
            name = Path(word).stem
            if files.setdefault(name, Path(word)).resolve() != Path(word).resolve():
                raise ConfigError(
                    "experiments",
                    word,
                    "a file of another name",
                    f"there is an experiment {name!r}",
                )
        elif word in known:
            name = word
        else:
            raise ConfigError(
                "experiments",
                repr(word),
                "the name of an experiment, or a TOML file",
                did_you_mean(word, known) or "`quadriga experiments --list` lists them",
            )
        asked[name] = None
    if not asked:
        raise ConfigError(
            "experiments", "none", f"files in {FOLDER}", "is the project installed as a whole?"
        )
    return [read_experiment(file) for file in files.values()], list(asked)

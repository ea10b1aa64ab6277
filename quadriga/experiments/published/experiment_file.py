"""An experiment's TOML file, checked once: everything that is wrong with it is one error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from quadriga.experiments.measures import MEASURES
from quadriga.experiments.published.experiment import (
    BOUNDS,
    SENSES,
    Experiment,
    Part,
    Published,
    Requirement,
)
from quadriga.experiments.published.figures import FIGURES
from quadriga.experiments.results import COST
from quadriga.experiments.seeds import parse_seeds
from quadriga.experiments.sweep import parse_sweep
from quadriga.experiments.tables import COLUMNS
from quadriga.experiments.toml_table import TomlTable
from quadriga.experiments.variants import (
    Variant,
    combine_with_predictors,
    parse_variants,
    read_keys,
)
from quadriga.recordings.traces import ERRORS
from quadriga.shared.config.load import flatten, read_toml
from quadriga.shared.errors import ConfigError
from quadriga.team import scenarios

_KEYS: Final = (
    "title",
    "question",
    "scenarios",
    "planners",
    "predictors",
    "baseline",
    "seeds",
    "common",
    "variants",
    "sweep",
    "publish",
    "requirements",
)
_TABLES: Final = ("outcome", "falls", "ratios", "figures")
_ASKED: Final = (
    "measure", *SENSES, "bound", "variants", "scenarios", "over", "moonshot", "against", "at_least",
)  # fmt: skip
_OVER: Final = ("each", "all")
_OUTCOME: Final = ("trials", "success", "falls", "transport", "cost", "p50", "p99")
_RATIOS: Final = (COST, *ERRORS)


def read_experiment(path: Path) -> Experiment:
    """The experiment of a file.

    Raises:
        ConfigError: the file cannot be read, or says something that is none.
    """
    table = TomlTable(str(path), read_toml(path), _KEYS)
    variants = _variants(table)
    known = [variant.name for variant in variants]
    baseline = table.text("baseline", "none" if "none" in known else known[0])
    table.check_one("baseline", baseline, known)
    names = _scenarios(table)
    labels = [scenarios.label(name) for name in names]
    published = _read_published(table.table("publish", _TABLES), compared=len(variants) > 1)
    return Experiment(
        name=path.stem,
        title=table.text("title"),
        question=table.text("question"),
        parts=_parts(table, names),
        variants=variants,
        baseline=baseline,
        seeds=parse_seeds(f"{path}: seeds", table.text("seeds")),
        published=published,
        requirements=tuple(
            requirement
            for asked in table.tables("requirements", _ASKED)
            for requirement in _requirements(
                asked, known, baseline, labels, poolable=len(labels) > 1 and not table.has("sweep")
            )
        ),
    )


def _variants(table: TomlTable) -> tuple[Variant, ...]:
    """Planners by name, then the tables; each on top of what all have in common."""
    common = flatten(table.mapping("common"))
    planners = table.texts("planners", ())
    with _name_file_in_errors(table, "planners"):
        variants = list(parse_variants([",".join(planners)], None)) if planners else []
    with _name_file_in_errors(table, "predictors"):
        variants = list(combine_with_predictors(variants, table.texts("predictors", ())))
    for name, keys in read_keys(table.mapping("variants"), f"{table.where}: variants").items():
        variants.append(Variant(name, keys))
    names = [variant.name for variant in variants]
    if not names or len(set(names)) < len(names):
        raise ConfigError(
            f"{table.where}: planners and variants",
            ", ".join(names) or "none",
            "at least one, of different names",
        )
    return tuple(Variant(variant.name, {**common, **variant.keys}) for variant in variants)


@contextmanager
def _name_file_in_errors(table: TomlTable, name: str) -> Iterator[None]:
    """Have what reads the command line name the file instead."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(
            f"{table.where}: {name}", error.got, error.expected, error.cause
        ) from None


def _scenarios(table: TomlTable) -> tuple[str, ...]:
    names = table.texts("scenarios", ())
    if not names:
        raise ConfigError(f"{table.where}: scenarios", "none", "a list of names or TOML files")
    for name in names:
        if name not in scenarios.names() and not name.endswith(".toml"):
            table.check_one("scenarios", name, scenarios.names())
    return names


def _parts(table: TomlTable, names: tuple[str, ...]) -> tuple[Part, ...]:
    """One campaign; with something swept one for each scenario, which has its own."""
    if not table.has("sweep"):
        return (Part("", names),)
    labels = {scenarios.label(name): name for name in names}
    swept = table.table("sweep", labels)
    parts = []
    for label, name in labels.items():
        mine = swept.table(label, ("keys", "axis"))
        keys = mine.text("keys")
        with _name_file_in_errors(mine, "keys"):
            sweep = parse_sweep(keys)
        parts.append(Part(label, (name,), sweep, mine.text("axis", sweep.name)))
    return tuple(parts)


def _read_published(table: TomlTable, *, compared: bool) -> Published:
    return Published(
        outcome=table.texts("outcome", _OUTCOME, COLUMNS),
        falls=table.yes("falls", compared),
        ratios=table.texts("ratios", _RATIOS if compared else (), _RATIOS),
        figures=table.texts("figures", ("success",), FIGURES),
    )


def _requirements(
    table: TomlTable, variants: list[str], baseline: str, labels: list[str], *, poolable: bool
) -> list[Requirement]:
    """Those of a table: one for each of its measures."""
    senses = [sense for sense in SENSES if table.has(sense)]
    if len(senses) != 1:
        raise ConfigError(
            table.where, ", ".join(senses) or "no limit", f"one of {', '.join(SENSES)}"
        )
    bound = table.text("bound", "value")
    table.check_one("bound", bound, BOUNDS)
    over = table.texts("over", ("each",), _OVER)
    measures = table.texts("measure", (), MEASURES)
    if not measures or not over:
        raise ConfigError(f"{table.where}: measure and over", "nothing", "at least one of each")
    against = table.text("against", baseline)
    table.check_one("against", against, variants)
    others = tuple(variant for variant in variants if variant not in (baseline, against))
    chosen = table.texts("variants", (), variants) or others or (baseline,)
    if table.has("against") and not all(MEASURES[name].paired for name in measures):
        raise ConfigError(f"{table.where}: against", repr(against), "none", "no pairs are measured")
    _check_measures(table, measures, bound, against=against, chosen=chosen)
    if "all" in over and not poolable:
        raise ConfigError(
            f"{table.where}: over",
            "all",
            "each",
            "pooled are several scenarios, of which none sweeps",
        )
    places = table.texts("scenarios", (), labels)
    if "all" in over and places:
        raise ConfigError(
            f"{table.where}: scenarios",
            f"{', '.join(places)} with over {list(over)}",
            'over = "each"',
            "all worlds together are those of every scenario",
        )
    at_least = 0
    if table.has("at_least"):
        at_least = _read_at_least(table, len(places or labels) if poolable else None, over)
    return [
        Requirement(
            measure=measure,
            sense=senses[0],
            limit=table.number(senses[0]),
            bound=next(known for known in BOUNDS if known == bound),
            variants=chosen,
            scenarios=places,
            each="each" in over,
            pooled="all" in over,
            moonshot=table.yes("moonshot", False),
            against="" if against == baseline else against,
            at_least=at_least,
        )
        for measure in measures
    ]


def _read_at_least(table: TomlTable, worlds: int | None, over: tuple[str, ...]) -> int:
    """In how many worlds it must be met; `worlds` there are, unless a sweep makes more."""
    number, most = table.number("at_least"), math.inf if worlds is None else worlds
    if "all" in over:
        raise ConfigError(
            f"{table.where}: at_least", f"{number:g} with over {list(over)}", 'over = "each"'
        )
    if not 1 <= number <= most or number != int(number):
        expected = "a whole number ≥ 1" + (f" and ≤ {worlds}, its worlds" if worlds else "")
        raise ConfigError(f"{table.where}: at_least", f"{number:g}", expected)
    return int(number)


def _check_measures(
    table: TomlTable,
    measures: tuple[str, ...],
    bound: str,
    *,
    against: str,
    chosen: tuple[str, ...],
) -> None:
    """Refuse what no trial could ever answer."""
    for name in measures:
        if MEASURES[name].paired and against in chosen:
            raise ConfigError(
                f"{table.where}: measure",
                repr(name),
                "one of a variant alone",
                f"it compares with {against}, of which it is asked",
            )
        if bound != "value" and not MEASURES[name].interval:
            raise ConfigError(
                f"{table.where}: bound", repr(bound), "none", f"{name} has no interval"
            )

"""Whether a command of the manual is one that there is, with options that it has."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from quadriga.commands.command import Given
from quadriga.commands.config_options import read_config
from quadriga.commands.mistakes import check_words
from quadriga.commands.parser import CommandLine, build_parser
from quadriga.experiments.seeds import parse_seeds
from quadriga.experiments.sweep import parse_sweep
from quadriga.experiments.variants import parse_variants
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import SOURCE

# Of the system, or of packages that pages tell how to install.
_SYSTEM: Final = ". chown cp docker export grep head install ip journalctl ls podman scp ssh"
_MORE: Final = "dask pip podman-compose pytest systemctl true useradd wait"
_OTHERS: Final = frozenset((*_SYSTEM.split(), *_MORE.split()))
_AROUND: Final = frozenset(("docker", "podman", "podman-compose"))
# What these targets of the Makefile give ARGS to.
_WITH_ARGS: Final[Mapping[str, tuple[str, ...]]] = {
    "walk": ("walk",),
    "figures": ("experiments",),
    "acceptance": ("experiments",),
}
_PLUGINS: Final = SOURCE / "tests" / "plugins"
_PLUGIN_KIND: Final = "balance"  # a planner that is installed only where a page is about it
_BUILT_IN: Final = "decentralised"  # what stands for it


def check_command(words: Sequence[str]) -> None:
    """See that a command can be typed.

    Raises:
        AssertionError: there is no such program, target or module.
        QuadrigaError: a command of this project does not have such options or values.
    """
    program, *rest = words
    if program in _AROUND and "quadriga" in words:  # `docker compose exec operator quadriga …`
        check_command(words[words.index("quadriga") :])
    elif "/" in program:
        check_command([Path(program).name, *rest])
    elif program == "sudo":
        check_command(rest)
    elif program in _CHECKS:
        _CHECKS[program](rest)
    else:
        assert program in _OTHERS, f"no program {program} is known"


@cache
def _parser() -> CommandLine:
    return build_parser()


def read_command(words: Sequence[str]) -> tuple[str, Config, Given] | None:
    """The command, its configuration and what of that was given; None for a help text.

    A file that does not exist stands for one of the reader's: then the defaults are beneath.

    Raises:
        QuadrigaError: there is no such command, option or key, or a value is wrong.
        SystemExit: an argument is missing, or is one too many.
    """
    known = [word.replace(_PLUGIN_KIND, _BUILT_IN) for word in words]
    check_words(known, _parser().list_options())
    if not known or known[-1] in ("--help", "--help-all", "--version"):
        return None
    arguments = _parser().parse_args(known)
    if arguments.config is not None and not arguments.config.is_file():
        arguments.config = None
    scenario = arguments.scenario
    if scenario is not None and scenario.endswith(".toml") and not Path(scenario).is_file():
        arguments.scenario = None
    if arguments.command == "campaign":
        _check_campaign(arguments.planners, arguments.seeds, arguments.sweep)
    config, given = read_config(arguments)
    return arguments.command, config, given


def _check_campaign(planners: Sequence[str], seeds: str | None, sweeps: Sequence[str]) -> None:
    for variant in parse_variants(planners, None) if planners else ():
        load(None, {**variant.keys, "identification.response": ""})
    if seeds is not None:
        parse_seeds("--seeds", seeds)
    for sweep in sweeps:
        parse_sweep(sweep)


def _check_quadriga(words: Sequence[str]) -> None:
    read_command(words)


def _check_make(words: Sequence[str]) -> None:
    makefile = (SOURCE / "Makefile").read_text(encoding="utf-8")
    targets = re.findall(r"^([a-z][\w/%.-]*):", makefile, re.MULTILINE)
    for word in words:
        name, equals, value = word.partition("=")
        if equals:
            assert name in ("ARGS", "PYTHON", "VENV"), word
            for target in set(words) & _WITH_ARGS.keys():
                read_command([*_WITH_ARGS[target], *shlex.split(value)])
        else:
            shapes = (re.escape(target).replace("%", ".+") for target in targets)
            assert any(re.fullmatch(shape, word) for shape in shapes), f"no target {word}"


def _check_python(words: Sequence[str]) -> None:
    if words[0] != "-m":
        return
    module = words[1]
    installed = any(_PLUGINS.glob(f"*/{module}"))  # by the page that types it
    assert module == "venv" or installed or find_spec(module) is not None, f"no module {module}"


_CHECKS: Final[Mapping[str, Callable[[Sequence[str]], None]]] = {
    "quadriga": _check_quadriga,
    "make": _check_make,
    "python": _check_python,
    "python3": _check_python,
}

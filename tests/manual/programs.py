"""Whether a command of the manual is one that there is, with options and names that it has."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from quadriga.commands import fault
from quadriga.commands.command import Given
from quadriga.commands.config_options import read_config
from quadriga.commands.mistakes import check_words
from quadriga.commands.parser import CommandLine, build_parser
from quadriga.experiments.published.catalogue import list_names
from quadriga.experiments.variants import parse_variants
from quadriga.faults.catalogue import ALL, select_faults
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import SOURCE
from quadriga.team import scenarios

# Of the system, or of packages that pages tell how to install.
_SYSTEM: Final = ". chown cp docker export grep head install ip journalctl ls podman scp ssh"
_MORE: Final = "git cmake dask pip podman-compose pytest systemctl true useradd wait"
_OTHERS: Final = frozenset((*_SYSTEM.split(), *_MORE.split()))
_AROUND: Final = frozenset(("docker", "podman", "podman-compose"))
_MAKEFILE: Final = (SOURCE / "Makefile").read_text(encoding="utf-8").replace("\\\n", " ")
_TARGETS: Final = re.findall(r"^([a-z][\w/%.-]*):", _MAKEFILE, re.MULTILINE)
_LEFT_OPEN: Final = re.compile(r"…|[\[\]|]|^[A-Z][A-Z_]*$")  # for the reader to fill in
_PLUGINS: Final = SOURCE / "tests" / "plugins"
_PLUGIN_KIND: Final = "balance"  # a planner that is installed only where a page is about it
_BUILT_IN: Final = "decentralised"  # what stands for it
# Folders of the checkout that pages name files of.
_FOLDERS: Final = "agents|benchmarks|bridges|deploy|docs|plant|quadriga|shared|sim_server|tests"
_PLACE: Final = re.compile(rf"(?:^|(?<=[\s=,:;'\"]))(?:{_FOLDERS})/[\w./@-]+|[\w-]+\.lock\b")
_EXTRA: Final = re.compile(r"\.\[(\w+)\]")
_BUILT: Final = "docs/_build"  # by `make docs`


def is_place(text: str) -> bool:
    """Whether a text is the name of a file or folder of the checkout, without a part left open."""
    return _PLACE.fullmatch(text) is not None and "/NAME" not in text


def check_places(text: str) -> None:
    """See that the files of the checkout and the extras of the package that a text names are there.

    Raises:
        AssertionError: one is not.
    """
    for place in _PLACE.findall(text):
        found = (SOURCE / place).exists() or place.startswith(_BUILT)
        assert found, f"no file {place} in the checkout"
    for extra in _EXTRA.findall(text):
        assert extra in (metadata("quadriga").get_all("Provides-Extra") or ()), f"no extra {extra}"


def check_command(words: Sequence[str]) -> None:
    """See that a command can be typed; of one around another, as `docker`, that other one.

    Raises:
        AssertionError: there is no such program, target or module.
        QuadrigaError: a command of this project does not have such options or values.
    """
    program, rest = Path(words[0]).name, words[1:]
    check_places(" ".join(words))
    if program == "sudo":
        check_command(rest)
    elif program in _AROUND:
        if "quadriga" in rest:
            check_command(rest[rest.index("quadriga") :])
    elif program == "quadriga":
        read_command(rest)
    elif program == "make":
        _check_make(rest)
    elif program in ("python", "python3"):
        _check_module(rest)
    else:
        assert program in _OTHERS, f"no program {program} is known"


def check_mention(words: Sequence[str]) -> None:
    """See that a command that prose mentions can be typed, what it leaves out being added.

    Raises:
        AssertionError: there is no such target, module or file.
        QuadrigaError: a command of this project does not have such options or values.
    """
    program, *rest = words
    if any(_LEFT_OPEN.search(word) for word in words):
        known = [word for word in rest if not _LEFT_OPEN.search(word)]
        if program == "quadriga":
            check_words(known, _parser().list_options())
        return
    with suppress(SystemExit):  # an argument that is needed is left out
        check_command(words)


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
    config, given = read_config(arguments)
    _check_names(arguments, config)
    return arguments.command, config, given


def _check_names(arguments: argparse.Namespace, config: Config) -> None:
    """See that the scenarios, variants, experiments and faults that a command names are there."""
    if arguments.command == "campaign":
        for name in arguments.scenarios:
            scenarios.path(name)
        planners = arguments.planners or ["none,distributed"]
        for variant in parse_variants(planners, arguments.variants):
            load(None, {**variant.keys, "identification.response": ""})
    elif arguments.command == "experiments":
        known = [name for name in arguments.names if not name.endswith(".toml")]
        assert {*known} <= {*list_names()}, f"an unknown one of {known}"
    elif arguments.command == "fault" and not (arguments.list or arguments.live):
        select_faults([ALL] if arguments.table else fault._names_of(arguments), config)


def _check_make(words: Sequence[str]) -> None:
    for word in words:
        name, equals, _ = word.partition("=")
        if equals:
            assert name in ("ARGS", "PYTHON", "VENV"), word
        else:
            shapes = (re.escape(target).replace("%", ".+") for target in _TARGETS)
            assert any(re.fullmatch(shape, word) for shape in shapes), f"no target {word}"


def _check_module(words: Sequence[str]) -> None:
    """Of a module that there is, or that the page which types it installs."""
    if words[0] == "-m" and not any(_PLUGINS.glob(f"*/{words[1]}")):
        assert find_spec(words[1]) is not None, f"no module {words[1]}"

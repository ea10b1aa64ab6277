"""Whether a command of the manual is one that there is, with options that it has."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from quadriga.commands.command import Given
from quadriga.commands.config_options import read_config
from quadriga.commands.mistakes import check_words
from quadriga.commands.parser import CommandLine, build_parser
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import SOURCE
from tests.manual.named import check_named, check_places

# Of the system, or of packages that pages tell how to install.
_SYSTEM: Final = ". chown cp docker export grep head install ip journalctl ls podman scp ssh"
_MORE: Final = "git cmake dask pip podman-compose pytest systemctl true useradd wait"
_OTHERS: Final = frozenset((*_SYSTEM.split(), *_MORE.split()))
_AROUND: Final = frozenset(("docker", "podman", "podman-compose"))
_IN_SERVICE: Final = frozenset(("exec", "run", "cp"))  # of `docker compose`
_MAKEFILE: Final = (SOURCE / "Makefile").read_text(encoding="utf-8").replace("\\\n", " ")
# A target's own command that is given ARGS.
_WITH_ARGS: Final = re.compile(r"\$\(BIN\)/((?:quadriga|python) .*)\$\(ARGS\)")
_LEFT_OPEN: Final = re.compile(r"…|[\[\]|]|^[A-Z][A-Z_]*$")  # for the reader to fill in
_PODMAN: Final = re.compile(r"quadriga_([a-z]\w*)_1\b")  # a container of `podman-compose`
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
    check_places(" ".join(words))
    if program in _AROUND:
        _check_container(rest)
    elif "/" in program:
        check_command([Path(program).name, *rest])
    elif program == "sudo":
        check_command(rest)
    elif program in _CHECKS:
        _CHECKS[program](rest)
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
    check_named(arguments, config)
    return arguments.command, config, given


def _check_quadriga(words: Sequence[str]) -> None:
    read_command(words)


def _check_make(words: Sequence[str]) -> None:
    targets = re.findall(r"^([a-z][\w/%.-]*):", _MAKEFILE, re.MULTILINE)
    for word in words:
        name, equals, value = word.partition("=")
        if equals:
            assert name in ("ARGS", "PYTHON", "VENV"), word
            for target in words if name == "ARGS" else ():
                if "=" not in target:
                    _check_arguments(target, shlex.split(value))
        else:
            shapes = (re.escape(target).replace("%", ".+") for target in targets)
            assert any(re.fullmatch(shape, word) for shape in shapes), f"no target {word}"


def _check_arguments(target: str, words: Sequence[str]) -> None:
    """See that a target takes ARGS, and that the command it gives them to takes these."""
    recipe = re.search(rf"^{re.escape(target)}:.*\n((?:\t.*\n)*)", _MAKEFILE, re.MULTILINE)
    own = _WITH_ARGS.search(recipe[1]) if recipe else None
    assert own is not None, f"no ARGS of {target}"
    check_command([*shlex.split(own[1]), *words])


def _check_python(words: Sequence[str]) -> None:
    """Of a module that there is; it need not be imported to see which options stand in it."""
    if words[0] != "-m":
        return
    module, *rest = words[1:]
    if module == "venv" or any(_PLUGINS.glob(f"*/{module}")):  # installed by the page that types it
        return
    spec = find_spec(module)
    if spec is not None and spec.submodule_search_locations is not None:
        spec = find_spec(f"{module}.__main__")
    assert spec is not None, f"no module {module}"
    if spec.origin is None or not Path(spec.origin).is_relative_to(SOURCE):
        return
    text = Path(spec.origin).read_text(encoding="utf-8")
    for option in (word.partition("=")[0] for word in rest if word.startswith("-")):
        assert f'"{option}"' in text, f"no option {option} of {module}"


def _check_container(words: Sequence[str]) -> None:
    """Of services that there are; what is typed behind one is given to its entry point."""
    for name in _PODMAN.findall(" ".join(words)):
        assert name in _services(), f"no service {name}"
    verb = next((place for place, word in enumerate(words) if word in _IN_SERVICE), None)
    if words[0] != "compose" or verb is None:
        return
    service, *rest = [word for word in words[verb + 1 :] if not word.startswith("--rm")]
    service = service.partition(":")[0]
    assert service in _services(), f"no service {service}"
    if words[verb] == "exec":
        check_command(rest)
    elif words[verb] == "run":
        check_command([*_services()[service], *rest])


@cache
def _services() -> Mapping[str, list[str]]:
    """The entry point of each service without its options: `quadriga`, or a command of it."""
    text = (SOURCE / "docker-compose.yml").read_text(encoding="utf-8")
    _, _, text = text.partition("\nservices:\n")
    parts = re.split(r"^  ([\w-]+):\n", text.partition("\nnetworks:")[0], flags=re.MULTILINE)
    found = {}
    for name, part in zip(parts[1::2], parts[2::2], strict=True):
        own = re.search(r"entrypoint: \[quadriga, (\w+)", part)
        found[name] = ["quadriga", own[1]] if own else ["quadriga"]
    return found


_CHECKS: Final[Mapping[str, Callable[[Sequence[str]], None]]] = {
    "quadriga": _check_quadriga,
    "make": _check_make,
    "python": _check_python,
    "python3": _check_python,
}

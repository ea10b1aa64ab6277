"""What a user typed that nothing is named like, and what was probably meant: pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Final

from quadriga.shared.errors import ConfigError, did_you_mean

_ALIKE: Final = 0.75  # of 1: what is less like a stray word is no hint


def check_words(words: Sequence[str], options: Mapping[str, Collection[str]]) -> None:
    """See that the command is one, and that it has the long options that are given.

    Whether each has the value that it needs is for the parser of the command to see.

    Args:
        words: as typed, without the program's name.
        options: by command its options, such as `--robots`.

    Raises:
        ConfigError: there is no such command or option; it tells the one that was likely meant.
    """
    if not words or words[0].startswith("-"):
        return
    command, *rest = words
    if command not in options:
        hint = did_you_mean(command, options) or "`quadriga --help` lists them"
        raise ConfigError("command", repr(command), "one that there is", hint)
    for word in rest:
        if word == "--":
            return
        option = word.partition("=")[0]
        if option.startswith("--") and option not in options[command]:
            every = "--help-all" if "--help-all" in options[command] else "--help"
            known = f"`quadriga {command} {every}` lists them"
            hint = did_you_mean(option, [name for name in options[command] if name[:2] == "--"])
            expected = "an option that it has"
            raise ConfigError(f"quadriga {command}", option, expected, hint or known)


def refuse_strays(
    command: str,
    strays: Sequence[str],
    places: Sequence[str],
    options: Collection[str],
    scenarios: Iterable[str],
) -> None:
    """Refuse words of a command line that its command has no place for.

    Args:
        command: its name.
        strays: the words that are left over.
        places: of words without an option, as the help shows them.
        options: the command's options.
        scenarios: names of what can be walked, which is easily typed without its option.

    Raises:
        ConfigError: there is such a word; it tells what was likely meant.
    """
    if not strays:
        return
    word = strays[0]
    expected = f"nothing but options and {' '.join(places)}" if places else "nothing but options"
    meant = {name.removeprefix("--"): name for name in options if name[:2] == "--"}
    if "--scenario" in options:
        meant |= {name: f"--scenario {name}" for name in scenarios}
    close = get_close_matches(word.lstrip("-"), list(meant), 1, _ALIKE)
    help_text = f"`quadriga {command} --help` tells what it takes"
    hint = f"did you mean {meant[close[0]]!r}?" if close else help_text
    raise ConfigError(f"quadriga {command}", repr(word), expected, hint)

"""What a user typed that nothing is named like, and what was probably meant: pure."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from quadriga.shared.errors import ConfigError, did_you_mean


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
            known = f"`quadriga {command} --help-all` lists them"
            hint = did_you_mean(option, [name for name in options[command] if name[:2] == "--"])
            expected = "an option that it has"
            raise ConfigError(f"quadriga {command}", option, expected, hint or known)

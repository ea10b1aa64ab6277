"""The error tree: every error a user can cause names the thing, what was got and expected."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Final

_LONGEST: Final = 500  # characters shown of a name, or of what was got
_ELSEWHERE: Final = "use another folder: --out for a run, XDG_CACHE_HOME for the cache"
_REMEDIES: Final = {
    errno.ENOSPC: f"free some room there, or {_ELSEWHERE}",
    errno.EDQUOT: f"free some room there, or {_ELSEWHERE}",
    errno.EROFS: _ELSEWHERE,
    errno.EACCES: f"give this user the right to, or {_ELSEWHERE}",
}


class QuadrigaError(Exception):
    """Base of every error that is shown to a user as one line, without a traceback.

    Args:
        name: the thing that is wrong (a configuration key, a file, a message field).
        got: what was found.
        expected: what would have been right.
        cause: the likely cause or the remedy; may be empty.
    """

    def __init__(self, name: str, got: str, expected: str, cause: str = "") -> None:
        self.name, self.got, self.expected, self.cause = name, got, expected, cause
        tail = f" ({cause})" if cause else ""
        super().__init__(f"{_cut(name)}: got {_cut(got)}, expected {expected}{tail}")

    def __reduce__(self) -> tuple[type[QuadrigaError], tuple[str, str, str, str]]:
        """So that a worker process can hand it on."""
        return type(self), (self.name, self.got, self.expected, self.cause)


class ConfigError(QuadrigaError):
    """A configuration key, a command-line argument or a TOML file is wrong."""


class MessageError(QuadrigaError):
    """Bytes from the wire are not a valid message of the type their key promises."""


class BusError(QuadrigaError):
    """The bus cannot be opened or a process that must be on it is absent."""


class PredictorError(QuadrigaError):
    """A predictor file is missing, foreign, or fails one of its gates."""


class PredictorFileError(PredictorError):
    """The file of a predictor, or of the data it is fitted to, is missing, foreign or damaged."""


class RecordingError(QuadrigaError):
    """A recording cannot be read or written."""


class MeshError(QuadrigaError):
    """The URDF of a robot, or a mesh file that it names, is missing or cannot be read."""


class BridgeError(QuadrigaError):
    """The way to a robot cannot be opened, or the robot does not let itself be commanded."""


class CheckError(QuadrigaError):
    """A robot is not as it must be before it is commanded."""


class ProcessError(QuadrigaError):
    """A process of the team failed, did not start, or has vanished while the team walked."""


def _cut(text: str) -> str:
    """A text that others wrote, as far as a reader will look."""
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}… ({len(text):,} characters)"


@contextmanager
def name_file_errors(
    kind: type[QuadrigaError], name: object, expected: str, cause: str = ""
) -> Iterator[None]:
    """Name the file that the system refuses within the block, in an error of this kind.

    Raises:
        QuadrigaError: of this kind; a file cannot be read or written, or its text is not UTF-8.
    """
    try:
        yield
    except (OSError, UnicodeDecodeError) as error:
        raise kind(str(name), system_reason(error), expected, cause or remedy(error)) from None


def system_reason(error: OSError | UnicodeDecodeError) -> str:
    """Why the system, or the decoding of its text, refuses a file."""
    if isinstance(error, UnicodeDecodeError):
        return "bytes that are not UTF-8"
    return error.strerror or str(error)


def remedy(error: OSError | UnicodeDecodeError) -> str:
    """What helps where the system lets nothing be written; "" of another refusal."""
    return _REMEDIES.get(error.errno or 0, "") if isinstance(error, OSError) else ""


def did_you_mean(got: object, known: Iterable[str]) -> str:
    """The known name that is like the one got, as a likely cause; "" if none is."""
    close = get_close_matches(str(got), list(known), 1)
    return f"did you mean {close[0]!r}?" if close else ""

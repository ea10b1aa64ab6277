"""The outcome of a check: how much it looked at, what breaks its rule, what is worth a note."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Protocol

from quadriga.shared.messages import Message

SHOWN: Final = 5  # objections that are kept one by one


@dataclass(frozen=True, slots=True)
class Objection:
    """One message that breaks a rule; a tick of −1 is none."""

    tick: int
    key: str
    got: str
    limit: str


@dataclass(slots=True)
class Finding:
    """The outcome of a check, growing while the recording is read.

    Attributes:
        name: the check's.
        of: what it looks at, in the plural.
        looked: how many of them.
        objections: how many break the rule.
        first: the first of those.
        notes: what is worth knowing though no rule is broken.
        count: text in place of how many of them break the rule.
    """

    name: str
    of: str
    looked: int = 0
    objections: int = 0
    first: list[Objection] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    count: str = ""

    @property
    def passed(self) -> bool:
        """Whether nothing breaks the rule."""
        return not self.objections

    @property
    def text(self) -> str:
        """How much it looked at, and how much of that breaks the rule."""
        if self.count:
            return self.count
        some = "" if self.passed else f"{self.objections:,} of "
        return f"{some}{self.looked:,} {self.of}"

    def add_objection(self, tick: int, key: str, got: str, limit: str, count: int = 1) -> None:
        """Count something that breaks the rule."""
        self.objections += count
        if len(self.first) < SHOWN:
            self.first.append(Objection(tick, key, got, limit))


@dataclass(frozen=True, slots=True)
class CheckedMessage:
    """A decoded message of a recording: its key, the robot in it or "", its topic's name."""

    key: str
    robot: str
    topic: str
    message: Message


class Check(Protocol):
    """Looks at one message after the other, then at what they were together."""

    finding: Finding

    def look(self, item: CheckedMessage) -> None:
        """Take in one message, in the order of the file."""
        ...

    def finish(self) -> None:
        """The recording is over."""
        ...

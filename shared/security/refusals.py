"""What a router has refused, whom and why, from the lines of Zenoh's log.

Zenoh tells its verdict on a message and, in the next line of the same thread, that it has dropped
it. Verdicts alone are no refusal: most say what is permitted, or what would be refused. They name
the session of a sender; the common name of its certificate comes from the link.

A message to somebody who has just left is dropped too, without a verdict. That is no refusal, and
must not be told of the message before: sizes are limited only as messages come in, so what is
permitted to go out is never too large, nor is a query or a reply that has been passed on. (Zenoh
would tell that of puts too, in one more line for each: without it a put whose first receiver has
just left is told as large.)
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from typing import Final, NamedTuple

DENIED: Final = "denied"  # no rule permits it
REVOKED: Final = "revoked"  # nothing is permitted to its certificate any more
LARGE: Final = "large"  # larger than permitted
OFTEN: Final = "often"  # sooner after the last than permitted
EXPIRED: Final = "expired"  # its certificate has, and its link was closed
UNTRUSTED: Final = "untrusted"  # its certificate, or the lack of one, was not accepted
FULL: Final = "full"  # there are as many sessions as permitted
REASONS: Final = (DENIED, REVOKED, LARGE, OFTEN, EXPIRED, UNTRUSTED, FULL)

# What must be logged so that refusals can be told from it.
LEVELS: Final = (
    "error,zenoh::net::routing::interceptor=trace,zenoh::net::routing::dispatcher::queries=trace,"
    "zenoh_transport::unicast::manager=trace,zenoh_link_tls=debug,zenoh_link_commons=warn"
)
_DROPPED: Final = "Msg intercepted!"
_PASSED_ON: Final = "::dispatcher::queries"  # in lines of a query or a reply that has come in
_NO_SESSION: Final = "Denying new transport"
_NO_LINK: Final = ". Hint: increase the system open file limit"  # of whatever failed
_ACCEPTS: Final = "Accepted TLS connection"
_EXPIRES: Final = "remote certificate chain expired"
# Of the lines that tell a refusal, or whose a link is.
MARKERS: Final = (_DROPPED, _NO_SESSION, _NO_LINK, _ACCEPTS, _EXPIRES)
SOMEBODY: Final = "somebody"  # whose certificate was not accepted, so that it has no name
CONNECT: Final = "connect"
_STAY: Final = "stay connected"
_LONGEST: Final = 1000  # characters of a line that are read: a key may have 65,000
_MOST_LINKS: Final = 1000  # whose are remembered: more than a router has at a time

_COLOUR: Final = re.compile(r"\x1b\[[0-9;]*m")
_THREAD: Final = re.compile(r"ThreadId\((\d+)\)")
_VERDICT: Final = re.compile(
    r"\b(?P<session>[0-9a-f]{1,32})(?: on \S+)? is (?P<un>un)?authorized to "
    r"(?P<action>[A-Za-z/ ]+?) \((?P<flow>in|e)gress\) on (?P<key>\S+)"
)
_OFTEN: Final = re.compile(
    r"dropped by the downsampling interceptor: \w+\((?P<key>[^()\s]+)\).* "
    r"from:\S*?/(?P<session>[0-9a-f]+)"
)
_ACCEPTED: Final = re.compile(
    _ACCEPTS + r" on \S+: (?P<address>\S+)\. .*Common Name: (?P<name>.+?)\.?$"
)
_CLOSED: Final = re.compile(r"=> (?:tls/)?(?P<address>\S+?) : " + re.escape(_EXPIRES))
_UNACCEPTED: Final = re.compile(r"zenoh_link_tls\S*: (?P<why>.*)" + re.escape(_NO_LINK))
_MOMENT: Final = re.compile(r"[:(]?\s*verification time.*")  # and what follows differs each time


class Refused(NamedTuple):
    """One kind of refusal.

    Attributes:
        who: session of the sender or its beginning, or the common name of its certificate.
        action: what it did.
        key: on which key; "" of a connection.
        reason: one of the words above.
    """

    who: str
    action: str
    key: str
    reason: str


class RefusalParser:
    """Turns lines of the log into refusals; lines of several threads may be mixed."""

    def __init__(self) -> None:
        self._verdicts: dict[str, Refused] = {}  # the last of each thread
        self._accepted = SOMEBODY  # whose link was accepted last
        self._links: dict[str, str] = {}  # whose they are, by the other side's address

    def take(self, lines: Iterable[str]) -> Counter[Refused]:
        """The refusals that these lines tell, with how often."""
        found: Counter[Refused] = Counter()
        for line in lines:
            refused = self._take(_COLOUR.sub("", line[:_LONGEST]))
            if refused is not None:
                found[refused] += 1
        return found

    def _take(self, line: str) -> Refused | None:
        if "::interceptor" in line:
            return self._take_message(line)
        if _PASSED_ON in line:
            self._verdicts.pop(_thread_of(line), None)
            return None
        accepted = _ACCEPTED.search(line)
        if accepted:
            self._note_link(accepted["address"], accepted["name"])
        elif _NO_SESSION in line:
            return Refused(self._accepted, CONNECT, "", FULL)
        elif closed := _CLOSED.search(line):
            return Refused(self._links.get(closed["address"], SOMEBODY), _STAY, "", EXPIRED)
        elif unaccepted := _UNACCEPTED.search(line):
            why = _MOMENT.sub("", unaccepted["why"])
            return Refused(SOMEBODY, f"{CONNECT}: {why}", "", UNTRUSTED)
        return None

    def _note_link(self, address: str, name: str) -> None:
        self._accepted = name
        self._links.pop(address, None)
        self._links[address] = name
        if len(self._links) > _MOST_LINKS:
            del self._links[next(iter(self._links))]

    def _take_message(self, line: str) -> Refused | None:
        at = _thread_of(line)
        if _DROPPED in line:
            return self._verdicts.pop(at, None)
        if verdict := _VERDICT.search(line):
            self._verdicts.pop(at, None)
            if verdict["un"] or verdict["flow"] == "in":
                self._verdicts[at] = _of_verdict(verdict)
        elif often := _OFTEN.search(line):
            self._verdicts[at] = Refused(often["session"], "put", often["key"], OFTEN)
        return None


def _thread_of(line: str) -> str:
    thread = _THREAD.search(line)
    return thread[1] if thread else ""


def _of_verdict(verdict: re.Match[str]) -> Refused:
    """What has been refused if the message is dropped: who may send it, sent too much of it."""
    reason = DENIED if verdict["un"] else LARGE
    action = verdict["action"].lower() if verdict["flow"] == "in" else "hear"
    return Refused(verdict["session"], action, verdict["key"], reason)

"""What a router has refused, as the reason why a process is not there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from quadriga.shared.bus.diagnosis import BAD, NOTE, Diagnosis
from quadriga.shared.security.past_refusals import PastRefusal, refusals_of
from quadriga.shared.security.refusals import DENIED as NOT_PERMITTED
from quadriga.shared.security.refusals import EXPIRED as HAS_EXPIRED
from quadriga.shared.security.refusals import FULL as NO_SESSION
from quadriga.shared.security.refusals import REVOKED as IS_REVOKED
from quadriga.shared.security.refusals import UNTRUSTED as NOT_ACCEPTED

REVOKED: Final = "revoked"
EXPIRED: Final = "expired"
DENIED: Final = "denied"
LIMITED: Final = "limited"
FULL: Final = "full"
NOT_TRUSTED: Final = "not-trusted"
ROUTER_SILENT: Final = "router-silent"

_RECENT: Final = 10.0  # s; what was refused to one who is there and is longer ago is over
_SHOWN: Final = 3  # keys that are named
_OF_ITSELF: Final = (IS_REVOKED, HAS_EXPIRED, NO_SESSION)
_CERTS: Final = "`quadriga certs show`, where they were made, tells which"


def diagnose_refusals(
    name: str, past: Sequence[PastRefusal] | None, *, here: bool
) -> Iterator[Diagnosis]:
    """What a router has refused a process.

    Args:
        name: of the process.
        past: what was refused to anybody, the newest last; None: the router does not say.
        here: whether the process is there: then only what is recent is wrong.
    """
    own = refusals_of(name, past or ())
    newest = {each.refused.reason: each for each in own}
    for reason, (code, what, remedy) in _WORDS.items():
        if reason in newest:
            last = newest[reason]
            text = f"{what.format(who=last.refused.who)} ({_tell_age(last)})"
            yield Diagnosis(code, _judge(last, here), text, remedy.format(name=name))
    told = [each for each in own if each.refused.reason not in _OF_ITSELF]
    for code, others in (
        (DENIED, [each for each in told if each.refused.reason == NOT_PERMITTED]),
        (LIMITED, [each for each in told if each.refused.reason != NOT_PERMITTED]),
    ):
        if others:
            yield _describe_keys(code, others, here)


def diagnose_router(past: Sequence[PastRefusal] | None, *, complete: bool) -> Iterator[Diagnosis]:
    """What a router has refused to who has no name, or that it says nothing at all.

    Args:
        past: what was refused, the newest last; None: a router that ought to says nothing.
        complete: whether all processes of the team are there: then it was a stranger.
    """
    if past is None:
        text = "the router does not answer this process, although they are linked"
        cause = f"the certificate here is revoked ({_CERTS}), or the router is frozen"
        yield Diagnosis(ROUTER_SILENT, BAD, text, cause)
        return
    for each in past:
        if each.refused.reason == NOT_ACCEPTED:
            why = each.refused.action.partition(": ")[2]
            text = f"the router has not let in somebody: {why} ({_tell_age(each)})"
            cause = f"a certificate that has expired, is of another authority or missing: {_CERTS}"
            yield Diagnosis(NOT_TRUSTED, NOTE if complete else BAD, text, cause)


def _describe_keys(code: str, found: Sequence[PastRefusal], here: bool) -> Diagnosis:
    last = found[-1]
    named = [f"{each.refused.action} {each.refused.key}" for each in found[-_SHOWN:]]
    more = len(found) - len(named)
    keys = ", ".join(named) + (f" and {more} more" if more else "")
    if code == DENIED:
        cause = "not its own key: has the router another team.name or team.robots? docs/security.md"
        return Diagnosis(code, _judge(last, here), f"denied {keys} ({_tell_age(last)})", cause)
    cause = "larger or more often than any message of this key"
    return Diagnosis(code, NOTE, f"too much: {keys} ({_tell_age(last)})", cause)


def _judge(last: PastRefusal, here: bool) -> str:
    return NOTE if here and last.age > _RECENT else BAD


def _tell_age(last: PastRefusal) -> str:
    times = "once" if last.times == 1 else f"{last.times} times, last"
    return f"{times} {last.age:.0f} s ago"


_RENEW: Final = "`quadriga certs renew {name}`, and copy its folder to its machine"
_WORDS: Final = {
    IS_REVOKED: (REVOKED, "its certificate {who} is revoked", _RENEW),
    HAS_EXPIRED: (EXPIRED, "its certificate {who} has expired, and its link was closed", _RENEW),
    NO_SESSION: (
        FULL,
        "the router had no session left for {who}",
        "who takes them all? the router's log names them; `quadriga certs revoke` keeps them out",
    ),
}

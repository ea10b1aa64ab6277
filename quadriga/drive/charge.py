"""Who drives the team: one rule, as a function of what drivers do and when.

Nobody drives until somebody takes the controls, by an act of its own. While who has them is heard,
nobody else can take them. A driver who is silent for 300 ms, who gives the controls back, or whose
dead man's switch is not held has the team stand; after silence the controls must be taken again.
Times are ms of any steady clock.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from quadriga.drive.wish import Wish
from quadriga.shared.runtime.record import record

SILENT_MS: Final = 300
NOBODY_DRIVES: Final = "nobody drives"


@record
class InCharge:
    """Who is in charge, and what it asks for.

    Attributes:
        driver: its name; "" if there is none.
        heard: when it was heard last.
        wish: what it asks for; None: nothing yet.
        held: whether its dead man's switch is held.
        ended: why the last driver drives no more; "" if there was none.
    """

    driver: str = ""
    heard: int = 0
    wish: Wish | None = None
    held: bool = False
    ended: str = ""


def take(charge: InCharge, driver: str, now: int) -> InCharge:
    """Have `driver` take the controls, unless somebody has them who is heard."""
    if charge.driver not in ("", driver) and now - charge.heard <= SILENT_MS:
        return charge
    return InCharge(driver, now)


def hear(charge: InCharge, driver: str, wish: Wish, now: int, *, held: bool) -> InCharge:
    """Note what a driver asks for; of nobody but who has the controls it counts."""
    if driver != charge.driver:
        return charge
    return replace(charge, heard=now, wish=wish, held=held)


def release(charge: InCharge, driver: str) -> InCharge:
    """Have `driver` give the controls back, if it has them."""
    return InCharge(ended=f"{driver} gave the controls back") if driver == charge.driver else charge


def leave(charge: InCharge, driver: str) -> InCharge:
    """Note that `driver` is gone: its page is closed, or its program has ended."""
    return InCharge(ended=f"{driver} is gone") if driver == charge.driver else charge


def lapse(charge: InCharge, now: int) -> InCharge:
    """Note that time passes: who has been silent for too long has the controls no more."""
    if not charge.driver or now - charge.heard <= SILENT_MS:
        return charge
    return InCharge(ended=f"{charge.driver} is silent")


def why_stand(charge: InCharge) -> str:
    """Why the team has to stand; "" while somebody drives it."""
    if not charge.driver:
        return charge.ended or NOBODY_DRIVES
    if charge.wish is None or not charge.held:
        return f"{charge.driver} does not hold on"
    return ""

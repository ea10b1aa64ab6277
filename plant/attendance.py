"""Who is there, in real time: whoever leaves, falls silent or is back is announced."""

from __future__ import annotations

from collections.abc import Collection

from quadriga.plant.server import PlantServer
from quadriga.shared import codes
from quadriga.shared.bus.session import HERE
from quadriga.shared.members import OPERATOR


def note_absences(server: PlantServer) -> None:
    """Announce whose commands are lost since the last look, and who answers again.

    A robot is silent once its motors would be damped, or have been held for as long: commands that
    always come late move nobody. References last for most of a second: so that nobody walks on by
    them without an operator, agents are told at once that there is none.
    """
    world, tick = server.config.world, server.plant.tick
    present = server.bus.members_at(HERE)
    if server.time.drives:
        _note_operator(server, present)
    for name in server.plant.names:
        age, late_ms = tick - server.commands.tick_of(name), server.late_ms.get(name, 0)
        if name not in server.silent:
            if name not in present:
                _announce_loss(server, name, codes.GONE, "gone")
            elif age > world.command_damp_ms:
                _announce_loss(server, name, codes.SILENT, f"silent for {age} ms")
            elif late_ms > world.command_damp_ms:
                why = f"late for {late_ms} ms: its joints are held"
                _announce_loss(server, name, codes.SILENT, why)
        elif name in present and age <= world.command_hold_ms and not late_ms:
            server.silent.discard(name)
            server.announce(codes.BACK, name, "answers again")


def _note_operator(server: PlantServer, present: Collection[str]) -> None:
    gone = OPERATOR not in present
    if gone == server.operator_gone:
        return
    server.operator_gone = gone
    if gone:
        server.announce(codes.OPERATOR_GONE, "", "operator gone: no reference counts any more")
    else:
        server.announce(codes.OPERATOR_BACK, "", "the operator is there again")


def _announce_loss(server: PlantServer, name: str, code: str, why: str) -> None:
    server.silent.add(name)
    server.announce(code, name, server.explain_silence(name, why))

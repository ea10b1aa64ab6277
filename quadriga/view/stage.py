"""SHELL: scene and panels together, each brought up to date as often as it is worth."""

from __future__ import annotations

from typing import Final

import viser

from quadriga.pictures.meshes import link_meshes
from quadriga.view.compose import compose
from quadriga.view.curves import CurveWindow
from quadriga.view.panels import Panels
from quadriga.view.picture import Picture
from quadriga.view.snapshot import Snapshot
from quadriga.view.team_shape import TeamShape
from quadriga.view.viser_scene import TeamScene

FRAME_S: Final = 1.0 / 30.0  # between two pictures
_PANEL_S: Final = 0.25  # between two changes of words and curves
_CALM: Final = ("", "walk")


class TeamStage:
    """A team on show.

    Attributes:
        shape: of the team.
        panels: beside the scene.
        curves: of the last seconds.
    """

    def __init__(self, server: viser.ViserServer, shape: TeamShape) -> None:
        """Show the team at its place.

        Raises:
            MeshError: the meshes of the robots are missing.
        """
        self._server, self.shape = server, shape
        self._scene = TeamScene(server, shape, link_meshes(shape.config.robot.urdf_path()))
        self.panels = Panels(server, shape, self._scene)
        self.curves = CurveWindow(shape.count)
        self._panels_due = 0.0
        self._drawn = -1  # tick of the picture that is shown

    @property
    def has_audience(self) -> bool:
        """Whether anybody looks; else nothing need be drawn."""
        return bool(self._server.get_clients())

    def show(self, snapshot: Snapshot, state: str, now: float) -> bool:
        """Draw a snapshot; True if words and curves were brought up to date, too.

        Args:
            snapshot: what to show.
            state: what the heading says of it.
            now: s of a clock that never goes back.
        """
        is_due = now >= self._panels_due
        if snapshot.tick == self._drawn and not is_due:
            return False
        picture = compose(self.shape, snapshot)
        self._scene.show(picture)
        self.curves.add(picture)
        self._drawn = snapshot.tick
        if not is_due:
            return False
        self._panels_due = now + _PANEL_S
        self._scene.name_robots([_label_of(picture, i) for i in range(self.shape.count)])
        self.panels.show(picture, self.curves, state)
        return True


def _label_of(picture: Picture, index: int) -> str:
    """What stands over a robot: its name, and what is unusual about it."""
    name, account = picture.robots[index], picture.accounts[index]
    if not picture.known[index]:
        return f"{name}: not heard"
    return name if account.mode in _CALM else f"{name}: {account.reason or account.mode}"

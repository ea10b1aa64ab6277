"""SHELL: scene and panels together, each brought up to date as often as it is worth."""

from __future__ import annotations

from typing import Final

import viser

from quadriga.pictures.meshes import link_meshes
from quadriga.view import words
from quadriga.view.compose import compose
from quadriga.view.curves import CurveWindow
from quadriga.view.panels import Panels
from quadriga.view.picture import Picture, RobotAccount
from quadriga.view.readings import read_accounts, read_outputs
from quadriga.view.snapshot import Snapshot
from quadriga.view.team_shape import TeamShape
from quadriga.view.viser_scene import ViewScene

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
        self._scene = ViewScene(server, shape, link_meshes(shape.config.robot.urdf_path()))
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
        if self.curves.is_due(snapshot.tick):
            self.curves.add(snapshot.tick, read_outputs(self.shape, snapshot))
        self._drawn = snapshot.tick
        if is_due:
            self._panels_due = now + _PANEL_S
            self._show_words(picture, snapshot, state)
        return is_due

    def _show_words(self, picture: Picture, snapshot: Snapshot, state: str) -> None:
        accounts = read_accounts(self.shape, snapshot)
        known = picture.known.tolist()
        self._scene.name_robots(list(map(label_of, self.shape.robots, accounts, known)))
        self.panels.show_words(
            words.format_heading(self.shape, picture, snapshot.reference, state),
            words.format_robots(self.shape.robots, accounts, known),
        )
        self.panels.show_curves(self.curves)
        self.panels.heed_boxes()


def label_of(name: str, account: RobotAccount, known: bool) -> str:
    """What stands over a robot: its name, and what is unusual about it."""
    if not known:
        return f"{name}: not heard"
    return name if account.mode in _CALM else f"{name}: {account.reason or account.mode}"

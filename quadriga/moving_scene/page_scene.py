"""SHELL: the scene of a run's page, from its recording."""

from __future__ import annotations

from contextlib import suppress

from quadriga.moving_scene.scene import build_scene
from quadriga.moving_scene.spans import choose_spans
from quadriga.pictures.meshes import link_meshes
from quadriga.report.run import ReportedRun
from quadriga.shared.errors import ConfigError, MeshError, RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.view.recorded import RecordedRun


def scene_of(run: ReportedRun) -> str:
    """The scene as JSON; "" of a recording that tells neither places nor shapes of robots."""
    with suppress(RecordingError, ConfigError, MeshError):
        recorded = RecordedRun(Recording(run.path))
        config = recorded.shape.config
        stride_ms = 2 * config.gait.stance_ms
        spans = choose_spans(run.timeline, recorded.first, recorded.last, stride_ms)
        return build_scene(recorded, spans, link_meshes(config.robot.urdf_path()))
    return ""

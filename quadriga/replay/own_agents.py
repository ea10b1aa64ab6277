"""Only the project's own agents are pure functions of what they received."""

from __future__ import annotations

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording


def require_own_agents(recording: Recording, config: Config) -> None:
    """Refuse to compute the controller of a user's own again.

    Raises:
        RecordingError: the recorded team walked with one.
    """
    if config.team.agent_command:
        raise RecordingError(
            str(recording.path),
            f"commands of the controller {config.team.agent_command!r}",
            "commands of the project's own agents",
            "a controller of one's own cannot be recomputed; the world can: `replay --world`",
        )

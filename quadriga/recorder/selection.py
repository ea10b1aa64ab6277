"""What of a team's traffic is recorded, and how, as a user asks for it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

from quadriga.recorder.parts import Limits
from quadriga.recordings.key_patterns import key_patterns
from quadriga.shared.config.sections import TeamConfig
from quadriga.shared.members import PLANNER, plant_name
from quadriga.shared.recording.quota import LONGEST_KEY, MAX_FOREIGN_KEYS
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import TABLE


@dataclass(frozen=True, slots=True)
class Selection:
    """What is recorded, and how.

    Attributes:
        topics: patterns of the keys that are recorded, see `quadriga.recordings.key_patterns`;
            empty: all that the table of topics has recorded.
        exclude: patterns of keys that are not.
        limits: when a new file is begun.
        at_once: begin with whoever is there, without waiting for a team.
    """

    topics: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    limits: Limits = field(default_factory=Limits)
    at_once: bool = False

    def metadata(self) -> dict[str, str]:
        """What the metadata say of a recording that is not of everything."""
        patterns = {"topics": self.topics, "exclude": self.exclude}
        return {name: json.dumps(texts) for name, texts in patterns.items() if texts}


def own_keys(team: str) -> frozenset[str]:
    """Every key of a team of any size: who records it may not have its configuration."""
    most = TeamConfig.__dataclass_fields__["robots"].metadata["high"]
    robots = robot_names(most)
    names = (*robots, *map(plant_name, ("", *robots)), PLANNER)
    return frozenset(
        topic.key(team, name) for topic in TABLE for name in (names if topic.per_robot else ("",))
    )


class KeyFilter:
    """Which keys are recorded.

    Attributes:
        expression: what to subscribe to.
        own: the team's keys.
        all: whether nothing is left out.
    """

    def __init__(self, team: str, selection: Selection) -> None:
        """Raises ConfigError if a pattern cannot be that of a key."""
        self._topics = key_patterns(selection.topics, team, "--topics")
        unasked = () if selection.topics else tuple(t.name for t in TABLE if not t.recorded)
        self._exclude = key_patterns((*selection.exclude, *unasked), team, "--exclude")
        alone = self._topics[0].expression if len(self._topics) == 1 else ""
        self.expression = alone or f"{team}/**"  # two subscriptions would hear a message twice
        self.all = not (self._topics or self._exclude)
        self.own = own_keys(team)
        self._known = {key: self._matches(key) for key in self.own}

    def __call__(self, key: str) -> bool:
        """Whether a key is recorded."""
        known = self._known.get(key)
        if known is None:
            known = self._matches(key)
            if len(self._known) < MAX_FOREIGN_KEYS and len(key) <= LONGEST_KEY:
                self._known[key] = known
        return known

    def _matches(self, key: str) -> bool:
        asked = not self._topics or any(p.matches(key) for p in self._topics)
        return asked and not any(p.matches(key) for p in self._exclude)

"""Responses are measured anew when something changes that they depend on, and only then."""

from __future__ import annotations

from dataclasses import fields

import pytest

from quadriga.experiments.probe.cache import response_key
from quadriga.shared.config.sections import Config
from tests.quadriga.identification.test_cache import ALL, changed

WHOLE = ("sensors", "estimator", "gait", "controller", "world", "reference", "team", "motors")
NOT = {*("team.name", "team.plant", "team.plant_per_robot", "world.scenario", "world.mode")}
PLANNED = {"planner.interface", "planner.N", "planner.applied"}
OTHERS = ("bridge", "bus", "identification", "plant", "recorder", "runtime", "planner")


@pytest.mark.parametrize("section", [item.name for item in fields(Config)])
def test_the_key_changes_with_what_responses_depend_on_and_with_that_alone(section: str) -> None:
    before = response_key(Config())
    assert response_key(Config()) == before
    for name in ALL:
        if name.partition(".")[0] != section:
            continue
        depends = name in PLANNED or (section not in OTHERS and name not in NOT)
        assert (response_key(changed(Config(), name)) != before) == depends, name


def test_every_section_has_its_place() -> None:
    """A new section counts unless it is named here as one that does not."""
    assert {item.name for item in fields(Config)} == {*WHOLE, *OTHERS}

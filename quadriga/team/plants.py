"""The kinds of plant: the simulated world, and what installed packages add by an entry point."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Final

from quadriga.shared.config.sections import BRIDGED, SIMULATED, Config
from quadriga.shared.errors import ConfigError, did_you_mean

if TYPE_CHECKING:
    from quadriga.plant.process import PlantFactory

GROUP: Final = "quadriga.plants"  # of the entry points; each is a `PlantFactory`


def plant_kinds() -> tuple[str, ...]:
    """What `team.plant` may be, the simulated world first."""
    own = (SIMULATED, BRIDGED)
    return (*own, *sorted(entry_points(group=GROUP).names.difference(own)))


def check_plant(config: Config) -> None:
    """Refuse a kind of plant that cannot be imported; the project's own kinds always can be.

    Raises:
        ConfigError: there is no such kind, or its package cannot be imported.
    """
    if config.team.plant not in (SIMULATED, BRIDGED):
        plant_factory(config)


def plant_factory(config: Config) -> PlantFactory:
    """What builds the plant that a configuration asks for.

    Raises:
        ConfigError: there is no such kind, or its package cannot be imported.
    """
    kind = config.team.plant
    if kind == SIMULATED:
        from quadriga.sim_server.world.world import World

        return World
    if kind == BRIDGED:
        from quadriga.bridges.plant import build_bridge

        return build_bridge
    found = entry_points(group=GROUP, name=kind)
    if not found:
        kinds = plant_kinds()
        hint = did_you_mean(kind, kinds) or "is the package that adds it installed here?"
        raise ConfigError("team.plant", repr(kind), f"one of {', '.join(kinds)}", hint)
    point = next(iter(found))
    try:
        factory: PlantFactory = point.load()
    except (ImportError, AttributeError) as error:
        raise ConfigError("team.plant", f"{kind!r}: {error}", f"what {point.value} names") from None
    return factory

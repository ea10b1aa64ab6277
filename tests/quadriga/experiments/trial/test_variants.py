"""Names of what can be compared: every set of keys is one the configuration takes."""

from __future__ import annotations

import pytest

from quadriga.agents.predictor.fits import FITS
from quadriga.experiments.trial.trials import NO_PREDICTOR, Choice, Trial, config_of, trials
from quadriga.experiments.trial.variants import (
    CONFIGURED,
    PLANNERS,
    PREDICTORS,
    SCENARIOS,
    chosen,
    named_as,
    seeds_of,
    with_keys,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

DEFAULT = Config()


@pytest.mark.parametrize("variants", [PLANNERS, PREDICTORS, SCENARIOS])
def test_every_set_builds_a_configuration_of_its_own(
    variants: dict[str, dict[str, object]],
) -> None:
    built = {name: with_keys(DEFAULT, keys) for name, keys in variants.items()}
    for name, config in built.items():
        for key, value in variants[name].items():
            section, _, field = key.partition(".")
            assert getattr(getattr(config, section), field) == value
    own = [config for name, config in built.items() if name != CONFIGURED]
    assert len(set(own)) == len(own)


def test_every_fit_there_is_can_be_compared() -> None:
    assert set(FITS) < set(PREDICTORS)


def test_the_default_has_a_name_and_anything_else_is_the_configured_one() -> None:
    assert named_as(DEFAULT, PLANNERS) == "distributed"
    assert named_as(DEFAULT, PREDICTORS) == "ridge"
    other = with_keys(DEFAULT, {"planner.kind": "distributed", "planner.damping": 0.25})
    assert named_as(other, PLANNERS) == CONFIGURED
    assert with_keys(other, PLANNERS[CONFIGURED]) == other


def test_an_unknown_key_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"planner.dampin"):
        with_keys(DEFAULT, {"planner.dampin": 0.5})


def test_planners_are_compared_with_one_predictor_and_predictors_with_one_planner() -> None:
    choice = Choice(("none", "damped"), ("ridge", "arx"), ("flat", "boxes"), (4, 7))
    found = trials(DEFAULT, choice)
    assert len(found) == len(set(found)) == 4 * 4
    assert found[:4] == [
        Trial("none", NO_PREDICTOR, "flat", 4),
        Trial("damped", "ridge", "flat", 4),
        Trial("distributed", "ridge", "flat", 4),
        Trial("distributed", "arx", "flat", 4),
    ]
    whole = trials(DEFAULT, Choice(("none", "damped"), ("ridge", "arx"), ("flat",), (0,), True))
    assert [(t.planner, t.predictor) for t in whole] == [
        ("none", NO_PREDICTOR),
        ("damped", "ridge"),
        ("damped", "arx"),
    ]


def test_a_trial_is_walked_in_its_world_with_its_planner() -> None:
    config = config_of(DEFAULT, Trial("exchanged", "plain", "boxes", 9))
    assert (config.world.seed, config.world.terrain, config.world.payload) == (9, "boxes", 4.5)
    assert (config.planner.kind, config.planner.exchanges) == ("distributed", 2)
    assert config.identification.block_weight == 1.0
    assert config.identification.max_radius > 1.0
    assert config.world.seconds == DEFAULT.world.seconds


def test_names_are_read_in_their_order_and_once() -> None:
    assert chosen("--planners", " damped,none,damped", PLANNERS) == ("damped", "none")
    for names in ("damped,nonsense", "", ",", "?"):
        with pytest.raises(ConfigError, match=r"--planners.*decentralised"):
            chosen("--planners", names, PLANNERS)


@pytest.mark.parametrize(
    ("span", "seeds"), [("0:3", (0, 1, 2)), ("7", (7,)), ("5,1, 0:2", (5, 1, 0)), ("3,3", (3,))]
)
def test_seeds_are_read(span: str, seeds: tuple[int, ...]) -> None:
    assert seeds_of("--seeds", span) == seeds


@pytest.mark.parametrize("span", ["", "a", "3:1", "2:2", "-1", "1:", ":3", "1:2:3", "0.5", "1,,2"])
def test_what_are_no_seeds_is_refused(span: str) -> None:
    with pytest.raises(ConfigError, match="--seeds"):
        seeds_of("--seeds", span)

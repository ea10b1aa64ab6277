import numpy as np
import pytest

from quadriga.shared.config.sections import Config
from quadriga.sim_server.world.payload import build_loads
from quadriga.sim_server.world.team_model import build_team_model
from tests.sim_server.standing import configured


def masses(config: Config) -> list[float]:
    return [load.mass for load in build_loads(config)]


def test_a_load_is_shared_carried_by_one_or_by_some_with_shares_of_their_own() -> None:
    assert masses(configured(4, payload=10.0)) == [2.5] * 4
    assert masses(configured(3, payload=9.0, payload_on="r2")) == [0.0, 9.0, 0.0]
    assert masses(configured(3, payload=9.0, payload_on="r2, r3")) == [0.0, 4.5, 4.5]
    assert masses(configured(3, payload=10.0, payload_on="r1:6,r3:4")) == [6.0, 0.0, 4.0]
    swept = masses(configured(3, payload=20.0, payload_on="r1:6,r3:4"))
    assert swept == pytest.approx([12.0, 0.0, 8.0])


def test_a_load_lies_somewhere_else_with_another_seed() -> None:
    places = np.array(
        [
            [
                load.offset
                for load in build_loads(configured(2, payload=1.0, payload_scatter=0.05, seed=s))
            ]
            for s in range(50)
        ]
    )
    assert np.abs(places).max() <= 0.05
    assert places.std(axis=0).min() > 0.02
    assert not np.allclose(places[:, 0], places[:, 1])
    assert build_loads(configured(2, payload=1.0, seed=3))[0].offset == (0.0, 0.0)


def test_who_else_carries_something_does_not_move_a_load() -> None:
    all_of_them = build_loads(configured(5, payload=9.0, payload_scatter=0.05, seed=4))
    alone = build_loads(configured(2, payload=9.0, payload_scatter=0.05, seed=4, payload_on="r2"))
    assert alone[1].offset == all_of_them[1].offset


def test_the_world_has_the_load_where_it_is_said_to_be() -> None:
    config = configured(2, payload=9.0, payload_on="r2", payload_scatter=0.1, seed=3)
    model, load = build_team_model(config).model, build_loads(config)[1]
    assert model.body("r2/payload").mass == pytest.approx([9.0])
    np.testing.assert_allclose(model.body("r2/payload").pos[:2], load.offset)
    x, y = load.offset
    assert load.detail == f"9 kg, {1000 * x:+.0f} mm ahead, {1000 * y:+.0f} mm left"

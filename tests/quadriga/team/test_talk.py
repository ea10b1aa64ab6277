"""A word that a person says to a team is said again, the same to the byte, but not for ever."""

from __future__ import annotations

from quadriga.shared import members
from quadriga.shared.bus.zenoh_bus import HERE, Bus
from quadriga.shared.config.load import load
from quadriga.shared.members import SIM
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import SafeStop
from quadriga.shared.wire.topics import STOP
from quadriga.team.endpoint import free_endpoint
from quadriga.team.talk import TeamTalk

WORD = SafeStop(5, 0, "dog", False)


def test_a_word_is_repeated_for_a_second_and_to_those_who_turn_up_later() -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    with Bus.open(config.bus, "team", SIM) as plant, TeamTalk(config, members.STOP) as talk:
        plant.subscribe(STOP.key("team"))
        plant.declare(HERE)
        say = talk.publisher(STOP)
        assert talk.follow(lambda: talk.look() == {SIM}, 20.0)
        say(WORD)
        assert not talk.follow(lambda: False, 1.5)
        heard = [payload for _, payload in plant.drain()]
        assert set(heard) == {encode(WORD)}
        assert 3 <= len(heard) <= 12
        with Bus.open(config.bus, "team", "r1") as late:
            late.subscribe(STOP.key("team"))
            late.declare(HERE)
            assert talk.follow(lambda: bool(late.drain()), 20.0)
        assert not talk.follow(lambda: False, 0.3)
        assert len(plant.drain()) == 1, "once for who is new"

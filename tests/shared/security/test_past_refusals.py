"""What a router remembers of its refusals, and what is read of that."""

from __future__ import annotations

from quadriga.shared.security.past_refusals import RefusalMemory, read_entries, refusals_of
from quadriga.shared.security.refusals import Refused

PUT = Refused("r2.1", "put", "team/r1/command", "denied")


def test_kinds_are_counted_and_the_newest_is_last() -> None:
    memory = RefusalMemory()
    other = PUT._replace(key="team/r1/plan")
    for refused, now in ((PUT, 1.0), (other, 2.0), (PUT, 3.0)):
        memory.note(refused, 20, now)
    first, last = read_entries(memory.entries(3.5))
    assert (first.refused, first.times, first.age) == (other, 20, 1.5)
    assert (last.refused, last.times, last.age) == (PUT, 40, 0.5)


def test_a_flood_of_keys_displaces_only_those_of_the_same_sender() -> None:
    memory = RefusalMemory()
    memory.note(PUT, 1, 0.0)
    for k in range(1000):
        memory.note(Refused("r1.1", "put", f"team/{k}/" + "x" * 60_000, "denied"), 1, 1.0)
    found = read_entries(memory.entries(1.0))
    assert len(found) < 10
    assert PUT in {each.refused for each in found}
    assert sum(len(entry) for entry in memory.entries(1.0)) < 16_384


def test_a_flood_of_senders_is_forgotten_from_the_oldest_on() -> None:
    memory = RefusalMemory()
    for k in range(1000):
        memory.note(PUT._replace(who=f"{k}"), 1, 1.0)
    found = read_entries(memory.entries(1.0))
    assert found[-1].refused.who == "999"
    assert len(found) < 100


def test_what_is_no_entry_is_left_out_and_the_rest_is_fit_for_a_terminal() -> None:
    good = '["r2.1", "put", "a\\u001b[2Jb", "denied", 1, 0.5]'
    wrong = (
        *("", "[", "{}", "[" * 100_000, "[1]", '["a", "b", "c", "denied", 1]'),
        *('["a", "b", "c", "other", 1, 1]', '["a", "b", "c", "denied", "1", 1]'),
        *('["a", "b", "c", "denied", true, 1]', '["a", "b", "c", "denied", 1, "x"]'),
        *('["a", "b", "c", "denied", -1, 1]', f'["a", "b", "c", "denied", 1{"0" * 99}, 1]'),
        *(f'["a", "b", "c", "denied", 1, {"9" * 400}]', '["a", "b", "c", "denied", 1, NaN]'),
    )
    (found,) = read_entries((*wrong, good))
    assert "\x1b" not in found.refused.key


def test_refusals_of_one_identity_are_those_of_all_its_certificates() -> None:
    memory = RefusalMemory()
    for who in ("r2.1", "r2.3", "r1.1", "r2", "somebody"):
        memory.note(PUT._replace(who=who), 1, 0.0)
    found = refusals_of("r2", read_entries(memory.entries(0.0)))
    assert [each.refused.who for each in found] == ["r2.1", "r2.3", "r2"]

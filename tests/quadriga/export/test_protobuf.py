"""What is encoded comes back, read with nothing but the descriptors that are in the file."""

from __future__ import annotations

from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given
from hypothesis import strategies as st

from quadriga.export.protobuf import ProtobufType

NAMES = ("q.FL_hip", "q.FL_calf", "r1-r2.error", "z", "q.3rd", "a.b.c.d")
doubles = st.floats(width=64)
KIND = ProtobufType("Trial", [("tick", int), ("mode", str), ("vx", float)], ["ms"], NAMES)
SAMPLED = ProtobufType("Sampled", [], [], ["used.r1"], [f"u.leg{i}.x" for i in range(40)])


def reader(kind: ProtobufType) -> Any:
    files = descriptor_pb2.FileDescriptorSet.FromString(kind.descriptor)
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(kind.name))


READ, READ_SAMPLED = reader(KIND), reader(SAMPLED)


@given(st.lists(doubles, min_size=6, max_size=6), st.integers(0, 2**42), st.lists(doubles))
def test_plain_fields_lists_and_numbers_come_back_to_the_bit(
    numbers: list[float], tick: int, ms: list[float]
) -> None:
    plain = {"tick": tick, "mode": "ständ", "vx": numbers[0], "ms": ms}
    found = READ.FromString(KIND.encode(plain, np.array(numbers)))
    assert (found.tick, found.mode) == (tick, "ständ")
    back = [
        found.q.FL_hip,
        found.q.FL_calf,
        found.r1_r2.error,
        found.z,
        found.q._3rd,
        found.a.b.c.d,
    ]
    assert np.array(back).tobytes() == np.array(numbers).tobytes()
    assert np.array([found.vx, *found.ms]).tobytes() == np.array([numbers[0], *ms]).tobytes()


@given(st.integers(1, 5))
def test_samples_come_back_row_by_row(rows: int) -> None:
    values = np.random.default_rng(rows).standard_normal((rows, 40))
    found = READ_SAMPLED.FromString(SAMPLED.encode({}, np.array([4.5]), values))
    assert found.used.r1 == 4.5
    assert [[getattr(s.u, f"leg{i}").x for i in range(40)] for s in found.samples] == (
        values.tolist()
    )

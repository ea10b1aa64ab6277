"""DDS on the loopback, both ends in one process, and what must never be sent."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest

from quadriga.shared.errors import BridgeError
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.unitree import rpc
from quadriga.shared.unitree.codecs import GO2
from quadriga.shared.unitree.dds import (
    LOW_COMMANDS,
    LOW_STATES,
    DdsParticipant,
    StructReader,
    StructWriter,
    describe_topic,
    load_library,
)
from quadriga.shared.unitree.packets import MotorTargets
from quadriga.shared.unitree.rpc import RpcEnd, RpcMessage

DOMAIN = 190  # of no other test
WAIT = 10.0  # s


@pytest.fixture
def participant() -> Iterator[DdsParticipant]:
    with closing(DdsParticipant(DOMAIN, "lo")) as made:
        yield made


def test_a_topic_has_no_type_information() -> None:
    """With it, processes of version 0.10 on the same topic end: the robot's own among them."""
    for topic in (LOW_COMMANDS, LOW_STATES):
        descriptor, program = describe_topic(topic)
        for part in (descriptor.type_information, descriptor.type_mapping):
            assert (part.data, part.size) == (None, 0)
        assert descriptor.flags == 0
        assert descriptor.ops_count == len(program) == len(topic.ops) + 1


def test_the_python_package_is_never_imported() -> None:
    """It would send type information for whatever is declared through it."""
    code = (
        "import sys; from quadriga.shared.unitree.dds import load_library; "
        "import quadriga.bridges.drivers, quadriga.sim_server.emulator; "
        "load_library(); print(any(name.split('.')[0] == 'cyclonedds' for name in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == "False"
    assert load_library() is not None


def test_what_is_written_is_read_to_the_byte(participant: DdsParticipant) -> None:
    writer = StructWriter(participant, LOW_COMMANDS)
    reader = StructReader(participant, LOW_COMMANDS)
    random = np.random.default_rng(0)
    rows = random.normal(size=(5, 12))
    packet = GO2.encode_command(MotorTargets(np.ones(12, np.uint8), *rows))
    assert reader.take() is None
    assert writer.send(packet)
    deadline = monotonic() + WAIT
    while (read := reader.take()) is None:
        assert monotonic() < deadline
        sleep(0.001)
    assert read == packet
    assert reader.take() is None
    witness = StructReader(participant, LOW_COMMANDS, of_others=True)
    packets = [bytes([k]) + packet[1:] for k in range(100)]
    assert all([writer.send(sent) for sent in packets])
    sleep(0.05)  # a late process gets them all
    assert [reader.take() for _ in packets] == packets
    first = reader.writer
    with closing(DdsParticipant(DOMAIN, "lo")) as other:
        foreign = StructWriter(other, LOW_COMMANDS)
        while witness.take() is None:
            assert monotonic() < deadline
            foreign.send(packet)
            sleep(0.001)
        assert reader.take() == packet
        assert reader.writer == witness.writer != first
    assert reader.writers == writer.readers == 1


def test_a_call_is_answered_with_its_number(participant: DdsParticipant) -> None:
    client = RpcEnd(participant, rpc.MOTION_SWITCHER, serves=False)
    server = RpcEnd(participant, rpc.MOTION_SWITCHER, serves=True)
    texts = ("{}", "", "ä" * 300)
    deadline = monotonic() + WAIT
    for number, text in enumerate(texts):
        assert client.send(RpcMessage(number, rpc.CHECK_MODE, text))
        answers = list[RpcMessage]()
        while not answers:
            for request in server.receive():
                assert request == RpcMessage(number, rpc.CHECK_MODE, text)
                server.send(RpcMessage(request.id, request.api, f"got {text}", 7))
            answers = list(client.receive())
            assert monotonic() < deadline
            sleep(0.001)
        assert answers == [RpcMessage(number, rpc.CHECK_MODE, f"got {text}", 7)]


def test_an_interface_that_is_not_there_is_one_clear_error() -> None:
    with pytest.raises(BridgeError, match=r"DDS domain 191 on 'eth77': got error -\d+ of Cyclone"):
        DdsParticipant(191, "eth77")

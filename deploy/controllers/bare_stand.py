"""A controller without quadriga: Zenoh, MessagePack and NumPy alone, as any language has them.

quadriga walk --robots 1 --controller 'python deploy/controllers/bare_stand.py'
"""

import json
import os
from queue import SimpleQueue

import msgpack
import numpy as np
import zenoh

TEAM, ROBOT = os.environ["QUADRIGA_TEAM"], os.environ["QUADRIGA_ROBOT"]
PEER = os.environ["QUADRIGA_MODE"] == "peer"
SETTINGS = {
    "mode": os.environ["QUADRIGA_MODE"],
    "connect/endpoints": [os.environ["QUADRIGA_ENDPOINT"]],
    "listen/endpoints": [os.environ["QUADRIGA_LISTEN"]] if PEER else [],
    "connect/exit_on_failure": False,
    "connect/timeout_ms": -1 if PEER else 10_000,
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": PEER,
}
FIELDS = ("tau", "q_des", "v_des", "kp", "kd")


def answer(state, q_des):
    """The command that answers a state: hold the joints at `q_des`, (12,), rad."""
    zero, one = np.zeros(12), np.ones(12)
    arrays = zip(FIELDS, (zero, q_des, zero, 80.0 * one, 3.0 * one), strict=True)
    head = {"schema": 1, "tick": state["tick"], "stamp_ns": state["stamp_ns"]}
    return msgpack.packb(head | {name: array.astype("<f8").tobytes() for name, array in arrays})


def newest(inbox):
    """The newest state, waiting for one; in real time those before it are too late."""
    sample = inbox.get()
    while sample is not None and not inbox.empty():
        sample = inbox.get()
    return sample


def main():
    config = zenoh.Config()
    for key, value in SETTINGS.items():
        config.insert_json5(key, json.dumps(value))
    inbox = SimpleQueue()  # states; None: the walk is over

    def take_event(sample):
        if msgpack.unpackb(sample.payload.to_bytes())["kind"] == "stop":
            inbox.put(None)

    def take_token(sample):
        if sample.kind == zenoh.SampleKind.DELETE:  # who drives time is gone
            inbox.put(None)

    with zenoh.open(config) as session:
        command = session.declare_publisher(
            f"{TEAM}/{ROBOT}/command",
            express=True,
            congestion_control=zenoh.CongestionControl.BLOCK,  # in lock-step none may be lost
        )
        declared = [
            session.declare_subscriber(f"{TEAM}/{ROBOT}/state", inbox.put),
            session.declare_subscriber(f"{TEAM}/sim/event", take_event),
            session.liveliness().declare_subscriber(f"{TEAM}/sim/here/*", take_token),
        ]
        me = session.info.zid()  # behind the subscriptions: who sees the tokens is heard
        for stage in ("here", "ready"):
            declared.append(session.liveliness().declare_token(f"{TEAM}/{ROBOT}/{stage}/{me}"))
        q_des = None
        while (sample := newest(inbox)) is not None:
            state = msgpack.unpackb(sample.payload.to_bytes())
            if q_des is None:
                q_des = np.frombuffer(state["q_joint"], "<f8")
            command.put(answer(state, q_des))


if __name__ == "__main__":
    main()

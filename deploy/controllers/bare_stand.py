"""A controller without quadriga: Zenoh and NumPy alone, as any language has them.

quadriga walk --robots 1 --controller 'python deploy/controllers/bare_stand.py'
"""

import json
import os
import socket
import struct
from pathlib import Path
from queue import SimpleQueue

import numpy as np
import zenoh

TEAM, ROBOT = os.environ["QUADRIGA_TEAM"], os.environ["QUADRIGA_ROBOT"]
PLANT, LINK = os.environ["QUADRIGA_PLANT"], os.environ["QUADRIGA_LINK"]
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
HEADER = struct.Struct("<HBBIqq8s")  # version, kind, robot, 0, tick, stamp [ns], layout
VERSION, LAYOUT = 1, bytes.fromhex("8e84b210f4fe91d7")
HELLO, WELCOME, REFUSED, STATE, COMMAND, END = range(1, 7)
PLACE = int(ROBOT[1:]) - 1
Q = slice(0, 12)  # of a state: the joints' angles, rad


def pack(kind, body, tick=0):
    """A packet of the plant link."""
    return HEADER.pack(VERSION, kind, PLACE, 0, tick, 1_000_000 * tick, LAYOUT) + body


def answer(tick, q_des):
    """The command that answers the state of a tick: hold the joints at `q_des`, (12,), rad."""
    zero, one = np.zeros(12), np.ones(12)
    row = np.concatenate([zero, q_des, zero, 80.0 * one, 3.0 * one])  # tau, q, v, kp, kd
    return pack(COMMAND, row.astype("<f8").tobytes(), tick)


def main():
    config = zenoh.Config()
    for key, value in SETTINGS.items():
        config.insert_json5(key, json.dumps(value))
    seen, packets = SimpleQueue(), SimpleQueue()  # the plant's coming and going; what it sends

    def take_token(sample):
        there = sample.kind == zenoh.SampleKind.PUT
        (seen if there else packets).put(b"")  # b"": the plant is gone

    with zenoh.open(config) as session:
        keys = f"{TEAM}/@link/{ROBOT}/"
        command = session.declare_publisher(
            keys + "command",
            express=True,
            congestion_control=zenoh.CongestionControl.BLOCK,  # in lock-step none may be lost
        )
        declared = [
            session.declare_subscriber(keys + "state", lambda s: packets.put(s.payload.to_bytes())),
            session.liveliness().declare_subscriber(
                f"{TEAM}/{PLANT}/here/*", take_token, history=True
            ),
        ]
        me = session.info.zid()  # behind the subscriptions: who sees the tokens is heard
        tokens = session.liveliness()
        declared.append(tokens.declare_token(f"{TEAM}/{ROBOT}/here/{me}"))
        seen.get()  # the plant listens now
        send, receive = command.put, packets.get
        if Path(LINK).is_socket():  # it is on this computer
            link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            link.connect(LINK)
            send, receive = link.send, lambda: link.recv(1024)
        send(pack(HELLO, ROBOT.encode()))
        q_des = None
        while packet := receive():
            _, kind, _, _, tick, _, _ = HEADER.unpack_from(packet)
            if kind == END:
                break
            if kind == REFUSED:
                raise SystemExit(packet[HEADER.size :].decode())
            if kind == WELCOME:
                declared.append(tokens.declare_token(f"{TEAM}/{ROBOT}/ready/{me}"))
            if kind == STATE:
                row = np.frombuffer(packet, "<f8", offset=HEADER.size)
                q_des = row[Q] if q_des is None else q_des
                send(answer(tick, q_des))


if __name__ == "__main__":
    main()

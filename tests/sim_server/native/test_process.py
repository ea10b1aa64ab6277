"""The process of the simulated robots: orders through its standard input, its news, its truth."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

from quadriga.shared.runtime.clock import monotonic, sleep
from tests.bridges.test_udp_driver import HOST, free_port

WAIT = 60.0  # s


def wait_for(words: str, file: Path) -> None:
    deadline = monotonic() + WAIT
    while words not in file.read_text(encoding="utf-8"):
        assert monotonic() < deadline, file.read_text(encoding="utf-8")
        sleep(0.01)


def test_it_is_steered_while_it_runs_and_ends_with_all_written(tmp_path: Path) -> None:
    said, truth = tmp_path / "said.log", tmp_path / "truth.csv"
    command = [sys.executable, "-m", "quadriga", "sim", "--as", "a1", "--hung", "--robots", "1"]
    command += ["--do", "r1 loss 0.05", "--do", "0.1 r1 battery 8", "--truth", str(truth)]
    keys = {
        "bridge.endpoint": f"{HOST}:{free_port()}",
        "bridge.listen": f"{HOST}:{free_port()}",
        "runtime.priority": "ordinary",
    }
    command += [f"--set={key}={value}" for key, value in keys.items()]
    with (
        said.open("wb") as log,
        subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log) as process,
    ):
        assert process.stdin is not None
        wait_for("100 ms: order r1 battery 8\n", said)
        process.stdin.write(b"r1 explode\nr1 clear")
        process.stdin.flush()
        wait_for("order: got 'explode', expected r1 and one of loss", said)
        assert "order r1 clear" not in said.read_text(encoding="utf-8"), "its line has no end yet"
        process.stdin.write(b"\n")
        process.stdin.close()
        wait_for("ms: order r1 clear\n", said)
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT) == 0
    lines = said.read_text(encoding="utf-8").splitlines()
    assert "0 ms: order r1 loss 0.05" in lines
    end = lines[-1]
    assert "ticks began late" in end
    header, *rows = truth.read_text(encoding="utf-8").splitlines()
    assert header.startswith("ms,r1_x,r1_y,r1_z,")
    assert [int(row.split(",")[0]) for row in rows] == [10 * k for k in range(len(rows))]
    assert 10 * len(rows) >= int(end.split()[0])
    assert abs(float(rows[-1].split(",")[3]) - 0.6) < 0.02, "it hangs"

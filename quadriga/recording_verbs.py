"""The commands that make, read and mend recordings, one function each."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from shared.config import Config
from shared.errors import ConfigError

if TYPE_CHECKING:
    from quadriga.recorder import Recorded
    from quadriga.recording_choice import Wanted

Given = dict[str, Any]
_SMALLEST = 0.1  # MB, of a file: its schemas and index alone take some of that


def wanted(arguments: argparse.Namespace) -> Wanted:
    """What `quadriga record` is asked to record."""
    from quadriga.recording_choice import Wanted
    from quadriga.recording_parts import Limits

    size, seconds = arguments.max_size, arguments.max_duration
    if size and not size >= _SMALLEST:
        raise ConfigError("--max-size", f"{size:g} MB", f"at least {_SMALLEST:g}")
    if seconds and not seconds >= _SMALLEST:
        raise ConfigError("--max-duration", f"{seconds:g} s", f"at least {_SMALLEST:g}")
    limits = Limits(round(1e6 * size), seconds)
    if arguments.report and limits != Limits():
        raise ConfigError("--report", "a recording in parts", "one in a single file")
    return Wanted(tuple(arguments.topics), tuple(arguments.exclude), limits, arguments.now)


def recorded(done: Recorded) -> str:
    """What `quadriga record` says at its end."""
    files = ", ".join(map(str, done.paths))
    text = f"recorded to {files}: {done.messages:,} messages, {sum(done.lost.values()):,} lost"
    worst = sorted(done.lost.items(), key=lambda item: -item[1])[:5]
    return text + "".join(f"\n  {key}: {count:,} lost" for key, count in worst)


def info(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """What a recording holds."""
    from quadriga.info import info
    from quadriga.survey import survey

    found = survey(arguments.file)
    print("\n".join(info(found)))
    if found.error is not None:
        raise found.error
    return 0


def recover(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """A whole file from what is left of a damaged one."""
    from quadriga.recover import recover, told

    done = recover(arguments.file, arguments.output)
    if done is None:
        print(f"{arguments.file} is whole: nothing to recover")
        return 0
    print(f"damaged: {done.error.got}")
    print("\n".join(told(done)))
    return 0


def check(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Every message of a recording against the rules; 1 if one is broken."""
    from quadriga.check import check, told

    findings = check(arguments.file)
    print("\n".join(told(findings)))
    return int(not all(finding.passed for finding in findings))

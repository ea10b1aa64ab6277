"""The commands that make, read and mend recordings, one function each."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Generator, Iterator
from contextlib import AbstractContextManager, closing
from typing import TYPE_CHECKING, Any, cast

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.signals import stop_flag

if TYPE_CHECKING:
    from quadriga.recorder.process import Recorded
    from quadriga.recorder.selection import Wanted
    from quadriga.shared.recording.reader import ChunkEntry

Given = dict[str, Any]
_SMALLEST = 0.1  # MB, of a file: its schemas and index alone take some of that


def wanted(arguments: argparse.Namespace) -> Wanted:
    """What `quadriga record` is asked to record."""
    from quadriga.recorder.parts import Limits
    from quadriga.recorder.selection import Wanted

    size, seconds = arguments.max_size, arguments.max_duration
    if size and not _SMALLEST <= size < math.inf:
        raise ConfigError("--max-size", f"{size:g} MB", f"at least {_SMALLEST:g}")
    if seconds and not _SMALLEST <= seconds < math.inf:
        raise ConfigError("--max-duration", f"{seconds:g} s", f"at least {_SMALLEST:g}")
    limits = Limits(round(1e6 * size), seconds)
    if arguments.report and limits != Limits():
        raise ConfigError("--report", "a recording in parts", "one in a single file")
    return Wanted(tuple(arguments.topics), tuple(arguments.exclude), limits, arguments.now)


def recorded(done: Recorded) -> str:
    """What `quadriga record` says at its end."""
    files = str(done.paths[0])
    if len(done.paths) > 1:
        files += f" … {done.paths[-1].name} ({len(done.paths)} files)"
    text = f"recorded to {files}: {done.messages:,} messages, {sum(done.lost.values()):,} lost"
    worst = sorted(done.lost.items(), key=lambda item: -item[1])[:5]
    return text + "".join(f"\n  {key}: {count:,} lost" for key, count in worst)


def info(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """What a recording holds."""
    from quadriga.recordings.info import info
    from quadriga.recordings.survey import survey

    found = survey(arguments.file)
    print("\n".join(info(found)))
    if found.error is not None:
        raise found.error
    return 0


def recover(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """A whole file from what is left of a damaged one."""
    from quadriga.recordings.recover import recover, told

    done = recover(arguments.file, arguments.output)
    if done is None:
        print(f"{arguments.file} is whole: nothing to recover")
        return 0
    print(f"damaged: {done.error.got}")
    print("\n".join(told(done)))
    return 0


def check(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Every message of a recording against the rules; 1 if one is broken."""
    from quadriga.recordings.check import check, told

    findings = check(arguments.file)
    print("\n".join(told(findings)))
    return int(not all(finding.passed for finding in findings))


def echo(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Messages as text, one line each."""
    from quadriga.recordings.echo import line
    from quadriga.recordings.listen import from_bus, from_file

    if arguments.count < 0:
        raise ConfigError("-n", str(arguments.count), "at least 0")
    left = arguments.count or -1
    with stop_flag() as stopped:
        if arguments.file:
            feed: Iterator[ChunkEntry | None] = from_file(arguments.file, arguments.key)
        else:
            feed = from_bus(config, "echo", arguments.key, stopped, _say)
        with closing_feed(feed):
            for entry in feed:
                if stopped():
                    break
                if entry is None:
                    continue
                print(line(entry, full=arguments.full), flush=not arguments.file)
                left -= 1
                if not left:
                    break
    return 0


def hz(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Rates, intervals and gaps by key."""
    from quadriga.recordings.listen import config_of, from_bus, from_file
    from quadriga.recordings.rates import Paces
    from quadriga.shared.config.timing import periods

    if arguments.file:
        paces = Paces(periods(config_of(arguments.file)))
        try:
            for entry in from_file(arguments.file, arguments.keys):
                paces.add(entry)
        finally:
            print("\n".join(paces.table()))
        return 0
    if arguments.count < 0 or not arguments.every > 0.0:
        raise ConfigError("-n, --every", f"{arguments.count}, {arguments.every:g}", "more than 0")
    paces, left, begun = Paces(periods(config)), arguments.count or -1, monotonic()
    with stop_flag() as stopped:
        feed = from_bus(config, "hz", arguments.keys, stopped, _say)
        with closing_feed(feed):
            for each in feed:
                if each is not None:
                    paces.add(each)
                if monotonic() - begun < arguments.every or paces.empty:
                    continue
                print("\n".join((*paces.table(), "")), flush=True)
                paces.again()
                begun, left = monotonic(), left - 1
                if not left:
                    break
    return 0


def closing_feed(feed: Iterator[Any]) -> AbstractContextManager[Any]:
    """Leave the bus when the reading ends early."""
    return closing(cast("Generator[Any]", feed))


def _say(text: str) -> None:
    print(f"quadriga: {text}", file=sys.stderr, flush=True)

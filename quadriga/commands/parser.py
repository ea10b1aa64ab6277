"""What an operator types: the command line, its commands and their exit statuses."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from typing import Final

from quadriga.commands import (
    agent,
    bridge,
    campaign,
    certs,
    check,
    collect,
    config,
    desk,
    doctor,
    drive,
    echo,
    estop,
    experiments,
    export,
    fault,
    fit,
    hz,
    info,
    operate,
    plan,
    play,
    prepare,
    probe,
    record,
    recover,
    replay,
    report,
    reset,
    resim,
    resume,
    router,
    scenarios,
    sim,
    status,
    stop,
    top,
    tune,
    version,
    walk,
    whatif,
)
from quadriga.commands.command import Run
from quadriga.commands.config_options import build_config_options, read_config
from quadriga.commands.running import registered
from quadriga.shared.errors import ConfigError, ProcessError, QuadrigaError, system_reason
from quadriga.shared.printable import printable, printable_line
from quadriga.shared.runtime.signals import die_with_parent, interrupt_on_sigterm, kill_if_orphaned

FAILED: Final = 1  # a robot fell or a process failed
WRONG: Final = 2  # the command, the configuration or a file is wrong
INTERRUPTED: Final = 130

# In the order of `quadriga --help`.
_COMMANDS: Final = (
    walk.add, scenarios.add, sim.add, bridge.add, desk.add, fault.add, agent.add, plan.add,
    record.add, report.add, play.add, resim.add, whatif.add, export.add, info.add, recover.add,
    check.add, echo.add, hz.add, top.add, status.add, replay.add, router.add, certs.add, doctor.add,
    prepare.add, operate.add, collect.add, fit.add, probe.add, campaign.add, experiments.add, tune.add,
    drive.add, estop.add, stop.add, reset.add, resume.add, config.add, version.add,
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; its exit status. A user's mistake costs one line, not a traceback."""
    typed = sys.argv[1:] if argv is None else list(argv)
    arguments = build_parser().parse_args(typed)
    arguments.typed = shlex.join(["quadriga", *typed])
    try:
        interrupt_on_sigterm()
        if arguments.parent:
            die_with_parent(arguments.parent)
            kill_if_orphaned(arguments.parent)
        config, given = read_config(arguments)
        with registered(arguments, config):
            status: int = arguments.call(arguments, config, given)
    except ProcessError as error:
        return _complain(error, FAILED)
    except QuadrigaError as error:
        return _complain(error, WRONG)
    except KeyboardInterrupt:
        print("quadriga: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # of `quadriga config | head`
        sys.stdout = None
        return 0
    except OSError as error:  # a disk that is full, a folder that is read-only
        what, reason = error.filename or "a file or a connection", system_reason(error)
        return _complain(ConfigError(str(what), reason, "one that can be used"), WRONG)
    return status


def build_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = argparse.ArgumentParser(
        prog="quadriga",
        description="A team of yoked quadrupeds that walk as one.",
        epilog="Every command reads one configuration: defaults, then --scenario, then --config, "
        "then options.",
    )
    commands = top.add_subparsers(metavar="command", required=True)

    def add_command(name: str, run: Run, doc: str) -> argparse.ArgumentParser:
        command = commands.add_parser(
            name,
            help=doc,
            description=doc,
            parents=[build_config_options(name)],
            allow_abbrev=False,
        )
        command.set_defaults(call=run, command=name)
        return command

    for add in _COMMANDS:
        add(add_command)
    return top


def _complain(error: QuadrigaError, status: int) -> int:
    shown = (
        printable if isinstance(error, ProcessError) else printable_line
    )  # with a log's last lines
    print(shown(f"quadriga: {error}"), file=sys.stderr)
    return status

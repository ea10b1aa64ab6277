"""SHELL of `quadriga export`: a bar while the files are written, then what they are."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.export.columns import TickReached
from quadriga.export.source import Source
from quadriga.progress import build_progress
from quadriga.shared.errors import ConfigError, RecordingError, name_file_errors
from quadriga.shared.printable import printable
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic

_STRIDE: Final = 100  # ticks between updates of the bar

_Writer = Callable[[Source, Path, TickReached], tuple[Path, ...]]


@dataclass(frozen=True, slots=True)
class _Format:
    """A format.

    Attributes:
        writer: module and function that write it. They are imported only for it: others need not
            be installed.
        output: what the default output is called.
        extra: the extra of this package that installs what it needs; "" if it needs nothing.
        layout: module, function and file name of what is written beside it to look at it by.
    """

    writer: tuple[str, str]
    output: str
    extra: str = ""
    layout: tuple[str, str, str] | None = None


_FORMATS: Final = {
    "foxglove": _Format(
        ("foxglove_file", "write_foxglove"),
        "{}.foxglove.mcap",
        "export",
        ("foxglove_layout", "write_layout", "{}.foxglove-layout.json"),
    ),
    "rerun": _Format(("rerun_file", "write_rerun"), "{}.rrd", "rerun"),
    "csv": _Format(("csv_files", "write_csv"), "{}-csv"),
    "parquet": _Format(("parquet_files", "write_parquet"), "{}-parquet", "export"),
}
FORMATS: Final = tuple(_FORMATS)


def run(path: Path, form: str, out: Path | None, console: Console) -> None:
    """Export a recording.

    Args:
        path: the recording.
        form: one of `FORMATS`.
        out: file or folder to write, which must not exist; None puts it beside the recording.
        console: for the bar and the last word.

    Raises:
        RecordingError: no recording, or nothing in it that can be exported.
        ConfigError: the output exists or cannot be written, or a package is not installed.
    """
    recording = Recording(path)
    write = _import_writer(form)
    out = out or path.with_name(_FORMATS[form].output.format(path.stem))
    layout = _layout_file(form, out) if out.name else None
    for file in (out, layout):
        if file is not None and file.exists():
            raise ConfigError(
                "--output",
                f"{file}, which exists",
                "a new file or folder",
                "an export overwrites nothing",
            )
    begun = monotonic()
    source = Source(recording)
    if not source.topics:
        raise RecordingError(str(path), "no message of a known topic", "a recorded walk")
    files = _write(write, source, out, console)
    size = sum(file.stat().st_size for file in files)
    count = f" with {len(files)} files" if len(files) > 1 else ""
    lines = [f"{out}{count}, {size / 1e6:.1f} MB in {monotonic() - begun:.1f} s"]
    if layout is not None:
        _write_layout(form, source, layout)
        lines.append(f"{layout}, its layout: Layouts > Import from file")
    if recording.cut:
        lines.append(f"only as far as the recording goes: {recording.cut}")
    lines += [
        f"left out {many} messages of {key}: not a valid message of a known topic"
        for key, many in sorted(source.left_out.items())
    ]
    for line in lines:
        console.print(printable(line), markup=False, highlight=False, soft_wrap=True)


def _write(write: _Writer, source: Source, out: Path, console: Console) -> list[Path]:
    """Write all files of an export or none; returns them."""
    # Under a name of its own, so that what others wrote meanwhile is neither mixed nor removed.
    partial = out.with_name(f".{out.name}.{os.getpid()}.partial")
    shown = 0
    bar = build_progress(console, "{task.completed:.1f}/{task.total:.1f} s", fleeting=True)
    task = bar.add_task("exporting", total=source.last / 1000)

    def show(tick: int) -> None:
        nonlocal shown
        if tick >= shown + _STRIDE:
            shown = tick
            bar.update(task, completed=tick / 1000)

    with bar:
        try:
            files = write(source, partial, show)
            if out.exists():
                raise ConfigError("--output", f"{out}, which exists by now", "a new file or folder")
            partial.rename(out)
        except BaseException as error:
            _remove(partial)
            if isinstance(error, OSError):
                raise ConfigError(
                    "--output", f"{out}: {error.strerror or error}", "a writable place with room"
                ) from None
            raise
    return [out / file.relative_to(partial) for file in files]


def _layout_file(form: str, out: Path) -> Path | None:
    """Where the layout of an export goes: beside it. None for formats without one."""
    layout = _FORMATS[form].layout
    return layout and out.with_name(layout[2].format(out.stem.removesuffix(f".{form}")))


def _write_layout(form: str, source: Source, path: Path) -> None:
    module, function, _ = _FORMATS[form].layout or ("", "", "")
    with name_file_errors(ConfigError, path, "a file that can be written"):
        getattr(import_module(f"quadriga.export.{module}"), function)(source, path)


def _remove(out: Path) -> None:
    """Take back an export that was not finished."""
    if out.is_dir():
        shutil.rmtree(out, ignore_errors=True)
    else:
        with suppress(OSError):  # it was never there
            out.unlink()


def _import_writer(form: str) -> _Writer:
    (module, function), extra = _FORMATS[form].writer, _FORMATS[form].extra
    try:
        writer: _Writer = getattr(import_module(f"quadriga.export.{module}"), function)
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"--to {form}",
            f"no Python package {error.name}",
            f"the extra {extra!r}",
            f"pip install -e '.[{extra}]' in the project's folder",
        ) from None
    return writer

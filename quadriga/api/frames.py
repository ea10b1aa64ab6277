"""Tables of pandas, which is imported only by who asks for one."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from quadriga.shared.errors import ConfigError

if TYPE_CHECKING:
    from pandas import DataFrame


def build_frame(columns: Mapping[str, Any], index: Mapping[str, Any]) -> DataFrame:
    """A table of these columns, with one or several columns as its index.

    Raises:
        ConfigError: pandas is not installed.
    """
    try:
        pandas = import_module("pandas")
    except ModuleNotFoundError as error:
        raise ConfigError(
            "a frame",
            f"no Python package {error.name}",
            "the extra 'frame'",
            "pip install 'quadriga[frame]', or pip install -e '.[frame]' in a checkout",
        ) from None
    if len(index) == 1:
        ((name, values),) = index.items()
        rows = pandas.Index(values, name=name)
    else:
        rows = pandas.MultiIndex.from_arrays([*index.values()], names=[*index])
    return pandas.DataFrame(dict(columns), index=rows)

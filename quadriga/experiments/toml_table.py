"""Tables of a TOML file that say what is walked: whatever is wrong with one is one error."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

from quadriga.shared.config.load import is_finite, show_value
from quadriga.shared.errors import ConfigError, did_you_mean


class TomlTable:
    """A table of a file, whose keys are all known."""

    def __init__(self, where: str, body: Any, known: Collection[str]) -> None:
        self.where, self._body = where, body
        if not isinstance(body, dict):
            raise ConfigError(where, show_value(body), "a table")
        for name in body:
            self.check_one("a key", name, known)

    def check_one(self, what: str, got: Any, known: Collection[str]) -> None:
        """Refuse what is not among the known ones."""
        if got not in known:
            one_of, hint = f"one of {', '.join(known)}", did_you_mean(got, known)
            raise ConfigError(f"{self.where}: {what}", show_value(got), one_of, hint)

    def has(self, name: str) -> bool:
        return name in self._body

    def text(self, name: str, default: str | None = None) -> str:
        return str(
            self._get(name, default, lambda v: isinstance(v, str) and bool(v.strip()), "text")
        )

    def yes(self, name: str, default: bool) -> bool:
        return bool(self._get(name, default, lambda v: isinstance(v, bool), "true or false"))

    def number(self, name: str) -> float:
        def right(value: Any) -> bool:
            return type(value) in (int, float) and is_finite(value)

        return float(self._get(name, None, right, "a finite number"))

    def texts(
        self, name: str, default: tuple[str, ...], known: Collection[str] = ()
    ) -> tuple[str, ...]:
        """Several texts, each once, or one of them alone."""
        value = self._body.get(name, default)
        values = [value] if isinstance(value, str) else value
        if not isinstance(values, (list, tuple)) or not all(isinstance(v, str) for v in values):
            raise ConfigError(f"{self.where}: {name}", show_value(value), "a list of texts")
        for one in values if known else ():
            self.check_one(name, one, known)
        if len(set(values)) < len(values):
            raise ConfigError(f"{self.where}: {name}", show_value(value), "each once")
        return tuple(values)

    def table(self, name: str, known: Collection[str]) -> TomlTable:
        return TomlTable(f"{self.where}: {name}", self._body.get(name, {}), known)

    def tables(self, name: str, known: Collection[str]) -> list[TomlTable]:
        value = self._body.get(name, [])
        if not isinstance(value, list):
            raise ConfigError(f"{self.where}: {name}", "no list", f"tables headed [[{name}]]")
        return [
            TomlTable(f"{self.where}: {name}, the {k}.", v, known) for k, v in enumerate(value, 1)
        ]

    def mapping(self, name: str) -> Mapping[str, Any]:
        return dict(
            self._get(name, {}, lambda v: isinstance(v, dict), f"a table, written [{name}]")
        )

    def _get(self, name: str, default: Any, right: Callable[[Any], bool], what: str) -> Any:
        value = self._body.get(name, default)
        if value is None or not right(value):
            raise ConfigError(
                f"{self.where}: {name}", "nothing" if value is None else show_value(value), what
            )
        return value

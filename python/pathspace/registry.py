"""The integrators that there are."""

from __future__ import annotations

from types import ModuleType
from typing import Any, Iterator

from . import _native


class Registry:
    """Integrators by name, with one line on each.

    >>> for name, what in ps.Registry():
    ...     print(name, "-", what)

    The integrators of a plug-in crate are compiled into a module of their own, which holds those of
    pathspace as well (see the README); `Registry(module)` lists them and `use(module)` renders with them.
    """

    def __init__(self, module: ModuleType | None = None) -> None:
        self._own: Any = (module or _current).integrators

    def __iter__(self) -> Iterator[tuple[str, str]]:
        return iter(self._own.list())

    def __len__(self) -> int:
        return len(self._own.list())

    def __contains__(self, name: str) -> bool:
        return any(name == known for known, _ in self)

    def __repr__(self) -> str:
        return f"Registry({', '.join(name for name, _ in self)})"

    def usual(self) -> list[str]:
        """Names of those that take part in a comparison where none is named."""
        return list(self._own.usual())


_current: ModuleType = _native


def use(module: ModuleType) -> Registry:
    """Takes integrators, and the engine, from the module of a plug-in crate from here on.

    Scenes that were loaded before belong to the module before: load them again.
    """
    global _current
    for name in ("integrators", "Scene", "Session"):
        if not hasattr(module, name):
            raise TypeError(f"{module.__name__} is no module of integrators: it has no {name}")
    _current = module
    return Registry(module)


def engine() -> Any:
    """The compiled module in use."""
    return _current

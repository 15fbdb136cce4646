"""Progress for people."""

from __future__ import annotations

import sys
from typing import Any, Callable

Report = Callable[[float, float, float], None]


class Bar:
    """A bar of tqdm in terminals and notebooks; nothing elsewhere unless asked for."""

    def __init__(self, what: str, wanted: bool | Report | None) -> None:
        self._bar: Any = None
        self._report: Report | None = None
        if callable(wanted):
            self._report = wanted
        elif wanted or (wanted is None and (sys.stderr.isatty() or _in_notebook())):
            from tqdm.auto import tqdm

            form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"
            self._bar = tqdm(total=1.0, desc=what, bar_format=form, leave=False)

    @property
    def report(self) -> Report | None:
        """What the engine calls: share of the budget used, samples per pixel, seconds."""
        return self._set if self._bar is not None else self._report

    def _set(self, used: float, spp: float, seconds: float) -> None:
        self._bar.n = min(max(used, 0.0), 1.0)
        self._bar.set_postfix_str(f"{spp:g} spp", refresh=False)
        self._bar.refresh()

    def set(self, used: float, text: str = "") -> None:
        """The share done, with a word."""
        if self._bar is not None:
            self._bar.n = min(max(used, 0.0), 1.0)
            self._bar.set_postfix_str(text, refresh=False)
            self._bar.refresh()
        elif self._report is not None:
            self._report(used, float("nan"), float("nan"))

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    if shell is None:
        return False
    current = shell.get_ipython()
    return current is not None and current.__class__.__name__ == "ZMQInteractiveShell"

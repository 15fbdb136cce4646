"""Figures fit for a paper."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .comparison import Comparison

# Okabe and Ito's colours, which all eyes tell apart.
_COLOURS = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#000000", "#F0E442"]


def comparison_figure(found: Comparison) -> Any:
    """Error against time, and efficiencies over the baseline; a row for each scene."""
    import matplotlib.pyplot as plt

    rows = max(len(found.scenes), 1)
    with plt.rc_context({"pdf.fonttype": 42, "svg.fonttype": "none", "font.size": 8, "axes.grid": True, "grid.alpha": 0.3}):
        figure, axes = plt.subplots(rows, 2, figsize=(7, 2.6 * rows), squeeze=False, layout="constrained")
        for scene, (left, right) in zip(found.scenes, axes):
            _curves(left, scene)
            _ratios(right, scene)
    return figure


def _curves(ax: Any, scene: Any) -> None:
    for n, method in enumerate(scene.methods):
        colour = _COLOURS[n % len(_COLOURS)]
        # An estimate of a squared error that is not positive says only that it is small.
        points = [p for p in method.points if p.mse.value > 0 and p.seconds > 0]
        x, y = [p.seconds for p in points], [p.mse.value for p in points]
        low = [max(p.mse.low, 1e-3 * p.mse.value) if math.isfinite(p.mse.low) else p.mse.value for p in points]
        high = [p.mse.high if math.isfinite(p.mse.high) else p.mse.value for p in points]
        ax.plot(x, y, "o-", color=colour, label=method.integrator, markersize=3, linewidth=1)
        if len(points) > 1:
            ax.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)
        else:
            ax.vlines(x, low, high, color=colour, linewidth=1)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("seconds")
    ax.set_ylabel("MSE")
    ax.set_title(scene.scene)
    ax.legend(fontsize=7, frameon=False)


def _ratios(ax: Any, scene: Any) -> None:
    methods = [a for a in scene.methods if a.ratio is not None and a.ratio.value > 0]
    baseline = next((a.integrator for a in scene.methods if a.ratio is None), "the baseline")
    for row, method in enumerate(methods):
        colour = _COLOURS[scene.methods.index(method) % len(_COLOURS)]
        r = method.ratio
        ax.plot([r.value], [row], "o", color=colour, markersize=4)
        if math.isfinite(r.low) and math.isfinite(r.high):
            ax.hlines([row], r.low, r.high, color=colour, linewidth=1.5)
    ax.axvline(1.0, color="black", linewidth=0.8, linestyle=":")
    ax.set_xscale("log")
    ax.set_yticks(range(len(methods)), [a.integrator for a in methods])
    ax.set_ylim(len(methods) - 0.5, -0.5)
    ax.set_xlabel(f"efficiency over that of {baseline} (95 %); higher is better")

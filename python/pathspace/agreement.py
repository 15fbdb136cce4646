"""Do two sets of images, of any renderers, show the same expectation?"""

from __future__ import annotations

import glob
import json
import math
import os
from dataclasses import dataclass
from typing import Any, Iterable, Sequence

import numpy as np

from . import _native


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, told: dict[str, float | None] | None) -> Estimate | None:
        """From JSON, where null is NaN."""
        if told is None:
            return None
        return cls(*(math.nan if told[k] is None else told[k] for k in ("value", "low", "high")))

    def __str__(self) -> str:
        return f"{self.value:.3g} [{self.low:.3g}, {self.high:.3g}]"


@dataclass(frozen=True)
class Agreement:
    """What `agree` finds."""

    verdict: str
    """`agree`, `differ` or `inconclusive`."""
    ground: str
    """Why: `resolved`, `image`, `tiles`, `too_noisy`, `too_few_images`, `repeated`, `heavy_tail`, `black`, `one_black`."""
    p: float
    """p-value over the means of the channels and the tiles together; below alpha where the verdict is `differ`."""
    alpha: float
    """Level of the test."""
    mdb: float
    """Minimum detectable bias: a relative difference of the mean luminance that would have been found with probability 0.9."""
    tile_mdb: float | None
    """The same of one tile of up to 16 x 16, the median; from 16 images a side on."""
    difference: Estimate | None
    """Mean luminance of A over that of B, minus 1."""
    efficiency: Estimate | None
    """Efficiency 1/(MSE · seconds) of A over that of B, where seconds are known."""
    efficiency_relative: Estimate | None
    """The same with relMSE."""
    sigma: np.ndarray
    """Map of A − B in standard deviations, tiles of up to 64 x 64."""
    details: dict[str, Any]
    """All that was tested, as `pathspace agree --json` prints it."""

    def __bool__(self) -> bool:
        """True where they agree."""
        return self.verdict == "agree"

    def __str__(self) -> str:
        words = {
            "resolved": "no difference found",
            "image": "the mean over the image differs",
            "tiles": "the light lies in other places",
            "too_noisy": "more images or samples are needed",
            "too_few_images": "fewer than 4 images on a side",
            "repeated": "two images of a side are the same to the bit: every image needs a seed of its own",
            "heavy_tail": "rare bright pixels rule the images",
            "black": "all images are black",
            "one_black": "one side is black",
        }
        seen = f"; a bias of {100 * self.mdb:.2g} % would have been seen" if math.isfinite(self.mdb) else ""
        return f"{self.verdict}: {words.get(self.ground, self.ground)} (p = {self.p:.2g}){seen}"

    def plot(self, ax: Any = None) -> Any:
        """The map of differences with matplotlib; colours end at 5 σ."""
        import matplotlib.pyplot as plt

        if ax is None:
            _, ax = plt.subplots(layout="constrained")
        shown = ax.imshow(self.sigma, cmap="RdBu_r", vmin=-5, vmax=5, interpolation="nearest")
        ax.figure.colorbar(shown, ax=ax, label="A − B in σ")
        ax.set_xticks([])
        ax.set_yticks([])
        ax.set_title(f"{self.verdict}, p = {self.p:.2g}")
        return ax


def agree(
    a: Any,
    b: Any,
    *,
    alpha: float = 1e-4,
    limit: float = 0.05,
    seconds: tuple[float | Sequence[float] | None, float | Sequence[float] | None] | None = None,
) -> Agreement:
    """Tests whether two sets of images show the same expectation; the renderers do not matter.

    `a` and `b` are each an array (images, height, width, 3), a list of arrays, or files: a pattern such as
    `"mitsuba-*.exr"`, or a list of paths (`.exr`, `.pfm`, `.npy`). Every image comes from a seed of its own. Numbers
    and noise of the sides may differ; with fewer than 4 images a side there is no verdict, and from 16 on tiles are tested as well.

    `alpha` bounds the probability of `differ` where there is no difference; `limit` is the largest bias that an
    agreement may have missed. `seconds` of one image of A and of B (or one number each image) give the ratio of
    efficiencies; our own files bring theirs.
    """
    (images_a, own_a), (images_b, own_b) = _images(a), _images(b)
    given = seconds or (None, None)
    spent = [_seconds(given[0], own_a, len(images_a)), _seconds(given[1], own_b, len(images_b))]
    told = json.loads(_native.agree(images_a, images_b, alpha, limit, spent))
    grid = told["map"]
    return Agreement(
        verdict=told["verdict"],
        ground=told["ground"],
        p=told["p"],
        alpha=told["alpha"],
        mdb=math.inf if told["mdb"] is None else told["mdb"],
        tile_mdb=told["tile_mdb"],
        difference=Estimate.of(told["difference"]),
        efficiency=Estimate.of(told["efficiency"]),
        efficiency_relative=Estimate.of(told["efficiency_relative"]),
        sigma=np.array(grid["sigma"], dtype=np.float64).reshape(grid["rows"], grid["columns"]),
        details=told,
    )


def _images(given: Any) -> tuple[list[np.ndarray], list[float]]:
    """Images as contiguous arrays, and the seconds that files or images name, where all do."""
    if isinstance(given, (str, os.PathLike)):
        pattern = os.fspath(given)
        given = sorted(glob.glob(pattern))
        if not given:
            raise FileNotFoundError(f"{pattern}: no such file")
    images: list[np.ndarray] = []
    seconds: list[float] = []
    for one in _each(given):
        if isinstance(one, (str, os.PathLike)):
            array, spent = _native.read_image(os.fspath(one))
        else:
            spent = getattr(one, "stats", {}).get("seconds")
            array = np.asarray(one)
            if array.ndim == 2:
                array = np.repeat(array[..., None], 3, axis=2)
            if array.ndim != 3 or array.shape[2] < 3:
                raise ValueError(f"an image has shape (height, width, 3), not {array.shape}")
            array = array[..., :3]
        images.append(np.ascontiguousarray(array, dtype=np.float32))
        if spent is not None:
            seconds.append(float(spent))
    return images, seconds if len(seconds) == len(images) else []


def _each(given: Any) -> Iterable[Any]:
    try:
        return iter(given)
    except TypeError:
        raise TypeError("images are an array, a list of arrays, or paths") from None


def _seconds(given: float | Sequence[float] | None, own: list[float], count: int) -> list[float]:
    if given is None:
        return own
    return [float(s) for s in np.broadcast_to(np.asarray(given, dtype=np.float64), (count,))]

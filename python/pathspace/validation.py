"""Is an integrator right?"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import Any, Callable, Mapping, Sequence

from . import registry
from .agreement import agree
from .rendering import render
from .scene import Scene, as_scene


@dataclass(frozen=True)
class PairVerdict:
    """Two integrators on the paths that both can make."""

    a: str
    b: str
    verdict: str
    """`agree`, `differ` or `inconclusive`."""
    p: float
    mdb: float | None
    """Relative bias of the image that would have been found."""


@dataclass(frozen=True)
class Validation:
    """What `validate` found."""

    passed: bool
    """True where no pair differs and nothing failed."""
    pairs: list[PairVerdict]
    text: str = field(repr=False)
    """The report in words."""
    details: dict[str, Any] = field(repr=False)

    def __bool__(self) -> bool:
        return self.passed

    def __str__(self) -> str:
        return self.text


def validate(
    scene: Scene | str | os.PathLike[str] | Mapping[str, Any],
    integrators: Sequence[str | Callable[[Scene, int, int], Any]],
    *,
    seed: int = 1,
    spp: int = 16,
    alpha: float = 1e-5,
    replicates: int = 32,
    rays: int = 20_000_000,
    mdb: float = 0.01,
    threads: int | None = None,
) -> Validation:
    """Compares integrators on a scene, every pair of them, on the image, every path length, and tiles for each kind of path.

    `alpha` bounds the probability of one false `differ` or more in the whole report. Each integrator goes on until it
    would see a bias of `mdb` of the image, or has traced `rays` rays. Suspicious pairs are rendered again with fresh seeds.

    An integrator written in Python is a function of scene, samples per pixel and seed that gives an image. Where there is one,
    all are judged by their images alone: `replicates` images each of `spp` samples per pixel, every pair by `agree`.
    """
    scene = as_scene(scene)
    if any(callable(i) for i in integrators):
        return _by_images(scene, integrators, seed, spp, alpha, replicates, threads)
    engine = registry.engine()
    options = {
        "seed": seed, "alpha": alpha, "replicates": replicates, "rays": rays, "mdb": mdb, "threads": threads,
    }
    told, text, passed = engine.validate(engine.integrators, scene.native, list(integrators), options)
    details = json.loads(told)
    pairs = [
        PairVerdict(p["a"], p["b"], p["outcome"], p["p"], p["mdb"])
        for one in details["scenes"]
        for p in one["pairs"]
    ]
    return Validation(passed, pairs, text, details)


def _by_images(
    scene: Scene,
    integrators: Sequence[str | Callable[[Scene, int, int], Any]],
    seed: int,
    spp: int,
    alpha: float,
    replicates: int,
    threads: int | None,
) -> Validation:
    """Every pair by its images, at an equal share of alpha."""
    names = [i if isinstance(i, str) else i.__name__ for i in integrators]
    images = []
    for n, integrator in enumerate(integrators):
        # Seeds of the whole test are consecutive, and no two renders share one.
        seeds = range(seed + n * replicates, seed + (n + 1) * replicates)
        if isinstance(integrator, str):
            images.append([render(scene, integrator, spp=spp, seed=s, threads=threads) for s in seeds])
        else:
            images.append([integrator(scene, spp, s) for s in seeds])
    couples = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names))]
    found = [agree(images[i], images[j], alpha=alpha / max(len(couples), 1)) for i, j in couples]
    pairs = [
        PairVerdict(names[i], names[j], one.verdict, one.p, one.mdb) for (i, j), one in zip(couples, found)
    ]
    text = "\n".join(f"{names[i]} and {names[j]}: {one}" for (i, j), one in zip(couples, found))
    passed = all(pair.verdict != "differ" for pair in pairs)
    return Validation(passed, pairs, text, {"pairs": [one.details for one in found]})

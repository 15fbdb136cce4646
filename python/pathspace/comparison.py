"""Integrators compared: are they right, and which one is faster?"""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Iterable, Mapping, Sequence

from . import _native, registry
from .agreement import Estimate
from .progress import Bar, Report
from .scene import Scene, as_scene


@dataclass(frozen=True)
class Point:
    """One integrator with one budget: figures of one replicate, averaged over the replicates."""

    budget: str
    """`16 spp`, `0.5 s`."""
    seconds: float
    cpu_seconds: float
    spp: float
    mse: Estimate
    """Mean over pixels and channels of the squared error."""
    relmse: float
    """The same of error² / (reference² + ε)."""
    replicates: int
    nonfinite: int
    """Contributions that were not finite, in all replicates: a mistake where there are any."""


@dataclass(frozen=True)
class Method:
    """One integrator on one scene."""

    integrator: str
    points: list[Point]
    efficiency: Estimate
    """1/(MSE · seconds) at the largest budget."""
    ratio: Estimate | None
    """Efficiency over that of the baseline, on what both make; `None` for the baseline itself."""
    slope: Estimate | None
    """Slope of ln MSE against ln seconds, −1 expected; from three budgets on."""


@dataclass(frozen=True)
class Pair:
    """Two integrators on one scene."""

    a: str
    b: str
    verdict: str
    """`agree`, `differ` or `inconclusive`."""
    p: float
    mdb: float
    """Relative bias of the image that would have been found."""
    ratio: Estimate
    """Efficiency of a over that of b."""


@dataclass(frozen=True)
class SceneComparison:
    """All integrators on one scene."""

    scene: str
    size: tuple[int, int]
    methods: list[Method]
    pairs: list[Pair]

    def method(self, integrator: str) -> Method:
        """The method of an integrator."""
        for method in self.methods:
            if method.integrator == integrator:
                return method
        raise KeyError(f"{integrator}: none of {', '.join(a.integrator for a in self.methods)}")


@dataclass(frozen=True)
class Comparison:
    """What `compare` found; `details` is all of results.json."""

    scenes: list[SceneComparison]
    complete: bool
    """False where Ctrl-C stopped it: replicates are then missing."""
    notes: list[str]
    """What was left out, and why."""
    folder: Path
    details: dict[str, Any] = field(repr=False)
    _keep: Any = field(repr=False, default=None)

    @property
    def differ(self) -> list[tuple[str, Pair]]:
        """Scene and pair wherever two integrators differ: one of the two is wrong."""
        return [(s.scene, p) for s in self.scenes for p in s.pairs if p.verdict == "differ"]

    def to_pandas(self) -> Any:
        """A table with one row for each scene, integrator and budget."""
        import pandas

        rows = []
        for scene in self.scenes:
            for method in scene.methods:
                for n, point in enumerate(method.points):
                    last = n == len(method.points) - 1
                    ratio = method.ratio if last else None
                    rows.append(
                        {
                            "scene": scene.scene,
                            "integrator": method.integrator,
                            "budget": point.budget,
                            "seconds": point.seconds,
                            "cpu_seconds": point.cpu_seconds,
                            "spp": point.spp,
                            "replicates": point.replicates,
                            "mse": point.mse.value,
                            "mse_low": point.mse.low,
                            "mse_high": point.mse.high,
                            "relmse": point.relmse,
                            "efficiency": method.efficiency.value if last else math.nan,
                            "ratio": ratio.value if ratio else math.nan,
                            "ratio_low": ratio.low if ratio else math.nan,
                            "ratio_high": ratio.high if ratio else math.nan,
                            "nonfinite": point.nonfinite,
                        }
                    )
        return pandas.DataFrame(rows)

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """Error against time with 95 % bands, and efficiencies over the baseline with intervals, a row for each
        scene. `path` writes it (`.pdf` and `.svg` are vectors); the answer is matplotlib's figure."""
        from .plotting import comparison_figure

        figure = comparison_figure(self)
        if path is not None:
            figure.savefig(path)
        return figure

    def report(self, folder: str | os.PathLike[str]) -> Path:
        """Copies the page with its images and tables to `folder`; the answer is the page."""
        folder = Path(folder)
        if folder.resolve() != self.folder.resolve():
            shutil.copytree(self.folder, folder, dirs_exist_ok=True)
        return folder / "report.html"

    def _repr_html_(self) -> str:
        return self.to_pandas()._repr_html_()


def _estimate(told: Mapping[str, Any]) -> Estimate:
    found = Estimate.of({key: told[key] for key in ("value", "low", "high")})
    assert found is not None
    return found


def _nan(value: float | None) -> float:
    return math.nan if value is None else value


def results(folder: str | os.PathLike[str]) -> Comparison:
    """The results of an experiment that the command, or `compare`, has left in a folder."""
    folder = Path(folder)
    told = json.loads((folder / "results.json").read_text())
    return _comparison(told, folder, None)


def _comparison(told: dict[str, Any], folder: Path, keep: Any) -> Comparison:
    units = {"seconds": "s", "spp": "spp"}

    def point(p: Mapping[str, Any]) -> Point:
        budget = f"{p['budget']['value']:g} {units[p['budget']['kind']]}"
        return Point(
            budget,
            _nan(p["seconds"]),
            _nan(p["cpu_seconds"]),
            _nan(p["spp"]),
            _estimate(p["mse"]),
            _nan(p["relmse"]),
            p["replicates"],
            p["nonfinite"],
        )

    def method(a: Mapping[str, Any]) -> Method:
        ratio = _estimate(a["ratio"]) if a["ratio"] else None
        slope = _estimate(a["slope"]) if a["slope"] else None
        return Method(a["integrator"], [point(p) for p in a["points"]], _estimate(a["efficiency"]), ratio, slope)

    def pair(p: Mapping[str, Any]) -> Pair:
        ratio = Estimate(*(_nan(p[f"efficiency_ratio{end}"]) for end in ("", "_low", "_high")))
        return Pair(p["a"], p["b"], p["verdict"], _nan(p["p"]), _nan(p["mdb"]), ratio)

    scenes = [
        SceneComparison(
            s["name"],
            (s["width"], s["height"]),
            [method(a) for a in s["methods"]],
            [pair(p) for p in s["pairs"]],
        )
        for s in told["scenes"]
    ]
    return Comparison(scenes, told["complete"], told["notes"], folder, told, keep)


def compare(
    scenes: Any,
    integrators: Sequence[str] = (),
    *,
    seconds: float | Sequence[float] | None = None,
    spp: int | Sequence[int] | None = None,
    sweep: str | None = None,
    replicates: int = 16,
    seed: int = 1,
    baseline: str | None = None,
    target_error: float | None = None,
    references: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: bool | Report | None = None,
    client: Any = None,
) -> Comparison:
    """Compares integrators on scenes with equal budgets: an experiment of `pathspace compare`.

    `scenes` is one scene or a list, each as in `render`; `integrators` are names with options, all there are unless given.
    A budget is `seconds` or `spp`, several of them, or one with `sweep="A..B"` for 2^A to 2^B times as much. `baseline` is
    the integrator that ratios are relative to, the first unless given.

    With `output` the results stay there, and the same call goes on after a stop with what is missing. With a Dask
    `client` renders are made on the cluster, one replicate at a time with `threads` threads each (1 unless given), and judged here.
    Ctrl-C stops it; the answer is then what can be said so far.
    """
    listed = [scenes] if isinstance(scenes, (str, os.PathLike, Scene, Mapping)) else list(scenes)
    loaded = [as_scene(scene) for scene in listed]
    if client is not None and threads is None:
        threads = 1
    keep = None
    if output is None:
        keep = tempfile.TemporaryDirectory(prefix="pathspace-compare-")
        folder = Path(keep.name)
    else:
        folder = Path(output)
        folder.mkdir(parents=True, exist_ok=True)
    integrators = list(integrators) or registry.Registry().usual()
    experiment = {
        "integrators": integrators,
        "spp": spp if spp is None or isinstance(spp, int) else list(spp),
        "seconds": seconds if seconds is None or isinstance(seconds, (int, float)) else list(map(float, seconds)),
        "sweep": sweep,
        "replicates": replicates,
        "seed": seed,
        "threads": threads,
        "baseline": baseline,
        "target_error": target_error,
        "references": None if references is None else os.path.abspath(references),
    }
    if isinstance(experiment["seconds"], int):
        experiment["seconds"] = float(experiment["seconds"])
    written = [_scene(scene, folder, n) for n, scene in enumerate(loaded)]
    path = folder / "compare.toml"
    path.write_text(_toml({"scenes": written, **experiment}))
    with Bar("compare", progress) as bar:
        if client is not None:
            from .cluster import cells_on

            cells_on(client, loaded, experiment, folder / "cells", bar)
        budgets = _count(spp) * _count(seconds) * _points(sweep)
        expected = len(loaded) * len(integrators) * replicates * budgets
        _run(path, folder, lambda done: bar.set(done / expected, f"{done} of {expected} renders"))
    told = json.loads((folder / "results.json").read_text())
    return _comparison(told, folder, keep)


def _count(budget: Any) -> int:
    return 1 if budget is None or isinstance(budget, (int, float)) else len(list(budget))


def _points(sweep: str | None) -> int:
    if sweep is None:
        return 1
    low, _, high = sweep.partition("..")
    try:
        return max(int(high) - int(low) + 1, 1)
    except ValueError:
        raise ValueError(f"sweep: expected A..B, not {sweep!r}") from None


def _run(experiment: Path, folder: Path, progress: Callable[[int], None]) -> None:
    """Runs the command on an experiment; Ctrl-C stops it after the render under way."""
    words = [sys.executable, "-m", "pathspace", "compare", "--experiment", str(experiment), "-o", str(folder)]
    environment = dict(os.environ, PATHSPACE_MODULE=registry.engine().__name__)
    with tempfile.TemporaryFile("w+") as said:
        # In a session of its own it has Ctrl-C from here alone, once.
        process = subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=said, env=environment, start_new_session=True
        )
        try:
            while True:
                try:
                    process.wait(0.2)
                    break
                except subprocess.TimeoutExpired:
                    progress(len(list((folder / "cells").glob("*.cell"))))
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.wait()
        except BaseException:
            process.kill()
            raise
        said.seek(0)
        lines = said.read().splitlines()
    errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    if process.returncode not in (0, 1):
        raise _native.PathspaceError(errors[-1] if errors else f"the command ended with {process.returncode}")
    for line in lines:
        if line.startswith("warning: "):
            warnings.warn(line.removeprefix("warning: "), stacklevel=4)


def _scene(scene: Scene, folder: Path, number: int) -> dict[str, Any]:
    """A scene as a table of an experiment."""
    source, changes = scene.source, dict(scene.source.changes)
    if changes.pop("box_filter", None):
        raise ValueError(f"{scene.name}: a comparison takes the filter of the scene, not box_filter")
    name = source.text
    if source.kind == "text":
        path = folder / "scenes" / f"dictionary-{number + 1}.xml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(source.text)
        name = str(path.resolve())
    elif source.kind == "file":
        name = os.path.abspath(source.text)
    elif source.kind == "files":
        raise ValueError(f"{scene.name}: came from another machine; load it from its file")
    table: dict[str, Any] = {"scene": name}
    if "size" in changes:
        table["size"] = "{}x{}".format(*changes["size"])
    if "crop" in changes:
        table["crop"] = ",".join(map(str, changes["crop"]))
    if "max_depth" in changes:
        table["max_depth"] = changes["max_depth"]
    if source.params:
        table["define"] = dict(source.params)
    return table


def _toml(table: Mapping[str, Any]) -> str:
    return "".join(f"{key} = {_value(v)}\n" for key, v in table.items() if v is not None)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    # JSON's strings, numbers and booleans are TOML's.
    return json.dumps(value)

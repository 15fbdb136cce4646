"""Renders on many machines, by Dask.

A Dask client decides where the work goes: `distributed.LocalCluster`, or dask-jobqueue for Slurm, PBS, SGE and LSF.

>>> from dask_jobqueue import SLURMCluster
>>> from distributed import Client
>>> cluster = SLURMCluster(cores=8, processes=8, memory="16GB", walltime="01:00:00")
>>> cluster.scale(jobs=4)
>>> image = ps.render(scene, "bdpt", spp=4096, client=Client(cluster))

A render is shared out in `pieces`: piece i of n is the shard i/n of the command, every n-th step, or, for Markov chains, a run
with a seed of its own. Pieces are put together in their order. The image depends on their number and on nothing else: not on the number of
workers, not on who rendered what, nor on those that died. A piece that is lost is rendered again. A scene travels once to each
worker, with all its files.

All machines need the same Python and the same pathspace. From a shell: `python -m pathspace.cluster SCENE --spp 1024 -o out.exr`.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import pickle
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Iterable

from . import _native, registry
from .image import Image, framed
from .progress import Bar, Report
from .rendering import Session
from .scene import Scene, Source, load_file

PIECES = 32
"""Pieces of a render, where their number is not given; a constant, so that images do not depend on who renders them."""

_AGAIN = 100
_PARTIAL_SECONDS = 2.0
_CACHE: dict[str, Scene] = {}


def render_on(
    client: Any,
    scene: Scene,
    integrator: str,
    *,
    spp: int,
    seed: int = 1,
    layers: Iterable[str] = (),
    threads: int | None = None,
    pieces: int | None = None,
    progress: bool | Report | None = None,
    partial: Callable[[Image], None] | None = None,
    folder: str | os.PathLike[str] | None = None,
) -> Image:
    """Renders `spp` samples per pixel in pieces; what `render(client=...)` does.

    `threads` are those of one piece: 1 unless given, because workers have several. `partial` is called with the image so far, every
    few seconds. In `folder` pieces are kept: the same call goes on with those that are missing, and `merge` reads them.
    """
    count = min(pieces or PIECES, spp)
    if count < 1:
        raise ValueError("spp and pieces must be 1 at least")
    # Refused here and at once, not on every worker.
    Session(scene, integrator, seed=seed, layers=layers, shard=(1, count))
    with tempfile.TemporaryDirectory(prefix="pathspace-pieces-") as temporary:
        place = Path(folder or temporary)
        place.mkdir(parents=True, exist_ok=True)
        paths = [place / f"piece-{i + 1:05}-of-{count}.film" for i in range(count)]
        missing = [i for i, path in enumerate(paths) if not path.exists()]
        bundle, key = _scatter(client, scene)
        layers = tuple(layers)
        shown = time.monotonic()
        done = count - len(missing)

        def submit(i: int) -> Any:
            job = (key, integrator, seed, layers, threads or 1, spp, i + 1, count)
            return client.submit(_piece, bundle, *job, pure=False)

        with Bar(f"{scene.name} by {integrator}", progress) as bar:
            bar.set(done / count)
            for i, content in _each(client, missing, submit):
                _whole(paths[i], content)
                done += 1
                bar.set(done / count, f"{done} of {count} pieces")
                if partial is not None and time.monotonic() - shown > _PARTIAL_SECONDS:
                    partial(_merged([p for p in paths if p.exists()]))
                    shown = time.monotonic()
        return _merged(paths)


def _merged(paths: list[Path]) -> Image:
    frame, _ = _native.merge([str(p) for p in paths])
    return framed(frame)


def _each(client: Any, items: Iterable[Any], submit: Callable[[Any], Any]) -> Iterable[tuple[Any, Any]]:
    """Results as they come. What is lost with its worker is submitted again; what fails by itself is raised."""
    from distributed import as_completed

    items = list(items)
    of = {}
    for item in items:
        of[submit(item)] = item
    tried = dict.fromkeys(items, 0)
    waiting = as_completed(list(of), with_results=True, raise_errors=False)
    for future, result in waiting:
        item = of.pop(future)
        if future.status == "finished" and not isinstance(result, BaseException):
            yield item, result
            continue
        error = future.exception() if future.status == "error" else None
        if isinstance(error, (_native.PathspaceError, ValueError, TypeError)):
            raise error
        tried[item] += 1
        if tried[item] > _AGAIN:
            raise RuntimeError(f"lost {_AGAIN} times with the worker it was on") from error
        again = submit(item)
        of[again] = item
        waiting.add(again)


def _scatter(client: Any, scene: Scene) -> tuple[Any, str]:
    """The scene for all workers, by a hash of its content, and a name for it there.

    A task and no scattered data: it is made again where all workers that had it have died.
    """
    source = scene.source.packed()
    name = hashlib.blake2b(pickle.dumps((scene.native.key, source)), digest_size=16).hexdigest()
    return client.submit(_carry, source, key=f"pathspace-scene-{name}"), scene.native.key


def _carry(source: Source) -> Source:
    return source


def _scene(source: Source, key: str) -> Scene:
    """The scene of a worker's process, built once."""
    if key not in _CACHE:
        if len(_CACHE) >= 4:
            _CACHE.clear()
        _CACHE[key] = source.load()
    return _CACHE[key]


def _piece(
    source: Source,
    key: str,
    integrator: str,
    seed: int,
    layers: tuple[str, ...],
    threads: int,
    spp: int,
    index: int,
    count: int,
) -> bytes:
    """One piece, as the file of its sums."""
    session = Session(
        _scene(source, key), integrator, seed=seed, threads=threads, layers=layers, shard=(index, count)
    )
    session.run(spp=spp)
    with tempfile.TemporaryDirectory(prefix="pathspace-piece-") as folder:
        path = Path(folder) / "piece.film"
        session.save(path)
        return path.read_bytes()


def _cell(
    source: Source,
    key: str,
    integrator: str,
    replicate: dict[str, Any],
) -> tuple[str, bytes]:
    """One render of a comparison: name and content of its file."""
    scene, engine = _scene(source, key), registry.engine()
    with tempfile.TemporaryDirectory(prefix="pathspace-cell-") as folder:
        engine.render_cell(engine.integrators, scene.native, integrator, replicate, folder)
        [path] = Path(folder).glob("*.cell")
        return path.name, path.read_bytes()


def cells_on(client: Any, scenes: list[Scene], experiment: dict[str, Any], folder: Path, bar: Bar) -> None:
    """Renders of an experiment on the cluster, each left in `folder`, where the command finds them."""
    folder.mkdir(parents=True, exist_ok=True)
    engine = registry.engine()
    threads, seed = experiment["threads"], experiment["seed"]
    jobs = []
    for scene in scenes:
        bundle, key = _scatter(client, scene)
        for number in range(experiment["replicates"]):
            for spp, seconds in _budgets(experiment):
                replicate = {
                    "spp": spp, "seconds": seconds, "replicate": number, "seed": seed, "threads": threads,
                }
                for integrator in experiment["integrators"]:
                    job = (engine.integrators, scene.native, integrator, replicate, folder)
                    if not engine.render_cell(*job, ask=True):
                        jobs.append((bundle, key, integrator, replicate))

    def submit(n: int) -> Any:
        return client.submit(_cell, *jobs[n], pure=False)

    for done, (_, (name, content)) in enumerate(_each(client, range(len(jobs)), submit)):
        _whole(folder / name, content)
        bar.set((done + 1) / len(jobs), f"{done + 1} of {len(jobs)} renders")


def _budgets(experiment: dict[str, Any]) -> list[tuple[int | None, float | None]]:
    """Budgets in samples or seconds, as the command counts them."""

    def listed(value: Any) -> list[Any]:
        return [] if value is None else list(value) if isinstance(value, (list, tuple)) else [value]

    spp, seconds = listed(experiment["spp"]), listed(experiment["seconds"])
    if experiment["sweep"]:
        low, _, high = experiment["sweep"].partition("..")
        factors = [2**k for k in range(int(low), int(high) + 1)]
        spp = [n * f for n in spp for f in factors]
        seconds = [s * f for s in seconds for f in factors]
        if not spp and not seconds:
            spp = factors
    return [(n, None) for n in spp] + [(None, float(s)) for s in seconds]


def _whole(path: Path, content: bytes) -> None:
    """Writes a file that is whole or not there."""
    part = path.with_suffix(".part")
    part.write_bytes(content)
    part.replace(path)


def main(arguments: list[str] | None = None) -> int:
    """The command `python -m pathspace.cluster`."""
    parser = argparse.ArgumentParser(
        prog="python -m pathspace.cluster", description="Renders a scene on a Dask cluster."
    )
    parser.add_argument("scene", help="scene file, or name of a scene of the library")
    parser.add_argument("-i", "--integrator", help="integrator with its options; that of the scene unless given")
    parser.add_argument("--spp", type=int, help="samples per pixel; those of the scene unless given")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", default="out.exr", help="image to write (.exr, .png, .npy, .pfm)")
    parser.add_argument("--size", help="size of the film, such as 640x480")
    parser.add_argument("--pieces", type=int, default=PIECES, help="the image depends on it, not on workers")
    parser.add_argument("--threads", type=int, default=1, help="threads of one piece")
    parser.add_argument("--folder", help="keeps the pieces; the same command goes on with what is missing")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--scheduler", help="address or scheduler file of a running cluster")
    where.add_argument("--workers", type=int, help="processes on this machine, where no scheduler is given")
    given = parser.parse_args(arguments)
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        parser.error("Dask is missing: pip install 'pathspace[cluster]'")
    from .scene import library

    changes: dict[str, Any] = {}
    try:
        if given.size:
            width, _, height = given.size.lower().partition("x")
            changes["size"] = (int(width), int(height))
        known = given.scene in library
        scene = library(given.scene, **changes) if known else load_file(given.scene, **changes)
        spp = given.spp or scene.spp
        if spp is None:
            parser.error("a goal is missing: --spp")
        if given.scheduler and os.path.exists(given.scheduler):
            client = Client(scheduler_file=given.scheduler)
        elif given.scheduler:
            client = Client(given.scheduler)
        else:
            client = Client(LocalCluster(n_workers=given.workers, threads_per_worker=1, dashboard_address=":0"))
        with client:
            image = render_on(
                client,
                scene,
                given.integrator or scene.integrator or "pt",
                spp=spp,
                seed=given.seed,
                threads=given.threads,
                pieces=given.pieces,
                folder=given.folder,
            )
        for path in image.write(given.output):
            print(f"wrote {path}")
    except (_native.PathspaceError, ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

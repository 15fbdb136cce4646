"""Rendering: at once, or step by step."""

from __future__ import annotations

import os
from typing import Any, Iterable, Mapping

from . import registry
from .image import Image, framed
from .progress import Bar, Report
from .scene import Scene, as_scene


def render(
    scene: Scene | str | os.PathLike[str] | Mapping[str, Any],
    integrator: str | None = None,
    *,
    spp: int | None = None,
    seconds: float | None = None,
    error: float | None = None,
    seed: int = 1,
    threads: int | None = None,
    layers: Iterable[str] = (),
    progress: bool | Report | None = None,
    client: Any = None,
    pieces: int | None = None,
    folder: str | os.PathLike[str] | None = None,
) -> Image:
    """Renders a scene.

    `scene` is a `Scene`, a path, the name of a scene of the library, or a dictionary. `integrator` is a name with
    options, such as `"bdpt"` or `"pt:nee=false,max_depth=5"`; that of the scene file unless given. It ends with
    `spp` samples per pixel, after `seconds`, or at a relative error of the image (root mean square noise of a pixel over mean
    brightness), whichever comes first; with the samples of the file where nothing is given.

    `layers` are of `length`, `st`, `unweighted`, `emitter`. `progress` is True, False, a function of (share done, samples
    per pixel, seconds), or None: a bar where somebody looks. With a Dask `client` the work is shared out in `pieces`, kept in
    `folder` where one is given; see `pathspace.cluster`.

    The same scene, integrator, seed and samples give the same bits for any number of threads, and as the command gives.
    Ctrl-C stops it within a second; the image is then what there is, with `complete` False.
    """
    scene = as_scene(scene)
    integrator = integrator or scene.integrator or "pt"
    if spp is None and seconds is None and error is None:
        spp = scene.spp
        if spp is None:
            raise ValueError("a goal is missing: spp, seconds or error")
    if client is not None:
        from .cluster import render_on

        if error is not None or seconds is not None:
            raise ValueError("pieces are shared out by samples: give spp, not seconds or error")
        return render_on(
            client, scene, integrator, spp=spp, seed=seed, layers=layers, threads=threads, pieces=pieces, progress=progress,
            folder=folder,
        )
    if pieces is not None or folder is not None:
        raise ValueError("pieces and folder are for a client, which is missing")
    session = Session(scene, integrator, seed=seed, threads=threads, layers=layers)
    with Bar(f"{scene.name} by {integrator}", progress) as bar:
        frame, _ = session.native.run(spp, seconds, error, bar.report)
    return framed(frame)


class Session:
    """A render that goes on: step, look, save, resume.

    >>> session = ps.Session(scene, "mmlt")
    >>> for _ in range(10):
    ...     session.step(4)             # four more samples per pixel
    ...     show(session.film())
    >>> session.save("render.checkpoint")
    >>> session = ps.Session.resume("render.checkpoint", scene, "mmlt")

    It goes on to the bit as if never interrupted. `film` may be called while another thread renders.
    """

    def __init__(
        self,
        scene: Scene | str | os.PathLike[str] | Mapping[str, Any],
        integrator: str | None = None,
        seed: int = 1,
        *,
        threads: int | None = None,
        layers: Iterable[str] = (),
        shard: tuple[int, int] | None = None,
        _resume: str | None = None,
    ) -> None:
        self.scene = as_scene(scene)
        integrator = integrator or self.scene.integrator or "pt"
        if shard is not None:
            # Counted from 1, as the command does.
            shard = (shard[0] - 1, shard[1])
            if not 0 <= shard[0] < shard[1]:
                raise ValueError("a shard is (i, n) with 1 <= i <= n")
        engine = registry.engine()
        options = {"seed": seed, "layers": list(layers), "threads": threads, "shard": shard, "resume": _resume}
        self.native = engine.Session(engine.integrators, self.scene.native, integrator, options)
        self._shards = 1 if shard is None else shard[1]

    @classmethod
    def resume(
        cls,
        path: str | os.PathLike[str],
        scene: Scene | str | os.PathLike[str] | Mapping[str, Any],
        integrator: str | None = None,
        seed: int = 1,
        **options: Any,
    ) -> Session:
        """Goes on from a checkpoint, which must be of this very render."""
        return cls(scene, integrator, seed, _resume=os.fspath(path), **options)

    def __repr__(self) -> str:
        return f"<Session {self.scene.name} by {self.integrator}>"

    @property
    def integrator(self) -> str:
        """The integrator with every option that is not its default."""
        return self.native.spec

    def step(self, samples: int = 1) -> Image:
        """So many samples per pixel more."""
        return self.run(spp=(self._steps() + samples) * self._shards)

    def run(
        self,
        *,
        spp: int | None = None,
        seconds: float | None = None,
        error: float | None = None,
        progress: bool | Report | None = False,
    ) -> Image:
        """Renders until the whole session has so many samples per pixel, seconds, or so small an error.

        Ctrl-C raises `KeyboardInterrupt` after the step under way; the session can be gone on with.
        """
        with Bar(repr(self), progress) as bar:
            frame, interrupted = self.native.run(spp, seconds, error, bar.report)
        if interrupted:
            raise KeyboardInterrupt
        return framed(frame)

    def _steps(self) -> int:
        return self.native.look()["steps"]

    def film(self) -> Image:
        """The image so far; while another thread renders, after its step under way."""
        return framed(self.native.look())

    def stop(self) -> None:
        """Ends the `run` of another thread after its step under way."""
        self.native.stop()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a checkpoint; shards are put together by `merge`."""
        self.native.save(os.fspath(path))

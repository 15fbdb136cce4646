"""Images: arrays that know how they were made."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Iterable, Mapping

import numpy as np

from . import _native


class Image(np.ndarray):
    """A float32 array (height, width, 3) of linear sRGB radiance, first row at the top, that shows itself in
    notebooks.

    Results of arithmetic are images too, without layers and figures.
    """

    layers: dict[str, np.ndarray]
    """Layers by name: `length.03`, `technique.s02.t01`, `unweighted.s02.t01`, `emitter.000`."""
    stats: dict[str, Any]
    """Figures of the render: steps, samples, rays, cpu_seconds, nonfinite, integrator, seed, …"""
    exposure: float | None
    """Factor on radiance when shown; `None` brings the 95 % quantile of luminance near white."""

    def __array_finalize__(self, other: Any) -> None:
        self.layers = {}
        self.stats = {}
        self.exposure = getattr(other, "exposure", None)

    @classmethod
    def of(cls, array: Any, layers: Mapping[str, Any] | None = None, **stats: Any) -> Image:
        """Any array (height, width, 3) as an image; no copy where it is float32 already."""
        image = np.asarray(array, dtype=np.float32).view(cls)
        if image.ndim != 3 or image.shape[2] != 3:
            raise ValueError(f"an image has shape (height, width, 3), not {image.shape}")
        image.layers = {name: np.asarray(v) for name, v in (layers or {}).items()}
        image.stats = dict(stats)
        return image

    @property
    def samples(self) -> float:
        """Samples per pixel."""
        return self.stats.get("samples_per_pixel", float("nan"))

    @property
    def seconds(self) -> float:
        """Seconds of rendering."""
        return self.stats.get("seconds", float("nan"))

    @property
    def complete(self) -> bool:
        """False where Ctrl-C stopped the render."""
        return bool(self.stats.get("complete", True))

    def show(self, exposure: float | None = None) -> Image:
        """The same image, shown with radiance multiplied by `exposure` (`None`: chosen from the image)."""
        view = self.view()
        view.exposure, view.layers, view.stats = exposure, self.layers, self.stats
        return view

    def png(self, exposure: float | None = None) -> bytes:
        """The tone-mapped image as PNG: exposure, a soft shoulder, the sRGB curve."""
        own = np.asarray(self)
        if own.ndim != 3 or own.shape[2] != 3:
            raise ValueError(f"an image has shape (height, width, 3), not {own.shape}")
        own = np.ascontiguousarray(own, dtype=np.float32)
        exposure = self.exposure if exposure is None else exposure
        return _native.png(own, _native.exposure(own) if exposure is None else exposure)

    def _repr_png_(self) -> bytes | None:
        return self.png() if self.ndim == 3 and self.shape[2] == 3 else None

    def write(self, path: str | os.PathLike[str], exposure: float | None = None) -> list[Path]:
        """Writes `.exr` (with layers and figures, and a PNG beside it), `.png`, `.npy` or `.pfm`; the answer is
        the files written."""
        path = Path(path)
        own = np.ascontiguousarray(np.asarray(self), dtype=np.float32)
        kind = path.suffix.lower()
        if kind == ".exr":
            return self._write_exr(path, own, exposure)
        if kind == ".png":
            path.write_bytes(self.png(exposure))
        elif kind == ".npy":
            np.save(path, own)
        elif kind == ".pfm":
            header = f"PF\n{own.shape[1]} {own.shape[0]}\n-1.0\n".encode()
            path.write_bytes(header + own[::-1].astype("<f4").tobytes())
        else:
            raise ValueError(f"{path}: unknown kind of image (known: .exr, .png, .npy, .pfm)")
        return [path]

    def _write_exr(self, path: Path, own: np.ndarray, exposure: float | None) -> list[Path]:
        layers = [(name, np.ascontiguousarray(v, dtype=np.float32)) for name, v in self.layers.items()]
        text = {key: str(self.stats.get(key, "")) for key in ("scene", "scene_hash", "integrator")}
        text["seed"] = str(self.stats.get("seed", 0))
        figures = {key: float(self.stats.get(key, 0.0)) for key in ("samples_per_pixel", "seconds")}
        exposure = self.exposure if exposure is None else exposure
        window = self.stats.get("window")
        return _native.write_image(path, own, layers, window, text, figures, exposure)


def framed(frame: Mapping[str, Any]) -> Image:
    """The image of a frame of the engine."""
    stats = {key: value for key, value in frame.items() if key not in ("image", "layers")}
    return Image.of(frame["image"], frame["layers"], **stats)


def read(path: str | os.PathLike[str]) -> Image:
    """Reads an image of any renderer: `.exr` (R, G, B or Y), `.pfm` or `.npy`."""
    array, seconds = _native.read_image(os.fspath(path))
    return Image.of(array, **({} if seconds is None else {"seconds": seconds}))


def merge(
    paths: Iterable[str | os.PathLike[str]], output: str | os.PathLike[str] | None = None
) -> Image:
    """Puts the sums of shards (`.film`) together, as `pathspace merge` does; `output` keeps the sums.

    `stats["missing"]` lists the shards that are in none of the files, counted from 1.
    """
    frame, missing = _native.merge(list(map(os.fspath, paths)), output)
    image = framed(frame)
    image.stats["missing"] = [i + 1 for i in missing]
    return image

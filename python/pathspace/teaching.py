"""Integrators in NumPy, to teach and to try ideas. They are slow, and they are judged like any other:

>>> ps.validate(scene, [path_tracer, "pt"])

All queries take and give arrays with one row for each ray.

| Query | Gives |
| --- | --- |
| `scene.sample_sensor(pixels, u)` | positions on the film, origins and directions of camera rays |
| `hits = scene.intersect(o, d)` | the closest surfaces: `hits.hit`, `p`, `n_g`, `n_s`, `material` |
| `hits.radiance` | L_e back along each ray, of the surroundings where nothing was hit |
| `hits.trace(d)` | the closest surfaces from these points in directions `d` |
| `hits.bsdf_eval(wo, wi)` | f(ω_o, ω_i) in 1/sr, without cosine |
| `hits.bsdf_pdf(wo, wi)` | density of `bsdf_sample` per solid angle |
| `hits.bsdf_sample(wo, u)` | `wi`, weight f·abs(cos θ_i)/p, pdf, whether the event is specular |
| `lights = hits.sample_emitters(u)` | `lights.d`, `radiance`, `pdf`, `delta`, `visible` |
| `hits.emitters_pdf(before)` | density with which `before.sample_emitters` takes these rays |
| `hits.visible(others)` | V, point by point |

Directions are unit vectors that point away from the surface; densities are per solid angle. Positions are those of the normalised
scene. A ray of direction 0 hits nothing. Rays see surfaces alone, not what is between them: scenes with media are for `render`.
"""

from __future__ import annotations

import numpy as np

from .image import Image
from .scene import Scene


class Film:
    """Sums of contributions, with the box filter."""

    def __init__(self, scene: Scene) -> None:
        self._width, self._height = scene.size
        self._origin = scene.origin
        self._sums = np.zeros((self._height * self._width, 3))

    def splat(self, position: np.ndarray, value: np.ndarray) -> None:
        """Adds values (n, 3) at positions (n, 2) in pixels of the whole film."""
        x, y = (np.floor(np.asarray(position, dtype=np.float64)).astype(int) - self._origin).T
        inside = (x >= 0) & (y >= 0) & (x < self._width) & (y < self._height)
        np.add.at(self._sums, (y * self._width + x)[inside], np.asarray(value)[inside])

    def image(self, spp: float) -> Image:
        """The sums over the samples per pixel."""
        return Image.of((self._sums / spp).reshape(self._height, self._width, 3), samples_per_pixel=spp)


def path_tracer(scene: Scene, spp: int, seed: int) -> Image:
    """Path tracing with next-event estimation and multiple importance sampling (Veach 1997; power heuristic)."""
    if scene.info()["media"]:
        raise ValueError("path_tracer knows no media")
    rng = np.random.default_rng(seed)
    film, count = Film(scene), scene.size[0] * scene.size[1]
    longest = scene.info()["max_depth"] or 64
    uniform = lambda k: rng.random((count, k), dtype=np.float32)
    column = lambda v: np.asarray(v, dtype=np.float64)[:, None]
    for _ in range(spp):
        position, o, d = scene.sample_sensor(np.arange(count), uniform(4))
        value, throughput = np.zeros((count, 3)), np.ones((count, 3))
        before, pdf, only_hit = None, np.zeros(count), np.ones(count, bool)
        for length in range(1, longest + 1):
            # Technique s = 0: the ray has hit an emitter.
            hits = scene.intersect(o, d) if before is None else before.trace(d)
            other = np.zeros(count) if before is None else hits.emitters_pdf(before)
            weight = np.where(only_hit, 1.0, pdf**2 / np.maximum(pdf**2 + other**2, 1e-300))
            value += throughput * hits.radiance * column(weight)
            if length == longest or not hits.hit.any():
                break
            # Technique s = 1: a point on an emitter is sampled and connected.
            lights = hits.sample_emitters(uniform(3))
            f = hits.bsdf_eval(-d, lights.d) * column(np.abs(np.sum(hits.n_s * lights.d, axis=1)))
            other = np.where(lights.delta, 0.0, hits.bsdf_pdf(-d, lights.d))
            # The density of the light times its weight, w/p = p/(p² + q²).
            share = lights.visible * lights.pdf / np.maximum(lights.pdf**2 + other**2, 1e-300)
            value += throughput * f * lights.radiance * column(share)
            # The next direction.
            wi, weight, pdf, only_hit = hits.bsdf_sample(-d, uniform(3))
            throughput *= weight
            # Roulette keeps the expectation and ends what carries little.
            survival = np.minimum(throughput.max(axis=1), 0.95) if length >= 5 else np.ones(count)
            alive = hits.hit & (rng.random(count) < survival)
            throughput = np.where(column(alive), throughput / np.maximum(column(survival), 1e-300), 0.0)
            before, d = hits, np.where(column(alive), wi, 0.0).astype(np.float32)
        film.splat(position, value)
    return film.image(spp)

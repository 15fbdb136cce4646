"""Queries on arrays, and the path tracer in NumPy."""

import numpy as np
import pytest

import pathspace as ps
from pathspace.teaching import Film, path_tracer


@pytest.fixture
def rays(scene):
    count = scene.size[0] * scene.size[1]
    rng = np.random.default_rng(1)
    return scene.sample_sensor(np.arange(count), rng.random((count, 4)))


def test_camera_rays_start_at_the_camera_and_hit_what_they_should(scene, rays):
    film, o, d = rays
    assert film.shape == (24 * 16, 2) and np.ptp(o, axis=0).max() == 0.0
    assert np.allclose(np.linalg.norm(d, axis=1), 1.0, atol=1e-6)
    hits = scene.intersect(o, d)
    assert len(hits) == len(o) and 0 < hits.hit.sum() < len(o)
    normals = hits.n_g[hits.hit]
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    assert (hits.material[~hits.hit] == -1).all()
    assert not scene.intersect(o, np.zeros_like(d)).hit.any()


def test_densities_of_directions_integrate_to_one(scene, rays):
    _, o, d = rays
    hits = scene.intersect(o, d)
    lit = hits.hit & (np.sum(hits.n_s * -d, axis=1) > 0)
    rng, total, runs = np.random.default_rng(2), np.zeros(len(o)), 400
    for _ in range(runs):
        wi = rng.standard_normal(d.shape)
        wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
        total += hits.bsdf_pdf(-d, wi) * 4 * np.pi / runs
    # The lamp is black and samples nothing worth a density; the ball is diffuse.
    ball = lit & (hits.radiance.max(axis=1) == 0)
    assert abs(total[ball].mean() - 1.0) < 0.02


def test_weights_are_value_times_cosine_over_density(scene, rays):
    _, o, d = rays
    hits = scene.intersect(o, d)
    wi, weight, pdf, specular = hits.bsdf_sample(-d, np.random.default_rng(3).random(d.shape))
    some = pdf > 0
    cosine = np.abs(np.sum(hits.n_s * wi, axis=1))
    expected = hits.bsdf_eval(-d, wi) * (cosine / np.where(some, pdf, 1.0))[:, None]
    assert some.any() and not specular.any()
    assert np.allclose(weight[some], expected[some], rtol=1e-3)


def test_emitters_are_found_with_the_density_they_are_sampled_with(scene, rays):
    _, o, d = rays
    hits = scene.intersect(o, d)
    lights = hits.sample_emitters(np.random.default_rng(4).random(d.shape))
    seen = lights.visible & (lights.pdf > 0)
    assert seen.any() and not lights.delta.any()
    found = hits.trace(np.where(seen[:, None], lights.d, 0.0))
    assert np.allclose(found.radiance[seen], lights.radiance[seen])
    assert np.allclose(found.emitters_pdf(hits)[seen], lights.pdf[seen], rtol=1e-2)
    assert found.visible(hits)[seen].mean() > 0.99


def test_the_path_tracer_in_numpy_is_judged_like_any_other():
    box = ps.library("cornell-box", res=32, max_depth=3)
    found = ps.validate(box, [path_tracer, "pt"], spp=64, replicates=20)
    [pair] = found.pairs
    assert found.passed and pair.verdict == "agree" and pair.mdb < 0.05, str(found)

    def too_bright(scene, spp, seed):
        return 1.1 * path_tracer(scene, spp, seed)

    assert not ps.validate(box, [too_bright, "pt"], spp=64, replicates=20).passed


def test_the_path_tracer_in_numpy_refuses_what_it_does_not_see():
    with pytest.raises(ValueError, match="media"):
        path_tracer(ps.library("fog-box", res=8), 1, 1)


def test_films_are_box_filtered(scene):
    film = Film(scene)
    film.splat(np.array([[0.5, 0.5], [0.9, 0.1], [23.9, 15.9], [24.1, 0.0]]), np.ones((4, 3)))
    image = film.image(2.0)
    assert image[0, 0, 0] == 1.0 and image[15, 23, 0] == 0.5 and image.sum() == 4.5


def test_bad_arrays_are_errors(scene):
    with pytest.raises(ValueError, match="no pixel"):
        scene.sample_sensor([10**6], np.zeros((1, 4)))
    with pytest.raises(ValueError, match="rows"):
        scene.intersect(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="shape"):
        scene.intersect(np.zeros((2, 2)), np.zeros((2, 2)))

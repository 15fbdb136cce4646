"""Renders: the same bits as the command, signals, threads, lifetimes."""

import gc
import os
import signal
import threading
import time

import numpy as np
import pytest

import pathspace as ps


@pytest.mark.parametrize("integrator", ["pt", "bdpt", "mmlt"])
def test_bits_are_those_of_the_command(scene, scene_file, command, tmp_path, integrator):
    image = ps.render(scene, integrator, spp=4, seed=7, layers=["length"])
    path = tmp_path / "a.exr"
    command("render", scene_file, "-i", integrator, "--spp", "4", "--seed", "7", "--layers", "length", "-o", path)
    theirs = ps.read(path)
    assert image.dtype == np.float32 and image.shape == (16, 24, 3)
    assert np.array_equal(image, theirs)
    # And the file that Python writes is read the same.
    own = tmp_path / "b.exr"
    image.write(own)
    assert np.array_equal(ps.read(own), theirs)
    assert "length.02" in image.layers


def test_threads_change_nothing(scene):
    one, three = (ps.render(scene, "bdpt", spp=3, threads=n) for n in (1, 3))
    assert np.array_equal(one, three)


def test_the_file_says_how_long_unless_told(scene):
    assert ps.render(scene).samples == 4
    assert ps.render(scene, spp=2).samples == 2
    timed = ps.render(scene, seconds=0.05)
    assert timed.complete and timed.samples > 0
    assert ps.render(scene, error=0.5, spp=10_000).stats["error"] is not None


def test_a_session_steps_saves_and_goes_on_to_the_bit(scene, tmp_path):
    session = ps.Session(scene, "mmlt", seed=3)
    session.step(2)
    path = tmp_path / "s.checkpoint"
    session.save(path)
    session.step(2)
    again = ps.Session.resume(path, scene, "mmlt", seed=3)
    assert again.film().samples == 2
    again.run(spp=4)
    assert np.array_equal(session.film(), again.film())
    assert np.array_equal(session.film(), ps.render(scene, "mmlt", spp=4, seed=3))
    with pytest.raises(ps.PathspaceError, match="seed"):
        ps.Session.resume(path, scene, "mmlt", seed=4)


def test_the_film_can_be_looked_at_while_another_thread_renders(scene):
    session = ps.Session(scene.with_film(size=(64, 64)), "pt")
    thread = threading.Thread(target=lambda: session.run(spp=10**9))
    thread.start()
    seen = [session.film().samples for _ in range(2)]
    session.stop()
    thread.join(10)
    assert not thread.is_alive() and 0 < seen[0] <= seen[1]


def test_shards_add_up_as_those_of_the_command_do(scene, scene_file, command, tmp_path):
    for i in (1, 2):
        part = ps.Session(scene, "bdpt", shard=(i, 2))
        part.run(spp=5)
        part.save(tmp_path / f"{i}.film")
        command("render", scene_file, "-i", "bdpt", "--spp", "5", "--shard", f"{i}/2", "-o", tmp_path / f"c{i}.exr")
    command("merge", tmp_path / "c1.exr", tmp_path / "c2.exr", "-o", tmp_path / "c.exr")
    merged = ps.merge([tmp_path / "2.film", tmp_path / "1.film"])
    assert np.array_equal(merged, ps.read(tmp_path / "c.exr"))
    assert merged.stats["missing"] == []


def test_ctrl_c_returns_what_there_is_within_a_second(scene):
    large = scene.with_film(size=(256, 256))
    sent = []

    def interrupt():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(1.0, interrupt)
    timer.start()
    image = ps.render(large, "pt", spp=10**9)
    waited = time.monotonic() - sent[0]
    assert not image.complete and image.samples > 0
    # A second by intention; machines that test may be busy.
    assert waited < 5


def test_ctrl_c_leaves_a_session_to_go_on_with(scene):
    session = ps.Session(scene.with_film(size=(128, 128)), "pt")
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        session.run(spp=10**9)
    before = session.film().samples
    session.step(1)
    assert session.film().samples == before + 1


def test_python_runs_while_it_renders(scene):
    large, ticks, done = scene.with_film(size=(128, 128)), [0], threading.Event()

    def count():
        while not done.is_set():
            ticks[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    ps.render(large, "pt", seconds=0.5)
    during = ticks[0]
    done.set()
    thread.join()
    # One that holds the interpreter's lock lets nobody count.
    assert during > 20


def test_two_renders_in_threads_overlap(scene):
    spans = []

    def work(seed):
        begun = time.monotonic()
        ps.render(scene, "pt", seconds=0.4, seed=seed, threads=1)
        spans.append((begun, time.monotonic()))

    threads = [threading.Thread(target=work, args=(seed,)) for seed in (1, 2)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert max(begin for begin, _ in spans) < min(end for _, end in spans)


def test_arrays_outlive_what_made_them(scene):
    image = ps.render(scene, "pt", spp=2, layers=["length"])
    layer, copy = image.layers["length.02"], np.array(image)
    view = image[4:8]
    del image
    gc.collect()
    assert np.isfinite(layer).all() and np.array_equal(view, copy[4:8])
    view[:] = 0.0
    assert view.sum() == 0.0


def test_progress_is_told(scene):
    seen = []
    ps.render(scene.with_film(size=(128, 128)), "pt", seconds=0.5, progress=lambda *told: seen.append(told))
    assert seen and all(0.0 <= used <= 1.0 for used, _, _ in seen)


def test_an_error_in_progress_stops_the_render(scene):
    def broken(*_):
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        ps.render(scene.with_film(size=(128, 128)), "pt", spp=10**9, progress=broken)


def test_images_show_and_write_themselves(scene, tmp_path):
    image = ps.render(scene, "pt", spp=4)
    assert image._repr_png_().startswith(b"\x89PNG")
    assert image.show(exposure=4.0)._repr_png_() != image.show(exposure=0.1)._repr_png_()
    for kind in ("exr", "npy", "pfm"):
        [path, *_] = image.write(tmp_path / f"a.{kind}")
        assert np.array_equal(ps.read(path), image)
    image.write(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    half = 0.5 * image
    assert isinstance(half, ps.Image) and half.layers == {} and half.stats == {}
    with pytest.raises(ValueError, match=".jpg"):
        image.write(tmp_path / "a.jpg")


def test_bad_use_is_an_exception(scene):
    for options, text in [
        ({"integrator": "magic", "spp": 1}, "magic"),
        ({"integrator": "pt:nee=maybe", "spp": 1}, "maybe"),
        ({"spp": 0}, "spp"),
        ({"seconds": -1.0}, "seconds"),
        ({"error": 2.0}, "error"),
        ({"spp": 1, "layers": ["paint"]}, "paint"),
        ({"spp": 1, "pieces": 4}, "client"),
    ]:
        with pytest.raises((ps.PathspaceError, ValueError), match=text):
            ps.render(scene, **options)


def test_integrators_are_listed():
    registry = ps.Registry()
    assert "bdpt" in registry and "magic" not in registry and len(registry) == len(list(registry))
    with pytest.raises(TypeError, match="no module of integrators"):
        ps.use(os)

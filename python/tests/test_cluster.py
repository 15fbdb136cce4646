"""Dask: the same bits for any number of workers, dead ones included."""

import os
import signal
import threading

import numpy as np
import pytest

import pathspace as ps

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client():
    options = {"threads_per_worker": 1, "dashboard_address": ":0", "processes": True}
    with distributed.LocalCluster(n_workers=4, **options) as cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture
def pieces(scene, tmp_path):
    """The image of eight shards of ten samples, put together here."""

    def merged(integrator, count=8, spp=10):
        paths = []
        for i in range(1, count + 1):
            part = ps.Session(scene, integrator, seed=5, shard=(i, count))
            part.run(spp=spp)
            paths.append(tmp_path / f"{integrator}-{i}.film")
            part.save(paths[-1])
        return ps.merge(paths)

    return merged


@pytest.mark.parametrize("integrator", ["bdpt", "mmlt"])
def test_four_workers_give_the_bits_of_shards(client, scene, pieces, integrator):
    image = ps.render(scene, integrator, spp=10, seed=5, client=client, pieces=8)
    assert np.array_equal(image, pieces(integrator)) and image.complete


def test_killed_workers_change_nothing(client, scene, pieces):
    large = scene.with_film(size=(96, 96))
    alone = ps.render(large, "bdpt", spp=64, seed=5, client=client, pieces=32)
    stop, killed = threading.Event(), []

    def kill():
        while not stop.wait(0.3) and len(killed) < 4:
            pids = list(client.run(os.getpid).values())
            if pids:
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])

    thread = threading.Thread(target=kill)
    thread.start()
    image = ps.render(large, "bdpt", spp=64, seed=5, client=client, pieces=32)
    stop.set()
    thread.join()
    assert killed and np.array_equal(image, alone)


def test_pieces_are_kept_and_gone_on_with(client, scene, tmp_path):
    first = ps.render(scene, "pt", spp=8, client=client, pieces=4, folder=tmp_path)
    films = sorted(tmp_path.glob("*.film"))
    assert len(films) == 4
    films[2].unlink()
    kept = films[0].stat().st_mtime_ns
    again = ps.render(scene, "pt", spp=8, client=client, pieces=4, folder=tmp_path)
    assert np.array_equal(first, again) and films[0].stat().st_mtime_ns == kept


def test_comparisons_are_rendered_on_the_cluster(client, scene, tmp_path):
    options = {"spp": 4, "replicates": 3, "threads": 1}
    there = ps.compare(scene, ["pt", "bdpt"], client=client, output=tmp_path / "there", **options)
    here = ps.compare(scene, ["pt", "bdpt"], output=tmp_path / "here", **options)
    mse = lambda found: [p.mse.value for a in found.scenes[0].methods for p in a.points]
    assert mse(there) == mse(here)


def test_faults_are_raised_here(client, scene):
    with pytest.raises(ps.PathspaceError, match="magic"):
        ps.render(scene, "magic", spp=4, client=client)
    with pytest.raises(ValueError, match="spp"):
        ps.render(scene, "pt", seconds=1.0, client=client)


def test_the_command_reaches_it(scene_file, scene, tmp_path):
    from pathspace import cluster

    words = [str(scene_file), "--spp", "4", "--pieces", "4", "--workers", "2", "-i", "pt", "-o", str(tmp_path / "a.npy")]
    assert cluster.main(words) == 0
    assert np.load(tmp_path / "a.npy").shape == (16, 24, 3)
    assert cluster.main([str(tmp_path / "gone.xml"), "--spp", "4", "--workers", "1"]) == 2

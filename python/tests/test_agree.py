"""The test for images of any renderer."""

import numpy as np
import pytest

import pathspace as ps


def images(seed, count, mean=0.5, size=16, noise=0.1):
    rng = np.random.default_rng(seed)
    return mean * (1.0 + noise * rng.standard_normal((count, size, size, 1))) * np.ones(3)


def test_one_expectation_agrees_and_more_light_differs():
    found = ps.agree(images(1, 16), images(2, 24))
    assert found and found.verdict == "agree" and 0 < found.mdb < 0.02
    assert found.difference.low < 0 < found.difference.high
    assert found.sigma.shape == (16, 16) and np.abs(found.sigma).max() < 5
    brighter = ps.agree(images(3, 16), images(4, 24, mean=0.52))
    assert not brighter and brighter.verdict == "differ" and brighter.p < 1e-4
    assert str(brighter).startswith("differ: the mean over the image differs")


def test_two_images_a_side_never_give_a_verdict():
    for mean in (0.5, 5.0):
        assert ps.agree(images(5, 2), images(6, 2, mean=mean)).verdict == "inconclusive"


def test_false_alarms_stay_below_the_level():
    alarms = sum(
        ps.agree(images(2 * k, 5, size=8), images(2 * k + 1, 8, size=8), alpha=0.05).verdict == "differ" for k in range(300)
    )
    # 1.5 α and three standard errors of the count.
    assert alarms <= 300 * 0.075 + 12


def test_the_ratio_of_efficiencies_counts_noise_and_seconds():
    found = ps.agree(images(7, 16, noise=0.2), images(8, 16, noise=0.1), seconds=(1.0, 2.0))
    assert 0.4 < found.efficiency.value < 0.6
    assert found.efficiency.low < 0.5 < found.efficiency.high
    assert ps.agree(images(7, 16), images(8, 16)).efficiency is None


def test_renders_bring_their_seconds_and_files_are_read(scene, tmp_path):
    sets = []
    for integrator in ("pt", "bdpt"):
        renders = [ps.render(scene, integrator, spp=8, seed=k) for k in range(1, 6)]
        for k, image in enumerate(renders):
            image.write(tmp_path / f"{integrator}-{k}.exr")
        sets.append(renders)
    in_memory = ps.agree(*sets)
    from_files = ps.agree(str(tmp_path / "pt-*.exr"), sorted(tmp_path.glob("bdpt-*.exr")))
    assert in_memory.verdict != "differ" and in_memory.p == from_files.p
    assert in_memory.efficiency is not None and from_files.efficiency is not None


def test_what_cannot_be_compared_is_an_error():
    with pytest.raises(ps.PathspaceError, match="at least 2"):
        ps.agree(images(1, 1), images(2, 4))
    with pytest.raises(ValueError, match="shape"):
        ps.agree(images(1, 4), images(2, 4, size=8))
    with pytest.raises(FileNotFoundError, match="nothing"):
        ps.agree("nothing-*.exr", images(2, 4))
    bad = images(1, 4)
    bad[2, 3, 4, 1] = np.nan
    with pytest.raises(ps.PathspaceError, match="finite"):
        ps.agree(bad, images(2, 4))


def test_the_map_is_drawn():
    pytest.importorskip("matplotlib").use("Agg")
    ax = ps.agree(images(1, 16), images(2, 16)).plot()
    assert ax.get_title().startswith("agree")

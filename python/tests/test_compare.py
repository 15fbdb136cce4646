"""Experiments and validation."""

import math

import numpy as np
import pytest

import pathspace as ps


@pytest.fixture(scope="module")
def found(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    return ps.compare(scene, ["pt", "bdpt"], spp=2, sweep="0..2", replicates=4, baseline="pt", output=folder / "out")


def test_results_are_dataclasses(found):
    [scene] = found.scenes
    assert [a.integrator for a in scene.methods] == ["pt", "bdpt"] and found.complete
    method = scene.method("bdpt")
    assert [p.budget for p in method.points] == ["2 spp", "4 spp", "8 spp"] and method.points[0].replicates == 4
    assert method.ratio.value > 0 and scene.method("pt").ratio is None
    [pair] = scene.pairs
    assert pair.verdict in ("agree", "inconclusive") and not found.differ
    with pytest.raises(KeyError, match="magic"):
        scene.method("magic")


def test_tables_plots_and_the_page(found, tmp_path):
    pytest.importorskip("pandas")
    table = found.to_pandas()
    assert len(table) == 6 and set(table["integrator"]) == {"pt", "bdpt"}
    assert (table["mse"] > 0).all() and math.isnan(table["ratio"].iloc[0])
    pytest.importorskip("matplotlib").use("Agg")
    for name in ("a.pdf", "a.svg"):
        found.plot(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    page = found.report(tmp_path / "page")
    assert page.exists() and (page.parent / "results.json").exists()


def test_dictionaries_take_part(tmp_path):
    from test_scene import DICTIONARY

    found = ps.compare(DICTIONARY, ["pt", "pt:nee=false"], spp=4, replicates=3)
    assert found.scenes[0].size == (24, 16) and not found.differ


def test_faults_are_exceptions(scene):
    with pytest.raises(ps.PathspaceError, match="magic"):
        ps.compare(scene, ["magic"], spp=1, replicates=2)
    with pytest.raises(ps.PathspaceError):
        ps.compare(scene, ["pt"], replicates=2)


def test_integrators_that_are_right_pass(scene):
    found = ps.validate(scene, ["pt", "bdpt"], rays=1_500_000)
    assert found and found.passed, str(found)
    [pair] = found.pairs
    assert pair.verdict in ("agree", "inconclusive") and {pair.a, pair.b} == {"pt", "bdpt"}
    assert "pt" in str(found)
    with pytest.raises(ps.PathspaceError, match="magic"):
        ps.validate(scene, ["pt", "magic"])

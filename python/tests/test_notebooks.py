"""Every notebook runs from top to bottom."""

from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")
pytest.importorskip("ipykernel")
pytest.importorskip("matplotlib")

FOLDER = Path(__file__).parent.parent / "notebooks"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.ipynb")), ids=lambda p: p.stem)
def test_notebook(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=240, resources={"metadata": {"path": str(tmp_path)}}).execute()


def test_notebooks_are_those_of_their_source(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    import make

    monkeypatch.setattr(make, "HERE", tmp_path)
    make.main()
    for path in FOLDER.glob("*.ipynb"):
        assert (tmp_path / path.name).read_text() == path.read_text(), f"run make.py: {path.name}"

"""Writes the notebooks from their sources: `python make.py`.

Cells are texts here, so that a change of a notebook can be read; outputs are made when they run.
"""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

HERE = Path(__file__).parent
SETUP = "import numpy as np\nimport matplotlib.pyplot as plt\nimport pathspace as ps"

NOTEBOOKS = {
    "1-first-caustic": [
        "# A first caustic\n\nA glass egg or ring focuses light. Path tracing from the camera finds such paths by luck; bidirectional path tracing connects "
        "both ends, and Metropolis methods stay where they found light.",
        (SETUP,),
        "The library has scenes made for such questions.",
        ('scene = ps.library("cornell-caustic", res=64)\nscene.info()',),
        "The same time for three integrators. An image shows itself; `show` sets the exposure, so that the three can be compared.",
        ('images = {name: ps.render(scene, name, seconds=0.5) for name in ("pt", "bdpt", "mmlt")}',),
        (
            "fig, axes = plt.subplots(1, 3, figsize=(9, 3), layout='constrained')\n"
            "for ax, (name, image) in zip(axes, images.items()):\n"
            "    ax.imshow(np.clip(image, 0, 1) ** (1 / 2.2))\n"
            "    ax.set_title(f'{name}, {image.samples:.0f} samples per pixel')\n"
            "    ax.axis('off')",
        ),
        "Where does the light of the caustic come from? Layers hold one image for each path length.",
        (
            "image = ps.render(scene, 'bdpt', spp=16, layers=['length'])\n"
            "{name: float(layer.mean()) for name, layer in image.layers.items()}",
        ),
    ],
    "2-is-my-integrator-right": [
        "# Is my integrator right?\n\nNoise hides mistakes. A test on independent images says what can be said: *agree* with the bias that would have been seen, *differ*, "
        "or *inconclusive*.",
        (SETUP,),
        "Images of any renderer will do. Here the suspect is ours with one light source too strong by 5 %.",
        (
            "scene = ps.library('cornell-box', res=32)\n"
            "known = [ps.render(scene, 'pt', spp=16, seed=k) for k in range(1, 17)]\n"
            "good = [ps.render(scene, 'bdpt', spp=16, seed=100 + k) for k in range(1, 17)]\n"
            "print(ps.agree(good, known))",
        ),
        ("suspect = [1.05 * image for image in good]\nfound = ps.agree(suspect, known)\nprint(found)\nassert found.verdict == 'differ'\nfound.plot();",),
        "With two images a side there is no verdict, however large the difference.",
        ("print(ps.agree(suspect[:2], known[:2]))",),
        "Integrators of pathspace can be held to each other more closely: path length by path length, and kind of path by kind of path.",
        ("checked = ps.validate(scene, ['pt', 'bdpt'], rays=2_000_000)\nprint(checked)\nassert checked.passed",),
    ],
    "3-speed-against-error": [
        "# Speed against error\n\nWhich integrator is better is a question of error *and* time. Efficiency is 1/(MSE · seconds): twice the efficiency is the same error in half the time.",
        (SETUP,),
        (
            "scene = ps.library('cornell-caustic', res=48)\n"
            "found = ps.compare(scene, ['pt', 'bdpt', 'mmlt'], seconds=0.03, sweep='0..2', replicates=4, baseline='pt')\n"
            "found.to_pandas()[['integrator', 'budget', 'seconds', 'spp', 'relmse', 'ratio', 'ratio_low', 'ratio_high']]",
        ),
        "Curves of an unbiased integrator fall with slope −1. The figure is a vector when written as PDF or SVG.",
        ("found.plot('speed-against-error.pdf');",),
        "A ratio is worth nothing if one of the two is wrong: pairs that differ are named.",
        ("found.differ",),
    ],
    "4-neumann-and-radiosity": [
        "# Neumann's series and radiosity\n\nThe rendering equation L = L_e + K L has the solution L = L_e + K L_e + K² L_e + …: light after no, one, two, … reflections. "
        "Layers by path length are these terms: paths of k edges are K^{k−1} L_e.",
        (SETUP,),
        (
            "scene = ps.library('cornell-box', res=48, max_depth=6)\n"
            "image = ps.render(scene, 'bdpt', spp=64, layers=['length'])\n"
            "terms = [image.layers[f'length.{k:02}'] for k in range(1, 7)]",
        ),
        (
            "fig, axes = plt.subplots(2, 6, figsize=(12, 4.2), layout='constrained')\n"
            "for k, term in enumerate(terms):\n"
            "    total = np.sum(terms[: k + 1], axis=0)\n"
            "    for ax, picture, name in ((axes[0, k], term, f'$K^{k}L_e$'), (axes[1, k], total, f'sum to $K^{k}L_e$')):\n"
            "        ax.imshow(np.clip(picture, 0, 1) ** (1 / 2.2))\n"
            "        ax.set_title(name)\n"
            "        ax.axis('off')",
        ),
        "Each term is smaller than the one before by about the mean reflectance: the series converges.",
        ("power = [float(t.mean()) for t in terms]\n[b / a for a, b in zip(power[1:], power[2:])]",),
        "Radiosity solves M B = E, with M = I − ρF, for the same diffuse scene by finite elements. Here it stands beside the path integral, and beside their difference.",
        (
            "solved = ps.render(scene, 'radiosity', spp=16)\n"
            "fig, axes = plt.subplots(1, 3, figsize=(9, 3), layout='constrained')\n"
            "shown = ((image, 'paths'), (solved, 'radiosity, M B = E'), (5 * np.abs(solved - image), '5 x difference'))\n"
            "for ax, (picture, name) in zip(axes, shown):\n"
            "    ax.imshow(np.clip(picture, 0, 1) ** (1 / 2.2))\n"
            "    ax.set_title(name)\n"
            "    ax.axis('off')",
        ),
        ("float(solved.mean() / image.mean() - 1)",),
    ],
}


def main() -> None:
    """Writes all of them beside this file."""
    for name, cells in NOTEBOOKS.items():
        made = [new_code_cell(c[0]) if isinstance(c, tuple) else new_markdown_cell(c) for c in cells]
        for n, cell in enumerate(made):
            # The same file from the same source.
            cell["id"] = f"cell-{n}"
        kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
        nbformat.write(new_notebook(cells=made, metadata=kernel), HERE / f"{name}.ipynb")


if __name__ == "__main__":
    main()

"""Research in bidirectional and Metropolis light transport, from Python.

>>> import pathspace as ps
>>> scene = ps.load_file("cornell-box/scene.xml")
>>> image = ps.render(scene, "bdpt", spp=16)      # float32 (height, width, 3)

| What | Where |
| --- | --- |
| Do two sets of images, of any renderers, show the same? | `agree` |
| Scenes: from files, from dictionaries, from the library | `load_file`, `load_dict`, `library` |
| An image | `render`, `Image`, `read` |
| A render that stops and goes on | `Session`, `merge` |
| Which integrator is faster, and are they right? | `compare`, `validate` |
| Many machines | `render(client=...)`, `compare(client=...)`, `pathspace.cluster` |
| Integrators of a plug-in crate | `Registry`, `use` |

Radiance is linear sRGB in W/(m² sr), lengths are scene units. Images have their first row at the top.
Everything that can go wrong is a `PathspaceError` or a `ValueError` with one line that says what;
scenes raise `SceneError`, which names file and line.
"""

from ._native import PathspaceError, SceneError, __version__
from .agreement import Agreement, Estimate, agree
from .comparison import Comparison, compare
from .image import Image, merge, read
from .registry import Registry, use
from .rendering import Session, render
from .scene import Scene, library, load_dict, load_file
from .transform import Transform
from .validation import Validation, validate

__all__ = [
    "Agreement",
    "Comparison",
    "Estimate",
    "Image",
    "PathspaceError",
    "Registry",
    "Scene",
    "SceneError",
    "Session",
    "Transform",
    "Validation",
    "__version__",
    "agree",
    "compare",
    "library",
    "load_dict",
    "load_file",
    "merge",
    "read",
    "render",
    "use",
    "validate",
]

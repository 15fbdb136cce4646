"""Scenes from files, from dictionaries and from the library."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from typing import Any, Mapping

import numpy as np

from . import registry
from .dictionary import scene_xml


@dataclass(frozen=True)
class Source:
    """Where a scene comes from, so that another process can load it again."""

    kind: str
    """`file`, `text`, `library` or `files`."""
    text: str
    """Path, XML, or name; with `files` the path of the main file."""
    params: tuple[tuple[str, str], ...] = ()
    changes: tuple[tuple[str, Any], ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)

    def load(self) -> Scene:
        """The scene."""
        made = registry.engine().Scene
        params, changes = list(self.params), _UNCHANGED | dict(self.changes)
        if self.kind == "file":
            native = made.from_file(self.text, params, changes)
        elif self.kind == "library":
            native = made.from_library(self.text, params, changes)
        elif self.kind == "files":
            native = made.from_files(dict(self.files), self.text, params, changes)
        else:
            native = made.from_text(self.text, _DICTIONARY, params, changes)
        return Scene(native, self)

    def packed(self) -> Source:
        """The same with all files in it, for a machine that does not have them."""
        if self.kind not in ("file", "text"):
            return self
        made = registry.engine().Scene
        if self.kind == "file":
            files = made.files(self.text, None, list(self.params))
            main = self.text
        else:
            files = made.files(_DICTIONARY, self.text, list(self.params))
            main = _DICTIONARY
        return replace(self, kind="files", text=main, files=files)


_UNCHANGED = {"size": None, "crop": None, "max_depth": None, "box_filter": None}

# Files that a dictionary names are looked for in the working directory.
_DICTIONARY = "dictionary.xml"


class Scene:
    """A scene that is ready to render. It does not change; `with_film` makes another one."""

    def __init__(self, native: Any, source: Source) -> None:
        self.native = native
        self.source = source

    def __repr__(self) -> str:
        (width, height), info = self.size, self.info()
        return f"<Scene {self.name}: {info['shapes']} shapes, {width}x{height} pixels>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (Source.load, (self.source.packed(),))

    @property
    def name(self) -> str:
        """Name in the library, or of the file."""
        return self.native.name

    @property
    def hash(self) -> str:
        """BLAKE3 of the content: elements and attributes, and mesh files."""
        return self.native.hash

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image in pixels."""
        return self.native.size

    @property
    def origin(self) -> tuple[int, int]:
        """Column and row of the whole film where the image begins: (0, 0) without a crop window."""
        return self.native.origin

    @property
    def warnings(self) -> list[str]:
        """What the reader ignored or mended, one line each."""
        return self.native.warnings

    @property
    def integrator(self) -> str | None:
        """The integrator that the file asks for."""
        return self.native.integrator

    @property
    def spp(self) -> int | None:
        """Samples per pixel that the file asks for."""
        return self.native.spp

    def info(self) -> dict[str, Any]:
        """What is in it: counts of shapes, triangles, emitters, bsdfs, media; `memory` is the bytes of the tree of
        rays; size, hash, depth, and the warnings of the reader."""
        return self.native.info()

    def sample_sensor(self, pixels: Any, u: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Camera rays: positions on the film (n, 2), origins and unit directions (n, 3).

        `pixels` (n,) are numbers of pixels, row by row; `u` (n, 4) in [0, 1) are the place in the pixel and on the lens. The
        mean of the radiance that the rays of a pixel carry is its value (box filter).
        """
        pixels = np.ascontiguousarray(pixels, dtype=np.int64)
        return registry.engine().sample_sensor(self.native, pixels, np.asarray(u, dtype=np.float32))

    def intersect(self, o: Any, d: Any) -> Any:
        """The closest surface along each ray `o + t d` (n, 3): the ray-casting function. See `pathspace.teaching` for
        what hits can be asked. Positions are those of the normalised scene (bounding sphere of radius 1 at the origin)."""
        rays = (np.asarray(v, dtype=np.float32) for v in (o, d))
        return registry.engine().intersect(self.native, *rays)

    def with_film(
        self,
        size: tuple[int, int] | None = None,
        crop: tuple[int, int, int, int] | None = None,
        max_depth: int | None = None,
        box_filter: bool | None = None,
    ) -> Scene:
        """The same scene with another size (width, height; the angle of view stays), a crop window (x, y,
        width, height), another longest path in edges (-1 is unlimited), or the box filter."""
        changes = dict(self.source.changes)
        changes.update(_changes(size, crop, max_depth, box_filter))
        return replace(self.source, changes=tuple(changes.items())).load()


def _changes(
    size: tuple[int, int] | None,
    crop: tuple[int, int, int, int] | None,
    max_depth: int | None,
    box_filter: bool | None,
) -> dict[str, Any]:
    given = {
        "size": None if size is None else tuple(size),
        "crop": None if crop is None else tuple(crop),
        "max_depth": max_depth,
        "box_filter": box_filter,
    }
    return {key: value for key, value in given.items() if value is not None}


def _params(params: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    def text(value: Any) -> str:
        return str(value).lower() if isinstance(value, bool) else str(value)

    return tuple((key, text(value)) for key, value in params.items())


def load_file(
    path: str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    max_depth: int | None = None,
    box_filter: bool | None = None,
    **params: Any,
) -> Scene:
    """Reads a scene in Mitsuba's XML; `params` are values for `$name` in it.

    Raises `SceneError`, which names file and line.
    """
    changes = _changes(size, crop, max_depth, box_filter)
    return Source("file", os.fspath(path), _params(params), tuple(changes.items())).load()


def load_dict(
    scene: Mapping[str, Any],
    *,
    size: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    max_depth: int | None = None,
    box_filter: bool | None = None,
) -> Scene:
    """Builds a scene from a dictionary in Mitsuba's form, with `Transform` or any 4x4 array where Mitsuba has
    `ScalarTransform4f`. Files are looked for in the working directory.

    Raises `SceneError` where the reader does not understand it, `ValueError` where it is no scene.
    """
    changes = _changes(size, crop, max_depth, box_filter)
    return Source("text", scene_xml(scene), (), tuple(changes.items())).load()


class Library:
    """The scenes that come with pathspace: `library["cornell-caustic"]`, or with parameters
    `library("cornell-caustic", res=128)`. Iterating gives names."""

    def __call__(
        self,
        name: str,
        *,
        size: tuple[int, int] | None = None,
        crop: tuple[int, int, int, int] | None = None,
        max_depth: int | None = None,
        box_filter: bool | None = None,
        **params: Any,
    ) -> Scene:
        changes = _changes(size, crop, max_depth, box_filter)
        return Source("library", name, _params(params), tuple(changes.items())).load()

    def __getitem__(self, name: str) -> Scene:
        return self(name)

    def __iter__(self):
        return (name for name, _ in registry.engine().library())

    def __len__(self) -> int:
        return len(registry.engine().library())

    def __contains__(self, name: str) -> bool:
        return name in list(self)

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {what}" for name, what in registry.engine().library())


library = Library()


def as_scene(scene: Scene | str | os.PathLike[str] | Mapping[str, Any]) -> Scene:
    """A scene, the name of one in the library, a path, or a dictionary."""
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, Mapping):
        return load_dict(scene)
    text = os.fspath(scene)
    return library(text) if text in library else load_file(text)

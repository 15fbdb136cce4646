"""Mitsuba's dictionary form as Mitsuba's XML, which the reader understands."""

from __future__ import annotations

import os
from numbers import Integral, Real
from typing import Any, Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

# Class of every plug-in of Mitsuba 3, known to the reader or not: what it does not know it says itself.
_CLASSES = {
    "bsdf": "diffuse dielectric thindielectric roughdielectric conductor roughconductor hair measured plastic roughplastic bumpmap "
    "normalmap blendbsdf mask twosided null principled principledthin polarizer retarder circular pplastic",
    "shape": "obj ply serialized sphere cylinder disk rectangle cube sdfgrid bsplinecurve linearcurve ellipsoids ellipsoidsmesh "
    "instance shapegroup merge",
    "emitter": "area constant envmap spot projector point directional directionalarea sunsky timed_sunsky volumelight",
    "sensor": "perspective thinlens orthographic radiancemeter irradiancemeter distant batch",
    "film": "hdrfilm specfilm",
    "rfilter": "box tent gaussian mitchell catmullrom lanczos",
    "sampler": "independent stratified multijitter orthogonal ldsampler",
    "integrator": "path direct volpath volpathmis ptracer prb prb_basic prbvolpath aov stokes moment depth direct_projective "
    "pt lt bdpt pssmlt mmlt rjmlt mlt erpt radiosity",
    "medium": "homogeneous heterogeneous",
    "phase": "isotropic hg tabphase rayleigh sggx blendphase",
    "volume": "constvolume gridvolume",
    "texture": "bitmap checkerboard mesh_attribute volume",
}
_CLASS = {name: tag for tag, names in _CLASSES.items() for name in names.split()}
# Vectors of three numbers that are places.
_POINTS = {"center", "position", "p0", "p1", "origin", "target", "to", "from"}
_MAX_DEPTH = 64


def scene_xml(scene: Mapping[str, Any]) -> str:
    """The XML of a dictionary whose type is `scene`; names of files become absolute."""
    if scene.get("type") != "scene":
        raise ValueError(f"the type of a scene's dictionary is 'scene', not {scene.get('type')!r}")
    lines = ['<scene version="3.0.0">']
    for key, value in scene.items():
        if key != "type":
            lines += _entry(key, value, f"{key}", 1, top=True)
    lines.append("</scene>")
    return "\n".join(lines) + "\n"


def _entry(key: str, value: Any, path: str, depth: int, top: bool = False) -> list[str]:
    """One key of a dictionary; `path` names it in messages."""
    if depth > _MAX_DEPTH:
        raise ValueError(f"{path}: dictionaries are nested deeper than {_MAX_DEPTH}")
    if isinstance(value, Mapping):
        return _object(key, value, path, depth, top)
    pad, name = "  " * depth, f"name={quoteattr(key)}"
    matrix = _matrix(value)
    if matrix is not None:
        numbers = " ".join(_number(v) for v in matrix.flatten())
        return [f'{pad}<transform {name}><matrix value="{numbers}"/></transform>']
    if isinstance(value, (bool, np.bool_)):
        return [f'{pad}<boolean {name} value="{str(bool(value)).lower()}"/>']
    if isinstance(value, Integral):
        return [f'{pad}<integer {name} value="{int(value)}"/>']
    if isinstance(value, Real):
        return [f'{pad}<float {name} value="{_number(value)}"/>']
    if isinstance(value, str):
        if key == "filename":
            # Names stand for the same file wherever the XML is.
            value = os.path.abspath(value)
        return [f"{pad}<string {name} value={quoteattr(value)}/>"]
    numbers = _vector(value)
    if numbers is not None:
        tag = "point" if key in _POINTS else "vector"
        text = ", ".join(_number(v) for v in numbers)
        return [f'{pad}<{tag} {name} value="{text}"/>']
    raise ValueError(f"{path}: a {type(value).__name__} is nothing that a scene can hold")


def _object(key: str, value: Mapping[str, Any], path: str, depth: int, top: bool) -> list[str]:
    pad, kind = "  " * depth, value.get("type")
    if not isinstance(kind, str):
        raise ValueError(f"{path}: a dictionary needs a 'type'")
    if kind == "ref":
        return [f"{pad}<ref name={quoteattr(key)} id={quoteattr(str(value.get('id', '')))}/>"]
    if kind in ("rgb", "srgb", "spectrum"):
        return [f"{pad}<{kind} name={quoteattr(key)} value={quoteattr(_colour(value, path))}/>"]
    tag = _CLASS.get(kind)
    if tag is None:
        raise ValueError(f"{path}: there is no plug-in of type {kind!r}")
    # A key of the scene is an id, which refs name; the key of a texture or medium is the property it is for.
    said = value.get("id", key if top else None)
    attributes = f"type={quoteattr(kind)}"
    if said is not None:
        attributes += f" id={quoteattr(str(said))}"
    if not top and tag in ("texture", "medium", "volume"):
        attributes += f" name={quoteattr(key)}"
    inner: list[str] = []
    for own, part in value.items():
        if own not in ("type", "id"):
            inner += _entry(own, part, f"{path}.{own}", depth + 1)
    if not inner:
        return [f"{pad}<{tag} {attributes}/>"]
    return [f"{pad}<{tag} {attributes}>", *inner, f"{pad}</{tag}>"]


def _colour(value: Mapping[str, Any], path: str) -> str:
    colour = value.get("value")
    if isinstance(colour, str):
        return colour
    if isinstance(colour, Real):
        return _number(colour)
    numbers = _vector(colour)
    if numbers is None:
        raise ValueError(f"{path}: a colour needs a 'value' of one or three numbers")
    return ", ".join(_number(v) for v in numbers)


def _matrix(value: Any) -> np.ndarray | None:
    """The 4x4 matrix of a transform: of ours, of Mitsuba's, or as an array."""
    if isinstance(value, (str, bool, Real)):
        return None
    try:
        array = np.array(getattr(value, "matrix", value), dtype=np.float64)
    except (TypeError, ValueError):
        return None
    # Mitsuba's variants of more than one lane have a last axis of 1.
    if array.ndim == 3 and array.shape[-1] == 1:
        array = array[..., 0]
    return array if array.shape == (4, 4) else None


def _vector(value: Any) -> np.ndarray | None:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.shape == (3,) else None


def _number(value: Any) -> str:
    """All digits."""
    return repr(float(value))

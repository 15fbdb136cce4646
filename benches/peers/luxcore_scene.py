"""From Mitsuba's XML to LuxCore: the part of the format that both express alike; anything else is refused with the reason.

Understood are rectangles, cubes and OBJ files; diffuse (also twosided) and dielectric materials and conductors of material `none`
(ideal mirrors); area emitters, which emit from the side of the normal; one perspective sensor with a square film.
"""

import dataclasses
import math
import pathlib
import xml.etree.ElementTree as ET

import numpy as np
from common import Refused

IOR = {"vacuum": 1.0, "air": 1.000277, "water": 1.3330, "bk7": 1.5046, "diamond": 2.419}
SETTINGS = {"default", "integrator", "sensor", "bsdf", "shape"}


@dataclasses.dataclass
class Mesh:
    """Triangles in the world, counter-clockwise seen from the side of the normal."""

    points: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray | None
    material: str


@dataclasses.dataclass
class Scene:
    """Camera and materials as LuxCore's properties, and the meshes."""

    properties: list[str]
    meshes: list[Mesh]
    size: int
    depth: int


def tessellate_spheres(root: ET.Element, folder: pathlib.Path, rings: int) -> int:
    """Makes every sphere an OBJ file with smooth normals, so that all renderers get the same triangles; says how many."""
    spheres = [s for s in root.iter("shape") if s.get("type") == "sphere"]
    for i, shape in enumerate(spheres):
        centre, radius = np.zeros(3), 1.0
        for child in list(shape):
            if child.get("name") in ("center", "radius"):
                if child.get("name") == "center":
                    centre = triple(child, 0.0)
                else:
                    radius = float(child.get("value"))
                shape.remove(child)
        name = f"compared-sphere-{i}.obj"
        write_sphere(folder / name, centre, radius, rings)
        shape.set("type", "obj")
        ET.SubElement(shape, "string", name="filename", value=name)
    return len(spheres)


def write_sphere(path: pathlib.Path, centre: np.ndarray, radius: float, rings: int) -> None:
    segments, lines = 2 * rings, []
    directions = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for i in range(1, rings):
        theta = math.pi * i / rings
        for j in range(segments):
            phi = 2 * math.pi * j / segments
            directions.append((math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)))
    for d in directions:
        x, y, z = centre + radius * np.array(d)
        lines.append(f"v {x:.9g} {y:.9g} {z:.9g}\nvn {d[0]:.9g} {d[1]:.9g} {d[2]:.9g}")

    def face(*corners: int) -> None:
        lines.append("f " + " ".join(f"{c + 1}//{c + 1}" for c in corners))

    def at(i: int, j: int) -> int:
        return 2 + (i - 1) * segments + j % segments

    for j in range(segments):
        face(0, at(1, j), at(1, j + 1))
        face(1, at(rings - 1, j + 1), at(rings - 1, j))
        for i in range(1, rings - 1):
            face(at(i, j), at(i + 1, j), at(i + 1, j + 1))
            face(at(i, j), at(i + 1, j + 1), at(i, j + 1))
    path.write_text("\n".join(lines) + "\n")


def triple(e: ET.Element, default: float) -> np.ndarray:
    if e.get("value") is not None:
        values = numbers(e.get("value"))
        return np.array(values * 3 if len(values) == 1 else values)
    return np.array([float(e.get(axis, default)) for axis in "xyz"])


def numbers(text: str) -> list[float]:
    return [float(t) for t in text.replace(",", " ").split()]


def load(path: pathlib.Path) -> Scene:
    """Reads a scene file with a square film."""
    try:
        return read(path)
    except ValueError as error:
        raise Refused(f"not understood: {error}") from error


def read(path: pathlib.Path) -> Scene:
    root = ET.parse(path).getroot()
    if root.get("version", "3").startswith("0"):
        raise Refused(f"file of the old version {root.get('version')}")
    defaults = {"$" + d.get("name"): d.get("value") for d in root.iter("default")}
    for e in root.iter():
        for key, value in e.attrib.items():
            e.set(key, defaults.get(value, value))
    for e in root:
        if e.tag not in SETTINGS:
            raise Refused(f"<{e.tag} type=\"{e.get('type')}\"> in the scene")
    depth = [int(e.get("value")) for e in root.findall("integrator/integer") if e.get("name") == "max_depth"]
    sensors = root.findall("sensor")
    if len(sensors) != 1:
        raise Refused(f"{len(sensors)} sensors")
    lines, size = camera(sensors[0])
    scene = Scene(lines, [], size, depth[-1] if depth else -1)
    bsdfs = {b.get("id"): b for b in root.findall("bsdf")}
    for i, e in enumerate(root.findall("shape")):
        scene.meshes.append(shape(e, f"m{i}", bsdfs, path.parent))
        scene.properties += material(e, f"m{i}", bsdfs)
    return scene


def camera(sensor: ET.Element) -> tuple[list[str], int]:
    if sensor.get("type") != "perspective":
        raise Refused(f"sensor {sensor.get('type')}")
    properties(sensor, {"fov", "fov_axis", "to_world", "near_clip", "far_clip", "focus_distance"})
    films = sensor.findall("film")
    extent = {e.get("name"): int(e.get("value")) for e in films[0].findall("integer")} if films else {}
    size = extent.get("width")
    if size is None or extent.get("height") != size or len(films) != 1:
        raise Refused("the film is not square")
    fov = [float(e.get("value")) for e in sensor.findall("float") if e.get("name") == "fov"]
    if not fov:
        raise Refused("the sensor has no fov")
    m = to_world(sensor)
    if np.linalg.det(m[:3, :3]) < 0:
        raise Refused("the sensor's to_world mirrors")
    origin, target, up = m[:3, 3], m[:3, 3] + m[:3, 2], m[:3, 1]
    # LuxCore looks one row of pixels beside; see the film in luxcore_adapter.py.
    row = 2 / size
    return [
        "scene.camera.type = perspective",
        f"scene.camera.lookat.orig = {row3(origin)}",
        f"scene.camera.lookat.target = {row3(target)}",
        f"scene.camera.up = {row3(up)}",
        f"scene.camera.fieldofview = {fov[0]:.9g}",
        f"scene.camera.screenwindow = -1 1 {-1 - row:.9g} {1 - row:.9g}",
        "scene.camera.autovolume.enable = 0",
    ], size


def row3(v) -> str:
    return " ".join(f"{float(x):.9g}" for x in v)


def properties(e: ET.Element, known: set[str]) -> None:
    """Refuses named children that are not known."""
    for child in e:
        name = child.get("name")
        if child.tag not in ("ref", "bsdf", "emitter", "film", "sampler") and name not in known:
            raise Refused(f"{e.tag} {e.get('type')} with {name or child.tag}")


def to_world(e: ET.Element) -> np.ndarray:
    """Product of the transform's parts; later ones act later."""
    m = np.eye(4)
    for part in e.findall("transform/*"):
        t = np.eye(4)
        if part.tag == "translate":
            t[:3, 3] = triple(part, 0.0)
        elif part.tag == "scale":
            t[:3, :3] = np.diag(triple(part, 1.0))
        elif part.tag == "rotate":
            t[:3, :3] = rotation(triple(part, 0.0), math.radians(float(part.get("angle"))))
        elif part.tag == "matrix":
            values = numbers(part.get("value"))
            n = math.isqrt(len(values))
            t[:n, :n] = np.array(values).reshape(n, n)
        elif part.tag == "lookat":
            origin, target, up = (np.array(numbers(part.get(k))) for k in ("origin", "target", "up"))
            z = (target - origin) / np.linalg.norm(target - origin)
            x = np.cross(up, z) / np.linalg.norm(np.cross(up, z))
            t[:3] = np.stack([x, np.cross(z, x), z, origin], 1)
        else:
            raise Refused(f"<{part.tag}> in a transform")
        m = t @ m
    return m


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def shape(e: ET.Element, name: str, bsdfs: dict, folder: pathlib.Path) -> Mesh:
    kind, m = e.get("type"), to_world(e)
    properties(e, {"to_world", "filename", "face_normals", "flip_normals"})
    on = {c.get("name"): c.get("value") == "true" for c in e.findall("boolean")}
    faces, flip = on.get("face_normals", False), on.get("flip_normals", False)
    mirrored = bool(np.linalg.det(m[:3, :3]) < 0)
    if kind in ("rectangle", "cube"):
        points, triangles = rectangle() if kind == "rectangle" else cube()
        normals = None
        # The normal is transformed as such, whatever happens to the winding.
        flip ^= mirrored
    elif kind == "obj":
        file = [c.get("value") for c in e.findall("string") if c.get("name") == "filename"]
        points, triangles, normals = read_obj(folder / file[0])
        if faces:
            normals = None
        elif normals is None:
            raise Refused(f"{file[0]} without vertex normals and without face_normals: they would be computed")
    else:
        raise Refused(f"shape {kind}")
    points = points @ m[:3, :3].T + m[:3, 3]
    if normals is not None:
        normals = normals @ np.linalg.inv(m[:3, :3])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        # The vertex normals say which side is in front.
        a, b, c = (points[triangles[:, i]] for i in range(3))
        against = (np.cross(b - a, c - a) * normals[triangles].sum(1)).sum(1) < 0
        triangles = np.where(against[:, None], triangles[:, ::-1], triangles)
    if flip:
        triangles = triangles[:, ::-1]
        normals = None if normals is None else -normals
    return Mesh(points, triangles, normals, name)


def rectangle():
    points = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    return points, np.array([[0, 1, 2], [0, 2, 3]])


def cube():
    points, triangles = [], []
    for axis in range(3):
        for side in (-1, 1):
            u, v, n = (np.eye(3)[(axis + k) % 3] for k in (1, 2, 0))
            first = len(points)
            points += [side * n + side * a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return np.array(points), np.array(triangles)


def read_obj(path: pathlib.Path):
    v, vn, corners, triangles = [], [], {}, []
    for line in path.read_text().splitlines():
        tag, *rest = line.split() or ["#"]
        if tag == "v":
            v.append([float(x) for x in rest[:3]])
        elif tag == "vn":
            vn.append([float(x) for x in rest[:3]])
        elif tag == "f":
            ids = []
            for corner in rest:
                p, *more = corner.split("/")
                n = int(more[1]) if len(more) == 2 and more[1] else 0
                key = (int(p) + (len(v) if int(p) < 0 else -1), n + (len(vn) if n < 0 else -1))
                ids.append(corners.setdefault(key, len(corners)))
            triangles += [[ids[0], ids[i], ids[i + 1]] for i in range(1, len(ids) - 1)]
    points = np.array([v[p] for p, _ in corners], float)
    smooth = vn and all(n >= 0 for _, n in corners)
    normals = np.array([vn[n] for _, n in corners], float) if smooth else None
    return points, np.array(triangles), normals


def material(e: ET.Element, name: str, bsdfs: dict) -> list[str]:
    """LuxCore's material of a shape, with what it emits."""
    found = [b for b in e.findall("bsdf")]
    for ref in e.findall("ref"):
        if ref.get("id") not in bsdfs:
            raise Refused(f"reference to {ref.get('id')}, which is no bsdf")
        found.append(bsdfs[ref.get("id")])
    if len(found) > 1:
        raise Refused("shape with several bsdfs")
    at = f"scene.materials.{name}"
    emitters = e.findall("emitter")
    if found:
        lines = bsdf(found[0], at, False)
    elif emitters:
        lines = [f"{at}.type = matte", f"{at}.kd = 0 0 0"]
    else:
        raise Refused("shape without bsdf: the default is not twosided")
    for emitter in emitters:
        if emitter.get("type") != "area":
            raise Refused(f"emitter {emitter.get('type')} of a shape")
        properties(emitter, {"radiance"})
        lines += [
            f"{at}.emission = {row3(colour(emitter, 'radiance', 1.0))}",
            f"{at}.emission.gain = 1 1 1",
            f"{at}.emission.power = 0",
        ]
    return lines


def bsdf(e: ET.Element, at: str, two_sided: bool) -> list[str]:
    kind = e.get("type")
    if kind == "twosided":
        inner = e.findall("bsdf")
        if len(inner) != 1 or len(e) != 1:
            raise Refused("twosided with other than one bsdf")
        return bsdf(inner[0], at, True)
    if kind == "diffuse":
        properties(e, {"reflectance"})
        if not two_sided:
            raise Refused("diffuse that is not twosided: LuxCore's matte reflects on both sides")
        return [f"{at}.type = matte", f"{at}.kd = {row3(colour(e, 'reflectance', 0.5))}"]
    if kind == "dielectric" and not two_sided:
        properties(e, {"int_ior", "ext_ior", "specular_reflectance", "specular_transmittance"})
        return [
            f"{at}.type = glass",
            f"{at}.kr = {row3(colour(e, 'specular_reflectance', 1.0))}",
            f"{at}.kt = {row3(colour(e, 'specular_transmittance', 1.0))}",
            f"{at}.interiorior = {ior(e, 'int_ior', 'bk7'):.9g}",
            f"{at}.exteriorior = {ior(e, 'ext_ior', 'air'):.9g}",
        ]
    if kind == "conductor":
        properties(e, {"material", "specular_reflectance"})
        if [c.get("value") for c in e.findall("string")] != ["none"]:
            raise Refused("conductor other than the ideal mirror (material none)")
        if not two_sided:
            raise Refused("conductor that is not twosided: LuxCore's mirror reflects on both sides")
        return [f"{at}.type = mirror", f"{at}.kr = {row3(colour(e, 'specular_reflectance', 1.0))}"]
    raise Refused(f"bsdf {'twosided ' if two_sided else ''}{kind}")


def colour(e: ET.Element, name: str, default: float) -> np.ndarray:
    for child in e:
        if child.get("name") == name:
            if child.tag not in ("rgb", "float") or not child.get("value"):
                raise Refused(f"{e.get('type')} whose {name} is a {child.tag} other than numbers")
            return triple(child, 0.0)
    return np.full(3, default)


def ior(e: ET.Element, name: str, default: str) -> float:
    for child in e:
        if child.get("name") == name:
            if child.tag == "float":
                return float(child.get("value"))
            default = child.get("value")
    if default not in IOR:
        raise Refused(f"refractive index {default}: give it as a number")
    return IOR[default]

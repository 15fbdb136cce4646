"""What the comparisons with other renderers share: the rewritten scene, our renders, and the statistics."""

import dataclasses
import json
import math
import pathlib
import shutil
import struct
import subprocess
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Callable

import numpy as np

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])


def rewrite(
    source: pathlib.Path,
    folder: pathlib.Path,
    size: int,
    depth: int | None,
    edit: Callable[[ET.Element, pathlib.Path], None] | None = None,
) -> pathlib.Path:
    """A copy of the scene's folder with a square box-filtered film; `edit` changes more of it (root, folder of the copy)."""
    copy = folder / source.parent.name
    shutil.copytree(source.parent, copy, dirs_exist_ok=True, copy_function=shutil.copyfile)
    for directory in [copy, *[p for p in copy.rglob("*") if p.is_dir()]]:
        directory.chmod(0o755)
    tree = ET.parse(source)
    root = tree.getroot()
    for film in root.iter("film"):
        for child in list(film):
            if child.tag == "rfilter" or child.get("name", "").startswith(("crop", "width", "height")):
                film.remove(child)
        for name in ("width", "height"):
            ET.SubElement(film, "integer", name=name, value=str(size))
        ET.SubElement(film, "rfilter", type="box")
    if depth is not None:
        for integrator in root.findall("integrator"):
            for child in list(integrator):
                if child.get("name") == "max_depth":
                    integrator.remove(child)
            ET.SubElement(integrator, "integer", name="max_depth", value=str(depth))
    if edit is not None:
        edit(root, copy)
    path = copy / "compared.xml"
    path.unlink(missing_ok=True)
    tree.write(path)
    return path


def max_depth(path: pathlib.Path) -> int:
    """The depth that the file asks for; −1 is unlimited."""
    root = ET.parse(path).getroot()
    defaults = {"$" + d.get("name"): d.get("value") for d in root.iter("default")}
    for integer in root.findall("integrator/integer"):
        if integer.get("name") == "max_depth":
            return int(defaults.get(integer.get("value"), integer.get("value")))
    return -1


def pathspace(program: str, scene: pathlib.Path, integrator: str, seed: int, out: pathlib.Path, *more: str):
    """One render with pathspace: the image and the report of `--json`."""
    command = [program, "render", str(scene), "-i", integrator, "--seed", str(seed), "-o", str(out), "--json", *more]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    return read_exr(out), json.loads(done.stdout.strip().splitlines()[-1])


def read_exr(path: pathlib.Path) -> np.ndarray:
    """R, G, B of an EXR file of one part with 32-bit floats, in scan lines or tiles of one level, not compressed or by ZIP."""
    data = path.read_bytes()
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version & 0x1800:
        raise ValueError(f"{path}: no EXR file of one part")
    at, header = 8, {}
    while data[at]:
        name, at = exr_text(data, at)
        _, at = exr_text(data, at)
        (length,) = struct.unpack_from("<I", data, at)
        header[name] = data[at + 4 : at + 4 + length]
        at += 4 + length
    channels, where = [], 0
    while header["channels"][where]:
        name, where = exr_text(header["channels"], where)
        kind, *_, dx, dy = struct.unpack_from("<iB3xii", header["channels"], where)
        if (kind, dx, dy) != (2, 1, 1):
            raise ValueError(f"{path}: channel {name} is no full channel of 32-bit floats")
        channels.append(name)
        where += 16
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    lines = {0: 1, 2: 1, 3: 16}.get(header["compression"][0])
    if lines is None:
        raise ValueError(f"{path}: compression {header['compression'][0]} is not read")
    tiled = bool(version & 0x200)
    across, down = struct.unpack_from("<II", header["tiles"]) if tiled else (width, lines)
    blocks = -(-width // across) * -(-height // down)
    image = np.zeros((height, len(channels), width), np.float32)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at + 1):
        if tiled:
            column, row, *_, length = struct.unpack_from("<5i", data, offset)
            x, y, start = column * across, row * down, offset + 20
        else:
            line, length = struct.unpack_from("<2i", data, offset)
            x, y, start = 0, line - y0, offset + 8
        block = image[y : y + down, :, x : x + across]
        raw = data[start : start + length]
        block[:] = np.frombuffer(raw if length == block.nbytes else unzip(raw), "<f4").reshape(block.shape)
    return np.stack([image[:, channels.index(c)] for c in "RGB"], -1)


def exr_text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(0, at)
    return data[at:end].decode(), end + 1


def unzip(data: bytes) -> bytes:
    """EXR's ZIP: differences of bytes from 128, first all bytes at even places, then those at odd ones."""
    steps = np.frombuffer(zlib.decompress(data), np.uint8).astype(np.int64)
    steps[1:] -= 128
    values = np.cumsum(steps).astype(np.uint8)
    mixed, half = np.empty_like(values), (len(values) + 1) // 2
    mixed[0::2], mixed[1::2] = values[:half], values[half:]
    return mixed.tobytes()


def tiles(image: np.ndarray, n: int = 16) -> np.ndarray:
    """Means of luminance over a grid of n×n tiles."""
    y = image[..., :3].astype(np.float64) @ LUMINANCE
    h, w = y.shape
    n = min(n, h, w)
    rows, cols = np.array_split(np.arange(h), n), np.array_split(np.arange(w), n)
    return np.array([[y[np.ix_(r, c)].mean() for c in cols] for r in rows]).ravel()


def welch(a: np.ndarray, b: np.ndarray):
    """t, p and minimum detectable bias per column; p from Student's t by numerical integration."""
    va, vb = a.var(0, ddof=1) / len(a), b.var(0, ddof=1) / len(b)
    se = np.sqrt(va + vb)
    mean = 0.5 * (np.abs(a.mean(0)) + np.abs(b.mean(0)))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(se > 0, (a.mean(0) - b.mean(0)) / se, 0.0)
        df = np.where(se > 0, (va + vb) ** 2 / (va**2 / (len(a) - 1) + vb**2 / (len(b) - 1)), 1.0)
        mdb = np.where(mean > 0, 5.17 * se / mean, 0.0)
    return t, np.array([student(abs(x), d) for x, d in zip(t, df)]), mdb


def student(t: float, df: float) -> float:
    """Two-sided tail of Student's t: Simpson's rule in the angle."""
    lo, hi, n = math.atan(t / math.sqrt(df)), math.pi / 2, 2000
    x = np.linspace(lo, hi, n + 1)
    y = np.cos(x) ** (df - 1) if df > 1 else np.ones_like(x)
    w = np.ones(n + 1)
    w[1:-1:2], w[2:-1:2] = 4, 2
    area = float((w * y).sum() * (hi - lo) / n / 3)
    return min(1.0, 2 * area * math.exp(math.lgamma((df + 1) / 2) - math.lgamma(df / 2)) / math.sqrt(math.pi))


def student_quantile(p: float, df: float) -> float:
    """The t with the two-sided tail p, by bisection."""
    lo, hi = 0.0, 1.0
    while student(hi, df) > p:
        hi *= 2
    for _ in range(60):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if student(mid, df) > p else (lo, mid)
    return 0.5 * (lo + hi)


def holm(p: np.ndarray) -> float:
    """The smallest p of a family after Holm's correction."""
    return float(min(1.0, (np.sort(p) * np.arange(len(p), 0, -1)).min()))


@dataclasses.dataclass
class Comparison:
    """Two estimates of one picture: means of luminance, tests, minimum detectable biases."""

    verdict: str
    means: tuple[float, float]
    p_image: float
    p_all: float
    mdb_image: float
    mdb_tiles: float

    def __str__(self) -> str:
        return (
            f"{self.verdict:12} mean {self.means[0]:.6g} / {self.means[1]:.6g}  p(image) {self.p_image:.3g}  "
            f"p(Holm, tiles too) {self.p_all:.3g}  MDB image {100 * self.mdb_image:.3f} %  tile median {100 * self.mdb_tiles:.2f} %"
        )


def compare(a: list[np.ndarray], b: list[np.ndarray]) -> Comparison:
    """Welch's test of image mean and 16×16 tiles over the replicates of two renderers."""
    ta, tb = np.array([tiles(i) for i in a]), np.array([tiles(i) for i in b])
    means = ta.mean(1, keepdims=True), tb.mean(1, keepdims=True)
    _, p, mdb = welch(*means)
    _, p_tiles, mdb_tiles = welch(ta, tb)
    p_all = holm(np.concatenate([p, p_tiles]))
    verdict = "differ" if p_all < 1e-4 else "agree" if mdb[0] <= 0.01 else "inconclusive"
    sides = float(means[0].mean()), float(means[1].mean())
    return Comparison(verdict, sides, float(p[0]), p_all, float(mdb[0]), float(np.median(mdb_tiles)))

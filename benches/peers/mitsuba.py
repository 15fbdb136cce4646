#!/usr/bin/env python3
"""Compares pathspace with Mitsuba 3 on the same scene file: pt with `path`, lt with `ptracer`.

    pip install mitsuba numpy
    benches/peers/mitsuba.py --pathspace target/release/pathspace --size 64 --spp 64 --replicates 16 SCENE.xml …

Both renderers get one rewritten copy of the file: same film size, box filter, same depth. Each replicate is a
render with its own seed. Per scene and pair of integrators the script prints, for the image mean and for a 16x16 grid of
tiles (luminance), Welch's t with Holm's correction and the minimum detectable bias 5.17 SE/mean; and the ratio of render times at
equal samples. Exit status 1 where a pair differs.
"""

import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET

import numpy as np

PAIRS = {"pt": "path", "lt": "ptracer"}
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])


def rewrite(source: pathlib.Path, folder: pathlib.Path, size: int, depth: int | None) -> pathlib.Path:
    """A copy of the scene's folder with a square box-filtered film."""
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


def tiles(image: np.ndarray, n: int = 16) -> np.ndarray:
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


def holm(p: np.ndarray) -> float:
    return float(min(1.0, (np.sort(p) * np.arange(len(p), 0, -1)).min()))


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    arguments.add_argument("scenes", nargs="+", type=pathlib.Path)
    arguments.add_argument("--pathspace", default="target/release/pathspace")
    arguments.add_argument("--variant", default="llvm_ad_rgb")
    arguments.add_argument("--integrators", default="pt,lt")
    arguments.add_argument("--size", type=int, default=64)
    arguments.add_argument("--spp", type=int, default=64)
    arguments.add_argument("--replicates", type=int, default=16)
    arguments.add_argument("--depth", type=int)
    options = arguments.parse_args()
    try:
        import mitsuba as mi
    except ImportError:
        print("Mitsuba 3 is not installed: pip install mitsuba")
        return 0
    mi.set_variant(options.variant)
    differs = False
    with tempfile.TemporaryDirectory() as folder:
        for source in options.scenes:
            path = rewrite(source, pathlib.Path(folder), options.size, options.depth)
            scene = mi.load_file(str(path))
            for ours in options.integrators.split(","):
                a, seconds_a, spec = [], 0.0, None
                for r in range(options.replicates):
                    out = pathlib.Path(folder) / "ours.exr"
                    command = [options.pathspace, "render", str(path), "-i", ours, "--spp", str(options.spp)]
                    command += ["--seed", str(r + 1), "-o", str(out), "--json"]
                    done = subprocess.run(command, check=True, capture_output=True, text=True)
                    report = json.loads(done.stdout.strip().splitlines()[-1])
                    seconds_a += report["seconds"]
                    a.append(np.array(mi.Bitmap(str(out)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32)))
                theirs = mi.load_dict({"type": PAIRS[ours], "max_depth": max_depth(path)})
                np.array(mi.render(scene, integrator=theirs, spp=1, seed=999))
                b, seconds_b = [], 0.0
                for r in range(options.replicates):
                    start = time.perf_counter()
                    image = np.array(mi.render(scene, integrator=theirs, spp=options.spp, seed=r + 1))
                    seconds_b += time.perf_counter() - start
                    b.append(image[..., :3])
                ta, tb = np.array([tiles(i) for i in a]), np.array([tiles(i) for i in b])
                means = np.array([[i.mean() for i in ta]]).T, np.array([[i.mean() for i in tb]]).T
                _, p, mdb = welch(*means)
                _, p_tiles, mdb_tiles = welch(ta, tb)
                p_all = holm(np.concatenate([p, p_tiles]))
                verdict = "differ" if p_all < 1e-4 else "agree" if mdb[0] <= 0.01 else "inconclusive"
                differs |= verdict == "differ"
                print(
                    f"{source.parent.name:16} {ours} ~ {PAIRS[ours]:8} {verdict:12} "
                    f"mean {means[0].mean():.6g} / {means[1].mean():.6g}  p(image) {p[0]:.3g}  p(Holm, tiles too) {p_all:.3g}  "
                    f"MDB image {100 * mdb[0]:.3f} %  tile median {100 * np.median(mdb_tiles):.2f} %  "
                    f"seconds {seconds_a:.2f} / {seconds_b:.2f} ({options.variant})",
                    flush=True,
                )
    return int(differs)


if __name__ == "__main__":
    sys.exit(main())

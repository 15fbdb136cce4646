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
import importlib.util
import pathlib
import sys
import tempfile
import time

if importlib.util.find_spec("numpy") is None:
    print("numpy is not installed: pip install mitsuba numpy")
    sys.exit(0)

import numpy as np  # noqa: E402
from common import compare, max_depth, pathspace, rewrite  # noqa: E402

# Mitsuba's package has the name of this file.
sys.path.pop(0)
PAIRS = {"pt": "path", "lt": "ptracer"}


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
                a, seconds_a = [], 0.0
                for r in range(options.replicates):
                    out = pathlib.Path(folder) / "ours.exr"
                    image, report = pathspace(options.pathspace, path, ours, r + 1, out, "--spp", str(options.spp))
                    seconds_a += report["seconds"]
                    a.append(image)
                theirs = mi.load_dict({"type": PAIRS[ours], "max_depth": max_depth(path)})
                np.array(mi.render(scene, integrator=theirs, spp=1, seed=999))
                b, seconds_b = [], 0.0
                for r in range(options.replicates):
                    start = time.perf_counter()
                    image = np.array(mi.render(scene, integrator=theirs, spp=options.spp, seed=r + 1))
                    seconds_b += time.perf_counter() - start
                    b.append(image[..., :3])
                compared = compare(a, b)
                differs |= compared.verdict == "differ"
                print(
                    f"{source.parent.name:16} {ours} ~ {PAIRS[ours]:8} {compared}  "
                    f"seconds {seconds_a:.2f} / {seconds_b:.2f} ({options.variant})",
                    flush=True,
                )
    return int(differs)


if __name__ == "__main__":
    sys.exit(main())

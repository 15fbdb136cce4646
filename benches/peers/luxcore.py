#!/usr/bin/env python3
"""Compares the efficiency 1/(MSE·seconds) of pathspace and LuxCore on the same scene file: bdpt with BIDIRCPU, pt with PATHCPU.

    pip install pyluxcore numpy
    benches/peers/luxcore.py --pathspace target/release/pathspace --size 128 --seconds 2 --replicates 16 SCENE.xml …

All renderers get one rewritten copy of the file: same square box-filtered film, same depth, spheres as the same fine meshes.
luxcore_scene.py turns it into LuxCore's properties and refuses what LuxCore has not, or has with another meaning. In each
replicate every renderer runs once for the same wall-clock seconds, with its own seed and the same number of threads
(films below 64x64 do not keep several threads of pathspace busy; compare seconds with processor seconds).

MSE is the variance over replicates, averaged over pixels and channels: of all pixels, and of the others than those that see
an emitter directly or lie beside one. The edges of seen emitters are by far the noisiest pixels, and bdpt renders them with less
noise because it connects emitters with the camera (s=1,t=1), which LuxCore does not; the second figure shows how both carry light.
Whether two renderers make the same picture is tested with Welch's t on the image mean and 16x16 tiles (luminance) with Holm's
correction, again with all pixels and with the others; the minimum detectable bias is 5.17 SE/mean. The interval of a ratio of
efficiencies is exp(ln ratio ± t sqrt((cv_a² + cv_b²)/K)), cv over replicates of squared error times seconds, t at 95 % for
K − 1 degrees of freedom; it leaves out that the replicates share the mean that their errors are taken from. MSE does not
contain bias. Both the tests and the MSE err where a renderer hardly ever finds some light, as path tracers do with caustics: its
replicates are skewed, look alike and too dark. Exit status 1 where a pair differs.

What is known of LuxCore and done here:
- Filter NONE: a pixel gets its own samples. With BOX of width 0.5 BIDIRCPU puts some of them into neighbours.
- The film is bottom-up and one row off; the screen window is moved by that row.
- Thread i takes the seed plus i, so seeds of replicates are apart.
- BIDIRCPU limits the edges of each subpath, not of the path, so it adds light of longer paths; ask for a --depth where that is little.
- BIDIRCPU's Russian roulette, on by default, gives wrong images. BIDIRCPU:roulette has it, BIDIRCPU has not and then connects all
  vertices of long subpaths, which is slow; so look at both, and at bdpt:roulette=false, which has none either. PATHCPU keeps its own.
- BIDIRCPU:METROPOLIS takes another sampler than RANDOM; this one is biased at short budgets.

For example --pair bdpt=BIDIRCPU --pair bdpt=BIDIRCPU:roulette --pair bdpt:roulette=false=BIDIRCPU --pair pt=PATHCPU.
"""

import argparse
import contextlib
import importlib.util
import math
import os
import pathlib
import sys
import tempfile
import time

MISSING = [name for name in ("numpy", "pyluxcore") if importlib.util.find_spec(name) is None]
if MISSING:
    print(f"{' and '.join(MISSING)} not installed: pip install pyluxcore numpy")
    sys.exit(0)

import numpy as np  # noqa: E402  before pyluxcore, whose allocator ends the process otherwise
from common import compare, pathspace, rewrite, student_quantile  # noqa: E402
from luxcore_scene import Refused, Scene, load, mirror_conductors, tessellate_spheres  # noqa: E402

ENGINES = ("BIDIRCPU", "PATHCPU")
SAMPLERS = ("RANDOM", "SOBOL", "METROPOLIS")
UNLIMITED = 64


def engine_of(spec: str) -> tuple[str, list[str]]:
    """ENGINE[:word,…] in parts."""
    engine, _, words = spec.partition(":")
    return engine, [w for w in words.split(",") if w]


@contextlib.contextmanager
def quiet():
    """Sends what native code prints to nowhere."""
    sys.stdout.flush()
    kept = [os.dup(1), os.dup(2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        for fd, copy in enumerate(kept, 1):
            os.dup2(copy, fd)
            os.close(copy)
        os.close(nowhere)


class Lux:
    """A scene in LuxCore."""

    def __init__(self, scene: Scene):
        self.lux, self.size = pyluxcore, scene.size
        self.scene = self.lux.Scene()
        self.scene.Parse(self.properties(scene.properties))
        for mesh in scene.meshes:
            normals = None if mesh.normals is None else [tuple(map(float, n)) for n in mesh.normals]
            points = [tuple(map(float, p)) for p in mesh.points]
            triangles = [tuple(map(int, t)) for t in mesh.triangles]
            self.scene.DefineMesh(mesh.material, points, triangles, normals, None, None, None)
            name = f"scene.objects.{mesh.material}"
            self.scene.Parse(self.properties([f"{name}.shape = {mesh.material}", f"{name}.material = {mesh.material}"]))

    def properties(self, lines: list[str]):
        out = self.lux.Properties()
        out.SetFromString("\n".join(lines) + "\n")
        return out

    def render(self, spec: str, seed: int, seconds: float, depth: int, threads: int):
        """Image, seconds and processor seconds without building the scene, and samples per pixel."""
        engine, words = engine_of(spec)
        sampler = next((w for w in words if w in SAMPLERS), "RANDOM")
        lines = [
            f"renderengine.type = {engine}",
            f"renderengine.seed = {1 + 1000 * seed}",
            f"sampler.type = {sampler}",
            "sampler.random.adaptive.strength = 0",
            f"native.threads.count = {threads}",
            f"film.width = {self.size}",
            f"film.height = {self.size}",
            "film.filter.type = NONE",
            "film.imagepipeline.0.type = NOP",
            "film.outputs.1.type = RGB",
            "film.outputs.1.filename = none.exr",
            "path.clamping.variance.maxvalue = 0",
            f"path.maxdepth = {depth}",
            f"light.maxdepth = {depth}",
        ]
        lines += [f"path.pathdepth.{kind} = {depth}" for kind in ("total", "diffuse", "glossy", "specular")]
        if engine == "BIDIRCPU" and "roulette" not in words:
            lines.append("path.russianroulette.depth = 1000000")
        session = self.lux.RenderSession(self.lux.RenderConfig(self.properties(lines), self.scene))
        session.Start()
        start, cpu = time.perf_counter(), time.process_time()
        time.sleep(seconds)
        # The count is lost once it is stopped.
        session.UpdateStats()
        session.Stop()
        spent, cpu = time.perf_counter() - start, time.process_time() - cpu
        spp = session.GetStats().Get("stats.renderengine.pass").GetFloat()
        image = np.zeros((self.size, self.size, 3), np.float32)
        session.GetFilm().GetOutputFloat(self.lux.FilmOutputType.RGB, image, 0)
        return image[::-1].copy(), spent, cpu, spp


class Runs:
    """The replicates of one renderer."""

    def __init__(self):
        self.images, self.seconds, self.cpu, self.spp = [], [], [], []

    def add(self, image: np.ndarray, seconds: float, cpu: float, spp: float) -> None:
        self.images.append(image)
        self.seconds.append(seconds)
        self.cpu.append(cpu)
        self.spp.append(spp)

    def errors(self, pixels: np.ndarray) -> np.ndarray:
        """Squared error of each replicate from their mean over these pixels, made unbiased: their mean is the MSE."""
        x = np.array(self.images, np.float64)[:, pixels]
        return ((x - x.mean(0)) ** 2).mean((1, 2)) * len(x) / (len(x) - 1)

    def efficiency(self, pixels: np.ndarray, seconds: list[float]) -> tuple[float, float]:
        """1/(MSE·seconds) and the coefficient of variation of one replicate's share in it."""
        costs = self.errors(pixels) * np.array(seconds)
        return 1 / costs.mean(), costs.std(ddof=1) / costs.mean()


def ratio(a: tuple[float, float], b: tuple[float, float], count: int) -> str:
    value = a[0] / b[0]
    spread = math.exp(student_quantile(0.05, count - 1) * math.sqrt((a[1] ** 2 + b[1] ** 2) / count))
    return f"{value:.3g} [{value / spread:.3g}, {value * spread:.3g}]"


def sees_emitter(path: pathlib.Path, options) -> np.ndarray:
    """Pixels that see an emitter, and their neighbours."""
    more = ["--max-depth", "1", "--spp", "64", "--threads", str(options.threads)]
    lit = pathspace(options.pathspace, path, "pt", 1, path.parent / "compared.exr", *more)[0].max(-1) > 0
    wide = np.pad(lit, 1)
    h, w = lit.shape
    return np.any([wide[y : y + h, x : x + w] for y in range(3) for x in range(3)], axis=0)


def measure(path: pathlib.Path, scene: Scene, pairs: list[tuple[str, str]], options) -> dict[str, Runs]:
    """All renderers in turn, replicate after replicate."""
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    runs = {name: Runs() for name in names}
    with quiet():
        lux = Lux(scene)
    out = path.parent / "compared.exr"
    # Replicate −1 warms up; the seed before the first is 0 or more.
    for r in range(-1, options.replicates):
        seconds = options.seconds if r >= 0 else min(0.2, options.seconds)
        for name in names:
            if engine_of(name)[0] in ENGINES:
                with quiet():
                    done = lux.render(name, options.seed + r, seconds, scene.depth, options.threads)
            else:
                budget = ["--seconds", str(seconds), "--threads", str(options.threads)]
                image, report = pathspace(options.pathspace, path, name, options.seed + r, out, *budget)
                cpu = report["cpu_seconds"] or math.nan
                done = image, report["seconds"], cpu, report["samples_per_pixel"]
            if r >= 0:
                runs[name].add(*done)
    with quiet():
        del lux
    return runs


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    arguments.add_argument("scenes", nargs="+", type=pathlib.Path)
    arguments.add_argument("--pathspace", default="target/release/pathspace")
    arguments.add_argument("--pair", action="append", help="OURS=THEIRS; default bdpt=BIDIRCPU and pt=PATHCPU")
    arguments.add_argument("--size", type=int, default=128)
    arguments.add_argument("--seconds", type=float, default=2, help="of one replicate of one renderer")
    arguments.add_argument("--replicates", type=int, default=16)
    arguments.add_argument("--seed", type=int, default=1, help="of the first replicate; the others follow")
    arguments.add_argument("--threads", type=int, default=2)
    arguments.add_argument("--depth", type=int, help="longest path in edges; that of the file unless given")
    arguments.add_argument("--rings", type=int, default=64, help="of the mesh of a sphere")
    arguments.add_argument("--mirrors", action="store_true", help="make conductors ideal mirrors, for all renderers")
    options = arguments.parse_args()
    if options.replicates < 2 or options.seed < 1:
        arguments.error("--replicates: at least 2 are needed; --seed: at least 1")
    pairs = [tuple(p.rsplit("=", 1)) for p in options.pair or ["bdpt=BIDIRCPU", "pt=PATHCPU"]]
    for pair in pairs:
        engine, words = engine_of(pair[-1])
        if len(pair) != 2 or engine not in ENGINES or not set(words) <= {*SAMPLERS, "roulette"}:
            known = f"THEIRS {' or '.join(ENGINES)}, after a colon roulette or {' or '.join(SAMPLERS)}"
            arguments.error(f"--pair {'='.join(pair)}: give OURS=THEIRS, {known}")
    global pyluxcore
    with quiet():
        import pyluxcore

        pyluxcore.Init()
    differs = False
    with tempfile.TemporaryDirectory() as folder:
        for source in options.scenes:
            differs |= one_scene(source, pathlib.Path(folder), pairs, options)
    return int(differs)


def one_scene(source: pathlib.Path, folder: pathlib.Path, pairs: list[tuple[str, str]], options) -> bool:
    changes = []

    def edit(root, copy):
        changes.clear()
        count = tessellate_spheres(root, copy, options.rings)
        if count:
            changes.append(f"{count} spheres as meshes of {options.rings} rings")
        count = mirror_conductors(root) if options.mirrors else 0
        if count:
            changes.append(f"{count} conductors as mirrors")

    name = source.resolve().parent.name
    try:
        path = rewrite(source.resolve(), folder, options.size, options.depth, edit)
        scene = load(path)
        if scene.depth < 0:
            path = rewrite(source.resolve(), folder, options.size, UNLIMITED, edit)
            scene = load(path)
    except (Refused, OSError) as reason:
        print(f"{name}: refused: {reason}")
        return False
    about = [f"{options.size}x{options.size}", f"depth {scene.depth}", f"{options.threads} threads"]
    about += [f"{options.replicates} replicates", f"pyluxcore {pyluxcore.Version()}", *changes]
    print(f"{name}: {', '.join(about)}", flush=True)
    runs = measure(path, scene, pairs, options)
    calm = ~sees_emitter(path, options)
    parts = [("all", np.ones_like(calm))] + ([("others", calm)] if calm.any() else [])
    columns = " ".join(f"{'MSE ' + what:>10}" for what, _ in parts)
    print(f"  others than those that see an emitter: {100 * calm.mean():.1f} % of the pixels")
    print(f"  {'renderer':28} {'mean':>9} {'seconds':>8} {'cpu':>7} {'spp':>8} {columns}")
    for renderer, r in runs.items():
        spent = f"{np.mean(r.images):9.6f} {np.mean(r.seconds):8.3f} {np.mean(r.cpu):7.3f} {np.mean(r.spp):8.1f}"
        print(f"  {renderer:28} {spent} " + " ".join(f"{r.errors(p).mean():10.4g}" for _, p in parts))
        if min(r.spp) < 4:
            print(f"    too few samples per pixel ({min(r.spp):.1f}): LuxCore leaves pixels black; ask for more --seconds")
    differs = False
    for ours, theirs in pairs:
        a, b = runs[ours], runs[theirs]
        print(f"  {ours} : {theirs}")
        for what, pixels in parts:
            compared = compare([i * pixels[..., None] for i in a.images], [i * pixels[..., None] for i in b.images])
            differs |= compared.verdict == "differ"
            print(f"    {what:6} {compared}")
        for what, pixels in parts:
            for clock in ("seconds", "cpu"):
                x, y = (r.efficiency(pixels, getattr(r, clock)) for r in (a, b))
                share = f"{x[0]:.4g} / {y[0]:.4g}"
                print(f"    {what:6} 1/(MSE {clock}) {share}, ratio {ratio(x, y, options.replicates)}", flush=True)
    return differs


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""LuxCore as an integrator of pathspace; see docs/peers.md.

Options: engine=PATHCPU (BIDIRCPU), sampler=RANDOM (SOBOL, METROPOLIS), roulette=true (false by default for BIDIRCPU), rings=256 of
the mesh that a sphere becomes.

luxcore_scene.py turns the scene file into LuxCore's properties and refuses what LuxCore has not, or has with another meaning. What is
known of LuxCore and done here:
- Filter NONE: a pixel gets its own samples. With BOX of width 0.5 BIDIRCPU puts some of them into neighbours.
- The film is bottom-up and one row off; the screen window is moved by that row.
- Thread i takes the seed plus i, so seeds of replicates are apart.
- BIDIRCPU limits the edges of each subpath, not of the path: it adds light of longer paths. Ask for a depth where that is little.
- BIDIRCPU's Russian roulette gives wrong images, and without it all vertices of long subpaths are connected, which is slow.
- METROPOLIS limits consecutive rejections, which is a bias at short budgets.
"""

import importlib.util
import pathlib
import tempfile
import time

from common import Clock, Refused, absent, rewrite, serve, write_exr

if any(importlib.util.find_spec(name) is None for name in ("numpy", "pyluxcore")):
    absent("pip install pyluxcore numpy (and name that Python in PATHSPACE_PYTHON)")

import numpy as np  # noqa: E402  before pyluxcore, whose allocator ends the process otherwise
import pyluxcore  # noqa: E402
from luxcore_scene import Scene, load, tessellate_spheres  # noqa: E402

TECHNIQUES = {"PATHCPU": ["s0", "s1"], "BIDIRCPU": ["s0", "s1", "inner", "t1"]}
SAMPLERS = ("RANDOM", "SOBOL", "METROPOLIS")
UNLIMITED = 64


class Renderer:
    def __init__(self):
        self.scene, self.startup = None, 0.0
        self.folder = tempfile.TemporaryDirectory()
        pyluxcore.Init()

    def properties(self, lines: list[str]):
        out = pyluxcore.Properties()
        out.SetFromString("\n".join(lines) + "\n")
        return out

    def choice(self, options: dict, key: str, values) -> str:
        chosen = options.pop(key, next(iter(values)))
        if chosen not in values:
            raise Refused(f"{key}={chosen}: expected {' or '.join(values)}")
        return chosen

    def describe(self, request: dict) -> dict:
        options = dict(request["options"])
        self.engine = self.choice(options, "engine", TECHNIQUES)
        self.sampler = self.choice(options, "sampler", SAMPLERS)
        default = "false" if self.engine == "BIDIRCPU" else "true"
        self.roulette = options.pop("roulette", default) == "true"
        rings = int(options.pop("rings", 256))
        if options:
            raise Refused(f"no option {', '.join(options)}")
        if request["width"] != request["height"]:
            raise Refused("the film is not square")
        clock = Clock()
        self.size = request["width"]
        self.depth = request["max_depth"] if request["max_depth"] > 0 else UNLIMITED
        folder = pathlib.Path(self.folder.name)
        path = rewrite(request, folder, self.depth, lambda root, copy: tessellate_spheres(root, copy, rings))
        self.load(load(path))
        self.startup += clock.spent()["seconds"]
        return {"version": f"LuxCore {pyluxcore.Version()}", "techniques": TECHNIQUES[self.engine]}

    def load(self, scene: Scene) -> None:
        self.scene = pyluxcore.Scene()
        self.scene.Parse(self.properties(scene.properties))
        for mesh in scene.meshes:
            normals = None if mesh.normals is None else [tuple(map(float, n)) for n in mesh.normals]
            points = [tuple(map(float, p)) for p in mesh.points]
            triangles = [tuple(map(int, t)) for t in mesh.triangles]
            self.scene.DefineMesh(mesh.material, points, triangles, normals, None, None, None)
            name = f"scene.objects.{mesh.material}"
            self.scene.Parse(self.properties([f"{name}.shape = {mesh.material}", f"{name}.material = {mesh.material}"]))

    def render(self, request: dict) -> dict:
        if self.scene is None:
            self.describe(request)
        # Below 2^31, with 1000 threads between replicates.
        seed = 1 + 1000 * (request["replicate"] % 4096 + 4096 * (request["seed"] % 512))
        lines = [
            f"renderengine.type = {self.engine}",
            f"renderengine.seed = {seed}",
            f"sampler.type = {self.sampler}",
            "sampler.random.adaptive.strength = 0",
            f"native.threads.count = {request['threads']}",
            f"film.width = {self.size}",
            f"film.height = {self.size}",
            "film.filter.type = NONE",
            "film.imagepipeline.0.type = NOP",
            "film.outputs.1.type = RGB",
            "film.outputs.1.filename = none.exr",
            "path.clamping.variance.maxvalue = 0",
            f"path.maxdepth = {self.depth}",
            f"light.maxdepth = {self.depth}",
        ]
        lines += [f"path.pathdepth.{kind} = {self.depth}" for kind in ("total", "diffuse", "glossy", "specular")]
        if not self.roulette:
            lines.append("path.russianroulette.depth = 1000000")
        if request["spp"] is not None:
            lines.append(f"batch.haltspp = {request['spp']}")
        clock = Clock()
        session = pyluxcore.RenderSession(pyluxcore.RenderConfig(self.properties(lines), self.scene))
        session.Start()
        self.startup += clock.spent()["seconds"]
        clock = Clock()
        if request["spp"] is None:
            time.sleep(request["seconds"])
        else:
            while not session.HasDone():
                time.sleep(0.002)
                session.UpdateStats()
        # The count is lost once it is stopped.
        session.UpdateStats()
        session.Stop()
        answer = clock.spent()
        spp = session.GetStats().Get("stats.renderengine.pass").GetFloat()
        if spp < 4:
            raise Refused(f"{spp:.1f} samples per pixel: LuxCore then leaves pixels black; ask for more")
        image = np.zeros((self.size, self.size, 3), np.float32)
        session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, image, 0)
        write_exr(request["output"], image[::-1])
        startup, self.startup = self.startup, 0.0
        return {**answer, "startup_seconds": startup, "spp": spp}


if __name__ == "__main__":
    renderer = Renderer()
    serve(renderer.describe, renderer.render)

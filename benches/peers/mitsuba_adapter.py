#!/usr/bin/env python3
"""Mitsuba 3 as an integrator of pathspace; see docs/peers.md.

Options: integrator=path (ptracer, volpath, …), variant=llvm_ad_rgb (scalar_rgb, …); any other one goes to Mitsuba's integrator.

It reads our scene files as they are. Kernels are compiled by a render before the first one that counts, with the same number of
samples, because that number may be part of the kernel. Seconds are filled with renders of equal samples, whose mean is the image.
"""

import importlib.util
import pathlib
import tempfile

from common import Clock, Refused, absent, rewrite, serve, write_exr

if any(importlib.util.find_spec(name) is None for name in ("numpy", "mitsuba")):
    absent("pip install mitsuba numpy (and name that Python in PATHSPACE_PYTHON)")

import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402
import numpy as np  # noqa: E402

TECHNIQUES = {
    **dict.fromkeys(("path", "volpath", "volpathmis", "prb", "prbvolpath"), ["s0", "s1"]),
    "ptracer": ["t1"],
}
# Parts of a budget in seconds; it ends at the part that is nearest to it.
PARTS = 8


def value(text: str):
    """A number or a truth value where the text is one."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return {"true": True, "false": False}.get(text, text)


class Renderer:
    def __init__(self):
        self.scene, self.warm, self.startup, self.part = None, set(), 0.0, {}
        self.folder = tempfile.TemporaryDirectory()

    def describe(self, request: dict) -> dict:
        options = dict(request["options"])
        self.name, variant = options.pop("integrator", "path"), options.pop("variant", "llvm_ad_rgb")
        if self.name not in TECHNIQUES:
            raise Refused(f"integrator {self.name}: known are {', '.join(TECHNIQUES)}")
        if variant not in mi.variants():
            raise Refused(f"variant {variant}: there are {', '.join(mi.variants())}")
        clock = Clock()
        mi.set_variant(variant)
        path = rewrite(request, pathlib.Path(self.folder.name), request["max_depth"])
        self.scene = mi.load_file(str(path))
        more = {key: value(text) for key, text in options.items()}
        self.integrator = mi.load_dict({"type": self.name, "max_depth": request["max_depth"], **more})
        self.startup += clock.spent()["seconds"]
        return {"version": f"Mitsuba {mi.__version__} {variant}", "techniques": TECHNIQUES[self.name]}

    def image(self, spp: int, seed: int) -> np.ndarray:
        rendered = mi.render(self.scene, integrator=self.integrator, spp=spp, seed=seed & 0x7FFFFFFF)
        return np.array(rendered)[..., :3]

    def warm_up(self, spp: int) -> float:
        """Seconds of a render whose kernel is compiled."""
        if spp not in self.warm:
            clock = Clock()
            self.image(spp, 1)
            self.startup += clock.spent()["seconds"]
            self.warm.add(spp)
        clock = Clock()
        self.image(spp, 2)
        spent = clock.spent()["seconds"]
        self.startup += spent
        return spent

    def part_of(self, seconds: float) -> int:
        """Samples per pixel that take about an eighth of the seconds."""
        if seconds not in self.part:
            spp = 1
            while (spent := self.warm_up(spp)) < 0.5 * seconds / PARTS and spp < 1 << 16:
                spp *= 2 if spent > 0.1 * seconds / PARTS else 4
            self.part[seconds] = spp
        return self.part[seconds]

    def render(self, request: dict) -> dict:
        if self.scene is None:
            self.describe(request)
        dr.set_thread_count(request["threads"])
        seed, budget = request["seed"], request["seconds"]
        if budget is None:
            parts, spp = 1, request["spp"]
            if spp not in self.warm:
                self.warm_up(spp)
        else:
            parts, spp = 1 << 30, self.part_of(budget)
        clock, total, done = Clock(), 0.0, 0
        while done < parts:
            total = total + self.image(spp, seed + 0x3C6EF35F * done)
            done += 1
            spent = clock.spent()["seconds"]
            if budget is not None and spent + 0.5 * spent / done > budget:
                break
        answer = clock.spent()
        write_exr(request["output"], np.asarray(total / done, np.float32))
        startup, self.startup = self.startup, 0.0
        return {**answer, "startup_seconds": startup, "spp": spp * done}


if __name__ == "__main__":
    renderer = Renderer()
    serve(renderer.describe, renderer.render)

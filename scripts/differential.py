#!/usr/bin/env python3
"""Random scenes of a grammar, rendered by Mitsuba 3 and by pathspace: do both show the same?

    cargo build --release && scripts/differential.py target/release/pathspace [--seeds A:B] [--keep DIR] [-i pt,bdpt] [--only WORD]

A scene is a function of its seed: materials nested up to three deep, with textures, on shapes under random transforms, lit by one to three emitters, seen by a
random sensor. Both sides render it several times with seeds of their own; means of tiles and of the whole image are compared in every channel by Welch's
test, at a family-wise level of 1e-3 over all scenes of the call. A scene that fails is rendered again with four times the replicates, and fails for good where it fails again.
Ends with 1 then. `--only` keeps the scenes in whose text the word stands. Needs Mitsuba 3 (`pip install mitsuba`) and its variant scalar_rgb; says so and ends with 0 without it.
"""

import argparse
import math
import os
import random
import subprocess
import sys
import tempfile

SIZE, TILE = 32, 8
TESTS = ((SIZE // TILE) ** 2 + 1) * 3
FAMILY = 1e-3


def number(v):
    return f"{v:.5g}"


class Grammar:
    """Writes one scene."""

    def __init__(self, seed, folder):
        self.r, self.folder, self.bitmaps = random.Random(seed), folder, 0

    def rgb(self, name, low=0.05, high=0.9):
        return f'<rgb name="{name}" value="{", ".join(number(self.r.uniform(low, high)) for _ in range(3))}"/>'

    def float(self, name, low, high):
        return f'<float name="{name}" value="{number(self.r.uniform(low, high))}"/>'

    def bitmap(self, name, channels=3, low=0.0, high=1.0, least=2):
        """A small image beside the scene."""
        import numpy as np
        import mitsuba as mi
        self.bitmaps += 1
        rng = np.random.default_rng(self.r.randrange(1 << 30))
        w, h = self.r.randint(least, 6), self.r.randint(least, 6)
        data = (low + (high - low) * rng.random((h, w, channels))).astype(np.float32)
        file = f"image-{self.bitmaps}.exr"
        mi.Bitmap(data).write(os.path.join(self.folder, file))
        wrap = self.r.choice(["repeat", "mirror", "clamp"])
        kind = self.r.choice(["bilinear", "nearest"])
        uv = self.uv() if self.r.random() < 0.5 else ""
        name = f' name="{name}"' if name else ""
        return (f'<texture type="bitmap"{name}><string name="filename" value="{file}"/><boolean name="raw" value="true"/>'
                f'<string name="wrap_mode" value="{wrap}"/><string name="filter_type" value="{kind}"/>{uv}</texture>')

    def uv(self):
        return (f'<transform name="to_uv"><scale x="{number(self.r.uniform(0.5, 4))}" y="{number(self.r.uniform(0.5, 4))}"/>'
                f'</transform>')

    def checker(self, name, colour):
        one, two = (self.rgb if colour else lambda n: self.float(n, 0.1, 0.9),) * 2
        return f'<texture type="checkerboard" name="{name}">{one("color0")}{two("color1")}{self.uv()}</texture>'

    def colour(self, name, varies=0.4):
        u = self.r.random()
        if u < varies / 2:
            return self.checker(name, True)
        return self.bitmap(name) if u < varies else self.rgb(name)

    def value(self, name, low=0.0, high=1.0):
        u = self.r.random()
        if u < 0.15:
            return self.checker(name, False)
        return self.bitmap(name, 1, 0.2, 0.9) if u < 0.3 else self.float(name, low, high)

    def roughness(self):
        kind = self.r.choice(["ggx", "beckmann"])
        alpha = (self.float("alpha", 0.1, 0.6) if self.r.random() < 0.7 else
                 self.float("alpha_u", 0.1, 0.5) + self.float("alpha_v", 0.1, 0.5))
        visible = self.r.choice(["true", "false"])
        return f'<string name="distribution" value="{kind}"/>{alpha}<boolean name="sample_visible" value="{visible}"/>'

    def one_roughness(self):
        kind = self.r.choice(["ggx", "beckmann"])
        return f'<string name="distribution" value="{kind}"/>{self.float("alpha", 0.1, 0.6)}'

    def ior(self):
        return self.float("int_ior", 1.2, 1.9)

    def maybe(self, text):
        return text if self.r.random() < 0.4 else ""

    def bsdf(self, depth, opaque, spreads=False):
        """A material; `opaque` where it is to stand in a twosided one, `spreads` where it may have no specular component: a blend of Mitsuba 3.9.1
        adds the probability of one to the densities of the other."""
        plain = ["diffuse", "conductor", "roughconductor", "plastic", "roughplastic", "principled"]
        through = ["dielectric", "roughdielectric", "thindielectric", "glassy", "principledthin"]
        made = ["blendbsdf", "normalmap", "bumpmap"] + ([] if opaque else ["mask", "twosided", "twosided"])
        choices = plain + ([] if opaque else through) + (made * 2 if depth > 0 else [])
        specular = ["conductor", "plastic", "dielectric", "thindielectric", "mask"]
        kind = self.r.choice([c for c in choices if not (spreads and c in specular)])
        # What stands in a bump map of 3.9.1 has an azimuth of its own.
        inner = lambda o=opaque: self.bsdf(depth - 1, o, spreads or kind == "blendbsdf")
        factors = self.maybe(self.rgb("specular_reflectance", 0.4, 1.0))
        body = {
            "diffuse": lambda: self.colour("reflectance"),
            "conductor": lambda: f'<string name="material" value="{self.r.choice(["Au", "Cu", "Ag", "Cr"])}"/>' + factors,
            "roughconductor": lambda: self.roughness() + f'<string name="material" value="{self.r.choice(["Au", "Al"])}"/>' + factors,
            "plastic": lambda: self.colour("diffuse_reflectance") + self.ior() + self.nonlinear() + factors,
            "roughplastic": lambda: self.colour("diffuse_reflectance") + self.one_roughness() + self.ior() + self.nonlinear() + factors,
            "dielectric": lambda: self.ior() + factors,
            "roughdielectric": lambda: self.ior() + self.roughness() + factors + self.maybe(self.rgb("specular_transmittance", 0.4, 1.0)),
            "thindielectric": lambda: self.ior() + factors,
            "principled": lambda: self.principled(False),
            "glassy": lambda: self.principled(True),
            "principledthin": self.thin,
            "blendbsdf": lambda: self.value("weight") + inner() + inner(),
            "mask": lambda: self.value("opacity") + inner(),
            "twosided": lambda: inner(True) + (inner(True) if self.r.random() < 0.5 else ""),
            "normalmap": lambda: self.normals() + inner(),
            "bumpmap": lambda: self.bitmap("", 1, 0.0, 1.0).replace('"nearest"', '"bilinear"') + self.float("scale", 0.02, 0.15) + inner(),
        }[kind]()
        return f'<bsdf type="{"principled" if kind == "glassy" else kind}">{body}</bsdf>'

    def nonlinear(self):
        return f'<boolean name="nonlinear" value="{self.r.choice(["true", "false"])}"/>'

    def normals(self):
        import numpy as np
        import mitsuba as mi
        self.bitmaps += 1
        rng = np.random.default_rng(self.r.randrange(1 << 30))
        n = np.concatenate([rng.uniform(-0.5, 0.5, (4, 4, 2)), np.ones((4, 4, 1))], axis=2)
        n /= np.linalg.norm(n, axis=2, keepdims=True)
        file = f"normals-{self.bitmaps}.exr"
        mi.Bitmap((0.5 * n + 0.5).astype(np.float32)).write(os.path.join(self.folder, file))
        return (f'<texture type="bitmap" name="normalmap"><string name="filename" value="{file}"/>'
                f'<boolean name="raw" value="true"/></texture>')

    def principled(self, transmits):
        names = ["anisotropic", "metallic", "spec_tint", "sheen", "sheen_tint", "flatness", "clearcoat", "clearcoat_gloss"]
        body = self.colour("base_color") + self.value("roughness", 0.2, 0.9)
        body += "".join(self.value(n) for n in names if self.r.random() < 0.5)
        if transmits:
            body += self.float("spec_trans", 0.2, 1.0) + self.float("eta", 1.2, 1.8)
        elif self.r.random() < 0.5:
            body += self.float("specular", 0.0, 1.0)
        return body

    def thin(self):
        names = ["anisotropic", "spec_trans", "spec_tint", "sheen", "sheen_tint", "flatness"]
        body = self.colour("base_color") + self.value("roughness", 0.2, 0.9) + self.float("eta", 1.2, 1.8)
        body += "".join(self.value(n) for n in names if self.r.random() < 0.5)
        return body + self.maybe(self.float("diff_trans", 0.0, 2.0))

    def place(self, size, spread, bumps):
        r = self.r
        # A bump map of Mitsuba 3.9.1 is black on a mirrored rectangle or cube.
        mirror = '<scale x="-1"/>' if r.random() < 0.15 and not bumps else ""
        # Mitsuba 3.9.1 does not normalise axes, and shears where they are not.
        axis = [r.uniform(-1, 1), r.uniform(-1, 1), 1.0]
        x, y, z = (f"{v / math.hypot(*axis):.9f}" for v in axis)
        return (f'<transform name="to_world">{mirror}<scale value="{number(size)}"/>'
                f'<rotate x="{x}" y="{y}" z="{z}" angle="{number(r.uniform(0, 360))}"/>'
                f'<translate x="{number(r.uniform(-spread, spread))}" y="{number(r.uniform(-spread, spread))}" z="{number(r.uniform(0.5, 1.2))}"/></transform>')

    def shape(self):
        kind = self.r.choice(["sphere", "cube", "disk", "cylinder", "rectangle"])
        size = {"sphere": 0.55, "cube": 0.4, "cylinder": 0.5}.get(kind, 0.7) * self.r.uniform(0.8, 1.2)
        material = self.bsdf(3, False)
        return f'<shape type="{kind}">{self.place(size, 0.9, "bumpmap" in material)}{material}</shape>'

    def emitters(self):
        r = self.r
        lamp = (f'<shape type="rectangle"><transform name="to_world"><scale value="{number(r.uniform(0.4, 1))}"/><rotate x="1" angle="180"/>'
                f'<translate x="{number(r.uniform(-1, 1))}" y="{number(r.uniform(-1, 0.5))}" z="3"/></transform>'
                f'<emitter type="area">{self.light("radiance", 4, 12)}</emitter></shape>')
        ball = (f'<shape type="sphere"><transform name="to_world"><scale value="0.25"/><translate x="{number(r.uniform(-2, 2))}" y="-0.5" z="2.4"/></transform>'
                f'<emitter type="area">{self.rgb("radiance", 10, 30)}</emitter></shape>')
        point = f'<emitter type="point"><point name="position" x="{number(r.uniform(-2, 2))}" y="-1.5" z="2.5"/>{self.rgb("intensity", 4, 9)}</emitter>'
        sun = f'<emitter type="directional"><vector name="direction" x="{number(r.uniform(-1, 1))}" y="0.6" z="-1"/>{self.rgb("irradiance", 0.5, 2)}</emitter>'
        sky = f'<emitter type="constant">{self.rgb("radiance", 0.2, 1)}</emitter>'
        # With two rows a map of Mitsuba 3.9.1 has only its poles.
        image = self.bitmap("", 3, 0.0, 2.0, least=3)
        file = image.split('value="')[1].split('"')[0]
        envmap = f'<emitter type="envmap"><string name="filename" value="{file}"/>{self.float("scale", 0.3, 1)}</emitter>'
        look = f'<lookat origin="{number(r.uniform(-2, 2))}, -1.5, 2.6" target="0, 0, 0.3" up="0, 0, 1"/>'
        spot = (f'<emitter type="spot"><transform name="to_world">{look}</transform>{self.rgb("intensity", 6, 16)}'
                f'{self.float("cutoff_angle", 15, 40)}{self.bitmap("texture") if r.random() < 0.4 else ""}</emitter>')
        projector = (f'<emitter type="projector"><transform name="to_world">{look}</transform>{self.bitmap("irradiance")}'
                     f'{self.float("fov", 30, 60)}{self.float("scale", 5, 20)}</emitter>')
        first = r.choice([lamp, lamp, ball, sky, envmap])
        rest = [e for e in [point, sun, spot, projector, lamp] if r.random() < 0.2]
        return first + "".join(e for e in rest if e != first)

    def light(self, name, low, high):
        # Textured lamps are not among what both show alike: their radiance is its mean here.
        return self.rgb(name, low, high)

    def sensor(self):
        r = self.r
        kind = r.choice(["perspective", "perspective", "thinlens", "orthographic"])
        look = f'<lookat origin="{number(r.uniform(-1.5, 1.5))}, -4.5, {number(r.uniform(1, 3))}" target="0, 0, 0.7" up="0, 0, 1"/>'
        if kind == "orthographic":
            look = '<scale x="1.8" y="1.8"/>' + look
        body = self.float("fov", 35, 50) if kind != "orthographic" else ""
        if kind == "thinlens":
            body += self.float("aperture_radius", 0.02, 0.1) + self.float("focus_distance", 3.5, 5)
        return (f'<sensor type="{kind}"><transform name="to_world">{look}</transform>{body}'
                f'<film type="hdrfilm"><integer name="width" value="{SIZE}"/><integer name="height" value="{SIZE}"/><rfilter type="box"/></film>'
                f'<sampler type="independent"/></sensor>')

    def scene(self):
        floor = self.bsdf(2, True)
        return (f'<scene version="3.0.0">\n<integrator type="path"><integer name="max_depth" value="6"/><integer name="rr_depth" value="100"/></integrator>\n'
                f'{self.sensor()}\n<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>'
                f'<bsdf type="twosided">{floor}</bsdf></shape>\n'
                f'<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><scale value="3"/><translate y="2.5" z="1"/></transform>'
                f'<bsdf type="diffuse">{self.colour("reflectance")}</bsdf></shape>\n'
                + "\n".join(self.shape() for _ in range(self.r.randint(2, 3))) + f'\n{self.emitters()}\n</scene>\n')


def tiles(image):
    """Means of the tiles and of the whole image, in every channel."""
    n = SIZE // TILE
    parts = image.reshape(n, TILE, n, TILE, 3).mean(axis=(1, 3)).reshape(-1)
    return list(parts) + list(image.mean(axis=(0, 1)))


def welch(a, b):
    """Two-sided p-value of Welch's test for each column."""
    import numpy as np
    a, b = np.array(a, dtype=np.float64), np.array(b, dtype=np.float64)
    va, vb = a.var(axis=0, ddof=1) / len(a), b.var(axis=0, ddof=1) / len(b)
    delta, se2 = a.mean(axis=0) - b.mean(axis=0), va + vb
    floor = (1e-6 * np.maximum(np.abs(a.mean(axis=0)), 1e-6)) ** 2
    t = delta / np.sqrt(se2 + floor)
    df = se2 ** 2 / np.maximum(va ** 2 / (len(a) - 1) + vb ** 2 / (len(b) - 1), 1e-300)
    return np.array([student(abs(x), max(n, 1.0)) for x, n in zip(t, df)]), delta / np.maximum(b.mean(axis=0), 1e-9)


def student(t, df):
    """P(|T| > t) by the continued fraction of the incomplete beta function."""
    x = df / (df + t * t)
    a, b = df / 2, 0.5
    if x >= 1.0:
        return 1.0
    swap = x > (a + 1) / (a + b + 2)
    if swap:
        a, b, x = b, a, 1 - x
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(max(x, 1e-300)) + b * math.log1p(-x)) / a
    c, d = 1.0, 1 / max(1 - (a + b) * x / (a + 1), 1e-300)
    f = d
    for m in range(1, 200):
        for numerator in (m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)), -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))):
            d = 1 / max(1 + numerator * d, 1e-300)
            c = 1 + numerator / c
            f *= c * d
    return 1 - front * f if swap else front * f


class Sides:
    """Both renderers."""

    def __init__(self, program, integrator, spp):
        self.program, self.integrator, self.spp = program, integrator, spp

    def mitsuba(self, file, seeds):
        import mitsuba as mi
        import numpy as np
        scene = mi.load_file(file)
        return [tiles(np.array(mi.render(scene, spp=self.spp, seed=s))[:, :, :3].astype(np.float64)) for s in seeds]

    def pathspace(self, file, seeds):
        import numpy as np
        out = os.path.join(os.path.dirname(file), "ours.npy")
        images = []
        for s in seeds:
            command = [self.program, "render", file, "-i", self.integrator, "--spp", str(self.spp), "--seed", str(s), "-o", out, "--force"]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                raise RuntimeError(done.stderr.strip())
            images.append(tiles(np.load(out).reshape(SIZE, SIZE, 3).astype(np.float64)))
        return images


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seeds", default="0:60")
    parser.add_argument("--keep")
    parser.add_argument("--only")
    parser.add_argument("-i", "--integrators", default="pt")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--replicates", type=int, default=8)
    args = parser.parse_args()
    try:
        import mitsuba as mi
        import numpy  # noqa: F401
    except ImportError as error:
        print(f"skipped: {error}")
        return 0
    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    first, last = (int(s) for s in args.seeds.split(":"))
    integrators = args.integrators.split(",")
    level = FAMILY / ((last - first) * TESTS * len(integrators))
    failed, compared = [], 0
    with tempfile.TemporaryDirectory(prefix="pathspace-differential-") as temporary:
        for seed in range(first, last):
            folder = os.path.join(args.keep or temporary, str(seed))
            os.makedirs(folder, exist_ok=True)
            file = os.path.join(folder, "scene.xml")
            text = Grammar(seed, folder).scene()
            with open(file, "w") as f:
                f.write(text)
            if args.only and args.only not in text:
                continue
            for integrator in integrators:
                sides = Sides(args.program, integrator, args.spp)
                n = args.replicates
                try:
                    theirs = sides.mitsuba(file, range(n))
                    ours = sides.pathspace(file, range(1, n + 1))
                    p, off = welch(ours, theirs)
                    if p.min() < 20 * level:
                        theirs += sides.mitsuba(file, range(n, 5 * n))
                        ours += sides.pathspace(file, range(n + 1, 5 * n + 1))
                        # The second look is at what the first one has not seen.
                        p, off = welch(ours[n:], theirs[n:])
                except RuntimeError as error:
                    print(f"{seed} {integrator}: {str(error).splitlines()[-1] if str(error) else error}")
                    failed.append(seed)
                    continue
                compared += 1
                at = int(p.argmin())
                whole = ", ".join(f"{100 * v:+.2f} %" for v in off[-3:])
                verdict = "differ" if p[at] < level else "agree"
                if verdict == "differ":
                    failed.append(seed)
                print(f"{seed} {integrator}: {verdict}, smallest p {p[at]:.1e} at {at}, whole image {whole}", flush=True)
    print(f"{compared} comparisons, {len(failed)} failed: {failed}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

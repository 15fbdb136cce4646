#!/usr/bin/env python3
"""Writes a copy of a scene whose metals every compared renderer has: smooth conductors become ideal mirrors (material `none`) with the
colour they have at normal incidence, rough ones diffuse.

    ideal_metals.py SCENE.xml [SCENE.xml ...]    writes SCENE-ideal.xml beside each
"""

import pathlib
import sys
import xml.etree.ElementTree as ET


def numbers(e: ET.Element) -> list[float]:
    values = [float(t) for t in e.get("value").replace(",", " ").split()]
    return values * 3 if len(values) == 1 else values


def normal_reflectance(e: ET.Element) -> str:
    """R = ((η − 1)² + k²) / ((η + 1)² + k²) for each colour."""
    given = {c.get("name"): c for c in e}
    if "eta" not in given or "k" not in given:
        sys.exit(f"error: {e.get('type')} {e.get('id') or ''} without eta and k")
    pairs = zip(numbers(given["eta"]), numbers(given["k"]))
    return ", ".join(f"{((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k):.6g}" for n, k in pairs)


def idealise(root: ET.Element) -> None:
    for e in root.iter("bsdf"):
        if e.get("type") not in ("conductor", "roughconductor"):
            continue
        rgb = normal_reflectance(e)
        for child in list(e):
            e.remove(child)
        if e.get("type") == "conductor":
            ET.SubElement(e, "string", name="material", value="none")
            ET.SubElement(e, "rgb", name="specular_reflectance", value=rgb)
        else:
            e.set("type", "diffuse")
            ET.SubElement(e, "rgb", name="reflectance", value=rgb)


if len(sys.argv) < 2:
    sys.exit(__doc__.strip())
for name in sys.argv[1:]:
    path = pathlib.Path(name)
    tree = ET.parse(path)
    idealise(tree.getroot())
    out = path.with_name(f"{path.stem}-ideal.xml")
    tree.write(out, encoding="utf-8", xml_declaration=True)
    print(out)

"""What the adapters share: the loop over requests (docs/peers.md), the rewritten scene, and the image file."""

import json
import os
import pathlib
import shutil
import struct
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable


class Refused(Exception):
    """The scene has something that the renderer has not, or not with the same meaning."""


def absent(how: str) -> None:
    """Answers that the renderer is not there, and ends."""
    print(json.dumps({"absent": how}), flush=True)
    sys.exit(0)


def serve(describe: Callable[[dict], dict], render: Callable[[dict], dict]) -> None:
    """Answers each line of stdin with one line; whatever else goes to stdout is sent to stderr."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = describe(request) if request["ask"] == "describe" else render(request)
        except Refused as reason:
            answer = {"error": str(reason)}
        except Exception as error:  # noqa: BLE001  the other side has to hear of it, whatever it is
            answer = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
        print(json.dumps(answer), file=answers, flush=True)


class Clock:
    """Wall clock and processor time of all threads, in seconds since the start."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def spent(self) -> dict:
        return {"seconds": time.perf_counter() - self.wall, "cpu_seconds": time.process_time() - self.cpu}


def rewrite(
    request: dict,
    folder: pathlib.Path,
    depth: int,
    edit: Callable[[ET.Element, pathlib.Path], None] | None = None,
) -> pathlib.Path:
    """A copy of the scene's folder with the film, depth and parameters of the request, the box filter and independent samples; `edit`
    changes more of it (root, folder of the copy)."""
    source = pathlib.Path(request["scene"])
    copy = folder / "scene"
    shutil.copytree(source.parent, copy, dirs_exist_ok=True, copy_function=shutil.copyfile)
    for directory in [copy, *[p for p in copy.rglob("*") if p.is_dir()]]:
        directory.chmod(0o755)
    tree = ET.parse(source)
    root = tree.getroot()
    for default in root.iter("default"):
        default.set("value", request["define"].get(default.get("name"), default.get("value")))
    for film in root.iter("film"):
        for child in list(film):
            if child.tag == "rfilter" or child.get("name", "").startswith(("crop", "width", "height")):
                film.remove(child)
        for name in ("width", "height"):
            ET.SubElement(film, "integer", name=name, value=str(request[name]))
        ET.SubElement(film, "rfilter", type="box")
    for sensor in root.iter("sensor"):
        for sampler in sensor.findall("sampler"):
            sensor.remove(sampler)
        ET.SubElement(sensor, "sampler", type="independent")
    for integrator in root.findall("integrator"):
        for child in list(integrator):
            if child.get("name") == "max_depth":
                integrator.remove(child)
        ET.SubElement(integrator, "integer", name="max_depth", value=str(depth))
    if edit is not None:
        edit(root, copy)
    path = copy / "compared.xml"
    tree.write(path)
    return path


def write_exr(path: str, image) -> None:
    """R, G, B of an array (height, width, 3) as an EXR file of scan lines, 32-bit floats, not compressed."""
    height, width, _ = image.shape
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(c + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    header = struct.pack("<II", 20000630, 2)
    for name, kind, value in (
        (b"channels", b"chlist", channels),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", box),
        (b"displayWindow", b"box2i", box),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    ):
        header += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    line = 12 * width
    first = len(header) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (line + 8) for y in range(height)))
    # In a line all of B, then G, then R.
    planes = image[..., ::-1].transpose(0, 2, 1).astype("<f4")
    lines = b"".join(struct.pack("<2i", y, line) + planes[y].tobytes() for y in range(height))
    pathlib.Path(path).write_bytes(header + offsets + lines)

"""The engine, compiled. What people use is in the modules beside it."""

import os
from typing import Any, Callable, Sequence, TypedDict

import numpy as np
from numpy.typing import NDArray

__version__: str
integrators: Integrators

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Path = str | os.PathLike[str]
Params = list[tuple[str, str]]

class PathspaceError(Exception): ...
class SceneError(PathspaceError): ...

class Integrators:
    def list(self) -> list[tuple[str, str]]: ...
    def usual(self) -> list[str]: ...

class Changes(TypedDict):
    size: tuple[int, int] | None
    crop: tuple[int, int, int, int] | None
    max_depth: int | None
    box_filter: bool | None

class SessionOptions(TypedDict):
    seed: int
    layers: Sequence[str]
    threads: int | None
    shard: tuple[int, int] | None
    resume: Path | None

class ValidateOptions(TypedDict):
    seed: int
    alpha: float
    replicates: int
    rays: int
    mdb: float
    threads: int | None

class Replicate(TypedDict):
    spp: int | None
    seconds: float | None
    replicate: int
    seed: int
    threads: int

class Scene:
    name: str
    asked: str
    hash: str
    key: str
    warnings: list[str]
    notes: list[str]
    integrator: str | None
    spp: int | None
    size: tuple[int, int]
    origin: tuple[int, int]
    max_depth: int | None
    @staticmethod
    def from_file(path: Path, params: Params, changes: Changes) -> Scene: ...
    @staticmethod
    def from_text(text: str, file: str, params: Params, changes: Changes) -> Scene: ...
    @staticmethod
    def from_library(name: str, params: Params, changes: Changes) -> Scene: ...
    @staticmethod
    def from_files(files: dict[str, bytes], path: str, params: Params, changes: Changes) -> Scene: ...
    @staticmethod
    def files(path: str, text: str | None, params: Params) -> dict[str, bytes]: ...
    def info(self) -> dict[str, Any]: ...

class Session:
    spec: str
    def __init__(self, integrators: Integrators, scene: Scene, spec: str, options: SessionOptions) -> None: ...
    def run(
        self,
        spp: int | None = None,
        seconds: float | None = None,
        error: float | None = None,
        progress: Callable[[float, float, float], Any] | None = None,
    ) -> tuple[dict[str, Any], bool]: ...
    def look(self) -> dict[str, Any]: ...
    def save(self, path: Path) -> None: ...
    def stop(self) -> None: ...

class Hits:
    hit: NDArray[np.bool_]
    p: F32
    n_g: F32
    n_s: F32
    material: NDArray[np.int64]
    radiance: F32
    def __len__(self) -> int: ...
    def trace(self, d: F32) -> Hits: ...
    def bsdf_eval(self, wo: F32, wi: F32) -> F32: ...
    def bsdf_pdf(self, wo: F32, wi: F32) -> F64: ...
    def bsdf_sample(self, wo: F32, u: F32) -> tuple[F32, F32, F64, NDArray[np.bool_]]: ...
    def sample_emitters(self, u: F32) -> Lights: ...
    def emitters_pdf(self, before: Hits) -> F64: ...
    def visible(self, others: Hits) -> NDArray[np.bool_]: ...

class Lights:
    d: F32
    radiance: F32
    pdf: F64
    delta: NDArray[np.bool_]
    visible: NDArray[np.bool_]

def sample_sensor(scene: Scene, pixels: NDArray[np.int64], u: F32) -> tuple[F32, F32, F32]: ...
def intersect(scene: Scene, o: F32, d: F32) -> Hits: ...
def agree(a: list[F32], b: list[F32], alpha: float, limit: float, seconds: list[list[float]]) -> str: ...
def command(integrators: Integrators, arguments: list[str]) -> int: ...
def validate(
    integrators: Integrators, scene: Scene, specs: list[str], options: ValidateOptions
) -> tuple[str, str, bool]: ...
def render_cell(
    integrators: Integrators, scene: Scene, spec: str, replicate: Replicate, folder: Path, *, ask: bool = False
) -> bool: ...
def read_image(path: Path) -> tuple[F32, float | None]: ...
def write_image(
    path: Path,
    image: F32,
    layers: list[tuple[str, F32]],
    window: tuple[int, ...] | None,
    text: dict[str, str],
    figures: dict[str, float],
    exposure: float | None,
) -> list[Any]: ...
def exposure(image: F32) -> float: ...
def png(image: F32, exposure: float) -> bytes: ...
def merge(paths: list[str], output: Path | None = None) -> tuple[dict[str, Any], list[int]]: ...
def library() -> list[tuple[str, str]]: ...

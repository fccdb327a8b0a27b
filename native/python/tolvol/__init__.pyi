# SPDX-License-Identifier: GPL-3.0-or-later
import enum
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Vertices = NDArray[np.float32] | NDArray[np.float64]
_Integers = NDArray[np.integer[Any]]
_Numbers = NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
_Three = tuple[float, float, float]
_Vector = Sequence[float] | NDArray[np.floating[Any]]
_Range = tuple[float, float]
_Outside = Literal["error", "keep"]
_Crossings = Literal["keep_out", "allow"]
_Transfer = Literal["signed", "magnitude"]

__version__: str
OUTSIDE_COLOURS: tuple[tuple[int, int, int], tuple[int, int, int]]

class TolvolError(Exception):
    code: str
    count: int | None
    first: int | None

class InvalidInput(TolvolError, ValueError): ...
class ResourceLimit(TolvolError): ...
class GlUnavailable(TolvolError): ...
class Cancelled(TolvolError): ...

class Verdict(enum.IntEnum):
    OUTSIDE = 0
    UNPROVED = 1
    INSIDE = 2

class _Part:
    def __enter__(self) -> None: ...
    def __exit__(self, *args: object) -> None: ...

class Progress:
    def __init__(self) -> None: ...
    @property
    def fraction(self) -> float: ...
    @property
    def stage(self) -> str: ...
    @property
    def count(self) -> int: ...
    @property
    def cancelled(self) -> bool: ...
    @property
    def finishing(self) -> bool: ...
    def part(self, first: float, last: float) -> _Part: ...
    def cancel(self) -> None: ...
    def finish(self) -> None: ...

class Worker:
    def __init__(self, work: Callable[[], object]) -> None: ...
    def done(self, seconds: float = 0.0) -> bool: ...
    def join(self) -> None: ...

class CheckResult:
    @property
    def verdicts(self) -> NDArray[np.uint8]: ...
    @property
    def method(self) -> str: ...
    @property
    def renderer(self) -> str: ...

class ToleranceVolume:
    def __init__(
        self,
        vertices: _Vertices,
        triangles: _Integers,
        tolerance: float,
        *,
        to_world: ArrayLike | None = None,
        precision: float | None = None,
        grid_memory: int | None = None,
        field: Literal["scatter", "gl", "fast_marching"] = "scatter",
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def diagonal(self) -> float: ...
    @property
    def precision(self) -> float: ...
    @property
    def field(self) -> Literal["scatter", "gl", "fast_marching"]: ...
    @property
    def spacing(self) -> float: ...
    @property
    def memory(self) -> int: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    def check(
        self,
        points: _Vertices,
        faces: _Integers,
        *,
        to_world: ArrayLike | None = None,
        groups: _Integers | None = None,
        method: Literal["certificate", "gl_certificate", "occlusion_query", "paper", "paper_half_h"] = "certificate",
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> CheckResult: ...
    def distance(
        self,
        points: _Vertices,
        *,
        to_world: ArrayLike | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float64]: ...
    def grid(
        self, *, signed: bool = False, progress: Progress | None = None
    ) -> tuple[NDArray[np.float32], _Three, float, float]: ...

def diagonal(vertices: _Vertices, triangles: _Integers, *, to_world: ArrayLike | None = None) -> float: ...

class DisplayTree:
    ROUNDING: float
    def __init__(self, volume: ToleranceVolume, *, progress: Progress | None = None) -> None: ...
    @property
    def nodes(self) -> NDArray[np.float32]: ...
    @property
    def corners(self) -> NDArray[np.float32]: ...
    @property
    def to_frame(self) -> NDArray[np.float64]: ...
    @property
    def scale(self) -> float: ...
    @property
    def closed(self) -> bool: ...
    def shares(
        self,
        vertices: _Vertices,
        triangles: _Integers,
        edges: Sequence[float] | NDArray[np.floating[Any]],
        *,
        to_world: ArrayLike | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> list[float]: ...
    def signed_distance(
        self,
        points: _Vertices,
        *,
        to_world: ArrayLike | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float64]: ...

class ConstrainResult:
    @property
    def vertices(self) -> NDArray[Any]: ...
    @property
    def factors(self) -> NDArray[np.float64]: ...
    @property
    def report(self) -> dict[str, Any]: ...

def constrain(
    before: _Vertices,
    after: _Vertices,
    faces: _Integers,
    volume: ToleranceVolume,
    *,
    to_world: ArrayLike | None = None,
    mode: Literal["pull_back", "reset"] = "pull_back",
    two_sided: bool = True,
    outside: _Outside = "error",
    crossings: _Crossings = "keep_out",
    max_normal_angle: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ConstrainResult: ...

class Guard:
    def __init__(
        self,
        positions: NDArray[np.float32],
        faces: _Integers,
        volume: ToleranceVolume,
        *,
        to_world: ArrayLike | None = None,
        two_sided: bool = True,
        outside: _Outside = "error",
        crossings: _Crossings = "allow",
        max_normal_angle: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None: ...
    def constrain(
        self, positions: NDArray[np.float32], *, progress: Progress | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]: ...
    def reset(self, positions: NDArray[np.float32], *, progress: Progress | None = None) -> None: ...
    def replace_faces(self, faces: _Integers, *, progress: Progress | None = None) -> NDArray[np.int32]: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def outside(self) -> NDArray[np.int32]: ...
    @property
    def uncovered(self) -> int: ...
    @property
    def exceeding(self) -> int: ...
    @property
    def warnings(self) -> list[str]: ...

class SmoothingResult:
    @property
    def vertices(self) -> NDArray[Any]: ...
    @property
    def report(self) -> dict[str, Any]: ...

def smooth(
    vertices: _Vertices,
    triangles: _Integers,
    volume: ToleranceVolume | None = None,
    *,
    to_world: ArrayLike | None = None,
    iterations: int = 10,
    operator: Literal["laplacian", "bilaplacian"] = "bilaplacian",
    weights: Literal["uniform", "cotangent"] = "cotangent",
    boundary: Literal["fixed", "along"] = "fixed",
    locked: NDArray[np.bool_] | None = None,
    strength: NDArray[np.float64] | None = None,
    mode: Literal["pull_back", "reset"] = "pull_back",
    two_sided: bool = True,
    outside: _Outside = "error",
    crossings: _Crossings = "keep_out",
    max_normal_angle: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SmoothingResult: ...

class DecimationResult:
    @property
    def vertices(self) -> NDArray[Any]: ...
    @property
    def triangles(self) -> NDArray[np.int32]: ...
    @property
    def vertex_map(self) -> NDArray[np.int32]: ...
    @property
    def vertex_source(self) -> NDArray[np.int32]: ...
    @property
    def triangle_source(self) -> NDArray[np.int32]: ...
    @property
    def source_triangle(self) -> NDArray[np.int32]: ...
    @property
    def source_weights(self) -> NDArray[np.float64]: ...
    @property
    def report(self) -> dict[str, Any]: ...

def decimate(
    vertices: _Vertices,
    triangles: _Integers,
    volume: ToleranceVolume | None,
    *,
    to_world: ArrayLike | None = None,
    placement: Literal["optimal", "subset"] = "optimal",
    two_sided: bool = True,
    target_triangles: int | None = None,
    locked: NDArray[np.bool_] | None = None,
    shares: NDArray[np.float64] | None = None,
    outside: _Outside = "error",
    wedges: _Integers | None = None,
    effort: Literal["fast", "thorough"] = "fast",
    crossings: _Crossings = "keep_out",
    max_normal_angle: float | None = None,
    cell: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> DecimationResult: ...
def wedges(triangles: _Integers, corners: NDArray[np.float32]) -> NDArray[np.int32]: ...

class HoleClosingResult:
    @property
    def triangles(self) -> NDArray[np.int32]: ...
    @property
    def triangle_loop(self) -> NDArray[np.int32]: ...
    @property
    def borders(self) -> NDArray[np.int32]: ...
    @property
    def corner_source(self) -> NDArray[np.int32]: ...
    @property
    def loops(self) -> list[dict[str, Any]]: ...
    @property
    def report(self) -> dict[str, Any]: ...

def close_holes(
    vertices: _Vertices,
    triangles: _Integers,
    volume: ToleranceVolume,
    *,
    to_world: ArrayLike | None = None,
    largest_perimeter: float | None = None,
    max_normal_angle: float | None = None,
    shares: NDArray[np.float64] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> HoleClosingResult: ...

class Lattice:
    def __init__(
        self,
        points: _Numbers,
        domain: ArrayLike | None = None,
        *,
        degree: int | Sequence[int] | None = None,
        weights: _Numbers | None = None,
        knots: Sequence[_Numbers | None] | None = None,
    ) -> None: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def degree(self) -> tuple[int, int, int]: ...

def lattice_points(shape: int | Sequence[int], domain: ArrayLike | None = None) -> NDArray[np.float64]: ...

class DeformationResult:
    @property
    def vertices(self) -> NDArray[Any]: ...
    @property
    def report(self) -> dict[str, Any]: ...

def deform(
    vertices: _Vertices,
    lattice: Lattice,
    faces: _Integers | None = None,
    volume: ToleranceVolume | None = None,
    *,
    to_world: ArrayLike | None = None,
    mode: Literal["blocked", "farthest", "pull_back"] = "blocked",
    two_sided: bool = True,
    outside: _Outside = "error",
    crossings: _Crossings = "keep_out",
    max_normal_angle: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> DeformationResult: ...

class DirectedHausdorffResult:
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def position(self) -> _Three: ...
    @property
    def triangle(self) -> int: ...

class HausdorffResult:
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def forward(self) -> DirectedHausdorffResult: ...
    @property
    def backward(self) -> DirectedHausdorffResult: ...

def weld(vertices: _Vertices, *, threads: int | None = None) -> tuple[NDArray[np.floating[Any]], NDArray[np.int32]]: ...
def list_rows(
    data: bytes | memoryview,
    count: int,
    types: Sequence[tuple[str | None, str]],
    *,
    offset: int = 0,
) -> tuple[list[NDArray[Any] | tuple[NDArray[Any], NDArray[np.int64]]], int]: ...
def crossing_pairs(
    vertices: _Vertices,
    triangles: _Integers,
    *,
    most: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.int32]: ...
def solidity(
    vertices: _Vertices,
    triangles: _Integers,
    *,
    to_world: ArrayLike | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]: ...
def directed_hausdorff(
    vertices_a: _Vertices,
    triangles_a: _Integers,
    vertices_b: _Vertices,
    triangles_b: _Integers,
    *,
    bound: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> DirectedHausdorffResult: ...
def hausdorff(
    vertices_a: _Vertices,
    triangles_a: _Integers,
    vertices_b: _Vertices,
    triangles_b: _Integers,
    *,
    bound: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> HausdorffResult: ...

class Sides:
    @property
    def mean(self) -> float: ...
    @property
    def mean_range(self) -> _Range: ...
    @property
    def share_inside(self) -> float: ...
    @property
    def share_inside_range(self) -> _Range: ...
    @property
    def inside(self) -> _Range: ...
    @property
    def outside(self) -> _Range: ...

class DeviationResult:
    @property
    def mean(self) -> float: ...
    @property
    def mean_range(self) -> _Range: ...
    @property
    def mean_error(self) -> float: ...
    @property
    def rms(self) -> float: ...
    @property
    def rms_range(self) -> _Range: ...
    @property
    def share_beyond(self) -> NDArray[np.float64]: ...
    @property
    def share_beyond_range(self) -> NDArray[np.float64]: ...
    @property
    def percentiles(self) -> NDArray[np.float64]: ...
    @property
    def percentiles_range(self) -> NDArray[np.float64]: ...
    @property
    def distances(self) -> NDArray[np.float64]: ...
    @property
    def weights(self) -> NDArray[np.float64]: ...
    @property
    def sides(self) -> Sides | None: ...
    @property
    def spacing(self) -> float: ...

def deviation(
    vertices_a: _Vertices,
    triangles_a: _Integers,
    vertices_b: _Vertices,
    triangles_b: _Integers,
    *,
    bounds: Sequence[float] | NDArray[np.floating[Any]] = (),
    percentiles: Sequence[float] | NDArray[np.floating[Any]] = (),
    threads: int | None = None,
    progress: Progress | None = None,
) -> DeviationResult: ...

class Camera:
    def __init__(self, eye: _Vector, target: _Vector, *, up: _Vector = (0, 0, 1), angle: float = 30) -> None: ...
    @staticmethod
    def framing(
        vertices: _Vertices,
        triangles: _Integers,
        *,
        size: tuple[int, int] = (1024, 1024),
        direction: _Vector = (0.55, -1, 0.4),
        up: _Vector = (0, 0, 1),
        angle: float = 30,
        margin: float = 0,
        to_world: ArrayLike | None = None,
    ) -> Camera: ...
    @property
    def eye(self) -> list[float]: ...
    @property
    def target(self) -> list[float]: ...
    @property
    def up(self) -> list[float]: ...
    @property
    def angle(self) -> float: ...

def transfer_colours(transfer: _Transfer = "signed") -> NDArray[np.uint8]: ...
def render_distance(
    vertices: _Vertices,
    triangles: _Integers,
    volume: ToleranceVolume,
    *,
    camera: Camera | None = None,
    size: tuple[int, int] = (1024, 1024),
    transfer: _Transfer = "signed",
    to_world: ArrayLike | None = None,
    edges: bool = False,
    samples: int = 2,
    threads: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.uint8]: ...
def render_volume(
    volume: ToleranceVolume,
    *,
    camera: Camera | None = None,
    size: tuple[int, int] = (1024, 1024),
    vertices: _Vertices | None = None,
    triangles: _Integers | None = None,
    to_world: ArrayLike | None = None,
    cut: tuple[_Vector, _Vector] | None = None,
    samples: int = 2,
    threads: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.uint8]: ...
def pause(seconds: float) -> None: ...
def renderer() -> str: ...
def shutdown() -> None: ...

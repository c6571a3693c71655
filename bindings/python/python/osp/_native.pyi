"""The compiled part of osp. Import from `osp` instead."""

import os
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "View",
    "Camera",
    "Culler",
    "Mesh",
    "Recording",
    "open_recording",
    "replay_frames",
    "verify_methods",
    "render_frame",
    "RecordingError",
    "AdapterError",
    "__version__",
    "INDEXES",
    "OCCLUSION_METHODS",
]

__version__: str
INDEXES: List[str]
OCCLUSION_METHODS: List[str]

class RecordingError(ValueError):
    path: str
    line: Optional[int]
    byte: Optional[int]

class AdapterError(RuntimeError): ...

@final
class View:
    @staticmethod
    def look_at(
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov_y_degrees: float = 60.0,
        aspect: float = ...,
        near_m: float = 0.1,
        far_m: float = 1000.0,
    ) -> View: ...
    @staticmethod
    def from_matrix(clip_from_world: ArrayLike, depth: str = "zero-to-one") -> View: ...
    @property
    def eye(self) -> NDArray[np.float32]: ...
    @property
    def forward(self) -> NDArray[np.float32]: ...
    @property
    def near_m(self) -> float: ...
    @property
    def far_m(self) -> float: ...
    @property
    def clip_from_world(self) -> NDArray[np.float32]: ...
    @property
    def frustum_planes(self) -> NDArray[np.float32]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Camera:
    def __new__(
        cls,
        clip_from_world: Union[View, ArrayLike],
        depth: Optional[str] = None,
        *,
        hide_by_occluders: bool = False,
        layers: int = 4294967295,
    ) -> Camera: ...
    def ray(self, x: float, y: float) -> Tuple[NDArray[np.float32], NDArray[np.float32]]: ...

@final
class Culler:
    def __new__(cls) -> Culler: ...
    def set(self, keys: ArrayLike, boxes: ArrayLike, maxs: Optional[ArrayLike] = None) -> None: ...
    def remove(self, keys: ArrayLike) -> None: ...
    def clear(self) -> None: ...
    def set_layers(self, keys: ArrayLike, layers: ArrayLike) -> None: ...
    def set_occluder(self, key: int, corners: ArrayLike, faces: Optional[ArrayLike] = None) -> None: ...
    def remove_occluder(self, key: int) -> None: ...
    def cull(self, *cameras: Union[Camera, View, ArrayLike]) -> Tuple[NDArray[np.uint64], ...]: ...
    def are_hidden(
        self, camera: Union[Camera, View, ArrayLike], boxes: ArrayLike, maxs: Optional[ArrayLike] = None
    ) -> NDArray[np.bool_]: ...
    def commit(self) -> None: ...
    @property
    def refused(self) -> List[Tuple[int, str]]: ...
    def bounds(self, key: int) -> NDArray[np.float32]: ...
    def in_box(self, min: ArrayLike, max: ArrayLike) -> NDArray[np.uint64]: ...
    def in_sphere(self, center: ArrayLike, radius_m: float) -> NDArray[np.uint64]: ...
    def on_ray(
        self, origin: ArrayLike, direction: ArrayLike, t_max: float = ...
    ) -> Tuple[NDArray[np.uint64], NDArray[np.float32]]: ...
    def pick(
        self,
        origin: ArrayLike,
        direction: ArrayLike,
        hit: Optional[Callable[[int], Optional[float]]] = None,
        t_max: float = ...,
    ) -> Optional[Tuple[int, float]]: ...
    def rays(
        self, origins: ArrayLike, directions: ArrayLike, t_max: float = ...
    ) -> Tuple[NDArray[np.uint64], NDArray[np.float32]]: ...
    def nearest(
        self, point: ArrayLike, count: int = 1
    ) -> Tuple[NDArray[np.uint64], NDArray[np.float32]]: ...
    def __len__(self, /) -> int: ...
    def __contains__(self, key: object, /) -> bool: ...

@final
class Mesh:
    def __new__(
        cls,
        triangles: ArrayLike,
        faces: Optional[ArrayLike] = None,
        *,
        opaque: Optional[ArrayLike] = None,
    ) -> Mesh: ...
    def visible(
        self,
        view: Union[View, ArrayLike],
        occlusion: Optional[str] = None,
        *,
        occluders: Optional[int] = None,
    ) -> NDArray[np.bool_]: ...
    @property
    def triangles(self) -> NDArray[np.float32]: ...
    def __len__(self, /) -> int: ...

@final
class Recording:
    @property
    def path(self) -> Path: ...
    @property
    def format(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def layers(self) -> List[str]: ...
    @property
    def left_out(self) -> List[str]: ...
    @property
    def warnings(self) -> List[str]: ...
    @property
    def skipped(self) -> int: ...
    @property
    def events(self) -> int: ...
    @property
    def bounds(self) -> Optional[NDArray[np.float32]]: ...
    def whole_view(self, aspect: float) -> View: ...
    def strokes(self) -> Dict[str, NDArray[Any]]: ...
    def points(self) -> Dict[str, NDArray[Any]]: ...
    def heads(self) -> Dict[str, NDArray[Any]]: ...
    def polygons(self) -> Dict[str, Any]: ...

def open_recording(
    path: Union[str, os.PathLike[str]], lenient: bool = False, max_polygons: Optional[int] = None
) -> Recording: ...
def replay_frames(
    path: Union[str, os.PathLike[str]],
    indexes: Sequence[str],
    occlusion: Sequence[str],
    pace: str,
    camera: str,
    budget_secs: float,
    lenient: bool,
    max_polygons: Optional[int],
) -> Tuple[Dict[str, NDArray[Any]], Dict[str, Any]]: ...
def verify_methods(
    path: Union[str, os.PathLike[str]],
    occlusion: Sequence[str],
    occluders: Sequence[int],
    views: int,
    pixels: Tuple[int, int],
    whole: bool,
    pace: str,
    camera: str,
    lenient: bool,
    max_polygons: Optional[int],
) -> Tuple[Dict[str, NDArray[Any]], Dict[str, int]]: ...
def render_frame(
    path: Union[str, os.PathLike[str]],
    size: Sequence[int],
    frame: Optional[int],
    view: Union[str, View, ArrayLike],
    occlusion: Optional[str],
    pace: str,
    time_secs: float,
    lenient: bool,
    max_polygons: Optional[int],
) -> NDArray[np.uint8]: ...

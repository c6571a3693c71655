"""Recorded sketches as arrays."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Union

from . import _native
from ._table import Table

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def open(
    path: Union[str, os.PathLike[str]],
    *,
    lenient: bool = False,
    max_polygons: Optional[int] = None,
) -> Recording:
    """Reads a recorded sketch to its end.

    `.ron` and `.ron.zst` (osp), `.tilt` as a file or folder (Tilt Brush, Open Brush), `.apa` (A-Painter), `.json`
    (CASSIE), `.poses`, `.poses.gz` (trackers), `.obj`, `.obj.gz`, `.glb`, `.gltf`: the format is detected from the
    content, then from the name.

    With `lenient`, damaged parts are skipped and counted (`Recording.skipped`, `Recording.warnings`). `max_polygons`
    (default 4,000,000) limits the memory that a file may take.

    `OSError`: the file cannot be read. `RecordingError` (a `ValueError`): the file is damaged, too large or of another
    format; the message names the file, the line or byte, and the expected form.

    >>> sketch = osp.open(recordings / "room.ron")
    >>> sketch
    <osp.Recording of 415 strokes, 12094 points, 11409 polygons: room.ron>
    >>> sketch.points["position"].shape
    (12094, 3)
    """
    return Recording(_native.open_recording(path, lenient, max_polygons))


class Recording:
    """A recorded sketch: the drawn strokes, and the model at the end. `osp.open` creates it.

    The tables are computed at their first use. Positions are in metres in the world, times in seconds. Colours are sRGB
    from 0 to 1 with opacity. Rotations are quaternions (x, y, z, w) from the space of the tracker or head to the world.

    >>> sketch = osp.open(recordings / "portrait.ron")
    >>> sketch.strokes["tool"][:3].tolist()
    ['ribbon', 'ribbon', 'ribbon']
    >>> seen = sketch.mesh.visible(sketch.whole_view(), "msvbsp")
    >>> 0 < len(sketch.triangles[seen]) <= len(sketch.triangles)
    True
    """

    def __init__(self, native: _native.Recording) -> None:
        self._native = native

    @property
    def path(self) -> Path:
        """The file from which the sketch was read."""
        return self._native.path

    @property
    def format(self) -> str:
        """Short name of the file's format: `ron`, `ron.zst`, `tilt`, `apa`, `cassie`, `poses`, `obj`, `glb`, `gltf`."""
        return self._native.format

    @property
    def name(self) -> str:
        """Name of the session; may be empty."""
        return self._native.name

    @property
    def source(self) -> str:
        """The program or file from which the session comes; may be empty."""
        return self._native.source

    @property
    def layers(self) -> List[str]:
        """Names of the layers, by their numbers."""
        return self._native.layers

    @property
    def left_out(self) -> List[str]:
        """Descriptions of the parts of the file that a recording cannot hold: pictures, models, videos."""
        return self._native.left_out

    @property
    def warnings(self) -> List[str]:
        """The reader's warnings: skipped damage, unknown brushes."""
        return self._native.warnings

    @property
    def skipped(self) -> int:
        """Number of damaged parts that were skipped (`lenient`)."""
        return self._native.skipped

    @property
    def events(self) -> int:
        """Number of events: samples, beginnings and ends of strokes, edits, head poses."""
        return self._native.events

    @property
    def bounds(self) -> Optional[NDArray[np.float32]]:
        """Smallest and largest corner of the model at the end, of the shape (2, 3); None if the model is empty."""
        return self._native.bounds

    @cached_property
    def strokes(self) -> Table:
        """A row for each stroke, in the order in which they begin: `stroke` (its number), `tool` (`ribbon`, `wall`,
        `tube`; `polygon` for faces without a tool), `brush` (name; empty without a brush), `color` (n, 4), `width_m`,
        `begin_secs`, `end_secs` (NaN if it has no end), `points` (their number), `layer`, `visible` (whether it is in
        the model at the end: not erased, undone or hidden)."""
        return Table(self._native.strokes())

    @cached_property
    def points(self) -> Table:
        """A row for each control point, in the order of recording: `stroke`, `time_secs`, `position` (n, 3), `rotation`
        (n, 4) of the tracker, `pressure` (0 to 1). Points are the positions of the hand; edits do not change them."""
        return Table(self._native.points())

    @cached_property
    def heads(self) -> Table:
        """A row for each pose of the head, which looks along its -z: `time_secs`, `position` (n, 3), `rotation` (n, 4)."""
        return Table(self._native.heads())

    @cached_property
    def _model(self) -> Dict[str, Any]:
        return self._native.polygons()

    @cached_property
    def polygons(self) -> Table:
        """A row for each polygon of the model at the end: `polygon` (its number), `stroke` (-1 if it has none),
        `corners` (n, 4, 3), where a triangle repeats its last corner, `corner_count` (3 or 4), `color` (n, 4), `opaque`
        (whether its whole area hides the polygons behind it). Particles, which are drawn facing the eye, have their stored
        orientation."""
        return Table(self._model["polygons"])

    @property
    def triangles(self) -> NDArray[np.float32]:
        """The model at the end as triangles, of the shape (n, 3, 3)."""
        triangles: NDArray[np.float32] = self._model["triangles"]
        return triangles

    @property
    def polygon_of_triangle(self) -> NDArray[np.uint32]:
        """For each triangle the row of its polygon: `polygons["color"][polygon_of_triangle]` are the colours of the
        triangles."""
        rows: NDArray[np.uint32] = self._model["polygon_of_triangle"]
        return rows

    @cached_property
    def mesh(self) -> _native.Mesh:
        """The triangles as an `osp.Mesh`, in which only opaque triangles hide others: `sketch.mesh.visible(view, "msvbsp")`
        has a truth value for each triangle."""
        return _native.Mesh(self.triangles, opaque=self.polygons["opaque"][self.polygon_of_triangle])

    @property
    def time_span_secs(self) -> Optional[Tuple[float, float]]:
        """The least and the largest time of a point or head pose; None if there is neither."""
        columns = [self.points["time_secs"], self.heads["time_secs"]]
        spans = [(float(column.min()), float(column.max())) for column in columns if len(column)]
        return (min(s[0] for s in spans), max(s[1] for s in spans)) if spans else None

    def whole_view(self, aspect: float = 16 / 9) -> _native.View:
        """A view that shows all of the model at the end on a screen with the ratio `aspect` of width to height, from the
        side where the artist began, if the head was recorded. `ValueError`: `aspect` is not between 0.001 and 1000."""
        return self._native.whole_view(aspect)

    def __repr__(self) -> str:
        strokes, points, polygons = (table.rows for table in (self.strokes, self.points, self.polygons))
        return f"<osp.Recording of {strokes} strokes, {points} points, {polygons} polygons: {self.path.name}>"

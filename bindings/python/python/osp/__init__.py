"""Visibility culling for 3D models that grow, for numpy.

* `Culler`: objects with keys of yours that come, move and go; which of them does each camera see, also behind walls? Which lie in a
  box or a ball, meet a ray, are nearest?
* `visible`, `Mesh`: which triangles of a mesh a camera sees, also behind what hides them.
* `open`: recorded sketches (Tilt Brush, Open Brush, A-Painter, CASSIE, osp's own, .obj, .glb) as arrays.
* `replay`, `verify`: measure spatial structures and occlusion culling on a recording.
* `render`: a picture of a recording, where there is a graphics adapter.

Space is right-handed, +y up, -z forward, in metres. A `View` is made from an eye and a target, or from any engine's matrix.

>>> culler = osp.Culler()
>>> culler.set([70, 80], [[-1, 0, -5, 1, 2, -4], [-1, 0, 4, 1, 2, 5]])   # min and max corner of each box
>>> view = osp.View.look_at(eye=(0, 1, 0), target=(0, 1, -1))
>>> culler.cull(view)
(array([70], dtype=uint64),)
"""

from ._measure import Replay, Verification, replay, verify
from ._native import (
    INDEXES,
    OCCLUSION_METHODS,
    AdapterError,
    Camera,
    Culler,
    Mesh,
    RecordingError,
    View,
    __version__,
)
from ._recording import Recording, open
from ._render import render
from ._table import Table
from ._visible import visible

__all__ = [
    "INDEXES",
    "OCCLUSION_METHODS",
    "AdapterError",
    "Camera",
    "Culler",
    "Mesh",
    "Recording",
    "RecordingError",
    "Replay",
    "Table",
    "Verification",
    "View",
    "__version__",
    "open",
    "render",
    "replay",
    "verify",
    "visible",
]

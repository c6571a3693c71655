"""Visibility culling for 3D models that grow, for numpy.

* `Culler`: objects with keys of your choice, which can be added, moved and removed. It finds the objects that each
  camera sees, with or without the objects that occluders hide. It finds the objects in a box or a sphere, along a ray,
  or nearest to a point.
* `Mesh`: finds the triangles of a mesh that a camera sees, with or without the triangles that others hide.
* `open`: reads recorded sketches (Tilt Brush, Open Brush, A-Painter, CASSIE, osp's own, .obj, .glb) as arrays.
* `replay`, `verify`: measure spatial structures and occlusion culling on a recording.
* `render`: draws a picture of a recording, if there is a graphics adapter.

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
]

"""Visibility culling for 3D models that grow, for numpy.

* `Index`: boxes that come, move and go; which of them does a camera see, lie in a box or a ball, meets a ray, are nearest?
* `visible`, `Mesh`: which triangles of a mesh a camera sees, also behind what hides them.
* `open`: recorded sketches (Tilt Brush, Open Brush, A-Painter, CASSIE, osp's own, .obj, .glb) as arrays.
* `replay`, `verify`: measure spatial structures and occlusion culling on a recording.
* `render`: a picture of a recording, where there is a graphics adapter.

Space is right-handed, +y up, -z forward, in metres. A `View` is made from an eye and a target, or from any engine's matrix.

>>> index = osp.Index()
>>> ids = index.insert([[-1, 0, -5, 1, 2, -4], [-1, 0, 4, 1, 2, 5]])   # min and max corner of each box
>>> view = osp.View.look_at(eye=(0, 1, 0), target=(0, 1, -1))
>>> index.frustum(view)
array([0], dtype=uint32)
"""

from ._measure import Replay, Verification, replay, verify
from ._native import INDEXES, OCCLUSION_METHODS, AdapterError, Index, Mesh, RecordingError, View, __version__
from ._recording import Recording, open
from ._render import render
from ._table import Table
from ._visible import visible

__all__ = [
    "INDEXES",
    "OCCLUSION_METHODS",
    "AdapterError",
    "Index",
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

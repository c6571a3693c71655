"""Visible triangles of a mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Union

from ._native import Mesh, View

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


def visible(
    view: Union[View, ArrayLike],
    triangles: ArrayLike,
    occlusion: Optional[str] = None,
    *,
    faces: Optional[ArrayLike] = None,
    opaque: Optional[ArrayLike] = None,
    occluders: Optional[int] = None,
) -> NDArray[np.bool_]:
    """Finds the triangles that a camera sees. Returns an array of truth values, one for each triangle.

    The arguments are those of `Mesh` and of `Mesh.visible`, and so are the errors. For several views of one mesh, make a
    `Mesh` once.

    >>> vertices = [[-1, -1, -3], [1, -1, -3], [0, 1, -3], [-1, -1, 3], [1, -1, 3], [0, 1, 3]]
    >>> view = osp.View.look_at(eye=(0, 0, 0), target=(0, 0, -1))
    >>> osp.visible(view, vertices, faces=[[0, 1, 2], [3, 4, 5]])
    array([ True, False])
    """
    return Mesh(triangles, faces, opaque=opaque).visible(view, occlusion, occluders=occluders)

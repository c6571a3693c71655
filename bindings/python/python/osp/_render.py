"""Pictures of recorded sketches."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Optional, Sequence, Union

from . import _native

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


def render(
    path: Union[str, os.PathLike[str]],
    size: Sequence[int] = (1280, 720),
    *,
    frame: Optional[int] = None,
    view: Union[str, _native.View, ArrayLike] = "whole",
    occlusion: Optional[str] = None,
    pace: str = "samples:16",
    time_secs: float = 10.0,
    lenient: bool = False,
    max_polygons: Optional[int] = None,
) -> NDArray[np.uint8]:
    """Draws a frame of a recording on the graphics adapter, without a window: the picture of `osp render`.

    The result has the shape (height, width, 4): red, green, blue (sRGB) and opacity (always 255), rows from the top. `size`
    is width and height in pixels. `frame` is the number of the frame, from 0 as in `osp.replay` at the same `pace`; without
    it the last frame is drawn.

    `view` selects the view. `whole` shows the whole model, from the side of the session's own camera, else from the side
    where the artist began; `recorded` is the recorded head, else the session's own camera, else `orbit`; `orbit`
    circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model. It can also be a
    `View`, or a matrix in the form of `View.from_matrix` with the depth from zero to one. Then the height of the
    view fills the picture, and the width follows `size`.

    Polygons outside of the view are not drawn. With `occlusion`, polygons that a method finds hidden are not drawn, either:
    `hzb` and `queries` on the adapter, or a method of `osp.replay`. The method `msvbsp-paper` may
    omit visible polygons; no other method changes a pixel. `time_secs` (0 to 10,000) is the time at which animated
    brushes are shown. `lenient` and `max_polygons` are the same as in `osp.open`.

    A software driver suffices (on Debian, `mesa-vulkan-drivers`). Each call reads the file twice and opens the adapter
    again.

    `AdapterError` (a `RuntimeError`): there is no graphics adapter, or it cannot draw this picture. `ValueError`: the
    width or height is not 1 to 16,384 pixels (some adapters draw less), there is no such frame, or a name is unknown.
    Other errors are those of `osp.open`.

    >>> osp.render(recordings / "room.ron", (320, 180)).shape
    (180, 320, 4)
    >>> inside = osp.View.look_at((0, 1.6, 0), (4, 1.4, 0))
    >>> osp.render(recordings / "room.ron", (320, 180), view=inside, occlusion="hzb").dtype
    dtype('uint8')
    """
    return _native.render_frame(
        path, list(size), frame, view, occlusion, pace, time_secs, lenient, max_polygons
    )

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

    `view` says where the eye is: `whole` shows the whole model, from the side of the session's own camera, or from which the
    artist began it; `recorded` is the recorded head, else the session's own camera, else `orbit`; `orbit` circles around the
    model, `follow` is behind the hand, `inside` turns in the middle of the model. Or it is a `View`, or a matrix as
    `View.from_matrix` takes it with the depth from zero to one: their height fills the picture, the width follows `size`.

    Polygons outside of the view are left out, and with `occlusion` those that are found to be hidden: `hzb` and `queries` on
    the adapter, or a method of `osp.replay`. Of these, `msvbsp-paper` and `depth-centers` may leave out what can be seen;
    no other changes a pixel. `time_secs` (0 to 10,000) is the moment that brushes which move by themselves are seen at.
    `lenient` and `max_polygons` are as in `osp.open`.

    A driver in software will do (on Debian, `mesa-vulkan-drivers`). Each call reads the file twice and opens the adapter anew.

    `AdapterError` (a `RuntimeError`): there is no graphics adapter, or it cannot do what is asked. `ValueError`: the size is
    not 1 to 16,384 pixels each way (some adapters draw less), there is no such frame, or a name is unknown. Others are those of
    `osp.open`.

    >>> osp.render(recordings / "room.ron", (320, 180)).shape
    (180, 320, 4)
    >>> inside = osp.View.look_at((0, 1.6, 0), (4, 1.4, 0))
    >>> osp.render(recordings / "room.ron", (320, 180), view=inside, occlusion="hzb").dtype
    dtype('uint8')
    """
    return _native.render_frame(
        path, list(size), frame, view, occlusion, pace, time_secs, lenient, max_polygons
    )

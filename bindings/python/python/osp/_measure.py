"""Measures spatial structures and occlusion culling on recordings."""

from __future__ import annotations

import os
from typing import Any, Dict, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native
from ._table import Table

_INDEXES = ("brute-force", "osp-paper", "osp", "octree-rebuild")
_METHODS = tuple(_native.OCCLUSION_METHODS)


def _names(names: Union[str, Sequence[str]]) -> Sequence[str]:
    return [names] if isinstance(names, str) else list(names)


class Replay(Table):
    """The measurements of `osp.replay`: a row for each frame of each index.

    | column | content |
    | --- | --- |
    | `index`, `occlusion` | names of the structure and of the method of occlusion culling |
    | `frame` | number of the frame, from 0 |
    | `inserted`, `removed`, `updated` | polygons that were added, removed and moved in this frame |
    | `polygons`, `visible`, `drawn` | polygons in the model, in the frustum, and to draw after occlusion culling |
    | `boxes_tested` | boxes that the frustum was tested against |
    | `insert_ns`, `cull_ns`, `occlusion_ns`, `frame_ns` | time to apply the changes (including a rebuild), to cull by the frustum, to cull by occlusion, and the sum of the three, nanoseconds |
    | `timed` | False if the frames before this frame were skipped (`budget_secs`), so that its times include the changes of the skipped frames |
    | `fingerprint` | a hash of the polygons in the frustum, uint64: equal for equal sets |
    """

    summary: Table
    """A row for each index (and method): `index`, `occlusion`, `frames` (measured), `insert_us`, `cull_us` (medians),
    `frame_us_p50`, `frame_us_p95`, `frame_us_p99`, `frame_us_max`, `visible`, `drawn` (means), `memory_bytes`,
    `fingerprint` (of the session, 16 hexadecimal digits, the same as in `osp replay`; empty if frames were
    skipped)."""

    agree: bool
    """Whether all structures found the same polygons in every frame."""

    def __init__(self, columns: Dict[str, Any], about: Dict[str, Any]) -> None:
        runs = columns.pop("run")
        names = {key: np.array(about[key], dtype=str) for key in ("index", "occlusion")}
        super().__init__({key: of_runs[runs] for key, of_runs in names.items()})
        self.update(columns)
        self["frame_ns"] = self["insert_ns"] + self["cull_ns"] + self["occlusion_ns"]
        self.agree = _is_one_value_a_frame(self["frame"], self["fingerprint"])
        self.summary = Table(names)
        rows = [self._summary_row(runs == run) for run in range(len(names["index"]))]
        for key in rows[0]:
            self.summary[key] = np.array([row[key] for row in rows])
        self.summary["memory_bytes"] = np.array(about["bytes"], dtype=np.uint64)
        self.summary["fingerprint"] = np.array([value or "" for value in about["fingerprint"]], dtype=str)

    def _summary_row(self, of_run: np.ndarray[Any, Any]) -> Dict[str, float]:
        timed = of_run & self["timed"]

        def percentile(column: str, percent: float) -> float:
            values = self[column][timed]
            return float(np.percentile(values, percent)) / 1000 if len(values) else float("nan")

        def mean(column: str) -> float:
            return float(self[column][of_run].mean()) if of_run.any() else float("nan")

        frame_us = {f"frame_us_{name}": percentile("frame_ns", q) for name, q in _PERCENTILES.items()}
        medians = {"insert_us": percentile("insert_ns", 50), "cull_us": percentile("cull_ns", 50)}
        return {
            "frames": int(of_run.sum()),
            **medians,
            **frame_us,
            "visible": mean("visible"),
            "drawn": mean("drawn"),
        }


_PERCENTILES = {"p50": 50, "p95": 95, "p99": 99, "max": 100}


def _is_one_value_a_frame(frames: np.ndarray[Any, Any], values: np.ndarray[Any, Any]) -> bool:
    pairs = np.unique(np.stack([frames.astype(np.uint64), values.astype(np.uint64)]), axis=1)
    return bool(pairs.shape[1] == len(np.unique(frames)))


def replay(
    path: Union[str, os.PathLike[str]],
    indexes: Union[str, Sequence[str]] = _INDEXES,
    *,
    occlusion: Union[str, Sequence[str]] = (),
    pace: str = "samples:16",
    camera: str = "auto",
    budget_secs: float = 10.0,
    lenient: bool = False,
    max_polygons: Optional[int] = None,
) -> Replay:
    """Plays a recording frame by frame through several structures, with the same polygons and the same view for each.

    `indexes` are names of `osp.INDEXES`. With `occlusion` (`none`, `auto`, `depth-last` or one of
    `osp.OCCLUSION_METHODS`; several are compared) each structure also culls hidden polygons. `pace` is `samples:N`, N
    samples of the hand in each frame, or `recorded`, by the time stamps. `camera` is `auto` (the recorded head, else the
    session's own camera, else `orbit`), `orbit`, `follow` or `inside`. An index is timed for at most `budget_secs`, on
    evenly spaced parts of the session. `lenient` and `max_polygons` are the same as in `osp.open`.

    Times depend on the machine and use one thread; fingerprints are the same everywhere. Errors are those of
    `osp.open`, and `ValueError` for an unknown name or a number out of its range.

    >>> table = osp.replay(recordings / "room.ron", ["brute-force", "osp"], pace="samples:64")
    >>> table.agree
    True
    >>> table.summary["fingerprint"][0] == table.summary["fingerprint"][1]
    True
    >>> import pandas
    >>> pandas.DataFrame(table).groupby("index")["visible"].max().tolist() == [table["visible"].max()] * 2
    True
    """
    columns, about = _native.replay_frames(
        path, _names(indexes), _names(occlusion), pace, camera, budget_secs, lenient, max_polygons
    )
    return Replay(columns, about)


class Verification(Table):
    """The results of `osp.verify`, summed over the views: a row for each method of occlusion culling and number of occluders.

    | column | content |
    | --- | --- |
    | `occlusion`, `occluders` | name of the method, largest number of occluders in a view |
    | `conservative` | whether the method guarantees never to cull a visible polygon |
    | `views` | views that were compared |
    | `false_culls` | visible polygons that were culled: 0 for a conservative method |
    | `misreported` | polygons reported twice, or that are not in view |
    | `hidden`, `hidden_culled`, `hidden_culled_percent` | number of hidden polygons in view, and number and percentage of these that were culled |
    | `drawn` | polygons to draw |
    | `select_ns`, `build_ns`, `query_ns` | time to choose occluders, to build the structure from them, and to test, nanoseconds |
    | `failed` | whether the method broke its guarantee |
    """

    seen: Dict[str, int]
    """Sums over the views that do not depend on a method: `views`, `in_view` (polygons in the frustum), `visible` and
    `hidden` (the polygons of these that can and cannot be seen), `lost` (polygons in view that frustum culling wrongly
    culled: 0)."""

    ok: bool
    """Whether every method kept its guarantee, and frustum culling culled no polygon in view."""

    def __init__(self, columns: Dict[str, Any], seen: Dict[str, int]) -> None:
        super().__init__(columns)
        self.seen = dict(seen)
        self.ok = self.seen["lost"] == 0 and not self["failed"].any()


def verify(
    path: Union[str, os.PathLike[str]],
    occlusion: Union[str, Sequence[str]] = _METHODS,
    *,
    occluders: Union[int, Sequence[int]] = 64,
    views: int = 8,
    pixels: Tuple[int, int] = (1280, 720),
    whole: bool = False,
    pace: str = "samples:16",
    camera: str = "auto",
    lenient: bool = False,
    max_polygons: Optional[int] = None,
) -> Verification:
    """Compares occlusion culling with the truly visible polygons, polygon by polygon.

    `occlusion` names methods: those of `osp.OCCLUSION_METHODS`, and `msvbsp-paper`, which is not conservative.
    `occluders` is one number or several to compare. `views` are spread over the session; with `whole` each shows the finished model. A picture of `pixels` (width, height), and rays to polygons that cover no
    pixel, determine the visible polygons. Other arguments and errors are the same as in `osp.replay`.

    >>> table = osp.verify(recordings / "room.ron", ["msvbsp", "depth"], views=1, pixels=(320, 180))
    >>> table.ok
    True
    >>> table["false_culls"].tolist()
    [0, 0]
    """
    counts = [occluders] if isinstance(occluders, int) else list(occluders)
    columns, seen = _native.verify_methods(
        path, _names(occlusion), counts, views, pixels, whole, pace, camera, lenient, max_polygons
    )
    return Verification(columns, seen)

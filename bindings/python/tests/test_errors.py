"""Every error raises one exception that names the expected form (for the culler: test_culler.py)."""

import numpy as np
import osp
import pytest
from conftest import looking, perspective

VIEW = osp.View.look_at((0, 0, 0), (0, 0, -1))
NAN, INF = float("nan"), float("inf")


def triangle(x=0.0):
    return [[[x, 0, 0], [1, 0, 0], [0, 1, 0]]]


CASES = [
    (lambda: osp.Mesh(triangle()).visible(np.eye(4)), ValueError, "perspective"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 0, 0)), ValueError, "target"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 1, 0)), ValueError, "up"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 0, 1), up=(0, 0, 0)), ValueError, "up"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 0, 1), near_m=0), ValueError, "near_m"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 0, 1), far_m=0.1), ValueError, "far_m"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 0, 1), fov_y_degrees=180), ValueError, "fov_y_degrees"),
    (lambda: osp.View.look_at((0, 0, 0), (0, 0, 1), aspect=NAN), ValueError, "aspect"),
    (lambda: osp.View.from_matrix(np.eye(4), depth="both"), ValueError, "depth"),
    (lambda: osp.View.from_matrix(np.zeros((4, 4))), ValueError, "singular"),
    (lambda: osp.View.from_matrix((perspective(60, 1, 1, 9) @ looking((9, 9, 9), (0, 0, 0))).T), ValueError, "transpose"),
    (lambda: osp.Mesh(triangle(NAN)).visible(VIEW), ValueError, "triangles, row 0"),
    (lambda: osp.Mesh(np.zeros((2, 3))).visible(VIEW), ValueError, r"\(n, 3, 3\)"),
    (lambda: osp.Mesh(np.zeros((2, 3)), [[0, 1, 2]]).visible(VIEW), ValueError, "below 2; found 2"),
    (lambda: osp.Mesh(np.zeros((2, 3)), [[0, 1, -1]]).visible(VIEW), ValueError, "found -1"),
    (lambda: osp.Mesh(np.zeros((2, 3)), [[0, 1]]).visible(VIEW), ValueError, r"\(m, 3\)"),
    (lambda: osp.Mesh(np.zeros((2, 3)), [[0.0, 1, 1]]).visible(VIEW), TypeError, "faces: expected whole"),
    (lambda: osp.Mesh(triangle()).visible(VIEW, "hzb"), ValueError, "expected one of .*msvbsp.*found \"hzb\""),
    (lambda: osp.Mesh(triangle()).visible(VIEW, "msvbsp", occluders=0), ValueError, "occluders"),
    (lambda: osp.Mesh(triangle(), opaque=[True, False]).visible(VIEW), ValueError, r"opaque: .*\(1,\)"),
    (lambda: osp.Mesh(triangle(), opaque=[1]).visible(VIEW), TypeError, "opaque: expected truth values"),
    (lambda: osp.Mesh(triangle()).visible(None), TypeError, "numbers"),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_what_is_wrong_raises_one_exception(case):
    call, exception, message = CASES[case]
    with pytest.raises(exception, match=message) as raised:
        call()
    # The type must be exact: a subclass would be another error. A panic of Rust is none of these types.
    assert raised.type is exception

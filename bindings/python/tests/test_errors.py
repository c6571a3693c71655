"""What is wrong raises one exception that says what was expected; the index is then as it was."""

import numpy as np
import osp
import pytest
from conftest import looking, perspective

BOX = [[0, 0, 0, 1, 1, 1]]
VIEW = osp.View.look_at((0, 0, 0), (0, 0, -1))
NAN, INF = float("nan"), float("inf")


def triangle(x=0.0):
    return [[[x, 0, 0], [1, 0, 0], [0, 1, 0]]]


CASES = [
    (lambda i: i.insert([[0, 0, 0, 1, 1]]), ValueError, r"boxes: expected .* \(n, 6\).*found \(1, 5\)"),
    (lambda i: i.insert([0, 0, 0, 1, 1, 1]), ValueError, r"found \(6,\)"),
    (lambda i: i.insert(np.zeros((2, 3, 4))), ValueError, r"found \(2, 3, 4\)"),
    (lambda i: i.insert([[0, 0, 0], [1]]), ValueError, "inhomogeneous"),
    (lambda i: i.insert([[0, 0, 0]], [[1, 1, 1]] * 2), ValueError, r"maxs: expected .* \(1, 3\)"),
    (lambda i: i.insert([[0, 0]], [[1, 1]]), ValueError, "mins: expected"),
    (lambda i: i.insert([["a"] * 6]), TypeError, "boxes: expected numbers"),
    (lambda i: i.insert(np.zeros((1, 6), complex)), TypeError, "complex128"),
    (lambda i: i.insert(np.zeros((1, 6), bool)), TypeError, "bool"),
    (lambda i: i.insert(np.zeros((1, 6), np.longdouble)), TypeError, "float128|longdouble"),
    (lambda i: i.insert(None), TypeError, "object"),
    (lambda i: i.insert(BOX + [[0, 0, NAN, 1, 1, 1]]), ValueError, "boxes, row 1: .*NaN"),
    (lambda i: i.insert([[0, 0, 0, 1, 1, INF]]), ValueError, "row 0: expected finite"),
    (lambda i: i.insert([[0, 0, 0, 1, 1, 1e39]]), ValueError, "finite numbers .of float32"),
    (lambda i: i.insert([[0, 2, 0, 1, 1, 1]]), ValueError, "min <= max"),
    (lambda i: i.insert(BOX, ids=[1, 2]), ValueError, "ids: expected 1, as many as boxes; found 2"),
    (lambda i: i.insert(BOX * 2, ids=[5, 5]), ValueError, "id 5: it is given twice"),
    (lambda i: i.insert(BOX * 2, ids=[6, 0]), ValueError, "id 0: it is in the index already"),
    (lambda i: i.insert(BOX, ids=[-1]), ValueError, "found -1"),
    (lambda i: i.insert(BOX, ids=[2**27]), ValueError, "found 134217728"),
    (lambda i: i.insert(BOX, ids=np.array([2**64 - 1], np.uint64)), ValueError, "18446744073709551615"),
    (lambda i: i.insert(BOX, ids=[1.0]), TypeError, "ids: expected whole numbers; found the type float64"),
    (lambda i: i.insert(BOX, ids=[[1]]), ValueError, r"ids: .*found \(1, 1\)"),
    (lambda i: i.update([0, 7], BOX * 2), KeyError, "id 7: it is not in the index"),
    (lambda i: i.update([0, 0], BOX * 2), ValueError, "twice"),
    (lambda i: i.update([0], BOX * 2), ValueError, "as many"),
    (lambda i: i.update([0], [[NAN] * 6]), ValueError, "finite"),
    (lambda i: i.remove([0, 7]), KeyError, "id 7"),
    (lambda i: i.remove([0, 0]), ValueError, "twice"),
    (lambda i: i.remove("a"), TypeError, "whole numbers"),
    (lambda i: i.boxes([7]), KeyError, "id 7"),
    (lambda i: i.frustum(np.eye(3)), ValueError, r"\(4, 4\)"),
    (lambda i: i.frustum(np.diag([1, 1, 0, 1])), ValueError, "singular"),
    (lambda i: i.frustum(np.eye(4), "both"), ValueError, "depth"),
    (lambda i: osp.visible(np.eye(4), triangle()), ValueError, "perspective"),
    (lambda i: i.frustum(np.full((4, 4), NAN)), ValueError, "finite"),
    (lambda i: i.frustum(VIEW, "zero-to-one"), ValueError, "a View has its own"),
    (lambda i: i.frustum("x"), TypeError, "numbers"),
    (lambda i: i.box((0, 0, 0), (1, 1)), ValueError, r"max: .*\(3,\)"),
    (lambda i: i.box((0, 0, 2), (1, 1, 1)), ValueError, "min <= max"),
    (lambda i: i.sphere((0, 0, 0), -1), ValueError, "radius_m"),
    (lambda i: i.sphere((0, 0, 0), NAN), ValueError, "radius_m"),
    (lambda i: i.sphere((0, 0, INF), 1), ValueError, "center: expected finite"),
    (lambda i: i.ray((0, 0, 0), (0, 0, 0)), ValueError, "direction"),
    (lambda i: i.ray((0, 0, 0), (0, NAN, 0)), ValueError, "direction"),
    (lambda i: i.ray((0, 0, 0), (0, 1, 0), -1), ValueError, "t_max"),
    (lambda i: i.ray((0, 0, 0), (0, 1, 0), NAN), ValueError, "t_max"),
    (lambda i: i.rays(np.zeros((2, 3)), np.ones((3, 3))), ValueError, "directions: expected 2"),
    (lambda i: i.rays(np.zeros((2, 3)), np.zeros((2, 3))), ValueError, "directions, row 0"),
    (lambda i: i.nearest((0, 0, 0), -1), OverflowError, "negative"),
    (lambda i: i.nearest((0, 0)), ValueError, "point"),
    (lambda i: osp.Index(root_size_m=0), ValueError, "root_size_m"),
    (lambda i: osp.Index(root_size_m=NAN), ValueError, "root_size_m"),
    (lambda i: osp.Index(capacity=2**28), ValueError, "capacity"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 0, 0)), ValueError, "target"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 1, 0)), ValueError, "up"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 0, 1), up=(0, 0, 0)), ValueError, "up"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 0, 1), near_m=0), ValueError, "near_m"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 0, 1), far_m=0.1), ValueError, "far_m"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 0, 1), fov_y_degrees=180), ValueError, "fov_y_degrees"),
    (lambda i: osp.View.look_at((0, 0, 0), (0, 0, 1), aspect=NAN), ValueError, "aspect"),
    (lambda i: osp.View.from_matrix(np.eye(4), depth="both"), ValueError, "depth"),
    (lambda i: osp.View.from_matrix(np.zeros((4, 4))), ValueError, "singular"),
    (lambda i: osp.View.from_matrix((perspective(60, 1, 1, 9) @ looking((9, 9, 9), (0, 0, 0))).T), ValueError, "transpose"),
    (lambda i: osp.visible(VIEW, triangle(NAN)), ValueError, "triangles, row 0"),
    (lambda i: osp.visible(VIEW, np.zeros((2, 3))), ValueError, r"\(n, 3, 3\)"),
    (lambda i: osp.visible(VIEW, np.zeros((2, 3)), faces=[[0, 1, 2]]), ValueError, "below 2; found 2"),
    (lambda i: osp.visible(VIEW, np.zeros((2, 3)), faces=[[0, 1, -1]]), ValueError, "found -1"),
    (lambda i: osp.visible(VIEW, np.zeros((2, 3)), faces=[[0, 1]]), ValueError, r"\(m, 3\)"),
    (lambda i: osp.visible(VIEW, np.zeros((2, 3)), faces=[[0.0, 1, 1]]), TypeError, "faces: expected whole"),
    (lambda i: osp.visible(VIEW, triangle(), "hzb"), ValueError, "expected one of .*msvbsp.*found \"hzb\""),
    (lambda i: osp.visible(VIEW, triangle(), "msvbsp", occluders=0), ValueError, "occluders"),
    (lambda i: osp.visible(VIEW, triangle(), opaque=[True, False]), ValueError, r"opaque: .*\(1,\)"),
    (lambda i: osp.visible(VIEW, triangle(), opaque=[1]), TypeError, "opaque: expected truth values"),
    (lambda i: osp.visible(None, triangle()), TypeError, "numbers"),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_what_is_wrong_raises_one_exception(case):
    call, exception, message = CASES[case]
    index = osp.Index()
    index.insert(BOX)
    with pytest.raises(exception, match=message) as raised:
        call(index)
    # A subclass would be another one: a panic of Rust, for one, is none of these.
    assert raised.type is exception
    assert index.ids.tolist() == [0] and index.boxes([0]).tolist() == BOX

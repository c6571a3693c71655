"""Tests views from an eye and from a matrix."""

import math

import numpy as np
import osp
import pytest
from conftest import is_inside, looking, perspective


def test_look_at_is_the_textbook_s_matrix(rng):
    for _ in range(50):
        eye, target, up = rng.uniform(-5, 5, (3, 3))
        fov, aspect, near, far = rng.uniform(20, 100), rng.uniform(0.5, 3), 0.2, 80
        view = osp.View.look_at(eye, target, up, fov, aspect, near, far)
        # osp's own matrix has reversed depth: near 1, far 0.
        reversed_depth = np.diag([1.0, 1, -1, 1])
        reversed_depth[2, 3] = 1
        matrix = perspective(fov, aspect, near, far) @ looking(eye, target, up)
        textbook = np.array(matrix)
        textbook[2] = matrix[3] - matrix[2]
        assert np.allclose(view.clip_from_world, textbook, atol=2e-5 * np.abs(textbook).max())
        assert np.allclose(view.eye, eye.astype(np.float32))
        forward = (target - eye) / np.linalg.norm(target - eye)
        assert np.allclose(view.forward, forward, atol=1e-6)


def test_from_matrix_shows_no_less(rng):
    points = rng.uniform(-10, 10, (5000, 3))
    for _ in range(20):
        eye, target = rng.uniform(-8, 8, (2, 3))
        matrix = perspective(70, 1.2, 0.1, 12) @ looking(eye, target)
        view = osp.View.from_matrix(matrix)
        planes = view.frustum_planes.astype(float)
        inside = (points @ planes[:, :3].T + planes[:, 3] >= 0).all(axis=1)
        shown = is_inside(matrix, points)
        assert inside[shown].all() and (inside & ~shown).sum() <= 2
        assert np.allclose(view.eye, eye, atol=1e-4)
        assert view.near_m == pytest.approx(0.1, rel=1e-3) and view.far_m == pytest.approx(12, rel=1e-3)


def test_a_view_without_end():
    view = osp.View.look_at((0, 0, 0), (0, 0, -1), aspect=1, fov_y_degrees=90, near_m=0.5, far_m=math.inf)
    assert view.far_m == math.inf
    x, y, z, w = view.clip_from_world @ [0, 0, -5, 1]
    assert (x, y) == (0, 0) and z / w == pytest.approx(0.1)
    culler = osp.Culler()
    culler.set([0, 1], [[-1, -1, -1e9, 1, 1, -0.9e9], [-1, -1, 1, 1, 1, 2]])
    assert culler.cull(view)[0].tolist() == [0]


def test_equal_views_are_equal():
    view, same, other = (osp.View.look_at((0, 0, z), (0, 0, -1)) for z in (0, 0, 1))
    assert view == same and view != other and hash(view) == hash(same) and len({view, same, other}) == 2
    assert repr(view) == "View(eye=(0, 0, 0), near_m=0.1, far_m=1000)"
    with pytest.raises(AttributeError):
        view.near_m = 1
    with pytest.raises(TypeError):
        osp.View()

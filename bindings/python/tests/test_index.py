"""The index against brute force in numpy."""

import math

import numpy as np
import osp
import pytest
from conftest import is_inside, looking, perspective, random_boxes


def in_frustum(planes, boxes):
    """The test of the documentation, in float32 and in its order."""
    seen = np.ones(len(boxes), dtype=bool)
    for nx, ny, nz, d in planes:
        x, y, z = (np.where(n >= 0, boxes[:, 3 + i], boxes[:, i]) for i, n in enumerate((nx, ny, nz)))
        seen &= ((nx * x + ny * y) + nz * z) + d >= 0
    return seen


def distance_squared(boxes, point):
    beside = np.clip(point, boxes[:, :3], boxes[:, 3:]) - point
    return (beside**2).sum(axis=1)


def enter(boxes, origin, direction):
    """Where a ray enters each box; infinite where it misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (boxes[:, :3] - origin) / direction, (boxes[:, 3:] - origin) / direction
    near, far = np.fmin(a, b).max(axis=1), np.fmax(a, b).min(axis=1)
    return np.where((near <= far) & (far >= 0), np.maximum(near, 0), np.inf)


def random_view(rng):
    eye, target = rng.uniform(-8, 8, (2, 3))
    return osp.View.look_at(eye, target, fov_y_degrees=rng.uniform(10, 120), far_m=rng.uniform(2, 40))


def test_queries_answer_as_brute_force(rng):
    boxes = random_boxes(rng, 3000)
    index = osp.Index()
    ids = index.insert(boxes)
    assert ids.dtype == np.uint32 and (ids == np.arange(3000)).all() and len(index) == 3000
    found = 0
    for _ in range(100):
        view = random_view(rng)
        seen = index.frustum(view)
        assert seen.dtype == np.uint32
        assert (seen == np.flatnonzero(in_frustum(view.frustum_planes, boxes))).all()
        found += len(seen)

        low, size = rng.uniform(-10, 10, 3), rng.uniform(0, 5, 3)
        low, high = low.astype(np.float32), (low + size).astype(np.float32)
        touching = (boxes[:, :3] <= high).all(axis=1) & (low <= boxes[:, 3:]).all(axis=1)
        assert (index.box(low, high) == np.flatnonzero(touching)).all()

        center, radius = rng.uniform(-10, 10, 3).astype(np.float32), np.float32(rng.uniform(0, 4))
        squared = distance_squared(boxes, center)
        answer = np.zeros(3000, dtype=bool)
        answer[index.sphere(center, float(radius))] = True
        is_clear = abs(squared - radius**2) > 1e-4
        assert (answer == (squared <= radius**2))[is_clear].all()

        nearest, distances = index.nearest(center, 7)
        assert np.allclose(distances, np.sort(np.sqrt(squared))[:7], atol=1e-5)
        assert np.allclose(distances, np.sqrt(squared[nearest]), atol=1e-5)

        direction = rng.normal(size=3).astype(np.float32)
        entered = enter(boxes.astype(float), center.astype(float), direction.astype(float))
        hit = index.ray(center, direction)
        if hit is None:
            assert np.isinf(entered).all()
        else:
            assert math.isclose(hit[1], entered.min(), rel_tol=1e-4, abs_tol=1e-4)
            assert math.isclose(hit[1], entered[hit[0]], rel_tol=1e-4, abs_tol=1e-4)
    assert found > 1000


@pytest.mark.parametrize("depth", ["zero-to-one", "minus-one-to-one"])
def test_a_matrix_as_mathematicians_write_it_shows_what_it_shows(rng, depth):
    boxes = random_boxes(rng, 2000, largest=0.01)
    index = osp.Index()
    index.insert(boxes[:, :3], boxes[:, 3:])
    most = 0
    for _ in range(20):
        eye, target = rng.uniform(-8, 8, (2, 3))
        matrix = perspective(50, 1.5, 0.1, 30, depth) @ looking(eye, target)
        reported = index.frustum(matrix, depth)
        centers = (boxes[:, :3] + boxes[:, 3:]) / 2
        shown = np.flatnonzero(is_inside(matrix, centers, depth))
        assert np.isin(shown, reported).all()
        # Points so small that little more is reported.
        assert len(reported) <= len(shown) * 1.1 + 5
        view = osp.View.from_matrix(matrix, depth=depth)
        assert (index.frustum(view) == reported).all()
        most = max(most, len(shown))
    assert most > 50


def test_boxes_come_move_and_go(rng):
    index, known = osp.Index(root_center=(0, 0, 0), root_size_m=20, capacity=500), {}
    for step in range(300):
        ids = rng.choice(2000, size=rng.integers(1, 30), replace=False)
        is_new = np.array([i not in known for i in ids])
        boxes = random_boxes(rng, len(ids), spread=15)
        index.insert(boxes[is_new], ids=ids[is_new])
        index.update(ids[~is_new], boxes[~is_new])
        known.update(zip(ids.tolist(), boxes))
        for i in ids[: len(ids) // 3].tolist():
            del known[i]
        index.remove(ids[: len(ids) // 3])
        if step % 10 == 0:
            in_use = np.array(sorted(known), dtype=np.uint32)
            rows = np.array([known[i] for i in in_use.tolist()])
            assert (index.ids == in_use).all() and len(index) == len(known)
            assert (index.boxes(in_use) == rows).all()
            view = random_view(rng)
            assert (index.frustum(view) == in_use[in_frustum(view.frustum_planes, rows)]).all()
    assert len(known) > 500 and next(iter(known)) in index and 5000 not in index
    bytes_before = index.memory_bytes
    index.clear()
    assert len(index) == 0 and len(index.ids) == 0 and 0 < index.memory_bytes <= bytes_before
    assert index.insert([[0, 0, 0, 1, 1, 1]]).tolist() == [0]


def test_float64_is_rounded_outwards():
    low, high = 0.1, 0.7  # float32 has neither
    index = osp.Index()
    index.insert(np.array([[low] * 3 + [high] * 3]))
    ((x0, _, _, x1, _, _),) = index.boxes([0])
    assert float(x0) <= low and float(x1) >= high
    assert np.float32(x0) >= np.nextafter(np.float32(low), np.float32(0))
    # A box that ends where this one begins touches it.
    assert index.box((0, 0, 0), (low, low, low)).tolist() == [0]
    assert index.box((high, high, high), (1, 1, 1)).tolist() == [0]


def test_many_rays_are_as_each_alone(rng):
    index = osp.Index()
    index.insert(random_boxes(rng, 500))
    origins, directions = rng.uniform(-10, 10, (100, 3)), rng.normal(size=(100, 3))
    ids, ts = index.rays(origins, directions, t_max=8)
    assert ids.dtype == np.int64 and ts.dtype == np.float32
    for origin, direction, i, t in zip(origins, directions, ids, ts):
        alone = index.ray(origin, direction, t_max=8)
        assert (alone or (-1, math.inf)) == (i, t)
    assert 0 < (ids >= 0).sum() < 100


def test_other_arrays_are_taken(rng):
    boxes = random_boxes(rng, 100)
    expected = None
    for same in [
        boxes,
        np.asfortranarray(boxes),
        np.repeat(boxes, 2, axis=0)[::2],
        boxes.astype(np.float64),
        boxes.astype(">f4"),
        boxes.tolist(),
    ]:
        index = osp.Index()
        assert len(index.insert(same, ids=np.arange(100, dtype=np.uint8))) == 100
        seen = index.boxes(range(100))
        expected = seen if expected is None else expected
        assert (seen == expected).all()
    index = osp.Index()
    assert index.insert(np.array([[0, 0, 0, 1, 2, 3]])).tolist() == [0]
    assert len(index.insert(np.empty((0, 6)))) == 0
    index.remove([])
    index.remove(np.uint32(0))
    assert len(index) == 0 and repr(index) == "<osp.Index of 0 boxes>"


def test_an_empty_index_answers():
    index = osp.Index()
    view = osp.View.look_at((0, 0, 0), (0, 0, -1))
    assert len(index.frustum(view)) == len(index.sphere((0, 0, 0), 1)) == 0
    assert index.ray((0, 0, 0), (0, 0, 1)) is None
    assert [len(column) for column in index.nearest((0, 0, 0), 3)] == [0, 0]
    ids, ts = index.rays(np.empty((0, 3)), np.empty((0, 3)))
    assert len(ids) == len(ts) == 0

"""Compares the culler with brute force in numpy, and checks the errors for wrong arguments."""

import threading

import numpy as np
import osp
import pytest
from conftest import is_inside, looking, perspective, random_boxes

NAN, INF = float("nan"), float("inf")
BOX = [0, 0, -6, 1, 1, -5]
WALL = [[-9, -9, -20], [9, -9, -20], [9, 9, -20], [-9, 9, -20]]
AHEAD = osp.View.look_at((0, 0, 0), (0, 0, -1))


def sorted_keys(keys):
    assert keys.dtype == np.uint64
    return np.sort(keys)


def test_batches_come_move_and_go_and_many_cameras_see_them(rng):
    culler, known = osp.Culler(), {}
    all_keys = rng.integers(0, 2**64, 3000, dtype=np.uint64, endpoint=False)
    most = 0
    for step in range(60):
        keys = rng.choice(all_keys, size=rng.integers(1, 200), replace=False)
        boxes = random_boxes(rng, len(keys), spread=12, largest=0.01)
        culler.set(keys, boxes[:, :3], boxes[:, 3:]) if step % 2 else culler.set(keys, boxes)
        known.update(zip(keys.tolist(), boxes))
        gone = keys[: len(keys) // 4]
        culler.remove(gone)
        for key in gone.tolist():
            del known[key]
        assert len(culler) == len(known)
        cameras, expected = [], []
        for _ in range(step % 4):
            eye, target = rng.uniform(-8, 8, (2, 3))
            depth = "minus-one-to-one" if step % 3 else "zero-to-one"
            matrix = perspective(60, 1.5, 0.1, 40, depth) @ looking(eye, target)
            rows = np.array(list(known.values()))
            is_shown = is_inside(matrix, (rows[:, :3] + rows[:, 3:]) / 2, depth)
            cameras.append(osp.Camera(matrix, depth))
            expected.append(np.array(list(known), dtype=np.uint64)[is_shown])
        seen = culler.cull(*cameras)
        assert len(seen) == len(cameras)
        for found, shown in zip(seen, expected):
            assert np.isin(shown, found).all() and len(np.unique(found)) == len(found)
            # The boxes are so small that few invisible ones are reported.
            assert len(found) <= len(shown) * 1.1 + 5
            most = max(most, len(shown))
    assert most > 100
    key = next(iter(known))
    assert key in culler and "x" not in culler and (culler.bounds(key).ravel() == known[key]).all()
    culler.clear()
    assert len(culler) == 0 and repr(culler) == "<osp.Culler of 0 objects>"


def test_a_mesh_a_box_and_a_quad_hide_and_layers_part(rng):
    behind = random_boxes(rng, 300, spread=3)
    behind[:, [2, 5]] -= 40
    keys = np.arange(300, dtype=np.uint64)
    occluders = [(WALL, None), ([[-9, -9, -22], [9, 9, -20]], None), (WALL, [[0, 1, 2], [0, 2, 3]])]
    eyes = [osp.View.look_at((x, 0, 0), (x, 0, -1)) for x in (-0.03, 0.03)]
    for corners, faces in occluders:
        culler = osp.Culler()
        culler.set(keys, behind)
        culler.set_occluder(1000, corners, faces)
        cameras = [osp.Camera(eye, hide_by_occluders=True) for eye in eyes]
        left, right, everything = culler.cull(*cameras, AHEAD)
        assert len(left) == len(right) == 0 and len(everything) == 300
        others = [[-1, -1, -9, 1, 1, -8], [-1, -1, 4, 1, 1, 5], [0, 0, NAN, 1, 1, 1]]
        assert culler.are_hidden(cameras[0], behind).all() and not culler.are_hidden(AHEAD, behind).any()
        assert culler.are_hidden(cameras[0], others).tolist() == [False, True, False]
        culler.set_layers(keys[:5], 2)
        culler.set_layers([5, 6], [4, 2])
        (second,) = culler.cull(osp.Camera(AHEAD, layers=2))
        assert sorted_keys(second).tolist() == [0, 1, 2, 3, 4, 6]
        culler.remove_occluder(1000)
        assert len(culler.cull(cameras[0])[0]) == 300


def test_a_ray_lists_candidates_and_picks_by_a_callback():
    culler = osp.Culler()
    culler.set([10, 20, 30], [[-1, -1, -3, 1, 1, -2], [-1, -1, -9, 1, 1, -5], [-1, -1, -8, 1, 1, -7]])
    culler.commit()
    origin, direction = osp.Camera(AHEAD).ray(0, 0)
    assert np.allclose(origin, [0, 0, -0.1]) and np.allclose(direction, [0, 0, -1])
    keys, ts = culler.on_ray((0, 0, 0), (0, 0, -1))
    assert keys.tolist() == [10, 20, 30] and ts.tolist() == [2, 5, 7]
    assert culler.on_ray((0, 0, 0), (0, 0, -1), t_max=5)[0].tolist() == [10, 20]
    assert culler.pick((0, 0, 0), (0, 0, -1)) == (10, 2)
    asked = []

    def hit(key):
        asked.append(key)
        return {10: None, 20: 6.5, 30: 7.5}[key]

    assert culler.pick((0, 0, 0), (0, 0, -1), hit) == (20, 6.5)
    assert asked == [10, 20], "30 begins behind the hit"
    assert culler.pick((0, 0, 0), (0, 0, -1), {10: 8.0, 20: 7.75, 30: 7.25}.get) == (30, 7.25)
    assert culler.pick((0, 0, 0), (0, 0, -1), hit, t_max=6) is None
    with pytest.raises(ZeroDivisionError):
        culler.pick((0, 0, 0), (0, 0, -1), lambda key: 1 / 0)


def test_queries_answer_as_brute_force(rng):
    boxes = random_boxes(rng, 3000)
    culler = osp.Culler()
    culler.set(np.arange(3000), boxes)
    culler.commit()
    for _ in range(60):
        low, size = rng.uniform(-10, 10, 3), rng.uniform(0, 5, 3)
        low, high = low.astype(np.float32), (low + size).astype(np.float32)
        touching = (boxes[:, :3] <= high).all(axis=1) & (low <= boxes[:, 3:]).all(axis=1)
        assert (sorted_keys(culler.in_box(low, high)) == np.flatnonzero(touching)).all()

        center, radius = rng.uniform(-10, 10, 3).astype(np.float32), np.float32(rng.uniform(0, 4))
        squared = ((np.clip(center, boxes[:, :3], boxes[:, 3:]) - center) ** 2).sum(axis=1)
        answer = np.zeros(3000, dtype=bool)
        answer[culler.in_sphere(center, float(radius))] = True
        is_clear = abs(squared - radius**2) > 1e-4
        assert (answer == (squared <= radius**2))[is_clear].all()

        nearest, distances = culler.nearest(center, 7)
        assert nearest.dtype == np.uint64 and distances.dtype == np.float32
        assert np.allclose(distances, np.sort(np.sqrt(squared))[:7], atol=1e-5)
        assert np.allclose(distances, np.sqrt(squared[nearest]), atol=1e-5)

        direction = rng.normal(size=3).astype(np.float32)
        entered = enter(boxes.astype(float), center.astype(float), direction.astype(float))
        hit = culler.pick(center, direction)
        if hit is None:
            assert np.isinf(entered).all()
        else:
            assert np.isclose(hit[1], entered.min(), rtol=1e-4, atol=1e-4)
            assert np.isclose(hit[1], entered[hit[0]], rtol=1e-4, atol=1e-4)
    assert [len(column) for column in culler.nearest((0, 0, 0), 4000)] == [3000, 3000]
    assert [len(column) for column in osp.Culler().nearest((0, 0, 0), 3)] == [0, 0]


def enter(boxes, origin, direction):
    """Returns the parameter at which a ray enters each box; infinite for boxes that the ray misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (boxes[:, :3] - origin) / direction, (boxes[:, 3:] - origin) / direction
    near, far = np.fmin(a, b).max(axis=1), np.fmax(a, b).min(axis=1)
    return np.where((near <= far) & (far >= 0), np.maximum(near, 0), np.inf)


def test_many_rays_are_as_each_alone(rng):
    culler = osp.Culler()
    culler.set(np.arange(500), random_boxes(rng, 500))
    culler.commit()
    origins, directions = rng.uniform(-10, 10, (100, 3)), rng.normal(size=(100, 3))
    keys, ts = culler.rays(origins, directions, t_max=8)
    assert keys.dtype == np.uint64 and ts.dtype == np.float32
    for origin, direction, key, t in zip(origins, directions, keys, ts):
        alone = culler.pick(origin, direction, t_max=8)
        assert (alone or (0, INF)) == (key, t)
    assert 0 < np.isfinite(ts).sum() < 100
    assert [len(column) for column in culler.rays(np.empty((0, 3)), np.empty((0, 3)))] == [0, 0]


def test_other_arrays_are_taken(rng):
    boxes = random_boxes(rng, 100)
    for same in [
        boxes,
        np.asfortranarray(boxes),
        np.repeat(boxes, 2, axis=0)[::2],
        boxes.astype(np.float64),
        boxes.astype(">f4"),
        boxes.tolist(),
    ]:
        culler = osp.Culler()
        culler.set(np.arange(100, dtype=np.uint8), same)
        assert all((culler.bounds(i).ravel() == boxes[i]).all() for i in range(100))
    culler.set([], np.empty((0, 6)))
    culler.set(range(2), np.array([[0, 0, 0, 1, 2, 3]] * 2))
    culler.remove([])
    culler.remove(np.uint32(0))
    assert len(culler) == 99


def test_refused_boxes_are_named_and_the_others_are_in():
    culler = osp.Culler()
    culler.set([1, 2, 3, 4], [BOX, [0, 0, NAN, 1, 1, 1], [0, 2, 0, 1, 1, 1], [0, 0, 0, 1, 1, INF]])
    (seen,) = culler.cull(AHEAD)
    assert seen.tolist() == [1] and len(culler) == 1
    assert [key for key, _ in culler.refused] == [2, 3, 4]
    assert all("expected finite corners with min <= max" in why for _, why in culler.refused)
    culler.cull()
    assert culler.refused == []


def test_float64_is_rounded_outwards_and_far_eyes_are_exact():
    culler = osp.Culler()
    culler.set(5, [0.1] * 3 + [0.7] * 3)  # float32 can store neither number exactly
    low, high = culler.bounds(5)
    assert (low.astype(float) <= 0.1).all() and (high.astype(float) >= 0.7).all()
    # A million kilometres away, an eye in float32 would be off by metres.
    far = 1e9
    matrix = perspective(60, 1, 0.1, 100) @ looking((far + 0.5, 0, 3), (far + 0.5, 0, 0))
    culler.set(6, [far - 64, -1, -1, far + 64, 1, 1])
    assert culler.cull(matrix)[0].tolist() == [6]


def test_threads_ask_while_one_changes(rng):
    culler = osp.Culler()
    kept = np.arange(500, dtype=np.uint64)
    culler.set(kept, random_boxes(rng, 500))
    culler.commit()
    stop, errors = threading.Event(), []

    def query():
        try:
            while not stop.is_set():
                assert np.isin(kept, culler.in_box((-20,) * 3, (20,) * 3)).all()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=query) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(200):
        more = np.arange(1000, 1050)
        culler.set(more, random_boxes(rng, 50))
        culler.cull(AHEAD)
        culler.remove(more)
    stop.set()
    for thread in threads:
        thread.join()
    assert not errors and len(culler) == 500


CASES = [
    (lambda c: c.set([1, 2], [BOX]), ValueError, "boxes: expected 2, as many as keys; found 1"),
    (lambda c: c.set([-1], [BOX]), ValueError, "keys: expected numbers from 0 to 18446744073709551615; found -1"),
    (lambda c: c.set([1.0], [BOX]), TypeError, "keys: expected whole numbers"),
    (lambda c: c.set([[1]], [BOX]), ValueError, r"keys: .*found \(1, 1\)"),
    (lambda c: c.set([1], [BOX[:5]]), ValueError, r"boxes: .*found \(1, 5\)"),
    (lambda c: c.set([1], [["a"] * 6]), TypeError, "boxes: expected numbers"),
    (lambda c: c.set([1], [BOX[:3]], [BOX[3:]] * 2), ValueError, "maxs"),
    (lambda c: c.remove("a"), TypeError, "whole numbers"),
    (lambda c: c.set_layers([1], 2**32), ValueError, "layers: .*found 4294967296"),
    (lambda c: c.set_layers([1, 2, 3], [1, 2]), ValueError, "layers: expected 3"),
    (lambda c: c.set_occluder(1, WALL[:3]), ValueError, "corners: expected four"),
    (lambda c: c.set_occluder(1, [[0, 0, 0]] * 4), ValueError, "flat, convex quad"),
    (lambda c: c.set_occluder(1, [[0, 0, NAN]] * 4), ValueError, "corners, row 0"),
    (lambda c: c.set_occluder(1, [[0, 0, 0]] * 2), ValueError, "surface with an area"),
    (lambda c: c.set_occluder(1, WALL, [[0, 1, 4]]), ValueError, "below 4; found 4"),
    (lambda c: c.set_occluder(-1, WALL), OverflowError, "negative"),
    (lambda c: c.cull(np.zeros((4, 4))), ValueError, "inverse"),
    (lambda c: c.cull(np.full((4, 4), NAN)), ValueError, "found NaN in column 0, row 0"),
    (lambda c: c.cull(np.eye(3)), ValueError, r"\(4, 4\)"),
    (lambda c: c.cull(None), TypeError, "numbers"),
    (lambda c: osp.Camera(np.eye(4), "both"), ValueError, "depth: expected zero-to-one, one-to-zero or"),
    (lambda c: osp.Camera(AHEAD, "zero-to-one"), ValueError, "a View has its own"),
    (lambda c: c.bounds(7), KeyError, "key 7"),
    (lambda c: c.in_box((0, 0, 2), (1, 1, 1)), ValueError, "min <= max"),
    (lambda c: c.in_sphere((0, 0, 0), -1), ValueError, "radius_m"),
    (lambda c: c.on_ray((0, 0, 0), (0, 0, 0)), ValueError, "direction"),
    (lambda c: c.pick((0, 0, 0), (0, 0, 1), t_max=NAN), ValueError, "t_max"),
    (lambda c: c.rays(np.zeros((2, 3)), np.ones((3, 3))), ValueError, "directions: expected 2"),
    (lambda c: c.rays(np.zeros((2, 3)), np.zeros((2, 3))), ValueError, "directions, row 0"),
    (lambda c: c.nearest((0, 0, 0), -1), OverflowError, "negative"),
    (lambda c: c.nearest((0, 0)), ValueError, "point"),
    (lambda c: c.set([1], [[0, 0, 0], [1]]), ValueError, "inhomogeneous"),
    (lambda c: c.set([1], np.zeros((1, 6), complex)), TypeError, "complex128"),
    (lambda c: c.set([1], np.zeros((1, 6), np.longdouble)), TypeError, "float128|longdouble"),
    (lambda c: c.in_box((0, 0, 0), (1, 1)), ValueError, r"max: .*\(3,\)"),
    (lambda c: c.in_sphere((0, 0, INF), 1), ValueError, "center: expected finite"),
    (lambda c: c.pick((0, 0, 5), (0, 0, -1), lambda key: "far"), TypeError, "str"),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_what_is_wrong_raises_one_exception(case):
    call, exception, message = CASES[case]
    culler = osp.Culler()
    culler.set(3, [-1, -1, -6, 1, 1, -5])
    culler.commit()
    with pytest.raises(exception, match=message) as raised:
        call(culler)
    # The type must be exact: a subclass would be another error. A panic of Rust is none of these types.
    assert raised.type is exception
    assert culler.cull(AHEAD)[0].tolist() == [3] and len(culler) == 1

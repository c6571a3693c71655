"""The cases that every binding of osp passes: bindings/conformance.txt, which explains its lines."""

import math
from pathlib import Path

import numpy as np
import osp

FILE = Path(__file__).resolve().parents[2] / "conformance.txt"


def with_opengl_depth(matrix):
    """Returns the matrix of the same view with depth from -1 to 1."""
    matrix = matrix.copy()
    matrix[2] = 2 * matrix[2] - matrix[3]
    return matrix


def is_near(hit, expected):
    return hit[0] == int(expected[0]) and math.isclose(hit[1], float(expected[1]), rel_tol=1e-4)


class OnCuller:
    """The culler under test. Its keys are 2^64 - 1 minus the ids of the file, so they need all 64 bits."""

    def __init__(self):
        self.culler = osp.Culler()

    def box(self, id, box):
        self.culler.set(2**64 - 1 - id, box)
        assert (self.culler.bounds(2**64 - 1 - id).ravel() == box).all()

    def remove(self, id):
        self.culler.remove(2**64 - 1 - id)

    def quad(self, id, corners):
        self.culler.set_occluder(2**64 - 1 - id, corners)

    def ids(self, keys):
        assert keys.dtype == np.uint64
        return sorted(2**64 - 1 - key for key in keys.tolist())

    def check_cameras(self, matrix, expected, **options):
        cameras = [
            osp.Camera(matrix, **options),
            osp.Camera(matrix, "one-to-zero", **options),
            osp.Camera(with_opengl_depth(matrix), "minus-one-to-one", **options),
        ]
        for keys in self.culler.cull(*cameras):
            assert self.ids(keys) == expected

    def check_visible(self, matrix, expected):
        self.check_cameras(matrix, expected)
        assert self.ids(*self.culler.cull(matrix)) == expected

    def check_unhidden(self, matrix, expected):
        self.check_cameras(matrix, expected, hide_by_occluders=True)

    def in_box(self, min, max):
        self.culler.commit()
        return self.ids(self.culler.in_box(min, max))

    def in_sphere(self, center, radius):
        self.culler.commit()
        return self.ids(self.culler.in_sphere(center, radius))

    def check_ray(self, origin, direction, t_max, expected):
        self.culler.commit()
        picked = self.culler.pick(origin, direction, t_max=t_max)
        (many_key,), (many_t,) = self.culler.rays([origin], [direction], t_max)
        keys, ts = self.culler.on_ray(origin, direction, t_max)
        assert (np.diff(ts) >= 0).all()
        if expected == ["none"]:
            assert picked is None and len(keys) == 0 and many_t == math.inf
        else:
            assert picked == (keys[0], ts[0]) == (many_key, many_t) and is_near((2**64 - 1 - picked[0], picked[1]), expected)


def test_conformance():
    tested = asked = case = None
    checked = {"visible": 0, "found": 0, "hit": 0, "unhidden": 0}
    for number, line in enumerate(FILE.read_text().splitlines(), 1):
        step, *words = line.split() or ["#"]
        try:
            if step.startswith("#"):
                continue
            if step == "case":
                case, tested = " ".join(words), OnCuller()
            elif step == "box":
                tested.box(int(words[0]), np.array(words[1:], dtype=np.float32))
            elif step == "remove":
                tested.remove(int(words[0]))
            elif step == "quad":
                tested.quad(int(words[0]), np.array(words[1:], dtype=np.float32).reshape(4, 3))
            elif step in ("view", "boxquery", "sphere", "ray"):
                asked = step, np.array(words, dtype=np.float32)
            elif step in checked:
                checked[step] += 1
                question, numbers = asked
                if step == "hit":
                    tested.check_ray(numbers[:3], numbers[3:6], numbers[6], words)
                    continue
                expected = [int(word) for word in words]
                if question == "view":
                    # The file has the matrix in column-major order.
                    check = tested.check_visible if step == "visible" else tested.check_unhidden
                    check(numbers.reshape(4, 4).T, expected)
                elif question == "boxquery":
                    assert tested.in_box(numbers[:3], numbers[3:]) == expected
                else:
                    assert tested.in_sphere(numbers[:3], numbers[3]) == expected
            else:
                raise AssertionError(f"{step}: unknown step")
        except Exception as error:
            raise AssertionError(f"{FILE.name}, line {number}, case {case}: {error}") from error
    assert all(count > 9 for count in checked.values()), checked

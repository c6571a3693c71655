"""The cases that every binding of osp passes: bindings/conformance.txt, which says what its lines mean."""

import math
from pathlib import Path

import numpy as np
import osp

FILE = Path(__file__).resolve().parents[2] / "conformance.txt"


def with_opengl_depth(matrix):
    """The same view with depth from -1 to 1."""
    matrix = matrix.copy()
    matrix[2] = 2 * matrix[2] - matrix[3]
    return matrix


def check_view(index, matrix, expected):
    assert index.frustum(matrix).tolist() == expected
    assert index.frustum(with_opengl_depth(matrix), "minus-one-to-one").tolist() == expected
    if matrix[3, :3].any():
        assert index.frustum(osp.View.from_matrix(matrix)).tolist() == expected


def check_ray(index, ray, expected):
    origin, direction, t_max = ray[:3], ray[3:6], ray[6]
    hit = index.ray(origin, direction, t_max)
    (many_id,), (many_t,) = index.rays([origin], [direction], t_max)
    if expected == ["none"]:
        assert hit is None and many_id == -1
    else:
        assert hit is not None and hit == (many_id, many_t) and hit[0] == int(expected[0])
        assert math.isclose(hit[1], float(expected[1]), rel_tol=1e-4)


def test_conformance():
    index = asked = case = None
    checked = {"visible": 0, "found": 0, "hit": 0}
    for number, line in enumerate(FILE.read_text().splitlines(), 1):
        step, *words = line.split() or ["#"]
        try:
            # An index knows no occluders.
            if step.startswith("#") or step in ("quad", "unhidden"):
                continue
            if step == "case":
                case, index = " ".join(words), osp.Index()
            elif step == "box":
                id, box = int(words[0]), [np.array(words[1:], dtype=np.float32)]
                if id in index:
                    index.update([id], box)
                else:
                    index.insert(box, ids=[id])
            elif step == "remove":
                index.remove([int(words[0])])
            elif step in ("view", "boxquery", "sphere", "ray"):
                asked = step, np.array(words, dtype=np.float32)
            elif step in checked:
                checked[step] += 1
                question, numbers = asked
                if step == "hit":
                    check_ray(index, numbers, words)
                    continue
                expected = [int(word) for word in words]
                if question == "view":
                    # Its columns come one after the other.
                    check_view(index, numbers.reshape(4, 4).T, expected)
                elif question == "boxquery":
                    assert index.box(numbers[:3], numbers[3:]).tolist() == expected
                else:
                    assert index.sphere(numbers[:3], numbers[3]).tolist() == expected
            else:
                raise AssertionError(f"{step}: a step that is not known")
        except Exception as error:
            raise AssertionError(f"{FILE.name}, line {number}, case {case}: {error}") from error
    assert all(count > 20 for count in checked.values()), checked

"""Shared parts of the tests."""

import os
import sys
import threading
from pathlib import Path

import numpy as np
import osp
import pytest

ROOT = Path(__file__).resolve().parents[3]
RECORDINGS = ROOT / "recordings"


@pytest.fixture
def recordings():
    return RECORDINGS


@pytest.fixture
def corpus():
    """The folder of real sessions, if there is one."""
    folder = os.environ.get("OSP_CORPUS")
    if not folder:
        pytest.skip("OSP_CORPUS names no folder of real sessions")
    return Path(folder)


def why_no_picture():
    """Returns why `osp.render` cannot draw here; None if it can. With OSP_GPU_TESTS=1, raises the error instead."""
    try:
        osp.render(RECORDINGS / "nested.ron", (16, 16), pace="samples:1024")
    except osp.AdapterError as error:
        if os.environ.get("OSP_GPU_TESTS") == "1":
            raise
        return str(error)
    return None


@pytest.fixture(scope="session")
def no_picture():
    return why_no_picture()


@pytest.fixture
def adapter(no_picture):
    """Skips a test that draws if there is no adapter."""
    if no_picture:
        pytest.skip(no_picture)


@pytest.fixture
def rng():
    return np.random.default_rng(20)


def assert_others_run_while(work):
    """Checks that this thread runs while another thread is in `work`."""
    errors, ended = [], []

    def run():
        try:
            work()
        except BaseException as error:
            errors.append(error)
        ended.append(True)

    # The other thread keeps the interpreter's lock until `work` releases it.
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        # A busy machine may let this thread rest during single runs.
        for _ in range(100):
            thread = threading.Thread(target=run)
            thread.start()
            is_meanwhile = not ended
            thread.join()
            assert not errors
            if is_meanwhile:
                return
            ended.clear()
    finally:
        sys.setswitchinterval(interval)
    pytest.fail("no other thread ran")


def random_boxes(rng, count, spread=10.0, largest=1.0):
    """Returns boxes as an array of the shape (count, 6), with numbers that float32 stores exactly."""
    mins = rng.uniform(-spread, spread, (count, 3)).astype(np.float32)
    maxs = (mins + rng.uniform(0, largest, (count, 3))).astype(np.float32)
    return np.hstack([mins, maxs])


def perspective(fov_y_degrees, aspect, near, far, depth="zero-to-one"):
    """Returns the perspective projection of textbooks, for a view along -z."""
    f = 1 / np.tan(np.radians(fov_y_degrees) / 2)
    if depth == "zero-to-one":
        a, b = far / (near - far), near * far / (near - far)
    else:
        a, b = (far + near) / (near - far), 2 * far * near / (near - far)
    return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])


def looking(eye, target, up=(0, 1, 0)):
    """Returns the matrix from the world to the view."""
    eye, target, up = (np.asarray(v, dtype=float) for v in (eye, target, up))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = [right, np.cross(back, right), back]
    matrix[:3, 3] = -matrix[:3, :3] @ eye
    return matrix


def is_inside(matrix, points, depth="zero-to-one", margin=0.0):
    """Returns for each point whether it lies in the clip volume of the matrix."""
    x, y, z, w = np.moveaxis(np.c_[points, np.ones(len(points))] @ matrix.T, -1, 0)
    least = 0 if depth == "zero-to-one" else -w
    in_w = w * (1 - margin)
    return (w > 0) & (abs(x) <= in_w) & (abs(y) <= in_w) & (z >= least) & (z <= w)

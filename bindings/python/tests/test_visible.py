"""Compares the visible triangles of a mesh with the triangles that rays hit."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import osp
import pytest
import trimesh
from conftest import is_inside, looking, perspective

MATRIX = perspective(60, 16 / 9, 0.1, 100)


def is_blocked(eye, points, own, triangles):
    """Returns for each point whether a triangle other than `own` lies between it and the eye (Möller and Trumbore, float64)."""
    blocked = np.zeros(len(points), dtype=bool)
    a, b, c = np.moveaxis(triangles.astype(float), 1, 0)
    edge1, edge2, from_a = b - a, c - a, eye - a
    for i, point in enumerate(points):
        direction = point - eye
        h = np.cross(direction, edge2)
        det = (edge1 * h).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (from_a * h).sum(axis=1) / det
            q = np.cross(from_a, edge1)
            v = (q * direction).sum(axis=1) / det
            t = (q * edge2).sum(axis=1) / det
        hits = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6) & (t > 1e-6) & (t < 1 - 1e-6)
        hits[own[i]] = False
        blocked[i] = hits.any()
    return blocked


def seen_by_rays(rng, matrix, eye, triangles, rays_each=4, among=slice(None)):
    """Returns the triangles with a sampled point that lies in the picture and is not blocked."""
    rows = np.arange(len(triangles))[among]
    own = np.repeat(rows, rays_each)
    weights = rng.dirichlet((0.5, 0.5, 0.5), size=len(own))
    points = (triangles[own] * weights[..., None]).sum(axis=1)
    shown = is_inside(matrix, points, margin=1e-5)
    own, points = own[shown], points[shown]
    return np.unique(own[~is_blocked(eye, points, own, triangles)])


def crowd(rng, count, low, high, size):
    middles = rng.uniform(low, high, (count, 1, 3))
    return (middles + rng.uniform(-size, size, (count, 3, 3))).astype(np.float32)


def wall(z, half):
    a, b, c, d = [-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]
    return np.array([[a, b, c], [a, c, d]], dtype=np.float32)


@pytest.mark.parametrize("method", osp.OCCLUSION_METHODS)
def test_what_a_ray_sees_is_never_hidden_and_a_wall_hides(rng, method):
    triangles = np.concatenate([wall(-3, 1.5), crowd(rng, 600, (-8, -5, -12), (8, 5, -1), 0.4)])
    mesh = osp.Mesh(triangles)
    in_frustum_only = hidden = checked = 0
    for _ in range(5):
        eye = rng.uniform(-0.5, 0.5, 3).astype(np.float32)
        target = eye + [rng.uniform(-0.1, 0.1), 0, -1]
        matrix = MATRIX @ looking(eye, target)
        view = osp.View.look_at(eye, target, near_m=0.1, far_m=100)
        in_view, seen = mesh.visible(view), mesh.visible(view, method)
        assert not (seen & ~in_view).any()
        by_rays = seen_by_rays(rng, matrix, eye.astype(float), triangles)
        assert seen[by_rays].all()
        in_frustum_only += in_view.sum()
        hidden += (in_view & ~seen).sum()
        checked += len(by_rays)
    assert checked > 500
    assert hidden > 50, f"{method} hides nothing of {in_frustum_only}"


@pytest.mark.parametrize("method", osp.OCCLUSION_METHODS)
def test_what_is_not_opaque_hides_nothing(rng, method):
    triangles = np.concatenate([wall(-3, 4), crowd(rng, 200, (-1, -1, -8), (1, 1, -5), 0.1)])
    view = osp.View.look_at((0, 0, 0), (0, 0, -1))
    opaque = np.ones(len(triangles), dtype=bool)
    assert osp.Mesh(triangles).visible(view, method).sum() == 2
    opaque[:2] = False
    assert osp.Mesh(triangles, opaque=opaque).visible(view, method)[:2].all()
    assert osp.Mesh(triangles, opaque=opaque).visible(view, method).sum() > 100


def test_a_mesh_of_trimesh():
    room = trimesh.util.concatenate(
        [trimesh.creation.icosphere(subdivisions=4, radius=1.0), trimesh.creation.box((6, 6, 0.1))]
    )
    room.vertices[-8:] += (0, 0, 3)
    view = osp.View.look_at((0, 0, 8), (0, 0, 0))
    seen = osp.Mesh(room.vertices, room.faces).visible(view, "msvbsp")
    assert seen.shape == (len(room.faces),) and seen.dtype == bool
    ball = len(room.faces) - 12
    assert not seen[:ball].any() and seen[ball:].any()
    # The ball is visible from the other side. `room.triangles` gives the same mesh.
    back = osp.View.look_at((0, 0, -8), (0, 0, 0))
    mesh = osp.Mesh(room.triangles)
    assert mesh.visible(back, "msvbsp")[:ball].sum() > ball / 2
    assert (mesh.visible(view, "msvbsp") == seen).all()
    assert len(mesh) == len(room.faces) and mesh.triangles.shape == (len(mesh), 3, 3)


def test_the_same_view_gives_the_same_answer_whatever_came_before(rng):
    walls = [wall(-2 - i / 4, 0.4) + np.float32([rng.uniform(-3, 3), rng.uniform(-2, 2), 0]) for i in range(60)]
    triangles = np.concatenate([*walls, crowd(rng, 400, (-8, -4, -30), (8, 4, -18), 0.3)]).astype(np.float32)
    mesh = osp.Mesh(triangles)
    views = [osp.View.look_at(rng.uniform(-1, 1, 3), (0, 0, -20)) for _ in range(12)]
    for method in ["depth", "msvbsp"]:
        alone = [osp.Mesh(triangles).visible(view, method, occluders=8) for view in views]
        assert sum(int((mesh.visible(view) & ~seen).sum()) for view, seen in zip(views, alone)) > 50
        for _ in range(2):
            for view, answer in zip(views, alone):
                assert (mesh.visible(view, method, occluders=8) == answer).all()
    with ThreadPoolExecutor(4) as pool:
        again = pool.map(lambda view: mesh.visible(view, "msvbsp", occluders=8), views)
        assert all((seen == answer).all() for seen, answer in zip(again, alone))


def test_strange_meshes():
    view = osp.View.look_at((0, 0, 0), (0, 0, -1))
    assert osp.Mesh(np.empty((0, 3, 3))).visible(view, "msvbsp").shape == (0,)
    assert osp.Mesh(np.empty((0, 3)), np.empty((0, 3))).visible(view).shape == (0,)
    # Triangles: a point, a line, and an enormous one around the eye.
    flat = np.array([[[0, 0, -2]] * 3, [[0, 0, -2], [0, 1, -2], [0, 2, -2]], [[-1e30, -1, 0], [1e30, -1, 0], [0, -1, -1e30]]])
    for method in [None, *osp.OCCLUSION_METHODS]:
        assert osp.Mesh(flat).visible(view, method).all()

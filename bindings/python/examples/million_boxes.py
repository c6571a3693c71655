"""Compares the culler with numpy, which tests every box, on a million boxes: times and results.

python million_boxes.py [COUNT]
"""

import sys
import time

import numpy as np

import osp


def fastest_ms(work, repeats=5):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        answer = work()
        times.append(time.perf_counter() - start)
    return 1000 * min(times), answer


def in_frustum(planes, boxes):
    seen = np.ones(len(boxes), dtype=bool)
    for nx, ny, nz, d in planes:
        # Corner that lies farthest along the normal.
        x, y, z = (boxes[:, axis + 3 * (n >= 0)] for axis, n in enumerate((nx, ny, nz)))
        seen &= ((nx * x + ny * y) + nz * z) + d >= 0
    return np.flatnonzero(seen)


count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
rng = np.random.default_rng(1)
mins = rng.uniform(-50, 50, (count, 3)).astype(np.float32)
boxes = np.hstack([mins, mins + np.float32(0.1)])
culler = osp.Culler()
keys = np.arange(count)
view = osp.View.look_at(eye=(0, 0, 0), target=(0, 0, -1))


def insert():
    culler.set(keys, boxes)
    culler.commit()


insert_ms, _ = fastest_ms(insert, repeats=1)
osp_ms, (seen,) = fastest_ms(lambda: culler.cull(view))
numpy_ms, expected = fastest_ms(lambda: in_frustum(view.frustum_planes, boxes))
assert np.array_equal(np.sort(seen), expected)
moved = boxes[:1000] + np.float32(0.5)


def move():
    culler.set(keys[:1000], moved)
    culler.commit()


update_ms, _ = fastest_ms(move)
print(f"{count:,} boxes: inserted in {insert_ms:,.0f} ms, 1,000 moved in {update_ms:.2f} ms")
print(f"frustum: {len(seen):,} found in {osp_ms:.2f} ms; numpy takes {numpy_ms:.1f} ms for the same answer")

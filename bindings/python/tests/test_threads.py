"""The interpreter goes on while osp works."""

import os
import signal
import threading

import numpy as np
import osp
import pytest
from conftest import assert_others_run_while, random_boxes


def test_other_threads_run_while_a_session_is_measured(recordings):
    assert_others_run_while(lambda: osp.verify(recordings / "room.ron", "msvbsp", views=2, pixels=(1280, 720)))


def test_ctrl_c_stops_a_long_replay(recordings):
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        while True:
            osp.replay(recordings / "room.ron", "octree-rebuild")
    timer.join()


def test_threads_query_while_one_changes(rng):
    index = osp.Index()
    kept = index.insert(random_boxes(rng, 500))
    stop, errors = threading.Event(), []

    def query():
        try:
            while not stop.is_set():
                found = index.box((-20,) * 3, (20,) * 3)
                assert np.isin(kept, found).all() and (np.diff(found.astype(int)) > 0).all()
                assert index.nearest((0, 0, 0), 1)[0].size == 1
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=query) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(200):
        more = index.insert(random_boxes(rng, 50))
        index.update(more, random_boxes(rng, 50))
        index.remove(more)
    stop.set()
    for thread in threads:
        thread.join()
    assert not errors and len(index) == 500

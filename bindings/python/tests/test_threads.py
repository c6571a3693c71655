"""Checks that other threads and Ctrl+C work during calls of osp."""

import os
import signal
import threading

import osp
import pytest
from conftest import assert_others_run_while


def test_other_threads_run_while_a_session_is_measured(recordings):
    assert_others_run_while(lambda: osp.verify(recordings / "room.ron", "msvbsp", views=2, pixels=(1280, 720)))


def test_ctrl_c_stops_a_long_replay(recordings):
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        timer.start()
        while True:
            osp.replay(recordings / "room.ron", "octree-rebuild")
    timer.join()

"""Tests pictures of recordings. Without a graphics adapter, pytest skips these tests unless OSP_GPU_TESTS is 1."""

import os
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import osp
import pytest
from conftest import ROOT, assert_others_run_while, looking, perspective

SIZE = (160, 90)
# The eye is in a room of the recording. The walls hide most of the other rooms.
INSIDE = osp.View.look_at((-1.5, 1.6, 1.5), (2, 1, -1))
SQUARE = "Polygon(t:{t},vertices:[({0},{0},{z}),({1},{0},{z}),({1},{1},{z}),({0},{1},{z})],color:({rgb},1.0))"
RED, BLUE = "1.0,0.0,0.0", "0.0,0.0,1.0"


@pytest.fixture
def squares(tmp_path):
    """A small red square, and behind it a large blue square that is drawn later."""
    path = tmp_path / "squares.ron"
    lines = [
        "Header(format:2)",
        SQUARE.format(-0.5, 0.5, z=-2.0, t=1.0, rgb=RED),
        SQUARE.format(-2.0, 2.0, z=-4.0, t=2.0, rgb=BLUE),
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def is_red(pixel):
    return pixel[0] > 120 and pixel[1] < 60 and pixel[2] < 60


def is_blue(pixel):
    return pixel[2] > 120 and pixel[0] < 60 and pixel[1] < 60


def test_a_picture_is_an_array_of_rows_from_the_top(adapter, squares):
    view = osp.View.look_at((0, 0, 0), (0, 0, -1))
    picture = osp.render(squares, (80, 40), view=view)
    assert picture.shape == (40, 80, 4) and picture.dtype == np.uint8 and (picture[..., 3] == 255).all()
    assert is_red(picture[20, 40]) and is_blue(picture[5, 40]) and is_blue(picture[35, 40])
    # The first rows are at the top: an eye below the red square sees it above the middle.
    low = osp.render(squares, (80, 40), view=osp.View.look_at((0, -0.7, 0), (0, -0.7, -1)))
    assert is_red(low[11, 40]) and is_blue(low[28, 40])


def test_before_the_last_frame_less_is_there(adapter, squares):
    view = osp.View.look_at((0, 0, 0), (0, 0, -1))
    first, last = (osp.render(squares, (80, 40), frame=n, view=view, pace="samples:1") for n in (0, 1))
    assert is_red(first[20, 40]) and not is_blue(first[5, 40]) and is_blue(last[5, 40])
    assert np.array_equal(last, osp.render(squares, (80, 40), view=view, pace="samples:1"))


def test_a_matrix_and_a_view_without_end_show_the_same(adapter, squares):
    eye, target = (0.3, 0.2, 1.0), (0, 0, -3)
    matrix = perspective(50, 2, 0.1, 100) @ looking(eye, target)
    of_matrix = osp.render(squares, (80, 40), view=matrix).astype(int)
    without_end = osp.View.look_at(eye, target, fov_y_degrees=50, far_m=float("inf"))
    # The vertical field of view stays, for any aspect ratio of the view.
    of_view = osp.render(squares, (80, 40), view=without_end).astype(int)
    assert len(np.unique(of_view.reshape(-1, 4), axis=0)) > 2
    assert abs(of_matrix - of_view).mean() < 1


def test_pictures_of_a_sketch(adapter, recordings):
    room = recordings / "room.ron"
    picture = osp.render(room, SIZE, view=INSIDE)
    assert picture.shape == (90, 160, 4) and len(np.unique(picture.reshape(-1, 4), axis=0)) > 100
    assert np.array_equal(picture, osp.render(str(room), list(SIZE), view=INSIDE))
    first = osp.render(room, SIZE, frame=0, view=INSIDE)
    assert not np.array_equal(picture, first)


@pytest.mark.parametrize("occlusion", ["hzb", "msvbsp", "depth-last"])
def test_occlusion_culling_changes_no_pixel(adapter, recordings, occlusion):
    room = recordings / "room.ron"
    without = osp.render(room, SIZE, view=INSIDE, occlusion="none")
    assert np.array_equal(without, osp.render(room, SIZE, view=INSIDE, occlusion=occlusion))


def program():
    """Returns the program that the variable `OSP` names, else the newest `osp` in the target folder."""
    if "OSP" in os.environ:
        return Path(os.environ["OSP"])
    folder = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    built = [folder / profile / "osp" for profile in ("debug", "release")]
    return max((path for path in built if path.is_file()), key=lambda path: path.stat().st_mtime, default=None)


@pytest.mark.parametrize("view, frame", [("whole", None), ("recorded", 40)])
def test_the_picture_is_that_of_the_program(adapter, recordings, tmp_path, view, frame):
    osp_program = program()
    if osp_program is None:
        pytest.skip("there is no target/debug/osp or target/release/osp to compare with")
    out = tmp_path / "out.png"
    arguments = ["--size", "320x180", "--camera", view, "--frame", "last" if frame is None else str(frame)]
    room = recordings / "room.ron"
    ran = subprocess.run([osp_program, "render", room, out, *arguments], capture_output=True, text=True)
    if "needs a build with the feature" in ran.stderr and "OSP" not in os.environ:
        pytest.skip(f"{osp_program} was built without `osp render`")
    assert ran.returncode == 0, ran.stderr
    of_program = np.round(matplotlib.image.imread(out) * 255)
    ours = osp.render(room, (320, 180), frame=frame, view=view)
    channels = of_program.shape[2]
    assert of_program.shape[:2] == (180, 320) and channels in (3, 4)
    assert abs(ours[..., :channels] - of_program).mean() < 1


def test_other_threads_run_while_a_picture_is_drawn(adapter, recordings):
    assert_others_run_while(lambda: osp.render(recordings / "room.ron", (640, 360)))


WRONG = [
    (dict(size=(0, 90)), ValueError, r"size: expected width and height, 1 to 16384 pixels each; found \[0, 90\]"),
    (dict(size=(160, -1)), ValueError, r"found \[160, -1\]"),
    (dict(size=(16385, 90)), ValueError, r"found \[16385, 90\]"),
    (dict(size=(160,)), ValueError, r"found \[160\]"),
    (dict(size=(160, 90, 4)), ValueError, r"found \[160, 90, 4\]"),
    (dict(size=(160.0, 90)), TypeError, "size"),
    (dict(size="160x90"), TypeError, "size"),
    (dict(size=160), TypeError, "int"),
    (dict(frame=1.0), TypeError, "frame"),
    (dict(view="outside"), ValueError, 'view: expected one of whole, recorded, .*; found "outside"'),
    (dict(view="auto"), ValueError, "view: expected one of"),
    (dict(view=np.zeros((4, 4))), ValueError, "perspective"),
    (dict(view=None), TypeError, "numbers"),
    (dict(occlusion="glass"), ValueError, 'occlusion: expected one of .*hzb.*; found "glass"'),
    (dict(occlusion="pvs"), ValueError, "occlusion: expected one of"),
    (dict(pace="slowly"), ValueError, "pace"),
    (dict(time_secs=float("nan")), ValueError, "time_secs: expected a number from 0 to 10000; found NaN"),
    (dict(time_secs=-1), ValueError, "found -1"),
    (dict(max_polygons=0), ValueError, "max_polygons"),
]


@pytest.mark.parametrize("case", range(len(WRONG)))
def test_what_is_wrong_raises_one_exception(squares, case):
    arguments, exception, message = WRONG[case]
    with pytest.raises(exception, match=message) as raised:
        osp.render(squares, **{"size": SIZE, **arguments})
    # The type must be exact: a subclass would be another error. A panic of Rust is none of these types.
    assert raised.type is exception


def test_a_file_that_cannot_be_drawn(squares, tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.ron"):
        osp.render(tmp_path / "nothing.ron", SIZE)
    other = tmp_path / "a.doc"
    other.write_text("hello")
    with pytest.raises(osp.RecordingError, match="one of the formats"):
        osp.render(other, SIZE)


def test_a_session_without_that_frame_or_any(adapter, squares, tmp_path):
    for frame in (1, -1):
        message = rf"frame: expected 0 to 0, as .*squares.ron has 1 frames at the pace samples:16; found {frame}"
        with pytest.raises(ValueError, match=message):
            osp.render(squares, SIZE, frame=frame)
    empty = tmp_path / "empty.ron"
    empty.write_text("Header(format:1)\n")
    with pytest.raises(ValueError, match=r"empty\.ron: nothing was drawn"):
        osp.render(empty, SIZE)


def test_damage_is_an_error_or_passed_over(adapter, squares):
    whole = osp.render(squares, SIZE)
    lines = squares.read_text().splitlines()
    squares.write_text("\n".join([*lines[:2], "Polygon(t:nonsense)", *lines[2:]]) + "\n")
    with pytest.raises(osp.RecordingError, match="line 3"):
        osp.render(squares, SIZE)
    assert np.array_equal(whole, osp.render(squares, SIZE, lenient=True))


@pytest.mark.skipif(sys.platform == "win32", reason="the test needs a system without Direct3D")
def test_without_an_adapter_there_is_one_clear_error(squares, monkeypatch):
    # Direct3D exists only on Windows.
    monkeypatch.setenv("WGPU_BACKEND", "dx12")
    with pytest.raises(osp.AdapterError, match="no graphics adapter was found: is a driver installed?") as raised:
        osp.render(squares, SIZE)
    assert isinstance(raised.value, RuntimeError)

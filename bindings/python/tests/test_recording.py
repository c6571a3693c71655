"""Tests the arrays of recordings."""

import io
import pathlib
import zipfile

import numpy as np
import osp
import pandas
import pytest

BEGIN = 'Begin(t:0.5,stroke:{0},tool:{1},width:0.02,color:(1.0,0.5,0.25,1.0),normal:Travel,thinnest:1.0{2})'
POINT = "Point(t:{1},stroke:{0},p:({2},1.0,0.0),q:(0.0,0.0,0.0,1.0),pressure:0.5)"


@pytest.fixture
def session(tmp_path):
    """Two ribbons, the first of which is erased, and a polygon."""
    lines = [
        'Header(format:2,name:"two",source:"test",layers:[(name:"one"),(name:"two")])',
        "Head(t:0.25,p:(0.0,1.6,2.0),q:(0.0,0.0,0.0,1.0))",
        BEGIN.format(1, "Ribbon", ""),
        *(POINT.format(1, 1 + i, i / 10) for i in range(4)),
        "End(t:5.0,stroke:1)",
        BEGIN.format(7, "Tube", ',paint:Some((brush:"Ink",layer:1))'),
        *(POINT.format(7, 6 + i, 1 + i / 10) for i in range(3)),
        "Erase(t:9.0,stroke:1)",
        "Polygon(t:9.5,vertices:[(0.0,0.0,0.0),(1.0,0.0,0.0),(1.0,1.0,0.0),(0.0,1.0,0.0)],color:(0.0,0.0,1.0,0.5))",
    ]
    path = tmp_path / "two.ron"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_session_is_read_to_its_arrays(session):
    sketch = osp.open(session)
    assert (sketch.name, sketch.source, sketch.format, sketch.path) == ("two", "test", "ron", session)
    assert sketch.layers == ["one", "two"] and sketch.warnings == [] and sketch.skipped == 0
    assert sketch.events == 13 and sketch.time_span_secs == (0.25, 8.0)
    strokes = sketch.strokes
    assert strokes["stroke"].tolist() == [1, 7]
    assert strokes["tool"].tolist() == ["ribbon", "tube"]
    assert strokes["brush"].tolist() == ["", "Ink"]
    assert np.array_equal(strokes["end_secs"], [5.0, np.nan], equal_nan=True)
    assert strokes["points"].tolist() == [4, 3]
    assert strokes["layer"].tolist() == [0, 1]
    assert strokes["visible"].tolist() == [False, True]
    assert strokes["color"].tolist() == [[1, 0.5, 0.25, 1]] * 2
    points = sketch.points
    assert points["stroke"].tolist() == [1] * 4 + [7] * 3
    assert points["time_secs"].tolist() == [1, 2, 3, 4, 6, 7, 8]
    assert np.allclose(points["position"][:, 0], [0, 0.1, 0.2, 0.3, 1, 1.1, 1.2])
    assert points["rotation"].shape == (7, 4) and (points["pressure"] == 0.5).all()
    assert sketch.heads["position"].tolist() == [[0, np.float32(1.6), 2]]
    polygons = sketch.polygons
    assert set(polygons["stroke"].tolist()) == {7, -1}
    last = {key: column[-1] for key, column in polygons.items()}
    assert last["stroke"] == -1 and last["corner_count"] == 4 and not last["opaque"]
    assert last["corners"].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert sketch.triangles.shape == (len(sketch.polygon_of_triangle), 3, 3)
    assert sketch.polygon_of_triangle[-2:].tolist() == [polygons.rows - 1] * 2
    assert np.allclose(sketch.bounds[1], sketch.triangles.max(axis=(0, 1)))


def test_only_opaque_paint_hides(tmp_path):
    """Draws a quad before the eye with several kinds of paint, and a small quad behind it."""
    corners = "[(-1.0,-1.0,-2.0),(1.0,-1.0,-2.0),(1.0,1.0,-2.0),(-1.0,1.0,-2.0)]"
    behind = "Polygon(t:2.0,vertices:[(-0.1,0.0,-4.0),(0.1,0.0,-4.0),(0.0,0.1,-4.0)],color:(1.0,0.0,0.0,1.0))"
    view = osp.View.look_at((0, 0, 0), (0, 0, -1))
    # Plain paint, half transparent paint, a brush with holes, an additive brush.
    for brush, alpha, hides in [("", 1, True), ("", 0.5, False), ("CelVinyl", 1, False), ("Light", 1, False)]:
        paint = f',paint:Some((brush:"{brush}"))' if brush else ""
        begin = BEGIN.format(1, "Ribbon", paint).replace("1.0,0.5,0.25,1.0", f"1.0,0.5,0.25,{alpha:.1f}")
        front = f"Polygon(t:1.0,stroke:1,vertices:{corners},color:(0.0,0.0,1.0,{alpha:.1f}))"
        path = tmp_path / "a.ron"
        path.write_text("\n".join(['Header(format:2)', begin, front, "End(t:1.5,stroke:1)", behind]) + "\n")
        sketch = osp.open(path)
        assert sketch.polygons["opaque"].tolist() == [hides, True]
        assert sketch.mesh.visible(view).all()
        assert sketch.mesh.visible(view, "msvbsp").tolist() == [True, True, not hides]


def test_tables_become_data_frames(session):
    sketch = osp.open(session)
    frame = sketch.points.to_pandas()
    assert list(frame.columns) == [
        *("stroke", "time_secs", "position_x", "position_y", "position_z"),
        *("rotation_x", "rotation_y", "rotation_z", "rotation_w", "pressure"),
    ]
    assert frame.groupby("stroke").size().to_dict() == {1: 4, 7: 3}
    corners = [name for name in sketch.polygons.to_pandas().columns if name.startswith("corners")]
    assert corners[:4] == ["corners_0_x", "corners_0_y", "corners_0_z", "corners_1_x"] and len(corners) == 12
    assert isinstance(sketch.strokes.to_pandas(), pandas.DataFrame)


def test_the_shipped_sessions(recordings):
    # These numbers are in recordings/README.md.
    for name, strokes, points, heads, polygons in [
        ("portrait", 400, 11_026, 13_237, 11_327),
        ("room", 415, 12_094, 17_831, 11_409),
        ("nested", 169, 6_253, 1_095, 6_084),
    ]:
        sketch = osp.open(str(recordings / f"{name}.ron"))
        found = [table.rows for table in (sketch.strokes, sketch.points, sketch.heads, sketch.polygons)]
        assert found == [strokes, points, heads, polygons]
        assert osp.Mesh(sketch.triangles).visible(sketch.whole_view()).all()


def test_errors_name_the_file_and_the_place(session, tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.ron") as missing:
        osp.open(tmp_path / "nothing.ron")
    assert missing.value.filename == str(tmp_path / "nothing.ron")
    with pytest.raises(osp.RecordingError, match="a folder"):
        osp.open(tmp_path)
    with pytest.raises(osp.RecordingError, match="one of the formats .ron") as unknown:
        (tmp_path / "a.doc").write_text("hello")
        osp.open(tmp_path / "a.doc")
    assert (unknown.value.line, unknown.value.byte) == (None, None) and isinstance(unknown.value, ValueError)

    text = session.read_text()
    session.write_text(text.replace("stroke:7,p:(1.1", "stroke:7,p:(NaN"))
    with pytest.raises(osp.RecordingError, match=r"two\.ron, line 11: expected .*finite.* found") as damage:
        osp.open(session)
    assert (damage.value.line, damage.value.byte, str(damage.value.path)) == (11, None, str(session))
    sketch = osp.open(session, lenient=True)
    assert sketch.skipped == 1 and sketch.points.rows == 6
    for call in (osp.replay, osp.verify):
        with pytest.raises(osp.RecordingError, match="line 11"):
            call(session)

    session.write_text(text)
    with pytest.raises(osp.RecordingError, match=r"at most 1 strokes \(max_polygons=N allows more\)"):
        osp.open(session, max_polygons=5)
    with pytest.raises(ValueError, match="max_polygons"):
        osp.open(session, max_polygons=0)
    for not_a_path in (7, None):
        with pytest.raises(TypeError):
            osp.open(not_a_path)


def test_a_damaged_tilt_names_the_byte(tmp_path):
    path = tmp_path / "a.tilt"
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("metadata.json", '{"BrushIndex": []}')
        archive.writestr("data.sketch", b"\x12\x34\x56\x78\0\0")
    path.write_bytes(b"tilT" + bytes([16, 0, 1, 0]) + bytes(8) + packed.getvalue())
    with pytest.raises(osp.RecordingError, match=r"a\.tilt/data\.sketch, byte \d+: expected") as damage:
        osp.open(path)
    assert damage.value.byte is not None and damage.value.line is None


def test_an_empty_session(tmp_path):
    path = tmp_path / "empty.ron"
    path.write_text("Header(format:1)\n")
    sketch = osp.open(path)
    assert sketch.bounds is None and sketch.time_span_secs is None and sketch.strokes.rows == 0
    assert sketch.triangles.shape == (0, 3, 3) and sketch.points["position"].shape == (0, 3)
    assert len(sketch.strokes.to_pandas()) == 0 and isinstance(sketch.whole_view(), osp.View)
    replayed = osp.replay(path)
    assert replayed.rows == 0 and replayed.agree and replayed.summary["frames"].tolist() == [0] * 4
    assert osp.verify(path).ok


def test_an_obj_without_strokes(tmp_path):
    path = pathlib.Path(tmp_path, "a.obj")
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    sketch = osp.open(path)
    assert sketch.format == "obj" and sketch.polygons.rows == 1
    assert sketch.triangles.tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]


def test_real_sketches(corpus):
    known = 0
    for path in sorted(corpus.glob("*/*.*")):
        if path.suffix not in (".tilt", ".apa") or path.stat().st_size > 3_000_000:
            continue
        sketch = osp.open(path, lenient=True)
        strokes, points = sketch.strokes, sketch.points
        assert strokes["points"].sum() == points.rows
        assert np.isfinite(points["position"]).all() and np.isfinite(sketch.triangles).all()
        assert np.isin(points["stroke"], strokes["stroke"]).all()
        known += points.rows
    assert known > 10_000

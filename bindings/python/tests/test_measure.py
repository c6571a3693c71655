"""Compares replays and verifications with the values that osp's own tests pin."""

import re

import numpy as np
import osp
import pandas
import pytest


def test_a_replay_has_the_fingerprints_that_osp_has_pinned(recordings):
    pins = (recordings / "fingerprints.pins").read_text()
    for name in ["nested", "scribble"]:
        frames, pinned = re.search(
            rf'"{name}.ron", pace: "samples:16", camera: "auto", frames: (\d+), fingerprint: "(\w+)"', pins
        ).groups()
        table = osp.replay(recordings / f"{name}.ron", ["brute-force", "osp", "dynamic-bvh"], budget_secs=1e6)
        assert table.agree
        assert table.summary["fingerprint"].tolist() == [pinned] * 3
        assert table.summary["frames"].tolist() == [int(frames)] * 3


def test_a_replay_is_a_table_of_frames(recordings):
    table = osp.replay(recordings / "portrait.ron", pace="samples:64")
    assert {len(column) for column in table.values()} == {table.rows}
    frame = pandas.DataFrame(table)
    assert set(frame["index"]) == {"brute-force", "osp-paper", "osp", "octree-rebuild"}
    of = {name: rows.reset_index() for name, rows in frame.groupby("index")}
    reference = of["brute-force"]
    for rows in of.values():
        for column in ("frame", "inserted", "removed", "updated", "polygons", "visible", "fingerprint"):
            assert (rows[column] == reference[column]).all()
        assert (rows["frame_ns"] == rows["insert_ns"] + rows["cull_ns"]).all() and (rows["cull_ns"] > 0).all()
    assert (reference["visible"] <= reference["polygons"]).all()
    assert reference["inserted"].sum() - reference["removed"].sum() == reference["polygons"].iloc[-1] == 11_327
    # Brute force tests each box in each frame; the tree does not.
    assert (reference["boxes_tested"] == reference["polygons"]).all()
    assert of["osp"]["boxes_tested"].sum() < reference["boxes_tested"].sum()
    summary = table.summary.to_pandas().set_index("index")
    assert summary.loc["osp", "frame_us_max"] == of["osp"]["frame_ns"].max() / 1000
    assert (summary["memory_bytes"] > 0).all()


def test_occlusion_in_a_replay(recordings):
    table = osp.replay(recordings / "room.ron", "osp", occlusion=["none", "msvbsp", "auto"], pace="samples:64")
    drawn = {method: table["drawn"][table["occlusion"] == method].sum() for method in ("none", "msvbsp", "auto")}
    assert drawn["msvbsp"] < drawn["none"] >= drawn["auto"] and table.agree
    assert table.summary["occlusion"].tolist() == ["none", "msvbsp", "auto"]
    assert (table["visible"] >= table["drawn"]).all()


def test_a_budget_leaves_frames_out(recordings):
    table = osp.replay(recordings / "room.ron", ["osp", "octree-rebuild"], budget_secs=1e-12)
    osp_frames, rebuilt_frames = table.summary["frames"]
    assert 40 <= osp_frames < 765 and 40 <= rebuilt_frames < 765
    assert table.summary["fingerprint"][1] == "" and not table["timed"].all() and table.agree


def test_a_disagreement_is_seen(recordings):
    from osp._measure import _is_one_value_a_frame

    frames, values = np.array([0, 1, 2, 0, 1, 2, 1]), np.array([5, 6, 7, 5, 6, 7, 6])
    assert _is_one_value_a_frame(frames, values)
    assert not _is_one_value_a_frame(frames, np.array([5, 6, 7, 5, 6, 8, 6]))


def test_verification(recordings):
    table = osp.verify(recordings / "room.ron", ["msvbsp", "depth"], views=3, pixels=(640, 360), occluders=[16, 64])
    assert table.ok and table["occlusion"].tolist() == ["msvbsp"] * 2 + ["depth"] * 2
    assert table["occluders"].tolist() == [16, 64] * 2 and (table["views"] == 3).all()
    assert (table["false_culls"] == 0).all() and table["conservative"].all() and not table["failed"].any()
    assert (table["hidden_culled"] > 100).all() and (table["hidden_culled"] <= table["hidden"]).all()
    assert table.seen["visible"] + table.seen["hidden"] <= table.seen["in_view"] and table.seen["lost"] == 0
    assert (table["hidden"] == table.seen["hidden"]).all()
    assert np.allclose(table["hidden_culled_percent"], 100 * table["hidden_culled"] / table["hidden"])
    assert len(pandas.DataFrame(table)) == 4


def test_a_method_that_hides_what_can_be_seen_is_found_out(recordings):
    table = osp.verify(recordings / "portrait.ron", "msvbsp-paper", views=6, pixels=(640, 360))
    assert not table["conservative"].any()
    assert table["false_culls"].sum() > 0
    # `ok` ignores the false culls of methods that are not conservative.
    assert table.ok


def test_whole_models_are_verified(recordings):
    table = osp.verify(recordings / "nested.ron", "msvbsp", views=2, pixels=(320, 180), whole=True)
    assert table.ok and table.seen["views"] == 2 and table.seen["in_view"] > 0


WRONG = [
    (lambda path: osp.replay(path, ["octree"]), 'indexes: expected one of brute-force, .*found "octree"'),
    (lambda path: osp.replay(path, []), "indexes: expected at least one"),
    (lambda path: osp.replay(path, occlusion="hzb"), "occlusion: expected one of none, .*found \"hzb\""),
    (lambda path: osp.replay(path, pace="fast"), "pace: expected `recorded` or `samples:N`"),
    (lambda path: osp.replay(path, camera="top"), "camera: expected one of auto, orbit"),
    (lambda path: osp.replay(path, budget_secs=0), "budget_secs"),
    (lambda path: osp.replay(path, budget_secs=float("nan")), "budget_secs"),
    (lambda path: osp.verify(path, "auto"), "occlusion: expected one of frusta"),
    (lambda path: osp.verify(path, []), "occlusion: expected at least one"),
    (lambda path: osp.verify(path, views=0), "views"),
    (lambda path: osp.verify(path, occluders=0), "occluders"),
    (lambda path: osp.verify(path, pixels=(8, 8)), "pixels"),
]


@pytest.mark.parametrize("case", range(len(WRONG)))
def test_wrong_settings(case, recordings):
    call, message = WRONG[case]
    with pytest.raises(ValueError, match=message):
        call(recordings / "nested.ron")

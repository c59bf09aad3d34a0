"""Scene files: errors are said, equal content hashes equal, poses are where they should be."""

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.pose import PoseSpec
from scenes.scene import load_scene, scene_from, scene_hash, scene_names


def test_every_shipped_scene_loads() -> None:
    assert "paper" in scene_names()
    for name in scene_names():
        assert load_scene(name).burrs


def test_all_errors_are_listed_with_suggestions() -> None:
    document = {"wheel": "paper", "finish": "ground", "rigg": {}, "camera": {"bit_depth": 3, "full_wel_e": 1}}
    with pytest.raises(InputError) as caught:
        scene_from(document, source="mine.toml")
    text = str(caught.value)
    assert "mine.toml: 3 problem" in text
    assert "did you mean 'rig'" in text
    assert "did you mean 'full_well_e'" in text
    assert "camera.bit_depth" in text
    with pytest.raises(InputError, match="did you mean 'paper'"):
        load_scene("papier")


def test_a_named_finish_can_be_overridden_in_part() -> None:
    scene = scene_from({"wheel": "paper", "finish": {"name": "ground", "metal": "brass"}}, source="x")
    assert (scene.finish.alpha, scene.finish.metal) == (0.2, "brass")


def test_the_hash_is_of_the_content() -> None:
    a = scene_from({"wheel": "paper", "finish": "ground", "name": "a"}, source="x")
    b = scene_from({"finish": {"alpha": 0.2}, "wheel": "paper", "name": "b"}, source="y")
    c = scene_from({"finish": {"alpha": 0.21}, "wheel": "paper"}, source="z")
    assert scene_hash(a) == scene_hash(b) != scene_hash(c)


def test_poses_move_the_axis_as_documented() -> None:
    def axis(pose: PoseSpec) -> Floats:
        return pose.T_camera_part(standoff_mm=600.0, middle_z_mm=5.0)[:3, 2]

    assert axis(PoseSpec()) == pytest.approx([0.0, -1.0, 0.0])
    assert axis(PoseSpec(elevation_deg=90.0)) == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    assert axis(PoseSpec(roll_deg=90.0)) == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    resting = PoseSpec(spin_deg=30.0).T_camera_part(standoff_mm=600.0, middle_z_mm=5.0)
    facing = np.array([np.cos(np.radians(-30.0)), np.sin(np.radians(-30.0)), 0.0])
    assert resting[:3, :3] @ facing == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    assert resting @ [0.0, 0.0, 5.0, 1.0] == pytest.approx([0.0, 0.0, 600.0, 1.0])

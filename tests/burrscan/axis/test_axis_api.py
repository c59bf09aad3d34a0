import numpy as np
import pytest

from bench.synthetic.revolution import revolution_scan
from burrscan.axis import METHODS, find_axis
from burrscan.axis.basis import SENSE
from burrscan.errors import InputError
from burrscan.variants import resolve
from tests.tiers import some_of


@some_of("name", sorted(METHODS, key=lambda name: name == "qian-huang"), first=len(METHODS) - 1)
def test_every_method_finds_an_easy_axis(name: str) -> None:
    scan = revolution_scan(shape=(160, 60), arc_deg=200.0, sigma_mm=0.02)
    axis = find_axis(scan.vertices_mm, scan.faces, method=name)
    assert scan.angle_error_deg(axis.direction) < 30.0
    assert axis.method == name
    assert axis.direction @ SENSE > 0.0
    assert np.linalg.norm(axis.direction) == pytest.approx(1.0)
    toward = scan.vertices_mm.mean(axis=0) - axis.point_mm
    assert abs(toward @ axis.direction) < 0.05 * np.linalg.norm(toward)  # nearest to the mean


def test_methods_resolve() -> None:
    for name in METHODS:
        assert callable(resolve(name, METHODS, stage="axis"))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((5, 2)), None, "shape"),
        ([["a", "b", "c"]], None, "numeric"),
        (np.zeros((50, 3)), None, "coincide"),
        (np.full((50, 3), np.nan), None, "too few"),
        (np.zeros((50, 3)), np.zeros((2, 4), dtype=int), "triangulate"),
        (np.zeros((50, 3)), np.zeros((2, 3)), "integers"),
        (np.zeros((50, 3)), np.full((2, 3), 50), "0 to 49"),
    ],
)
def test_bad_meshes(vertices: object, faces: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        find_axis(vertices, faces)  # type: ignore[arg-type]


def test_bad_names_and_sigmas() -> None:
    vertices = revolution_scan(shape=(20, 10)).vertices_mm
    with pytest.raises(InputError, match="did you mean 'profile'"):
        find_axis(vertices, method="profil")
    with pytest.raises(InputError, match="one value per vertex"):
        find_axis(vertices, sigma_mm=np.ones(3))

from bench.perf.geometry import installed, peer_line, size_line
from bench.perf.peers import Peer, Setting, Task, best_setting, measured
from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.revolution import RevolutionScan
from burrscan.arrays import Floats


def test_a_size_is_measured_stage_by_stage() -> None:
    cells = size_line(0.02).split()
    assert 15_000 < int(cells[0]) < 25_000
    assert len(cells) == 9
    assert all(float(cell) >= 0.0 for cell in cells)


def test_burrscan_is_among_those_compared() -> None:
    (name,) = (name for name in installed() if name.startswith("burrscan"))
    line = peer_line(name, installed()[name], Task("stepped_wheel", 140.0, 0.05), 1)
    assert float(line.split()[5]) < 0.02


def test_a_peer_is_given_the_setting_that_does_best() -> None:
    def off_by(scan: RevolutionScan, _task: Task, _seed: int, setting: Setting) -> Floats:
        off: float = setting["off"]
        return scan.direction + off * scan.T_mesh_part[:3, 0]

    peer = Peer("numpy", off_by, ({"off": 0.1}, {"off": 0.01}, {"off": 0.3}))
    task = Task("cylinder", 140.0, 0.2)
    assert best_setting(peer, task) == {"off": 0.01}
    assert abs(measured(peer, task, seeds=1).median_deg - 0.5729) < 1e-3


def test_a_known_generatrix_tells_more() -> None:
    for profile in ("stepped_wheel", "cylinder", "torus"):
        for arc_deg in (60.0, 140.0):
            free = cramer_rao_deg(profile, arc_deg=arc_deg, sigma_mm=0.2)
            known = cramer_rao_deg(profile, arc_deg=arc_deg, sigma_mm=0.2, known_generatrix=True)
            assert known < free

from bench.perf.geometry import finders, peer_line, size_line


def test_a_size_is_measured_stage_by_stage() -> None:
    cells = size_line(0.02).split()
    assert 15_000 < int(cells[0]) < 25_000
    assert len(cells) == 9
    assert all(float(cell) >= 0.0 for cell in cells)


def test_burrscan_is_among_those_compared() -> None:
    name, median_deg = peer_line("burrscan", finders()["burrscan"], 0.05, 1).split()[::2][:2]
    assert name == "burrscan"
    assert float(median_deg) < 0.02

import sys

import pytest

from bench.synthetic.__main__ import main
from bench.synthetic.axis_command import cells
from bench.synthetic.axis_table import axis_table


def test_every_method_sees_the_same_scans_and_is_measured() -> None:
    rows = list(axis_table(["profile", "line-complex"], seeds=2, shape=(120, 60)))
    assert len(rows) == 2 * 2 * 3
    best, peer = rows[0], rows[6]
    assert (best.method, peer.method) == ("profile", "line-complex")
    assert best.median_deg < 5.0 * best.bound_deg
    assert best.bound_deg == peer.bound_deg
    assert cells(peer)[6] == "–"  # it states no interval
    assert cells(best)[5] == "0 of 2"


def test_the_table_is_printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("bench.synthetic.axis_table.SIGMAS_MM", (0.2,))
    monkeypatch.setattr("bench.synthetic.axis_table.ARCS_DEG", (140.0,))
    monkeypatch.setattr(sys, "argv", ["bench.synthetic", "axis", "--methods", "profile", "--seeds", "1"])
    main()
    told = capsys.readouterr().out
    assert "0 of 1" in told
    assert "0.0056" in told

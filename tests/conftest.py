"""Settings of all tests, and which of them `make test-fast` leaves out.

Whole files, for a file shares its scenes and its compiled kernels.
"""

from __future__ import annotations

import pytest
from hypothesis import settings

settings.register_profile("compiled", deadline=None)  # the first call of a kernel compiles it
settings.load_profile("compiled")

SLOW = (
    "test_align",
    "test_basis",
    "test_board",
    "test_bound",
    "test_burr",
    "test_burr_families",
    "test_burrs",
    "test_calibration_board",
    "test_calibration_hand_eye",
    "test_calibration_photometric",
    "test_captures_replay",
    "test_cli_calibrate",
    "test_cli_comfort",
    "test_cli_completion",
    "test_cli_findings",
    "test_cli_grammar",
    "test_cli_hand_eye",
    "test_cli_json",
    "test_cli_scan",
    "test_cluster",
    "test_cluster_store",
    "test_colour",
    "test_compare_runs",
    "test_compare_statistics",
    "test_datum",
    "test_sectors",
    "test_subdivide",
    "test_detection",
    "test_drawing",
    "test_axis_api",
    "test_inspection_schema",
    "test_instrument",
    "test_joint",
    "test_linear",
    "test_meshes",
    "test_meshio",
    "test_optics",
    "test_reproduction",
    "test_perf_geometry",
    "test_pictures",
    "test_pipeline",
    "test_planted_faults",
    "test_profile",
    "test_project",
    "test_readme_lab",
    "test_renderer",
    "test_report",
    "test_report_browser",
    "test_report_parts",
    "test_run_crew",
    "test_run_end_to_end",
    "test_run_gather",
    "test_run_mesh",
    "test_run_runner",
    "test_scan",
    "test_scene",
    "test_simulate",
    "test_surface",
    "test_transport",
    "test_wheel_file",
    "test_wheel_mesh",
    "test_wheel_truth",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test of a slow file."""
    for item in items:
        if item.path.stem in SLOW:
            item.add_marker(pytest.mark.slow)

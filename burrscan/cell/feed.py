"""The mill led through a path, by the arm or, along an edge, by the table.

The arm's error, which the last look took off, changes as the flange turns: by a third of a millimetre over a
burr of 20 degrees. The mill is round, so the flange stays turned about it as it was in that look; and along a
burr that goes around the axis the table turns the part under the mill. Where the table's axis is in the arm's
frame nobody knows better than the arm does, so at both ends of such a burr a look says where its edge is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.chart import line_of
from burrscan.cell.look import of_several
from burrscan.cell.servo import Servoed
from burrscan.cell.station import Station, turned
from burrscan.cell.toolpath import ToolPath, lift
from burrscan.cell.track import edge_now
from burrscan.errors import InputError
from burrscan.pipeline import Pipeline, run
from burrscan.turns import turn_rad

_GATE_MM = 2.0
"""How far the edge may be at a burr's end from where it is expected: an arm's offset times the turn, and
more."""


class _Feed:
    """Brings the mill to places over the part as it lay in the servo's last look."""

    def __init__(self, station: Station, servoed: Servoed) -> None:
        burr, T_base_mesh, last, inspection = servoed.arrived()
        self._station, self.height_mm = station, last.height_mm
        self._stood = (last.T_base_camera @ station.T_camera_tool)[:3, 0]
        self._T_base_plate = turned(station.T_base_plate, servoed.turn_deg)
        frame = T_part_mesh(inspection.axis.point_mm, inspection.axis.direction)
        self._T_part_base = frame @ np.linalg.inv(T_base_mesh)
        self._T_part_burr = frame @ burr.T_mesh_burr
        self.around = bool(line_of(self._T_part_burr))

    def along_deg(self, T_base_tool: Floats) -> float:
        """Angle of a place about the part's axis, from the burr's middle."""
        x, y = (self._T_part_base @ T_base_tool[:, 3])[:2]
        middle = np.arctan2(self._T_part_burr[1, 3], self._T_part_burr[0, 3])
        return float(np.degrees(turn_rad(np.arctan2(y, x) - middle)))

    def on_edge(self, along_deg: float) -> Floats:
        """(4, 4) a place on the burr's edge, or its parallel, in the base frame."""
        about = turned(np.eye(4), along_deg)
        return np.asarray(np.linalg.inv(self._T_part_base) @ about @ self._T_part_burr, float)

    def go(self, T_base_tool: Floats) -> tuple[Floats, Floats]:
        """Stand there: (4, 4) where that is now that the table was turned, and the camera, as reported."""
        if self.around:
            sense = np.sign((self._T_part_base @ self._T_base_plate)[2, 2])  # part and table: either way up
            now = self._station.table.move(turned(self._T_base_plate, -sense * self.along_deg(T_base_tool)))
            T_base_tool = now @ np.linalg.inv(self._T_base_plate) @ T_base_tool
        turn = np.arctan2(T_base_tool[:3, 1] @ self._stood, T_base_tool[:3, 0] @ self._stood)
        flange = turned(T_base_tool, float(np.degrees(turn))) @ np.linalg.inv(self._station.T_flange_tool)
        reported = self._station.arm.move(np.asarray(flange, float))
        return T_base_tool, np.asarray(reported @ self._station.T_flange_camera, float)

    def end(self) -> None:
        """Turn the table back."""
        if self.around:
            self._station.table.move(self._T_base_plate)


def mill(station: Station, path: ToolPath, servoed: Servoed) -> None:
    """Go through a path of the frame of the base: approach, every pass, retreat.

    Parameters
    ----------
    station
        The cell.
    path
        In the frame of the base.
    servoed
        How the burr was reached.

    Raises
    ------
    burrscan.cell.positioner.OutOfReachError
        When the arm cannot follow; the spindle is stopped then, the arm stands where it was.
    InputError
        When the servo did not converge, and when the station has no spindle.

    """
    if station.spindle is None:
        raise InputError("the station has no spindle: give Station.spindle what starts and stops the mill")
    feed = _Feed(station, servoed)
    feed.go(path.above(0))
    station.spindle.start()
    try:
        for _, pose in path.travel():
            feed.go(pose)
    finally:
        station.spindle.stop()
    feed.go(path.above(path.last))
    feed.end()


def along_its_edge(
    station: Station, path: ToolPath, servoed: Servoed, *, pipeline: Pipeline | None = None
) -> ToolPath:
    """The path of a burr that goes around the axis, bent to where looks at both of its ends see its edge.

    Of any other burr the path as it is. It is moved by a parabola in the angle about the part's axis, by
    nothing in the middle, which the servo has reached.

    Raises
    ------
    burrscan.cell.positioner.OutOfReachError
        When the arm cannot look there.
    InputError
        When the servo did not converge, or a look does not show the edge.

    """
    feed = _Feed(station, servoed)
    if not feed.around:
        return path
    along = np.array([feed.along_deg(pose) for pose in path.stations])
    start, stop = float(along.min()), float(along.max())
    try:
        off = np.array([_off_edge(station, feed, feed.on_edge(end), pipeline) for end in (start, stop)])
    finally:
        feed.end()
    bend = np.linalg.solve([[start, start**2], [stop, stop**2]], off)
    moved = np.stack([along, along**2], axis=1) @ bend
    stations = np.array(path.stations)
    stations[:, :3, 3] += (stations[:, :3, 1:3] @ moved[..., None])[..., 0]
    return replace(path, stations=stations)


def _off_edge(station: Station, feed: _Feed, T_base_tool: Floats, pipeline: Pipeline | None) -> Floats:
    """(2,) how far the edge is from where it is expected, mm: across, and along the normal."""
    there, camera = feed.go(lift(T_base_tool, feed.height_mm))
    expected = np.linalg.inv(camera) @ lift(there, -feed.height_mm)
    seen = edge_now(run(station.scanner, of_several(pipeline)), expected, gate_mm=_GATE_MM)
    if seen is None:
        raise InputError("the edge that the burr stands on was not seen again at its end")
    return np.asarray((np.linalg.inv(expected) @ seen)[1:3, 3], float)

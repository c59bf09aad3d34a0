"""From images or a mesh of a shiny turned part to its axis, its generatrix and its burrs."""

from burrscan.correspondence import Correspondence, Scan
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.inspection import Axis, Burr, Check, Generatrix, Inspection, Value
from burrscan.rig import Rig, View
from burrscan.scanner import Patterns, Scanner
from burrscan.surface import Surface

__all__ = [
    "Axis",
    "Burr",
    "CameraSheet",
    "Check",
    "Correspondence",
    "Generatrix",
    "InputError",
    "Inspection",
    "Patterns",
    "ProjectorSheet",
    "Rig",
    "Scan",
    "Scanner",
    "Surface",
    "Value",
    "View",
]

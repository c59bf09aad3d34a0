"""From images or a mesh of a shiny turned part to its axis, its generatrix and its burrs."""

from burrscan.api import inspect, inspect_mesh
from burrscan.axis import find_axis
from burrscan.correspondence import Correspondence, Scan
from burrscan.datum import Datum, referred_to
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.inspection import Axis, Burr, Check, Generatrix, Inspection, Value
from burrscan.pipeline import Pipeline, Stage
from burrscan.rig import Rig, View
from burrscan.scanner import Patterns, Scanner
from burrscan.surface import Surface

__all__ = [
    "Axis",
    "Burr",
    "CameraSheet",
    "Check",
    "Correspondence",
    "Datum",
    "Generatrix",
    "InputError",
    "Inspection",
    "Patterns",
    "Pipeline",
    "ProjectorSheet",
    "Rig",
    "Scan",
    "Scanner",
    "Stage",
    "Surface",
    "Value",
    "View",
    "find_axis",
    "inspect",
    "inspect_mesh",
    "referred_to",
]

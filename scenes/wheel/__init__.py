"""Wheels with burrs: from a generatrix in TOML to a watertight mesh and its exact truth."""

from scenes.wheel.build import Wheel, build_wheel
from scenes.wheel.catalogue import load_wheel, wheel_names
from scenes.wheel.mill import Cut
from scenes.wheel.spec import AxialRidge, BurrSpec, Nick, RimBurr, WheelSpec
from scenes.wheel.truth import TrueBurr, burr_at, deviation_mm

__all__ = [
    "AxialRidge",
    "BurrSpec",
    "Cut",
    "Nick",
    "RimBurr",
    "TrueBurr",
    "Wheel",
    "WheelSpec",
    "build_wheel",
    "burr_at",
    "deviation_mm",
    "load_wheel",
    "wheel_names",
]

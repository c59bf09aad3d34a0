"""The renderer underneath: which Mitsuba variant this machine can run, and switching it on."""

from scenes.renderer.choice import THREADS_VARIABLE, Channels, Renderer, activate, choose, usable_cores
from scenes.renderer.diagnosis import DoctorReport, doctor, render_text
from scenes.renderer.probe import Probe

__all__ = [
    "THREADS_VARIABLE",
    "Channels",
    "DoctorReport",
    "Probe",
    "Renderer",
    "activate",
    "choose",
    "doctor",
    "render_text",
    "usable_cores",
]

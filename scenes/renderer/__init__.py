"""The renderer underneath: which Mitsuba variant this machine can run, and switching it on."""

from scenes.renderer.activation import activate
from scenes.renderer.choice import Channels, Renderer, choose
from scenes.renderer.diagnosis import DoctorReport, doctor, render_text
from scenes.renderer.probe import Probe
from scenes.renderer.threads import THREADS_VARIABLE, usable_cores

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

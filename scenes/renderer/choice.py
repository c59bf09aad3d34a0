"""Choosing the Mitsuba variant that this machine can really run."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Literal

from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.renderer.libraries import candidates
from scenes.renderer.probe import Probe, probe_cuda, probe_llvm

VARIANT_VARIABLE = "BURRSCAN_VARIANT"
"""Environment variable that names the variant to use, whatever else would run."""

VARIANTS = ("cuda_ad_mono", "cuda_ad_rgb", "llvm_ad_mono", "llvm_ad_rgb", "scalar_rgb")

Channels = Literal["mono", "rgb"]


@dataclass(frozen=True)
class Renderer:
    """The Mitsuba variant that this machine runs, and how that was found out."""

    variant: str
    llvm_path: str | None
    llvm_version: str | None
    reason: str
    probes: tuple[Probe, ...]

    @property
    def vectorised(self) -> bool:
        """Whether whole wavefronts of rays run at once, as the traced light transport needs."""
        return not self.variant.startswith("scalar")


def choose(*, channels: Channels = "mono") -> Renderer:
    """Choose CUDA if it works, else LLVM with the first library that works, else the scalar variant.

    Every library is tried in a process of its own, once: the outcome is remembered on disk by file, processor
    and versions. Mitsuba is not imported here.

    Parameters
    ----------
    channels
        ``"mono"`` for intensities, ``"rgb"`` for pictures to look at. Mitsuba has no scalar mono variant, so
        the fallback is ``scalar_rgb`` in both cases.

    Raises
    ------
    InputError
        When the environment variable ``BURRSCAN_VARIANT`` names a variant that is unknown or cannot run.

    """
    named = os.environ.get(VARIANT_VARIABLE)
    if named:
        return _named(named)
    probes = [probe_cuda()]
    if not probes[0].ran:
        probes += _probe_until_one_runs()
    return _best(probes, channels)


def _probe_until_one_runs() -> list[Probe]:
    probes = []
    for library in candidates():
        probes.append(probe_llvm(library))
        if probes[-1].ran:
            break
    return probes


def _best(probes: list[Probe], channels: Channels) -> Renderer:
    working = [probe for probe in probes if probe.ran]
    if not working:
        return Renderer("scalar_rgb", None, None, _why_scalar(probes), tuple(probes))
    best = working[0]
    variant = f"{best.backend}_ad_{channels}"
    if best.backend == "cuda":
        return Renderer(variant, None, None, "a CUDA device ran the representative kernel", tuple(probes))
    reason = f"LLVM {best.version} ran the representative kernel ({best.path})"
    return Renderer(variant, best.path, best.version, reason, tuple(probes))


def _why_scalar(probes: list[Probe]) -> str:
    failed = [
        f"LLVM {probe.version} {probe.verdict}".replace("  ", " ")
        for probe in probes
        if probe.backend == "llvm"
    ]
    found = ", ".join(failed) if failed else "no libLLVM found"
    return f"no CUDA, and no LLVM that works ({found}); 'burrscan doctor' says what to install"


def _named(variant: str) -> Renderer:
    """The variant of the user's wish, with the probe that it needs."""
    if variant not in VARIANTS:
        raise InputError(f"{VARIANT_VARIABLE}={variant}: {suggest(variant, list(VARIANTS))}")
    reason = f"{VARIANT_VARIABLE} asks for it"
    if variant.startswith("scalar"):
        return Renderer(variant, None, None, reason, ())
    probes = [probe_cuda()] if variant.startswith("cuda") else _probe_until_one_runs()
    if not any(probe.ran for probe in probes):
        told = [f"{probe.path or probe.backend}: {probe.verdict}, {probe.detail}" for probe in probes]
        ends = "; ".join(told) or "no libLLVM found"
        raise InputError(f"{VARIANT_VARIABLE}={variant} cannot run here ({ends})")
    if variant.startswith("cuda"):
        return Renderer(variant, None, None, reason, tuple(probes))
    return Renderer(variant, probes[-1].path, probes[-1].version, reason, tuple(probes))

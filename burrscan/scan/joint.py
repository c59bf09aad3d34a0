"""Reading a round of the adaptive scan: all frames of a pixel are weighed together.

The finest period gives candidate columns, one per stripe; each candidate predicts the other periods' phases
and every bit, and the one that explains them best is taken if it stands out. This is maximum likelihood over
the stripes, with the light from other surfaces as an unknown of bounded size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.codes.phase import Phase, decode_phase
from burrscan.devices import CameraSheet
from burrscan.scan.sequence import Sequence
from burrscan.scan.weigh import weigh

_COST_ROOF = 36.0
_EDGE_DOUBT = 0.5
_INDIRECT_BIT = 0.5
_INDIRECT_PHASE_RAD = 0.2


@dataclass(frozen=True)
class Reading:
    """One round, decoded.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) column and stated sigma, NaN where there is no modulation.
    direct_e
        (h, w) electrons that full light adds directly, over the dark.
    misfit
        (h, w) cost of the best candidate per observation, about 1 for an honest pixel.
    lead
        (h, w) by how much the second best candidate costs more, in units of chi².
    lost
        (h, w) light that full light shows beyond the stripes' modulation, per modulated light.
    torn
        (h, w) chi² of the stripes' modulations against those of one compact footprint. Large where the
        footprint is torn over a depth edge.
    clipped
        (h, w) True where a sine was clipped.

    """

    u_px: Floats32
    sigma_px: Floats32
    direct_e: Floats32
    misfit: Floats32
    lead: Floats32
    lost: Floats32
    torn: Floats32
    clipped: Bools

    def blanked(
        self,
        *,
        max_sigma_px: float,
        least_lead: float = 12.0,
        worst_misfit: float = 5.0,
        worst_torn: float = 16.0,
    ) -> Reading:
        """The same with NaN where the column is clipped, coarse, ambiguous or at odds with its frames."""
        with np.errstate(invalid="ignore"):
            fine = (self.sigma_px <= max_sigma_px) & (self.lead >= least_lead) & (self.misfit <= worst_misfit)
        fine &= ~self.clipped & (self.torn <= worst_torn)
        nan = np.float32(np.nan)
        return replace(self, u_px=np.where(fine, self.u_px, nan), sigma_px=np.where(fine, self.sigma_px, nan))


def read(images: Image, code: Sequence, *, camera: CameraSheet, dark_e: Floats32) -> Reading:
    """Decode a round.

    Parameters
    ----------
    images
        (F, h, w) DN, in the order of the sequence.
    code
        What was shown.
    camera
        The noise model.
    dark_e
        (h, w) electrons under a black projector at the round's exposure.

    Notes
    -----
    O(pixels · (F + width / period · (B + P))).

    """
    first = 2 * len(code.bits)
    blocks = [
        images[first + i * code.steps : first + (i + 1) * code.steps] for i in range(len(code.periods_px))
    ]
    phases = [
        decode_phase(block, camera=camera, period_px=period)
        for block, period in zip(blocks, code.periods_px, strict=True)
    ]
    return _combine(images[:first], phases, code, camera, dark_e)


def _combine(
    pairs: Image, phases: list[Phase], code: Sequence, camera: CameraSheet, dark_e: Floats32
) -> Reading:
    gain = camera.gain_dn_per_e
    offset = np.stack([phase.offset_px for phase in phases])
    sigma = np.stack([phase.sigma_px for phase in phases])
    amplitude = np.stack([phase.amplitude_dn for phase in phases])
    periods = np.array(code.periods_px)
    noise = np.array([camera.black_level_dn, gain, (gain * camera.read_noise_e) ** 2 + 1.0 / 12.0])
    dark_dn = dark_e * np.float32(gain)
    found, direct, indirect, misfit, lead = _choose(
        pairs, offset, sigma, amplitude, periods, code.bits, dark_dn, noise
    )
    lost = indirect / np.maximum(direct, np.float32(1e-6))
    u_px, sigma_px, torn = weigh(offset, sigma, amplitude, periods_px=periods, near_px=found, share=lost)
    clipped = np.logical_or.reduce([phase.clipped for phase in phases])
    return Reading(u_px, sigma_px, direct / np.float32(gain), misfit, lead, lost, torn, clipped)


@njit(cache=True, parallel=True, nogil=True)
def _choose(  # noqa: PLR0917, C901, PLR0912, PLR0915 (a kernel)
    pairs: Image,
    offset: Floats32,
    sigma: Floats32,
    amplitude: Floats32,
    periods: Floats,
    bits: Floats32,
    dark: Floats32,
    noise: Floats,
) -> tuple[Floats32, Floats32, Floats32, Floats32, Floats32]:
    count, height, width = offset.shape
    n_bits, columns = bits.shape
    black, gain, floor = noise[0], noise[1], noise[2]
    out_u = np.full((height, width), np.nan, np.float32)
    out_direct = np.zeros((height, width), np.float32)
    out_indirect = np.zeros((height, width), np.float32)
    out_misfit = np.full((height, width), np.inf, np.float32)
    out_lead = np.zeros((height, width), np.float32)
    for r in prange(height):
        difference, weight = np.empty(n_bits), np.empty(n_bits)
        variance = np.empty(count)
        for c in range(width):
            base, direct = 0, 0.0
            for j in range(count):
                direct += 2.0 * amplitude[j, r, c] / count
                if sigma[j, r, c] < sigma[base, r, c]:
                    base = j
            if not sigma[base, r, c] < 0.25 * periods[base]:
                continue
            total = 0.0
            for b in range(n_bits):
                on, off = float(pairs[2 * b, r, c]), float(pairs[2 * b + 1, r, c])
                difference[b] = on - off
                total += (on + off - 2.0 * black) / n_bits
                weight[b] = gain * max(on + off - 2.0 * black, 0.0) + 2.0 * floor
            # what is neither direct, dark nor noise came by other surfaces, and may follow a bit by that much
            doubt = gain * (max(total, 0.0) / n_bits + 4.0 * dark[r, c]) + 6.0 * floor
            indirect = max(total - 2.0 * dark[r, c] - direct - 2.0 * np.sqrt(doubt), 0.0)
            for b in range(n_bits):
                weight[b] += (_INDIRECT_BIT * indirect) ** 2 + (0.05 * direct) ** 2
            for j in range(count):
                wobble = periods[j] / (2.0 * np.pi) * _INDIRECT_PHASE_RAD * min(indirect / direct, 10.0)
                variance[j] = float(sigma[j, r, c]) ** 2 + wobble * wobble
            best, second, found = np.inf, np.inf, -1.0
            u = float(offset[base, r, c])
            while u < columns - 0.5:
                cost = 0.0
                for j in range(count):
                    if j != base:
                        gap = offset[j, r, c] - u
                        gap -= periods[j] * np.rint(gap / periods[j])
                        cost += min(gap * gap / (variance[j] + variance[base]), _COST_ROOF)
                column = min(max(int(np.rint(u)), 0), columns - 1)
                for b in range(n_bits):
                    gap = difference[b] - direct * bits[b, column]
                    # near the border of two cells the value depends on the footprint's exact place and shape
                    edge = _EDGE_DOUBT * direct * (1.0 - abs(bits[b, column]))
                    cost += min(gap * gap / (weight[b] + edge * edge), _COST_ROOF)
                if cost < best:
                    second, best, found = best, cost, u
                elif cost < second:
                    second = cost
                u += periods[base]
            out_u[r, c] = found
            out_direct[r, c] = direct
            out_indirect[r, c] = indirect
            out_misfit[r, c] = best / (n_bits + count - 1)
            out_lead[r, c] = second - best
    return out_u, out_direct, out_indirect, out_misfit, out_lead

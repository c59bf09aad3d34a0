"""The light profile of one projector pixel, as the lens images it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PixelProfile:
    """A separable trapezoid: the lit part of a pixel (a box) blurred by the lens (a box).

    Parameters
    ----------
    fill
        Lit width of a pixel as a share of the pitch; below 1 there is a dark gap between pixels.
    blur_px
        Width of the lens's blur in projector pixels. With ``fill = blur_px = 1`` the profile is the tent of
        bilinear interpolation, which is what Mitsuba's ``projector`` does with a bilinear bitmap.

    The profile is normalised so that an all-white image gives light 1 everywhere on average.
    """

    fill: float = 1.0
    blur_px: float = 1.0

"""Columns that continue a surface, against surfaces laid out by hand."""

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats32
from burrscan.scan.matching.matched import Reading
from burrscan.scan.validity.fusion import fuse, mean_of
from burrscan.scan.validity.region_growing import grow_regions

SHAPE = (40, 60)


def slope() -> Floats32:
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    u: Floats32 = (0.8 * columns + 0.3 * rows).astype(np.float32)
    return u


def believed(u: Floats32, sure: Bools, *, sigma_px: float = 0.05) -> Bools:
    return grow_regions(u, np.full(SHAPE, sigma_px, np.float32), sure)


def left() -> Bools:
    return np.broadcast_to(np.arange(SHAPE[1]) < 10, SHAPE)


def test_a_surface_is_followed_to_its_end() -> None:
    assert believed(slope(), left()).all()


def test_a_mirror_image_does_not_join_on() -> None:
    u = slope()
    u[10:30, 30:50] += 40.0
    found = believed(u, left())
    assert not found[10:30, 30:50].any()
    assert found.sum() == found.size - 400


def test_lone_errors_are_left_out_and_passed_by() -> None:
    u = slope()
    wrong = np.random.default_rng(3).random(SHAPE) < 0.2
    wrong &= ~left()
    u[wrong] += np.where(np.random.default_rng(4).random(wrong.sum()) < 0.5, -30.0, 25.0).astype(np.float32)
    assert (believed(u, left()) == ~wrong).mean() > 0.99


def test_without_sure_pixels_nothing_is_believed_and_sure_ones_always_are() -> None:
    assert not believed(slope(), np.zeros(SHAPE, bool)).any()
    alone = np.zeros(SHAPE, bool)
    alone[20, 30] = True
    assert (believed(slope(), alone) == alone).all()


def test_no_column_no_belief() -> None:
    u = slope()
    u[:, 20:24] = np.nan
    found = believed(u, left())
    assert found[:, :20].all()
    assert not found[:, 20:].any()


def test_order_of_rows_and_columns_does_not_matter() -> None:
    u = slope() + np.random.default_rng(5).normal(0.0, 0.3, SHAPE).astype(np.float32)
    turned = believed(u[::-1, ::-1].copy(), left()[::-1, ::-1].copy())[::-1, ::-1]
    assert (turned == believed(u, left())).all()


def reading(u_px: float, sigma_px: float) -> Reading:
    u, sigma = np.full(SHAPE, u_px, np.float32), np.full(SHAPE, sigma_px, np.float32)
    one, none = np.ones(SHAPE, np.float32), np.zeros(SHAPE, np.float32)
    return Reading(u, u, sigma, sigma, one, none, one, 99.0 * one, none, np.zeros(SHAPE, bool))


def test_rounds_are_weighed_by_information() -> None:
    mean = mean_of(reading(10.0, 0.1), reading(10.3, 0.2))
    assert mean.u_px[0, 0] == pytest.approx(10.06, abs=1e-4)
    assert mean.sigma_px[0, 0] == pytest.approx(0.1 / np.sqrt(1.25), rel=1e-4)


def test_where_rounds_contradict_neither_is_believed() -> None:
    assert fuse(reading(10.0, 0.1), reading(10.3, 0.1), width=64, max_sigma_px=0.35).mask.all()
    assert not fuse(reading(10.0, 0.1), reading(12.0, 0.1), width=64, max_sigma_px=0.35).mask.any()

"""Calls of several looks: what belongs together, how sure it is, and the sizes of the joined burr."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import expon

from burrscan.arrays import Floats
from burrscan.cell.belief import SURE
from burrscan.cell.chart import chart_of
from burrscan.cell.evidence import BLEMISHES, NOISE, Call, Place, distinct, joined
from burrscan.inspection import Burr
from tests.burrscan.cell.parts import axis, burr, generatrix

_CHART = chart_of(generatrix())


def _call(
    look: int, made: Burr, aside_deg: float = 20.0, *, along: bool = True, bare: tuple[int, ...] = ()
) -> Call:
    faced = along and aside_deg < 30.0
    return Call(look, made, np.array(made.T_mesh_burr), aside_deg, faced, along, frozenset(bare))


def _joined(calls: list[Call], *chances: float) -> tuple[Place, ...]:
    seen: Floats = np.stack([np.full((2, *_CHART.shape), chance) for chance in chances])
    return joined(calls, axis=axis(), chart=_CHART, chances=seen, burrs=2.0)


def test_calls_of_one_place_are_one_burr() -> None:
    places = _joined([_call(0, burr()), _call(1, burr(across_mm=0.8)), _call(1, burr(40.0))], SURE, SURE)
    assert sorted(len(place.calls) for place in places) == [1, 2]


def test_one_look_has_one_call_in_a_burr() -> None:
    places = _joined([_call(0, burr()), _call(0, burr(across_mm=1.0))], SURE)
    assert len(places) == 2


def _likelier(significance: float, *, along: bool = True) -> float:
    """Of a burr than of noise: burrs exceed 3.9 by 20.5 in the mean, noise by less but for a share."""
    clear, (faint, share) = expon(3.9, 20.5), (2.3, 0.07) if along else (4.3, 0.25)
    burr_, noise = clear.pdf(significance), expon(3.9, faint).pdf(significance)
    return float(burr_ / ((1.0 - share) * noise + share * burr_))


def test_the_odds_are_those_of_the_two_rates() -> None:
    # called in one look of three that would have found it: Bayes by hand
    (place,) = _joined([_call(0, burr(significance=7.0))], SURE, SURE, SURE)
    real = 2.0 * SURE * (1.0 - SURE) ** 2
    # a look without any other false call: the mean of an exponential rate that 1 / usual looks have shown
    noise = NOISE[0] / sum(NOISE) / (1.0 / sum(NOISE) + 1.0) / _likelier(7.0)
    false = 3 * (noise + BLEMISHES * 0.5**2)
    assert place.probability == pytest.approx(real / (real + false))
    assert not place.certain


def test_a_call_across_the_baseline_is_believed_less_until_another_confirms_it() -> None:
    chances = SURE, SURE
    (along,), (across,) = (_joined([_call(0, burr(), along=way)], *chances) for way in (True, False))
    odds = [place.probability / (1.0 - place.probability) for place in (along, across)]
    rest = BLEMISHES * 0.5
    noise = [
        one / sum(NOISE) / (1.0 / sum(NOISE) + 1.0) / _likelier(20.0, along=way)
        for one, way in zip(NOISE, (True, False), strict=True)
    ]
    assert odds[0] / odds[1] == pytest.approx((noise[1] + rest) / (noise[0] + rest))
    (twice,) = _joined([_call(n, burr(), along=False) for n in range(2)], *chances)
    assert twice.probability > 0.95


def test_noise_is_faint_along_the_baseline_and_across_it_often_as_clear_as_burrs() -> None:
    """The clearest call of a place says it; one that others confirm was no noise, however faint."""
    along, across = (
        [
            _joined([_call(0, burr(significance=sure), along=way)], SURE, SURE)[0].probability
            for sure in (4.5, 9.0, 15.0, 40.0)
        ]
        for way in (True, False)
    )
    assert along == sorted(along)
    assert along[0] < 0.1
    assert along[3] > 0.7
    assert across == sorted(across)
    assert across[3] < along[3]
    faint, clear = (
        _joined([_call(n, burr(significance=sure)) for n in range(2)], SURE, SURE)[0].probability
        for sure in (4.5, 40.0)
    )
    assert faint == pytest.approx(clear)


def test_a_look_with_many_calls_that_none_confirms_is_believed_less() -> None:
    others = [_call(0, burr(angle, significance=9.0)) for angle in (60.0, 100.0, 140.0, 180.0, 220.0, 260.0)]
    chances = 0.9, 0.5, 0.5
    (alone,) = _joined([_call(0, burr(significance=9.0))], *chances)
    bunch = _joined([_call(0, burr(significance=9.0)), *others], *chances)
    of_bunch = [place.probability for place in bunch]
    assert alone.certain
    assert max(of_bunch) < 0.5 * alone.probability
    # those of another look, and one that is confirmed, are not; they lie as those do, which are half believed
    (elsewhere,) = (p for p in _joined([_call(1, burr()), *others], *chances) if p.calls[0].look == 1)
    assert 1.0 < _odds(elsewhere) / _odds(_joined([_call(1, burr())], *chances)[0]) < 2.0
    twice = [_call(0, burr()), _call(1, burr())]
    (confirmed,) = _joined(twice, *chances)
    (beside,) = (place for place in _joined([*twice, *others], *chances) if len(place.calls) == 2)
    assert 1.0 < _odds(beside) / _odds(confirmed) < 2.0


def _odds(place: Place) -> float:
    return place.probability / (1.0 - place.probability)


def test_a_call_that_lies_as_the_others_do_is_believed_more() -> None:
    along = burr(significance=9.0)
    turned = np.array(along.T_mesh_burr)
    turned[:3, :2] = np.stack([turned[:3, 1], -turned[:3, 0]], axis=1)
    others = [_call(n, burr(angle)) for angle in (60.0, 120.0, 180.0) for n in range(3)]
    chances = SURE, SURE, SURE
    alike, across = (_call(0, one) for one in (along, replace(along, T_mesh_burr=turned)))
    for call, share in ((alike, 4.0 / 5.0), (across, 1.0 / 5.0)):
        (alone,) = _joined([call], *chances)
        (beside,) = (place for place in _joined([call, *others], *chances) if len(place.calls) == 1)
        # three that are sure beside Laplace's two, against one of two: the rule of succession
        assert _odds(beside) / _odds(alone) == pytest.approx(2.0 * share, rel=0.01)


def test_a_look_that_could_not_see_says_nothing() -> None:
    faint = burr(significance=9.0)
    (alone,) = _joined([_call(0, faint)], SURE)
    (beside,) = _joined([_call(0, faint)], SURE, 0.0)
    (denied,) = _joined([_call(0, faint)], SURE, SURE)
    assert alone.certain
    assert beside.certain
    assert beside.probability == pytest.approx(alone.probability)
    assert denied.probability < beside.probability - 0.3
    assert denied.suspicion > 0.2


def test_bare_metal_under_a_call_speaks_against_it_unless_another_call_has_none() -> None:
    # what the map says of the second look does not matter: it measured the metal under the call
    (ghost,) = _joined([_call(0, burr(), bare=(1, 2))], SURE, 0.0, 0.0)
    assert ghost.probability < 0.2
    (real,) = _joined([_call(0, burr(), bare=(2,)), _call(1, burr())], SURE, SURE, 0.0)
    assert real.probability > 0.95


def test_confirmed_calls_are_sure_and_lone_ones_suspicious() -> None:
    (confirmed,) = _joined([_call(n, burr()) for n in range(3)], SURE, SURE, SURE)
    (lone,) = _joined([_call(0, burr())], SURE, SURE)
    assert confirmed.probability > 0.95
    assert confirmed.suspicion == 0.0
    assert lone.suspicion > 0.0


def test_a_flank_that_mirrors_from_in_front_is_measured_from_aside() -> None:
    """A ridge of 1.4 mm, 0.5 high by the one look that faced it; what says more says how sure it is."""
    faced = _call(0, burr(height_mm=0.5, sigma_mm=0.2))
    aside = [_call(n, burr(height_mm=1.35, sigma_mm=0.3), 50.0) for n in (1, 2)]
    (place,) = _joined([faced, *aside], SURE, SURE, SURE)
    assert 0.9 < place.burr.height_mm.value < 1.2
    assert place.burr.height_mm.sigma > 0.25  # they disagree
    # from far aside half of it is hidden, and across the baseline its flanks mirror inside the rays' plane
    hidden = [_call(1, burr(height_mm=1.35, sigma_mm=0.3), 64.0)]
    mirrored = [_call(2, burr(height_mm=1.35, sigma_mm=0.3), 20.0, along=False)]
    (place,) = _joined([faced, *hidden, *mirrored], SURE, SURE, SURE)
    assert place.burr.height_mm.value == pytest.approx(0.5)


def test_sizes_are_weighted_by_what_is_stated() -> None:
    heights = [(1.00, 0.02), (1.10, 0.10)]
    calls = [_call(n, burr(height_mm=h, sigma_mm=s)) for n, (h, s) in enumerate(heights)]
    (place,) = _joined(calls, SURE, SURE)
    weight = np.array([1.0 / s**2 for _, s in heights])
    mean = (weight * [h for h, _ in heights]).sum() / weight.sum()
    assert place.burr.height_mm.value == pytest.approx(mean)
    assert place.burr.height_mm.sigma == pytest.approx(1.0 / np.sqrt(weight.sum()))


def test_looks_that_disagree_widen_the_deviation() -> None:
    calls = [_call(n, burr(height_mm=h, sigma_mm=0.02)) for n, h in enumerate((0.8, 1.0, 1.2))]
    (place,) = _joined(calls, SURE, SURE, SURE)
    assert place.burr.height_mm.value == pytest.approx(1.0)
    # the scatter, not the 0.012 that the stated deviations alone would give
    assert place.burr.height_mm.sigma == pytest.approx(0.2 / np.sqrt(3.0), rel=0.05)


def test_two_looks_from_aside_outvote_a_faint_one_that_faces_a_burr() -> None:
    faint = _call(0, burr(side="nick", significance=13.0))
    aside = [_call(1, burr(significance=35.0), 56.0), _call(2, burr(significance=20.0), 63.0)]
    (place,) = _joined([faint, *aside], SURE, SURE, SURE)
    assert place.burr.side == "protrusion"
    (place,) = _joined([faint, aside[0]], SURE, SURE)
    assert place.burr.side == "nick"


def test_one_look_from_aside_tells_neither_size_nor_side() -> None:
    faced = _call(0, burr(height_mm=1.0))
    oblique = _call(1, burr(height_mm=4.0, side="nick", sigma_mm=0.001, significance=90.0), aside_deg=64.0)
    (place,) = _joined([faced, oblique], SURE, SURE)
    assert place.burr.side == "protrusion"
    assert place.burr.height_mm.value == pytest.approx(1.0)
    (unfaced,) = _joined([_call(0, burr(significance=9.0), aside_deg=64.0)], SURE)
    assert unfaced.unfaced > 0.05  # it is to be looked at from in front
    assert 0.8 < unfaced.probability < 0.95
    assert not unfaced.certain
    (settled,) = _joined([_call(0, oblique.burr, aside_deg=64.0)], SURE)
    assert settled.certain
    assert settled.unfaced > 0.05
    (mirrored,) = _joined([_call(0, oblique.burr, along=False)], SURE)
    assert not replace(mirrored, probability=0.99).certain  # whatever its odds
    (twice,) = _joined([_call(n, burr(), aside_deg=60.0) for n in range(2)], SURE, SURE)
    assert twice.certain
    assert place.unfaced == 0.0


def test_one_base_carries_one_burr() -> None:
    """Both walls of a nick, called in the same two looks: the clearer call is the burr's.

    Bases of 1.5 mm overlap up to 1.5 mm apart, and as their angles have 0.02 degrees each, up to 1.58.
    """
    clear, other, apart = (
        [_call(look, burr(significance=sure, across_mm=across)) for look in (0, 1)]
        for sure, across in ((20.0, 0.0), (8.0, 1.55), (8.0, -1.65))
    )
    places = _joined([*clear, *other, *apart], 0.9, 0.9)
    assert len(places) == 3
    left = distinct(places, np.eye(4))
    assert len(left) == 2
    assert max(place.burr.significance for place in left) > 20.0
    assert all(any(place is one for one in places) for place in left)


def test_what_is_not_called_takes_no_base() -> None:
    """Two suspicions beside each other stay what they are."""
    faint = [_call(0, burr(significance=4.5, across_mm=across), 70.0) for across in (0.0, 0.7)]
    places = _joined(faint, *[0.9] * 5)
    assert len(places) == 2
    assert not any(place.certain for place in places)
    assert distinct(places, np.eye(4)) == places

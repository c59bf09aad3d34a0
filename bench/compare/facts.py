"""What happened on these very cases: burrs lost and gained by name, cases that went one way.

With the same scene, light and noise in both arms nothing but the change under test made the difference: each
of these is a fact, whatever may hold for other scenes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bench.compare.pairs import Pairing
from bench.compare.result import BurrChange, FoundOrMissed, Seen
from bench.run.records import Record
from burrscan.arrays import Floats
from burrscan.errors import InputError


def found_or_missed(pairing: Pairing) -> FoundOrMissed:
    """Every true burr of every pair. A failed case found none of its burrs.

    Where both arms failed nobody has counted the burrs, and there is nothing to compare.

    Raises
    ------
    InputError
        Where two records that both list true burrs of one scene list other numbers of them.

    """
    both, neither = 0, 0
    lost, gained = list[BurrChange](), list[BurrChange]()
    for base, new in zip(pairing.base, pairing.new, strict=True):
        if base.burrs and new.burrs and len(base.burrs) != len(new.burrs):
            raise InputError(
                f"{base.case}: records of one scene list {len(base.burrs)} and {len(new.burrs)} true burrs: "
                "one is damaged; remove its line from records.jsonl and run again with --resume"
            )
        for number in range(max(len(base.burrs), len(new.burrs))):
            before, after = (_found(record, number) for record in (base, new))
            both, neither = both + (before and after), neither + (not before and not after)
            if before != after:
                known = (new.burrs or base.burrs)[number]
                change = BurrChange(base.case, number + 1, _words(known))
                (lost if before else gained).append(change)
    return FoundOrMissed(both, tuple(lost), tuple(gained), neither)


def burrs_per_case(pairing: Pairing) -> tuple[Floats, Floats]:
    """Shares of true burrs found (N,) in both arms; NaN where a case has none, or nobody counted them."""
    shares = []
    for arm, other in ((pairing.base, pairing.new), (pairing.new, pairing.base)):
        counts = [max(len(a.burrs), len(b.burrs)) for a, b in zip(arm, other, strict=True)]
        found = [sum(_found(record, k) for k in range(n)) for record, n in zip(arm, counts, strict=True)]
        shares.append(np.array([f / n if n else np.nan for f, n in zip(found, counts, strict=True)], float))
    return shares[0], shares[1]


def went(differences: Floats, *, margin: float, higher: bool) -> tuple[int, int]:
    """How many pairs got worse, and better, by more than the margin.

    Parameters
    ----------
    differences
        (N,) new minus base; NaN where there is no value.
    margin
        In the metric's unit.
    higher
        Whether higher is better.

    """
    up, down = (int((sign * differences > margin).sum()) for sign in (1.0, -1.0))
    return (down, up) if higher else (up, down)


def every(pairing: Pairing, differences: Floats, *, margin: float, higher: bool) -> Seen:
    """Which way all pairs go by more than the margin, where both arms saw the same noise; or nothing."""
    known = int((~np.isnan(differences)).sum())
    worse, better = went(differences, margin=margin, higher=higher)
    if not pairing.same_noise or not known:
        return ""
    return "worse" if worse == known else "better" if better == known else ""


def _found(record: Record, number: int) -> bool:
    return record.failure is None and number < len(record.burrs) and bool(record.burrs[number]["found"])


def _words(burr: Mapping[str, Any]) -> str:
    kind = str(burr.get("kind", "")).replace("_", " ")
    height = f"{burr['height_mm']:.3g} mm high" if "height_mm" in burr else ""
    return ", ".join(word for word in (kind, height) if word)

"""Dotted paths, identities and random streams."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.suites.identity import content_hash, entropy, stream
from bench.suites.paths import flatten, merge, override
from burrscan.errors import InputError

KEYS = st.text("abc", min_size=1, max_size=3)
TABLES = st.recursive(
    st.integers() | st.text(max_size=3), lambda inner: st.dictionaries(KEYS, inner, max_size=3), max_leaves=8
).filter(lambda value: isinstance(value, dict))


def test_a_key_reaches_every_table_of_an_array_and_an_index_one() -> None:
    document = {"burr": [{"h": 1}, {"h": 2}]}
    assert override(document, "burr.h", 5) == {"burr": [{"h": 5}, {"h": 5}]}
    assert override(document, "burr.1.h", 5) == {"burr": [{"h": 1}, {"h": 5}]}
    assert override(document, "burr.0", {}) == {"burr": [{}, {"h": 2}]}


def test_the_document_given_is_not_changed() -> None:
    document = {"a": {"b": [1, 2]}}
    override(document, "a.b.0", 7)
    assert document == {"a": {"b": [1, 2]}}


@pytest.mark.parametrize("path", ["a.b.c", "list.3", "list.9.x"])
def test_a_path_that_leads_nowhere_is_refused_by_name(path: str) -> None:
    with pytest.raises(InputError, match=path):
        override({"a": {"b": 1}, "list": [{}]}, path, 0)


@given(TABLES)
def test_flattened_leaves_rebuild_their_tables(tables: dict[str, object]) -> None:
    rebuilt: dict[str, object] = {}
    for path, value in flatten(tables):
        rebuilt = override(rebuilt, path, value)
    assert dict(flatten(rebuilt)) == dict(flatten(tables))


@given(TABLES, TABLES)
def test_merging_keeps_the_upper_layer_and_what_it_does_not_touch(
    base: dict[str, object], over: dict[str, object]
) -> None:
    merged = merge(base, over)
    assert merge(merged, over) == merged
    assert set(merged) == set(base) | set(over)
    assert merge(base, {}) == base


def test_a_hash_depends_on_content_and_not_on_order() -> None:
    assert content_hash({"a": 1, "b": [1.5]}) == content_hash({"b": [1.5], "a": 1})
    assert content_hash({"a": 1}) != content_hash({"a": 2})


def test_streams_are_repeatable_and_differ_by_purpose_and_identity() -> None:
    one, other = content_hash("one"), content_hash("other")
    draws = [stream(i, p).random(4) for i, p in ((one, "a"), (one, "a"), (one, "b"), (other, "a"))]
    assert np.array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])
    assert not np.array_equal(draws[0], draws[3])


def test_entropy_holds_all_of_an_identity() -> None:
    identity = content_hash("x")
    assert "".join(f"{word:08x}" for word in entropy(identity)) == identity

"""What fuzzing draws, and what it asks of every call: odd numbers, other types, one line for each refusal."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

import graspatlas as ga

NAN, INF = float("nan"), float("inf")
ODD_NUMBERS = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    NAN,
    INF,
    -INF,
    5e-324,
    1e-300,
    1e-12,
    1e12,
    1e300,
    sys.float_info.max,
    2**70,
    10**400,
]
odd_numbers = st.sampled_from(ODD_NUMBERS) | st.floats() | st.integers(-3, 12)
no_numbers = st.sampled_from(
    [
        None,
        True,
        False,
        "",
        "a",
        "1",
        "nan",
        b"1",
        1j,
        [],
        {},
        (),
        [None],
        ["a"],
        [[1.0], [1.0, 2.0]],
        object(),
        int,
        np.nan,
    ]
)
anything = no_numbers | odd_numbers | st.lists(odd_numbers, max_size=4) | st.text(max_size=4)
vectors = st.tuples(odd_numbers, odd_numbers, odd_numbers) | st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def tried(call: Callable[[], Any], *also: type[Exception]) -> Any:
    """What a call gives, or None when it is refused in one line that is short enough to read."""
    try:
        return call()
    except ga.GraspAtlasError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 700, message
        return None
    except also:
        return None


def few(examples: int) -> Any:
    return settings(max_examples=examples)


def check_answer(result: ga.Result | None) -> None:
    """What is accepted has a right answer: charts, index, best, and a claim of being global that holds."""
    if result is None:
        return
    failed = {check.claim for check in result.check().checks if not check.passed}
    if not result.is_global:  # then it does not say that nothing is missing
        failed = {claim for claim in failed if "vertices closed" not in claim and "without the atlas" not in claim}
    assert not failed
    json.dumps(result.summary(), allow_nan=False)


def damaged(content: bytes, data: Any) -> bytes:
    """Bytes with a piece cut out, doubled, or replaced by others."""
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(len(content), start + 80)))
    piece = data.draw(
        st.sampled_from([b"", content[start:end] * 2, b"<", b'"', b"nan", b"1e999", b"-", b"0 0 0", b"\xff"])
    )
    return content[:start] + piece + content[end:]


json_values = (
    st.none() | st.booleans() | odd_numbers | st.text(max_size=3) | st.lists(odd_numbers, max_size=4) | st.just({})
)


def change_leaf(tree: Any, data: Any) -> None:
    """Replace one value somewhere in a tree of dicts and lists, or drop it."""
    while True:
        keys = list(tree) if isinstance(tree, dict) else list(range(len(tree)))
        key = data.draw(st.sampled_from(keys))
        if isinstance(tree[key], dict | list) and tree[key] and data.draw(st.booleans()):
            tree = tree[key]
            continue
        if data.draw(st.integers(0, 4)) == 0:
            del tree[key]
        else:
            tree[key] = data.draw(json_values)
        return

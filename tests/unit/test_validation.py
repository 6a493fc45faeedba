"""Each check returns plain values and says which argument, what was expected and what came."""

import numpy as np
import pytest

from sdpd import validation


def test_checks_return_plain_values():
    assert validation.positive("x", np.float32(2.0)) == 2.0
    assert type(validation.positive("x", np.int64(2))) is float
    assert type(validation.finite("x", np.array(1.5))) is float
    assert type(validation.integer("n", np.int32(3))) is int
    assert validation.boolean("b", np.True_) is True
    assert validation.vector("v", np.array([1, 2.0])) == (1.0, 2.0)
    assert validation.optional_positive("x", None) is None
    assert validation.optional_non_negative("x", 0) == 0.0
    assert str(validation.non_negative("x", -0.0)) == "0.0"
    assert validation.fraction("x", 0.0, 0.0, 1.0) == 0.0


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (
            lambda: validation.positive("dt", -0.1),
            ValueError,
            "`dt` must be finite and > 0, got -0.1",
        ),
        (lambda: validation.positive("dt", 0), ValueError, "`dt` must be finite and > 0, got 0"),
        (
            lambda: validation.positive("dt", float("nan")),
            ValueError,
            "`dt` must be finite and > 0, got nan",
        ),
        (
            lambda: validation.positive("dt", "1"),
            TypeError,
            "`dt` must be a number (finite and > 0), got '1' of type str",
        ),
        (
            lambda: validation.positive("dt", True),
            TypeError,
            "`dt` must be a number (finite and > 0), got True of type bool",
        ),
        (
            lambda: validation.positive("dt", np.ones(2)),
            TypeError,
            "`dt` must be a number (finite and > 0), got array([1., 1.]) of type ndarray",
        ),
        (lambda: validation.finite("x", np.inf), ValueError, "`x` must be finite, got inf"),
        (
            lambda: validation.non_negative("x", -1e-300),
            ValueError,
            "`x` must be finite and >= 0, got -1e-300",
        ),
        (
            lambda: validation.fraction("x", 1.0, 0.0, 1.0),
            ValueError,
            "`x` must be >= 0 and < 1, got 1",
        ),
        (
            lambda: validation.integer("n", 2.0),
            TypeError,
            "`n` must be an integer, got 2.0 of type float",
        ),
        (
            lambda: validation.integer("n", True, minimum=1),
            TypeError,
            "`n` must be an integer >= 1, got True of type bool",
        ),
        (
            lambda: validation.integer("n", 0, minimum=1),
            ValueError,
            "`n` must be an integer >= 1, got 0",
        ),
        (
            lambda: validation.boolean("b", 1),
            TypeError,
            "`b` must be True or False, got 1 of type int",
        ),
        (lambda: validation.text("s", 1), TypeError, "`s` must be a str, got 1 of type int"),
        (
            lambda: validation.choice("s", "luci", ("lucy", "b")),
            ValueError,
            "`s` must be one of 'lucy', 'b', got 'luci'; did you mean 'lucy'?",
        ),
        (
            lambda: validation.instance("s", 1, str, "a name"),
            TypeError,
            "`s` must be a name, got 1 of type int",
        ),
        (
            lambda: validation.vector("v", (1, 2), length=3),
            ValueError,
            "`v` must be a sequence of 3 numbers, got 2: (1, 2)",
        ),
        (
            lambda: validation.vector("v", 1.0),
            TypeError,
            "`v` must be a sequence of numbers, got 1.0 of type float",
        ),
        (lambda: validation.vector("v", (1, np.nan)), ValueError, "`v[1]` must be finite, got nan"),
        (
            lambda: validation.real_array("p", np.zeros((2, 2)), (2, 3)),
            ValueError,
            "`p` must be an array of shape (2, 3), got (2, 2)",
        ),
        (
            lambda: validation.real_array("p", np.zeros(2), (None, 3)),
            ValueError,
            "`p` must be an array of shape (any, 3), got (2,)",
        ),
        (
            lambda: validation.real_array("p", ["a"], (1,)),
            TypeError,
            "`p` must be an array of real numbers, got dtype <U1",
        ),
        (
            lambda: validation.real_array("p", [[0.0, np.inf]], (1, 2)),
            ValueError,
            "`p` must be finite, got inf at index (0, 1)",
        ),
    ],
)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text


def test_real_array_of_a_ragged_list_names_the_argument():
    with pytest.raises(ValueError, match=r"`p` must be an array of shape \(2, 2\)"):
        validation.real_array("p", [[1.0], [1.0, 2.0]], (2, 2))


def test_real_array_converts_integers():
    array = validation.real_array("p", [[1, 2]], (None, 2))
    assert array.dtype == np.float64
    assert array.flags.c_contiguous


def test_long_values_are_cut_in_messages():
    with pytest.raises(TypeError) as caught:
        validation.positive("dt", "x" * 500)
    assert len(str(caught.value)) < 160

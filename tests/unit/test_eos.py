"""Equations of state as data: parameters, values against their formulas, messages."""

import numpy as np
import pytest

import sdpd
from sdpd import eos, equations_of_state

RHO = np.array([900.0, 1000.0, 1100.0])
HERE = {"reference_density": 1000.0, "sound_speed": 2.0}


def test_core_takes_the_values_of_the_scene_unless_given():
    assert eos.ArtificialCompressibility().core(1000.0, 2.0) == (
        "artificial_compressibility",
        [1000.0, 2.0],
    )
    law = eos.Tait(exponent=7, background_pressure=3.0, reference_density=900.0, sound_speed=5.0)
    assert law.core(1000.0, 2.0) == ("tait", [900.0, 5.0, 7.0, 3.0])
    assert eos.Linear(background_pressure=-1.0).core(1.0, 2.0) == ("linear", [1.0, 2.0, -1.0])
    assert eos.IdealGas().core(1.0, 2.0) == ("ideal_gas", [2.0])
    assert eos.Polynomial(coefficients=[1, 2, 3]).core(1.0, 2.0) == ("polynomial", [1.0, 2.0, 3.0])
    table = eos.Table(densities=(1, 2), pressures=(0, 4))
    assert table.core(1.0, 2.0) == ("table", [1.0, 2.0, 0.0, 4.0])


@pytest.mark.parametrize(
    ("law", "pressure", "squared"),
    [
        (
            eos.ArtificialCompressibility(),
            lambda r: 2000.0 * ((r / 1e3) ** 2 - 1),
            lambda r: 4 * r / 1e3,
        ),
        (eos.Linear(background_pressure=7.0), lambda r: 7 + 4 * (r - 1e3), lambda r: 4 + 0 * r),
        (
            eos.Tait(exponent=7, background_pressure=7.0),
            lambda r: 4000 / 7 * ((r / 1e3) ** 7 - 1) + 7,
            lambda r: 4 * (r / 1e3) ** 6,
        ),
        (eos.IdealGas(), lambda r: 4 * r, lambda r: 4 + 0 * r),
        (
            eos.Polynomial(coefficients=(5.0, 1.0, 0.5)),
            lambda r: 5 + r + 0.5 * r**2,
            lambda r: 1 + r,
        ),
        (
            eos.Table(densities=(500.0, 1500.0), pressures=(0.0, 2000.0)),
            lambda r: 2 * (r - 500),
            lambda r: 2 + 0 * r,
        ),
    ],
)
def test_values(law, pressure, squared):
    p, c2, _ = law.evaluate(RHO, **HERE)
    np.testing.assert_allclose(p, pressure(RHO), rtol=1e-13, atol=1e-9)
    np.testing.assert_allclose(c2, squared(RHO), rtol=1e-13)
    np.testing.assert_array_equal(law.pressure(RHO, **HERE), p)


def test_ideal_gas_is_linear_with_the_full_background():
    a = eos.IdealGas().pressure(RHO, **HERE)
    b = eos.Linear(background_pressure=4000.0).pressure(RHO, **HERE)
    np.testing.assert_allclose(a, b, rtol=1e-14)


def test_specific_potential_is_the_integral_of_pressure_over_density_squared():
    for law in (
        eos.ArtificialCompressibility(),
        eos.Linear(background_pressure=9.0),
        eos.IdealGas(),
    ):
        step = 1e-3
        _, _, after = law.evaluate(RHO + step, **HERE)
        _, _, before = law.evaluate(RHO - step, **HERE)
        pressure = law.pressure(RHO, **HERE)
        np.testing.assert_allclose(
            (after - before) / (2 * step), pressure / RHO**2, rtol=1e-6, atol=1e-9
        )


@pytest.mark.parametrize(
    ("law", "accepted"),
    [
        (lambda: eos.Tait(exponent=1.0), False),
        (lambda: eos.Tait(exponent=1.01), True),
        (lambda: eos.Polynomial(coefficients=()), False),
        (lambda: eos.Polynomial(coefficients=(1.0,)), True),
        (lambda: eos.Table(densities=(1, 2, 3), pressures=(1, 1, 2)), True),
        (lambda: eos.Table(densities=(1, 2), pressures=(2, 1)), False),
    ],
)
def test_the_core_takes_what_is_accepted_here(law, accepted):
    if not accepted:
        with pytest.raises(ValueError):
            law()
        return
    for part in law().evaluate([1.5], reference_density=1.0, sound_speed=1.0):
        assert np.isfinite(part).all()


def test_laws_compare_hash_and_print():
    assert eos.Tait() == eos.Tait(exponent=7)
    assert hash(eos.Table(densities=[1, 2], pressures=[1, 2]))
    assert str(eos.IdealGas()) == "P = c^2 rho"
    assert "background_pressure = 2.0" in str(eos.Linear(background_pressure=2))
    assert sdpd.eos is equations_of_state


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (lambda: eos.Tait(exponent=1), ValueError, "`exponent` must be > 1, got 1"),
        (
            lambda: eos.Linear(background_pressure=np.nan),
            ValueError,
            "`background_pressure` must be finite, got nan",
        ),
        (
            lambda: eos.IdealGas(sound_speed=-1),
            ValueError,
            "`sound_speed` must be finite and > 0, got -1",
        ),
        (
            lambda: eos.IdealGas(reference_density="x"),
            TypeError,
            "`reference_density` must be a number (finite and > 0), got 'x' of type str",
        ),
        (
            lambda: eos.Polynomial(coefficients=[]),
            ValueError,
            "`coefficients` must have at least 1 entry (a_0, a_1, ...), got 0",
        ),
        (
            lambda: eos.Table(densities=[1.0], pressures=[1.0]),
            ValueError,
            "`densities` must have at least 2 entries, got 1",
        ),
        (
            lambda: eos.Table(densities=[1, 2], pressures=[1]),
            ValueError,
            "`pressures` must be a sequence of 2 numbers, got 1: [1]",
        ),
        (
            lambda: eos.Table(densities=[0, 2], pressures=[1, 2]),
            ValueError,
            "`densities` must be > 0, got 0 at index 0",
        ),
        (
            lambda: eos.Table(densities=[1, 1], pressures=[1, 2]),
            ValueError,
            "`densities` must increase, got 1 then 1 at index 1",
        ),
        (
            lambda: eos.Table(densities=[1, 2, 3], pressures=[1, 2, 0]),
            ValueError,
            "`pressures` must not decrease, got 2 then 0 at index 2",
        ),
        (
            lambda: eos.IdealGas(reference_density=5.0),
            ValueError,
            (
                "`reference_density` must be None for IdealGas, P = c^2 rho, which does not "
                "depend on it, got 5"
            ),
        ),
        (
            lambda: eos.Polynomial(coefficients=(0, 1), sound_speed=5.0),
            ValueError,
            (
                "`sound_speed` must be None for Polynomial, P = sum_k a_k rho^k, which does not "
                "depend on it, got 5"
            ),
        ),
        (
            lambda: eos.Table(densities=(1, 2), pressures=(1, 2), reference_density=7.0),
            ValueError,
            (
                "`reference_density` must be None for Table, P(rho) interpolated in a table, which "
                "does not depend on it, got 7"
            ),
        ),
        (
            lambda: eos.IdealGas().evaluate([0.0], reference_density=1, sound_speed=1),
            ValueError,
            "`density` must be finite and > 0",
        ),
        (
            lambda: eos.IdealGas().core(1.0, -1.0),
            ValueError,
            "`sound_speed` must be finite and > 0, got -1",
        ),
    ],
)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text

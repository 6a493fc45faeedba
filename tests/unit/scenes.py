"""Scenes that several test files build on."""

import sdpd


def water_scene(**changes):
    arguments = {
        "fluid": sdpd.fluids.water(),
        "box": sdpd.Box((1e-8, 1e-8, 1e-8)),
        "resolution": sdpd.Resolution(particles=3375, kernel="lucy", support=2.64),
        **changes,
    }
    return sdpd.Scene(**arguments)


def reduced_scene(dimension=3, eta=20.0, **changes):
    """m = dx = k_B T = 1."""
    fluid = changes.pop("fluid", None) or sdpd.Fluid(
        density=1.0, shear_viscosity=eta, temperature=1.0, boltzmann_constant=1.0
    )
    arguments = {
        "fluid": fluid,
        "box": sdpd.Box((12.0,) * dimension),
        "resolution": sdpd.Resolution(spacing=1.0),
        **changes,
    }
    return sdpd.Scene(**arguments)

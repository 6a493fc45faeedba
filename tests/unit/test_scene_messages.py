"""Every way a scene refuses its arguments: the class of the error and its text."""

import math

import pytest

import sdpd

from .scenes import reduced_scene, water_scene

MESSAGES = [
    (
        lambda: sdpd.Box((1.0,)),
        ValueError,
        "`lengths` must have 2 or 3 entries, got 1",
    ),
    (
        lambda: sdpd.Box((1.0, 0.0)),
        ValueError,
        "`lengths[1]` must be finite and > 0, got 0",
    ),
    (
        lambda: reduced_scene(box=sdpd.Box((8.0, 8.0, 8.0), periodic="xy")),
        ValueError,
        (
            "`walls` must close the box along z, which is not periodic, got fluid at "
            "(0.16666666666666666, 0.16666666666666666, 0.0); add a wall (see sdpd.walls.slab and "
            "enclosure) or make the axis periodic"
        ),
    ),
    (
        lambda: sdpd.Box((1.0, 1.0), periodic="xyz"),
        ValueError,
        "`periodic` must name axes among 'xy', each once, got 'xyz'",
    ),
    (
        lambda: sdpd.Resolution(),
        ValueError,
        "exactly one of `spacing` and `particles` must be given, got neither",
    ),
    (
        lambda: sdpd.Resolution(spacing=1.0, particles=2),
        ValueError,
        "exactly one of `spacing` and `particles` must be given, got both",
    ),
    (
        lambda: sdpd.Resolution(particles=0),
        ValueError,
        "`particles` must be an integer >= 1, got 0",
    ),
    (
        lambda: sdpd.Resolution(particles=(3, 0)),
        ValueError,
        "`particles[1]` must be an integer >= 1, got 0",
    ),
    (
        lambda: sdpd.Resolution(spacing=-1.0),
        ValueError,
        "`spacing` must be finite and > 0, got -1",
    ),
    (
        lambda: sdpd.Resolution(spacing=1.0, support=1.0),
        ValueError,
        (
            "`support` must be > 1 (in units of the spacing: particles further apart than h do not "
            "interact), got 1"
        ),
    ),
    (
        lambda: sdpd.Resolution(spacing=1.0, kernel="gauss"),
        ValueError,
        (
            "`kernel` must be one of 'lucy', 'quintic_spline', 'wendland_c2', 'wendland_c4', "
            "got 'gauss'"
        ),
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=1000, support=6.0)),
        ValueError,
        (
            "`box.lengths` must be >= two supports, 2h = 1.2e-08, on every periodic axis, "
            "got 1e-08 along "
            "x (h = 6 x spacing 1e-09); enlarge the box, or lower the spacing or the support"
        ),
    ),
    (
        lambda: water_scene(
            box=sdpd.Box((4e-9, 1e-9, 4e-9)), resolution=sdpd.Resolution(particles=(16, 4, 16))
        ),
        ValueError,
        (
            "`box.lengths` must be >= two supports, 2h = 1.5e-09, on every periodic axis, "
            "got 1e-09 along "
            "y (h = 3 x spacing 2.5e-10); enlarge the box, or lower the spacing or the support"
        ),
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=3000)),
        ValueError,
        (
            "`particles` must fill a lattice of about equal spacing in the box, got 3000; "
            "2744 = 14 x 14 "
            "x 14 would fit, or use start=sdpd.RandomStart(), which takes any number"
        ),
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=(10, 10))),
        ValueError,
        "`particles` must have one count per axis of the box (3), got 2: (10, 10)",
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(particles=(10, 10, 20))),
        ValueError,
        (
            "`particles` must give spacings within 10% of each other, got 1e-09 along x, "
            "1e-09 along y, "
            "5e-10 along z"
        ),
    ),
    (
        lambda: water_scene(resolution=sdpd.Resolution(spacing=7e-10)),
        ValueError,
        (
            "`spacing` must divide every length of the box for a lattice, got 7e-10 with "
            "length 1e-08 "
            "along x (ratio 14.2857); particles=(14, 14, 14) is the nearest lattice, or use "
            "start=sdpd.RandomStart()"
        ),
    ),
    (
        lambda: sdpd.LatticeStart(jitter=0.7),
        ValueError,
        "`jitter` must be >= 0 and <= 0.5 (of the spacing), got 0.7",
    ),
    (
        lambda: sdpd.LatticeStart(velocities="hot"),
        ValueError,
        "`velocities` must be one of 'auto', 'thermal', 'zero', got 'hot'",
    ),
    (
        lambda: sdpd.RandomStart(relax=1),
        TypeError,
        "`relax` must be True or False, got 1 of type int",
    ),
    (
        lambda: sdpd.Effects(fluctuations="on"),
        TypeError,
        "`effects.fluctuations` must be True or False, got 'on' of type str",
    ),
    (
        lambda: reduced_scene(effects=sdpd.Effects(dissipation=False, fluctuations=True)),
        ValueError,
        "`effects.fluctuations` must be False without dissipation: the noise balances the friction",
    ),
    (
        lambda: reduced_scene(eta=0.0, effects=sdpd.Effects(dissipation=True)),
        ValueError,
        "`effects.dissipation` must be False as the fluid has no viscosity",
    ),
    (
        lambda: reduced_scene(effects=sdpd.Effects(bulk_viscosity=True)),
        ValueError,
        "`effects.bulk_viscosity` must be False as `fluid.bulk_viscosity` is 0",
    ),
    (
        lambda: reduced_scene(effects=sdpd.Effects(body_force=True)),
        ValueError,
        "`effects.body_force` must be False as the scene has no body force",
    ),
    (
        lambda: reduced_scene(
            eta=3.0, effects=sdpd.Effects(central_friction=True, bulk_viscosity=False)
        ),
        ValueError,
        (
            "`effects.bulk_viscosity` must not be False with central_friction, which implies "
            "a bulk "
            "viscosity eta (1 + 2/D) = 5"
        ),
    ),
    (
        lambda: reduced_scene(
            fluid=reduced_scene(eta=3.0).fluid.replace(bulk_viscosity=1.0),
            effects=sdpd.Effects(central_friction=True),
        ),
        ValueError,
        (
            "`fluid.bulk_viscosity` must be 0 or eta (1 + 2/D) = 5 with central_friction, "
            "which fixes it, "
            "got 1"
        ),
    ),
    (
        lambda: reduced_scene(fluid=reduced_scene(eta=3.0).fluid.replace(bulk_viscosity=6.0)),
        ValueError,
        (
            "`fluid.bulk_viscosity` must be <= eta (1 + 2/D) = 5 (so that a >= 0 and the "
            "noise exists), "
            "got 6; lower it or set effects=sdpd.Effects(bulk_viscosity=False)"
        ),
    ),
    (
        lambda: sdpd.UniformForce((1.0,)),
        ValueError,
        "`acceleration` must have 2 or 3 entries, got 1",
    ),
    (
        lambda: reduced_scene(body_force=sdpd.UniformForce((1.0, 0.0))),
        ValueError,
        "`acceleration` must have 3 entries, as many as the box has axes, got 2",
    ),
    (
        lambda: reduced_scene(2, body_force=sdpd.SinusoidalForce(amplitude=1, along="z")),
        ValueError,
        "`along` must be an axis of the box ('xy'), got 'z'",
    ),
    (
        lambda: sdpd.SinusoidalForce(amplitude=1, wavenumber=0),
        ValueError,
        "`wavenumber` must be an integer >= 1, got 0",
    ),
    (
        lambda: reduced_scene(sound_speed=-1.0),
        ValueError,
        "`sound_speed` must be finite and > 0, got -1",
    ),
    (
        lambda: reduced_scene(velocity_scale=math.nan),
        ValueError,
        "`velocity_scale` must be finite and >= 0, got nan",
    ),
    (
        lambda: reduced_scene(length_scale=0.0),
        ValueError,
        "`length_scale` must be finite and > 0, got 0",
    ),
    (
        lambda: reduced_scene(calibrate=None),
        TypeError,
        "`calibrate` must be True or False, got None of type NoneType",
    ),
    (
        lambda: reduced_scene(
            sound_speed=2.0,
            fluid=reduced_scene().fluid.replace(
                equation_of_state=sdpd.eos.Polynomial(coefficients=(0.0, 1.0))
            ),
        ),
        ValueError,
        "`sound_speed` must be None as the equation of state has its own, got 2",
    ),
    (
        lambda: reduced_scene(
            fluid=reduced_scene().fluid.replace(
                equation_of_state=sdpd.eos.Polynomial(coefficients=(0.0, -1.0))
            )
        ),
        ValueError,
        "`fluid.equation_of_state` must have dP/drho > 0 at the density of the fluid 1, got -1",
    ),
    (
        lambda: reduced_scene(fluid="water"),
        TypeError,
        "`fluid` must be an sdpd.Fluid, e.g. sdpd.fluids.water(), got 'water' of type str",
    ),
    (
        lambda: reduced_scene(box=(1, 2, 3)),
        TypeError,
        "`box` must be an sdpd.Box, got (1, 2, 3) of type tuple",
    ),
    (
        lambda: reduced_scene(resolution=3),
        TypeError,
        "`resolution` must be an sdpd.Resolution, got 3 of type int",
    ),
    (
        lambda: reduced_scene(start="lattice"),
        TypeError,
        "`start` must be an sdpd.LatticeStart or sdpd.RandomStart, got 'lattice' of type str",
    ),
    (
        lambda: reduced_scene(effects={}),
        TypeError,
        "`effects` must be an sdpd.Effects or 'auto', got {} of type dict",
    ),
    (
        lambda: reduced_scene(body_force=(0, 0, 1)),
        TypeError,
        (
            "`body_force` must be an sdpd.UniformForce or sdpd.SinusoidalForce, got (0, 0, "
            "1) of type "
            "tuple"
        ),
    ),
]


@pytest.mark.parametrize(("call", "kind", "text"), MESSAGES)
def test_messages(call, kind, text):
    with pytest.raises(kind) as caught:
        call()
    assert str(caught.value) == text

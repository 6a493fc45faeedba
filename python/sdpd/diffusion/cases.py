"""The cases of Tables 7 and 8 of Yang (2013) and what formulas say about them.

Misprints of Table 7 are corrected: the support of cases 8 and 9 is 1.4e-7 and 1.9e-7 m (the printed
D_h follows from no other value). The time steps of the tables are not used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from sdpd import equations_of_state as eos
from sdpd import fluids, kernels, validation
from sdpd.box import Box
from sdpd.equations_of_state import EquationOfState
from sdpd.fluids import Fluid
from sdpd.initial import RandomStart
from sdpd.resolution import Resolution
from sdpd.scene import Scene

__all__ = [
    "DEFAULT_CASES",
    "EQUATIONS_OF_STATE",
    "EXPERIMENTAL_WATER",
    "NITROGEN",
    "TABLES",
    "WATER",
    "Case",
    "Formulas",
    "formulas",
    "get_cases",
]

# Self-diffusion of liquid water at 300 K as the dissertation quotes it, after Holz et al. (2000).
EXPERIMENTAL_WATER = 2.5e-9  # m^2/s
# The dissertation's coefficient of rho h^2 k_B T/(m eta), Y 3.8; 3/70 is right for Lucy in 3D.
DISSERTATION_FACTOR = 1.0 / 63.0


@dataclass(frozen=True)
class Case:
    """A periodic cube of fluid cut into particles.

    Attributes
    ----------
    number : int
        Number in its table.
    fluid : {"water", "nitrogen"}
    edge : float
        L [m].
    particles : int
        N.
    support_radius : float
        h, the full support radius [m].
    published_density, published_speed : float
        Mean density [kg/m^3] and rms thermal speed (of D components) [m/s] the dissertation found.
    published_mass_ratio, published_size_ratio : float
        Mass over that of a molecule and size over that of a molecule as printed [1].
    published_bird, published_support : float or None
        D_bird and D_h as printed (Y 3.7, 3.8) [m^2/s].
    """

    number: int
    fluid: str
    edge: float
    particles: int
    support_radius: float
    published_density: float
    published_speed: float
    published_mass_ratio: float
    published_size_ratio: float
    published_bird: float | None = None
    published_support: float | None = None

    @property
    def name(self) -> str:
        """For messages and file names."""
        return f"{self.fluid} case {self.number}"

    @property
    def spacing(self) -> float:
        """dx = (V/N)^(1/3) [m]."""
        return float(self.edge / self.particles ** (1.0 / 3.0))

    def resized(self, particles: int) -> Case:
        """The same fluid of particles in a smaller or larger box."""
        number = validation.integer("particles", particles, minimum=2)
        edge = self.spacing * number ** (1.0 / 3.0)
        return replace(self, edge=edge, particles=number)

    def scene(
        self,
        *,
        kernel: str = "lucy",
        equation_of_state: str | None = None,
        sound_ratio: float = 10.0,
    ) -> Scene:
        """The scene of the case.

        Parameters
        ----------
        kernel : str
            Key of the kernel; the dissertation's is Lucy's.
        equation_of_state : str, optional
            Key of `EQUATIONS_OF_STATE`; that of the fluid if None (the dissertation's choice).
        sound_ratio : float
            c/v_th, so that X = m c^2/(k_B T) is its square.

        Returns
        -------
        Scene
            Starting from relaxed random positions.
        """
        ratio = validation.positive("sound_ratio", sound_ratio)
        fluid = _fluid(self.fluid)
        if equation_of_state is not None:
            name = validation.choice(
                "equation_of_state", equation_of_state, list(EQUATIONS_OF_STATE)
            )
            fluid = fluid.replace(equation_of_state=EQUATIONS_OF_STATE[name])
        mass = fluid.density * self.edge**3 / self.particles
        return Scene(
            fluid=fluid,
            box=Box((self.edge,) * 3),
            resolution=Resolution(
                particles=self.particles,
                support=self.support_radius / self.spacing,
                kernel=kernel,
            ),
            start=RandomStart(),
            sound_speed=ratio * math.sqrt(fluid.thermal_energy / mass),
        )


EQUATIONS_OF_STATE: dict[str, EquationOfState] = {
    "artificial_compressibility": eos.ArtificialCompressibility(),
    "ideal_gas": eos.IdealGas(),
    "linear": eos.Linear(),
    "tait": eos.Tait(),
}


def _fluid(name: str) -> Fluid:
    if name == "water":
        return fluids.water(temperature=300.0)
    return fluids.nitrogen(temperature=300.0).replace(shear_viscosity=1e-5)  # Table 8


def _table(fluid: str, rows: list[tuple[float, ...]]) -> dict[int, Case]:
    cases = (
        Case(
            number=int(row[0]),
            fluid=fluid,
            edge=row[1],
            particles=int(row[2]),
            support_radius=row[3],
            published_density=row[4],
            published_speed=row[5],
            published_mass_ratio=row[6],
            published_size_ratio=row[7],
            published_bird=row[8] if len(row) > 8 else None,
            published_support=row[9] if len(row) > 9 else None,
        )
        for row in rows
    )
    return {case.number: case for case in cases}


# case, L [m], N, h [m], mean density [kg/m^3], rms speed [m/s], m/m_mol, dx/2R, D_bird, D_h [m^2/s]
WATER = _table(
    "water",
    [
        (1, 5e-9, 3375, 1e-9, 1050, 576, 1.24, 1.08, 1.98e-9, 1.86e-9),
        (2, 8e-9, 3375, 1.4e-9, 1040, 288, 5.07, 1.72, 1.24e-9, 8.83e-10),
        (3, 1e-8, 3375, 1.9e-9, 1050, 202, 9.91, 2.15, 9.88e-10, 7.55e-10),
        (4, 5e-8, 3375, 1e-8, 1020, 17.9, 1240, 10.8, 1.98e-10, 1.81e-10),
        (5, 1e-7, 3375, 1.9e-8, 1050, 6.5, 9910, 21.5, 9.88e-11, 8.41e-11),
        (6, 1e-6, 27000, 1e-7, 1015, 0.578, 1.24e6, 108, 1.98e-11, 1.80e-11),
        (7, 1e-6, 15625, 1.1e-7, 1015, 0.44, 2.14e6, 129, 1.65e-11, 1.26e-11),
        (8, 1e-6, 8000, 1.4e-7, 1039, 0.314, 4.18e6, 161, 1.32e-11, 1.07e-11),
        (9, 1e-6, 3375, 1.9e-7, 1034, 0.204, 9.91e6, 215, 9.88e-12, 8.28e-12),
        (10, 1e-6, 1000, 3e-7, 1055, 0.11, 3.34e7, 323, 6.59e-12, 6.24e-12),
    ],
)
NITROGEN = _table(
    "nitrogen",
    [
        (1, 1e-6, 3375, 2e-7, 1.21, 6.2, 6371, 222.22),
        (2, 1e-6, 1000, 3e-7, 1.20, 3.36, 21505, 333.33),
        (3, 1e-5, 3375, 1.9e-6, 1.22, 0.201, 6.37e6, 2222.22),
    ],
)
TABLES = {"water": WATER, "nitrogen": NITROGEN}
DEFAULT_CASES = {"water": (1, 3, 5, 9, 10), "nitrogen": (1, 2, 3)}


def get_cases(fluid: str = "water", numbers: tuple[int, ...] | None = None) -> list[Case]:
    """Cases of Table 7 (water) or 8 (nitrogen), in the order of their numbers.

    Parameters
    ----------
    fluid : {"water", "nitrogen"}
    numbers : sequence of int, optional
        Cases wanted; 1, 3, 5, 9 and 10 of water, all of nitrogen, if None.

    Raises
    ------
    ValueError
        If there is no such case.
    """
    table = TABLES[validation.choice("fluid", fluid, list(TABLES))]
    wanted = DEFAULT_CASES[fluid] if numbers is None else tuple(numbers)
    if not wanted:
        raise ValueError("`cases` must name at least one case")
    for number in wanted:
        if number not in table:
            listed = ", ".join(map(str, table))
            raise ValueError(f"`cases` must be among {listed} for {fluid}, got {number}")
    return [table[number] for number in sorted(set(wanted))]


@dataclass(frozen=True)
class Formulas:
    """What formulas say about the self-diffusion of a case [length^2/time].

    Attributes
    ----------
    size_ratio : float
        dx over the size of a molecule (Y 3.4 for the liquid, the diameter for the gas) [1].
    continuum : float
        K h^2 rho k_B T/(m eta): short times, infinitely many neighbours.
    factor : float
        K [1]; 3/70 for Lucy in 3D at zero bulk viscosity.
    bird : float
        k_B T/(2 pi eta dx), Y 3.7: the estimate of Bird et al. for a liquid of such molecules.
    dissertation : float
        rho h^2 k_B T/(63 m eta), Y 3.8, whatever the kernel.
    molecular : float or None
        Y 3.6, the same as `bird` for the molecules of the liquid.
    """

    size_ratio: float
    continuum: float
    factor: float
    bird: float
    dissertation: float
    molecular: float | None


def formulas(scene: Scene) -> Formulas:
    """Evaluate the formulas at the mean density of the fluid.

    Raises
    ------
    ValueError
        If the fluid does not say how large its molecules are.
    """
    fluid, h = scene.fluid, scene.support_radius
    size = fluid.molecular_diameter
    if size is None:
        raise ValueError("`scene.fluid.molecular_diameter` must be given, got None")
    kt, eta = scene.thermal_energy, fluid.shear_viscosity
    unit = fluid.density * h**2 * kt / (scene.particle_mass * eta)
    liquid = fluid.mean_free_path is None
    return Formulas(
        size_ratio=scene.spacing / size,
        continuum=scene.self_diffusion_continuum,
        factor=kernels.get(scene.resolution.kernel).self_diffusion_factor(scene.dimension),
        bird=kt / (2.0 * math.pi * eta * scene.spacing),
        dissertation=DISSERTATION_FACTOR * unit,
        molecular=kt / (2.0 * math.pi * eta * size) if liquid else None,
    )

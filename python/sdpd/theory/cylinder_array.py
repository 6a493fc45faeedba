r"""Steady flow through a square array of cylinders: drag at small Reynolds numbers, and the flow.

One cylinder of radius R in a periodic cell of edge L, fluid driven across it by a uniform
acceleration. The drag is the series of Sangani and Acrivos (1982); the flow is the solution of the
incompressible Navier-Stokes equations by spectral elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from sdpd import validation

__all__ = ["CylinderArrayFlow", "cylinder_array_drag", "cylinder_array_flow"]

Array = NDArray[np.float64]
_ORDER = 6  # of the velocity in an element; the pressure has one less, which is stable


def cylinder_array_drag(volume_fraction: float) -> float:
    r"""Drag on a cylinder of a dilute square array in Stokes flow, F/(eta U), per unit length.

    Parameters
    ----------
    volume_fraction : float
        :math:`c = \pi R^2/L^2`, ``0 < c <= 0.2``.

    Returns
    -------
    float
        F/(eta U), with U the superficial velocity, the mean over the whole cell, and
        :math:`F = \rho f L^2`. Where the acceleration f acts on the fluid alone, as on particles,
        :math:`\rho f (L^2 - \pi R^2)` of it is the force on the wall; the rest is the buoyancy
        in the pressure gradient that f stands for.

    Raises
    ------
    TypeError, ValueError
        If the fraction is out of range.

    Notes
    -----
    .. math:: \frac{F}{\eta U} = \frac{4\pi}{-\frac12\ln c - 0.738 + c - 0.887 c^2 + 2.038 c^3}

    The true drag is larger: by 0.1 % at c = 0.1, 0.2 % at 0.126 and 1.5 % at 0.2, where the
    terms left out tell (from `cylinder_array_flow`).

    References
    ----------
    .. [1] A. S. Sangani and A. Acrivos, Int. J. Multiphase Flow 8 (1982) 193, eq. 53.

    Examples
    --------
    >>> from sdpd.theory import cylinder_array_drag
    >>> round(cylinder_array_drag(0.1), 2)
    24.81
    """
    c = validation.positive("volume_fraction", volume_fraction)
    if c > 0.2:
        raise ValueError(f"`volume_fraction` must be <= 0.2, got {c:g}")
    series = -0.5 * np.log(c) - 0.738 + c - 0.887 * c**2 + 2.038 * c**3
    return float(4.0 * np.pi / series)


def _lagrange(nodes: Array, x: Array) -> tuple[Array, Array]:
    """Lagrange polynomials of `nodes` and their derivatives at x, (..., len(nodes)) each."""
    gaps = nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    values, slopes = [], []
    for i in range(len(nodes)):
        others = np.delete(np.arange(len(nodes)), i)
        factors = (x[..., None] - nodes[others]) / gaps[i, others]
        values.append(factors.prod(axis=-1))
        slopes.append(
            sum(
                np.delete(factors, k, axis=-1).prod(axis=-1) / gaps[i, j]
                for k, j in enumerate(others)
            )
        )
    return np.stack(values, axis=-1), np.stack(np.broadcast_arrays(*slopes), axis=-1)


def _lobatto(order: int) -> Array:
    """Gauss-Lobatto points on [0, 1]."""
    inner = np.polynomial.legendre.Legendre.basis(order).deriv().roots()
    return 0.5 * (1.0 + np.concatenate([[-1.0], np.sort(inner.real), [1.0]]))


class _Mesh:
    """Elements between the circle r = R (s = 0) and the square (s = 1), lengths in units of L.

    x(s, theta) is linear in s. In each quarter of the turn the map is analytic, so elements that
    end at the corners of the square converge exponentially with their order.
    """

    def __init__(self, radius: float, elements: int) -> None:
        self.radius, self.radial, self.turns = radius, elements, 4 * elements
        self.nodes = {p: _lobatto(p) for p in (_ORDER, _ORDER - 1)}
        points, weights = np.polynomial.legendre.leggauss(_ORDER + 3)
        self.gauss, self.weights = 0.5 * (1.0 + points), 0.5 * weights

    def place(self, s: Array, theta: Array) -> tuple[Array, Array, Array]:
        """Positions and their derivatives by s and theta, (..., 2) each."""
        # the quarter; at its ends either neighbour gives the same place
        turn = np.rint(theta / (0.5 * np.pi)) * (0.5 * np.pi)
        phi = theta - turn
        circle = self.radius * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        along = self.radius * np.stack([-np.sin(phi), np.cos(phi)], axis=-1)
        square = 0.5 * np.stack([np.ones_like(phi), np.tan(phi)], axis=-1)
        slope = 0.5 * np.stack([np.zeros_like(phi), 1.0 / np.cos(phi) ** 2], axis=-1)
        s = s[..., None]
        parts = (circle + s * (square - circle), square - circle, along + s * (slope - along))
        cos, sin = np.cos(turn)[..., None], np.sin(turn)[..., None]
        turned = (
            np.concatenate(
                [cos * v[..., :1] - sin * v[..., 1:], sin * v[..., :1] + cos * v[..., 1:]], -1
            )
            for v in parts
        )
        x, by_s, by_theta = turned
        return x, by_s, by_theta

    def coordinates(self, ds: Array, dtheta: Array) -> tuple[Array, Array]:
        """s and theta of local points, (elements, points); element = ring x turns + sector."""
        ring, sector = np.divmod(np.arange(self.radial * self.turns), self.turns)
        step = 2.0 * np.pi / self.turns
        s = (ring[:, None] + ds) / self.radial
        return s, (sector[:, None] + dtheta) * step - 0.25 * np.pi

    def numbers(self, order: int) -> tuple[NDArray[np.int64], int, NDArray[np.bool_]]:
        """Unknowns of each element, their number, and which of them lie on the circle."""
        nodes = self.nodes[order]
        ds, dtheta = (grid.ravel() for grid in np.meshgrid(nodes, nodes, indexing="ij"))
        x, _, _ = self.place(*self.coordinates(ds, dtheta))
        # periodic copies are one unknown: -0.5 becomes 0.5, whatever rounding made of it
        folded = np.rint((x - np.floor(x + 0.5 - 1e-9)) * 1e8).astype(np.int64)
        unique, index = np.unique(folded.reshape(-1, 2), axis=0, return_inverse=True)
        on_circle = np.hypot(*(1e-8 * unique.T)) < self.radius + 1e-6
        return index.reshape(x.shape[:2]), len(unique), on_circle

    def locate(self, points: Array) -> tuple[NDArray[np.int64], Array, Array]:
        """Element and local coordinates of points (P, 2) around the centre of a cylinder."""
        x = points - np.rint(points)
        theta = np.arctan2(x[:, 1], x[:, 0])
        phi = theta - np.rint(theta / (0.5 * np.pi)) * (0.5 * np.pi)
        s = (np.hypot(*x.T) - self.radius) / (0.5 / np.cos(phi) - self.radius)
        around = (theta + 0.25 * np.pi) % (2.0 * np.pi) / (2.0 * np.pi) * self.turns
        sector = np.minimum(around.astype(np.int64), self.turns - 1)
        ring = np.clip((s * self.radial).astype(np.int64), 0, self.radial - 1)
        return ring * self.turns + sector, s * self.radial - ring, around - sector


def _tensor(mesh: _Mesh, order: int, ds: Array, dtheta: Array) -> tuple[Array, Array, Array]:
    """Shape functions at local points and derivatives by ds and dtheta, (points, functions)."""
    a, da = _lagrange(mesh.nodes[order], ds)
    b, db = _lagrange(mesh.nodes[order], dtheta)
    return tuple(
        (left[:, :, None] * right[:, None, :]).reshape(len(ds), -1)
        for left, right in ((a, b), (da, b), (a, db))
    )  # type: ignore[return-value]


class _Solver:
    """Navier-Stokes in units of L and nu: the acceleration along x is G = f L^3/nu^2."""

    def __init__(self, mesh: _Mesh) -> None:
        self.mesh = mesh
        ds, dtheta = (g.ravel() for g in np.meshgrid(mesh.gauss, mesh.gauss, indexing="ij"))
        weights = np.outer(mesh.weights, mesh.weights).ravel()
        _, by_s, by_theta = mesh.place(*mesh.coordinates(ds, dtheta))
        by_s, by_theta = by_s / mesh.radial, by_theta * (2.0 * np.pi / mesh.turns)
        det = by_s[..., 0] * by_theta[..., 1] - by_s[..., 1] * by_theta[..., 0]
        self.volume = det * weights
        self.shape, shape_s, shape_t = _tensor(mesh, _ORDER, ds, dtheta)
        self.pressure_shape, _, _ = _tensor(mesh, _ORDER - 1, ds, dtheta)
        inverse = np.stack([by_theta[..., 1], -by_s[..., 1], -by_theta[..., 0], by_s[..., 0]], -1)
        inverse /= det[..., None]
        self.gradient = np.stack(
            [
                inverse[..., 0:1] * shape_s + inverse[..., 1:2] * shape_t,
                inverse[..., 2:3] * shape_s + inverse[..., 3:4] * shape_t,
            ]
        )  # (2, elements, points, functions)
        self.index, self.n, on_circle = mesh.numbers(_ORDER)
        self.pressure_index, self.n_pressure, _ = mesh.numbers(_ORDER - 1)
        held = np.concatenate([on_circle, on_circle, np.arange(self.n_pressure) == 0])
        self.free = np.flatnonzero(~held)
        self._linear()

    def _matrix(self, local: Array, rows: Any, columns: Any, shape: tuple[int, int]) -> Any:
        i = np.broadcast_to(rows[:, :, None], local.shape)
        j = np.broadcast_to(columns[:, None, :], local.shape)
        return sparse.coo_matrix((local.ravel(), (i.ravel(), j.ravel())), shape).tocsr()

    def _square(self, local: Array) -> Any:
        return self._matrix(local, self.index, self.index, (self.n, self.n))

    def _linear(self) -> None:
        w, g = self.volume, self.gradient
        viscous = self._square(np.einsum("eq,aeqi,aeqj->eij", w, g, g, optimize=True))
        shape = (self.n_pressure, self.n)
        parts = np.einsum("eq,qk,aeqj->aekj", w, self.pressure_shape, g, optimize=True)
        across = [self._matrix(-part, self.pressure_index, self.index, shape) for part in parts]
        self.stokes = sparse.bmat(
            [[viscous, None, across[0].T], [None, viscous, across[1].T], [*across, None]]
        ).tocsr()
        local = np.einsum("eq,qi->ei", w, self.shape)
        self.lumped = np.bincount(self.index.ravel(), local.ravel(), self.n)

    def _inertia(self, state: Array) -> tuple[Any, Array]:
        """Derivative and value of (u grad) u tested with each shape function."""
        nodal = np.stack([state[: self.n], state[self.n : 2 * self.n]])[:, self.index]
        u = np.einsum("qi,aei->aeq", self.shape, nodal)
        du = np.einsum("beqi,aei->abeq", self.gradient, nodal, optimize=True)
        carried = np.einsum("beq,beqj->eqj", u, self.gradient)
        along = np.einsum("eq,qi,eqj->eij", self.volume, self.shape, carried, optimize=True)
        turned = np.einsum(
            "eq,qi,qj,abeq->abeij", self.volume, self.shape, self.shape, du, optimize=True
        )
        blocks = [[self._square(turned[a, b] + (a == b) * along) for b in (0, 1)] for a in (0, 1)]
        derivative = sparse.block_diag(
            [sparse.bmat(blocks), sparse.csr_matrix((self.n_pressure,) * 2)]
        )
        local = np.einsum("eq,qi,beq,abeq->aei", self.volume, self.shape, u, du, optimize=True)
        value = [np.bincount(self.index.ravel(), part.ravel(), self.n) for part in local]
        return derivative.tocsr(), np.concatenate([*value, np.zeros(self.n_pressure)])

    def solve(self, acceleration: float) -> Array:
        """Velocities and pressure at all nodes, by Newton's method from Stokes flow."""
        load = np.zeros(2 * self.n + self.n_pressure)
        load[: self.n] = acceleration * self.lumped
        state, free = np.zeros_like(load), self.free
        size = np.inf
        for _ in range(30):
            derivative, inertia = self._inertia(state)
            residual = (load - self.stokes @ state - inertia)[free]
            step = splu((self.stokes + derivative)[free][:, free].tocsc()).solve(residual)
            state[free] += step
            size = float(np.abs(step[: 2 * self.n]).max())
            if size <= 1e-10 * np.abs(state).max():
                return state
        raise ArithmeticError(
            "no steady flow was found by Newton's method: the Reynolds number is too large"
        )


@dataclass(frozen=True, eq=False)
class CylinderArrayFlow:
    """Steady flow through a square array of cylinders; see `cylinder_array_flow`.

    Attributes
    ----------
    length, radius, acceleration, kinematic_viscosity, density : float
        As given.
    """

    length: float
    radius: float
    acceleration: float
    kinematic_viscosity: float
    density: float
    _solver: _Solver
    _state: Array

    def _evaluate(self, points: ArrayLike, pressure: bool) -> Array:
        where = np.asarray(points, dtype=np.float64)
        if where.shape[-1:] != (2,):
            raise ValueError(f"`points` must have shape (..., 2), got {where.shape}")
        solver, mesh = self._solver, self._solver.mesh
        element, ds, dtheta = mesh.locate(where.reshape(-1, 2) / self.length)
        inside = ds + element // mesh.turns < -1e-9
        if pressure:
            shape, _, _ = _tensor(mesh, _ORDER - 1, ds, dtheta)
            nodal = self._state[2 * solver.n :][solver.pressure_index[element]]
            values = np.einsum("pi,pi->p", shape, nodal) - self._mean_pressure
        else:
            shape, _, _ = _tensor(mesh, _ORDER, ds, dtheta)
            both = self._state[: 2 * solver.n].reshape(2, -1)[:, solver.index[element]]
            values = np.einsum("pi,api->pa", shape, both)
        values[inside] = np.nan
        return np.asarray(values.reshape(where.shape[:-1] + values.shape[1:]))

    @cached_property
    def _mean_pressure(self) -> float:
        solver = self._solver
        nodal = self._state[2 * solver.n :][solver.pressure_index]
        at = np.einsum("qi,ei->eq", solver.pressure_shape, nodal)
        return float((at * solver.volume).sum() / solver.volume.sum())

    def velocity(self, points: ArrayLike) -> Array:
        """Velocity at points relative to the centre of a cylinder.

        Parameters
        ----------
        points : array_like, shape (..., 2)
            Along and across the acceleration [length].

        Returns
        -------
        ndarray, shape (..., 2)
            [length/time]; NaN inside of a cylinder.
        """
        speed = self.kinematic_viscosity / self.length
        return self._evaluate(points, False) * speed

    def pressure(self, points: ArrayLike) -> Array:
        """Pressure at points relative to the centre of a cylinder; its mean over the fluid is 0.

        Parameters
        ----------
        points : array_like, shape (..., 2)
            Along and across the acceleration [length].

        Returns
        -------
        ndarray, shape (...)
            [energy/length^3]; NaN inside of a cylinder.
        """
        speed = self.kinematic_viscosity / self.length
        return self._evaluate(points, True) * self.density * speed**2

    @cached_property
    def mean_velocity(self) -> float:
        """Superficial velocity U: the mean of V_x over the whole cell, cylinder included."""
        total = float(self._solver.lumped @ self._state[: self._solver.n])
        return total * self.kinematic_viscosity / self.length

    @property
    def drag(self) -> float:
        """Force of the fluid on a cylinder per length, rho f (L^2 - pi R^2) [energy/length^2]."""
        return self.density * self.acceleration * (self.length**2 - np.pi * self.radius**2)

    @cached_property
    def traction(self) -> float:
        """The same force from the stress at the surface; from the drag it differs by the error."""
        solver, mesh = self._solver, self._solver.mesh
        first = np.arange(mesh.turns)
        points = mesh.gauss
        step = 2.0 * np.pi / mesh.turns
        nodal = self._state[: 2 * solver.n].reshape(2, -1)[:, solver.index[first]]
        held = self._state[2 * solver.n :][solver.pressure_index[first]]
        zero = np.zeros_like(points)
        _, shape_s, _ = _tensor(mesh, _ORDER, zero, points)
        shape, _, _ = _tensor(mesh, _ORDER - 1, zero, points)
        theta = (first[:, None] + points) * step - 0.25 * np.pi
        s = np.zeros_like(theta)
        _, by_s, _ = mesh.place(s, theta)
        normal = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
        # at the wall the velocity changes along the normal only: d/ds = (x_s . n) d/dn
        across = (by_s * normal).sum(axis=-1) / mesh.radial
        slope = np.einsum("qi,aei->eqa", shape_s, nodal) / across[..., None]
        pressure = np.einsum("qi,ei->eq", shape, held)
        stress = -pressure * normal[..., 0] + slope[..., 0]
        stress = stress + (slope * normal).sum(axis=-1) * normal[..., 0]
        total = float((stress * mesh.weights).sum() * step * self.radius / self.length)
        return total * self.density * self.kinematic_viscosity**2 / self.length


def cylinder_array_flow(
    *,
    length: float,
    radius: float,
    acceleration: float,
    kinematic_viscosity: float,
    density: float = 1.0,
    elements: int = 2,
) -> CylinderArrayFlow:
    r"""Steady incompressible flow through a square array of cylinders, driven by an acceleration.

    Parameters
    ----------
    length : float
        L, edge of the cell [length].
    radius : float
        R, at most 0.45 L [length].
    acceleration : float
        f along x, on the fluid [length/time^2].
    kinematic_viscosity : float
        nu [length^2/time].
    density : float
        rho, for pressure and drag [mass/length^3].
    elements : int
        Elements from wall to edge and on each side of the square, of order 6: two have errors of
        1e-5 and less at Reynolds numbers of order one.

    Returns
    -------
    CylinderArrayFlow

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range.
    ArithmeticError
        If no steady flow is found, at large Reynolds numbers.

    Notes
    -----
    .. math:: (\mathbf u\cdot\nabla)\mathbf u = -\nabla p/\rho + \nu\nabla^2\mathbf u
        + f\mathbf e_x, \qquad \nabla\cdot\mathbf u = 0,

    with no slip at the cylinder, everything else periodic. Galerkin's method with continuous
    velocities of order 6 and pressures of order 5; Newton's method.

    Examples
    --------
    >>> from sdpd.theory import cylinder_array_drag, cylinder_array_flow
    >>> flow = cylinder_array_flow(
    ...     length=1.0, radius=0.2, acceleration=1e-3, kinematic_viscosity=1.0
    ... )
    >>> drag = 1e-3 / flow.mean_velocity
    >>> abs(drag / cylinder_array_drag(0.04 * 3.141593) - 1.0) < 0.002
    True
    """
    length = validation.positive("length", length)
    radius = validation.positive("radius", radius)
    if radius > 0.45 * length:
        raise ValueError(f"`radius` must be <= 0.45 `length`, {0.45 * length:g}, got {radius:g}")
    f = validation.finite("acceleration", acceleration)
    nu = validation.positive("kinematic_viscosity", kinematic_viscosity)
    rho = validation.positive("density", density)
    number = validation.integer("elements", elements, minimum=1)
    solver = _Solver(_Mesh(radius / length, number))
    state = solver.solve(f * length**3 / nu**2)
    return CylinderArrayFlow(length, radius, f, nu, rho, solver, state)

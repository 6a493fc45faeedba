"""Pictures: what is drawn is what was given, and a clear word where nothing can be drawn."""

import sys

import numpy as np
import pytest

import sdpd
from sdpd import analysis, fields, plot
from sdpd.plot import gl
from tests.unit.scenes import water_scene
from tests.unit.sims import small, small_scene

BOX = (4.0, 2.0, 2.0)


def flow(box=BOX, frames=4):
    """A vortex along z, without noise."""
    generator = np.random.default_rng(31)
    for _ in range(frames):
        positions = generator.uniform(0.0, 1.0, size=(600, len(box))) * box
        x, y = 2.0 * np.pi * (positions / box)[:, :2].T
        velocities = np.zeros_like(positions)
        velocities[:, 0], velocities[:, 1] = np.sin(x) * np.cos(y), -0.5 * np.cos(x) * np.sin(y)
        yield fields.State(positions=positions, box=box, velocities=velocities)


def averaged(target, box=BOX):
    quantities = ("density", "velocity")
    return fields.average(flow(box), target, quantities=quantities, length=0.6)


@pytest.fixture
def axes():
    pytest.importorskip("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    FigureCanvasAgg(figure)
    yield figure.subplots()
    figure.canvas.draw()  # whatever fails late


def test_profile(axes):
    found = averaged(fields.Bins.over(BOX, "x", 8))
    drawn = plot.profile(found["density"], curve=lambda x: 0.0 * x + 37.5, axes=axes)
    assert drawn is axes
    points, curve = axes.lines[0], axes.lines[-1]
    assert points.get_xdata().tolist() == found.target.centers.tolist()
    assert points.get_ydata().tolist() == found["density"].mean.tolist()
    assert curve.get_ydata().tolist() == [37.5] * 400
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [length]", "density [mass/length^3]")
    # bars of one standard error
    (bars,) = [c for c in axes.collections if len(c.get_segments()) == 8]
    lengths = np.array([segment[1, 1] - segment[0, 1] for segment in bars.get_segments()])
    assert lengths == pytest.approx(2.0 * found["density"].stderr)


def test_profile_of_the_analysis(axes):
    position = np.random.default_rng(32).uniform(0.0, 2.0, size=(40, 50, 2))
    density = analysis.local_profile(position, axis=1, bins=4, box=(2.0, 2.0))
    plot.profile(density, label="n", axes=axes)
    assert axes.lines[0].get_ydata().tolist() == density.mean.tolist()
    assert axes.get_legend_handles_labels()[1] == ["n"]
    plot.profile(([0.0, 1.0], [2.0, 3.0], [0.1, 0.1]), axes=axes)
    assert axes.lines[-1].get_ydata().tolist() == [2.0, 3.0]


def test_map_and_streamlines(axes):
    found = averaged(fields.Plane.across(BOX, "z", 1.0, (24, 12)))
    plot.field_map(found["velocity"], axes=axes)
    (mesh,) = [c for c in axes.collections if hasattr(c, "get_clim")]
    values = np.linalg.norm(found["velocity"].mean, axis=-1)
    assert np.asarray(mesh.get_array()).ravel() == pytest.approx(values.T.ravel())
    plot.streamlines(found["velocity"], axes=axes)
    assert axes.get_xlabel() == "x [length]" and axes.get_ylabel() == "y [length]"
    assert axes.figure.axes[1].get_ylabel() == "speed [length/time]"


def test_what_cannot_be_drawn_is_named(axes):
    line = averaged(fields.Line((0.0, 1.0, 1.0), (4.0, 1.0, 1.0), 5))
    sheet = averaged(fields.Grid.over(BOX, (4, 1, 3)))
    with pytest.raises(ValueError, match="`data` must be a scalar or one component"):
        plot.profile(line["velocity"], axes=axes)
    with pytest.raises(ValueError, match="`data` must lie on a Plane"):
        plot.field_map(line["density"], axes=axes)
    with pytest.raises(ValueError, match="a scalar"):
        plot.streamlines(sheet["density"], axes=axes)


def test_without_gl_the_packages_are_named(monkeypatch):
    pytest.importorskip("pyvista")
    for died, reason in ((-11, "signal 11"), (1, "no display")):
        code = f"import os, sys; sys.stderr.write('no display\\n'); os._exit({died})"
        if died < 0:
            code = "import os; os.kill(os.getpid(), 11)"
        monkeypatch.setattr(gl, "_PROBE", code)
        monkeypatch.setattr(gl, "_known", {})
        with pytest.raises(RuntimeError, match=rf"{reason}.*apt install libegl1 libegl-mesa0"):
            plot.new_plotter()


def test_without_pyvista_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(ImportError, match=r"pip install 'sdpd\[visual\]'"):
        plot.new_plotter()


@pytest.fixture(scope="module")
def canvas():
    pytest.importorskip("pyvista")
    try:
        plot.require_gl()
    except RuntimeError as error:
        pytest.skip(str(error))


def picture(plotter, tmp_path):
    """Share of the pixels that are not background."""
    from PIL import Image

    path = plot.save(plotter, tmp_path / "picture.png")
    pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    return float((pixels != pixels[0]).any(axis=1).mean())


def test_particles(canvas, tmp_path):
    sim = small(scene=small_scene(6), seed=33, threads=1)
    assert picture(plot.particles(sim, colour="density"), tmp_path) > 0.1
    colour = sim.positions[:, 0]
    assert picture(plot.particles(sim.positions, colour=colour, box=(6.0, 6.0)), tmp_path) > 0.1
    with pytest.raises(ValueError, match="`colour` must be one of 'speed'"):
        plot.particles(sim, colour="velocity_z")
    with pytest.raises(ValueError, match=r"`path` must end in \.png or \.html"):
        plot.save(None, "picture.docx")


def test_slices_and_streamlines_in_space(canvas, tmp_path):
    found = averaged(fields.Grid.over(BOX, (16, 8, 8)))
    below = plot.slices(found, "velocity", normals="z")
    both = plot.stream_tubes(found, n_lines=8, plotter=below)
    assert picture(both, tmp_path) > 0.05
    with pytest.raises(ValueError, match="`name` must be that of a vector"):
        plot.stream_tubes(found, "density")


def test_surface_with_normals(canvas, tmp_path):
    corners = 1e-9 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.2]])
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    plotter = plot.surface(corners, [[0, 1, 2], [0, 2, 3]], normals=normals, colour=np.arange(4.0))
    assert picture(plotter, tmp_path) > 0.05
    ring = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    assert picture(plot.surface(ring, [[0, 1], [1, 2]], normals=-ring), tmp_path) > 0.0005
    for triangles, text in (([[0, 1, 4]], "must name points 0 to 3"), ([[0, 1, 2, 3]], "shape")):
        with pytest.raises(ValueError, match=text):
            plot.surface(corners, triangles)


def test_boundary_particles(canvas, tmp_path):
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    alone = picture(plot.boundary_particles(1e-6 * normals, -2.0 * normals), tmp_path)
    larger = plot.boundary_particles(1e-6 * normals, normals, spacing=5e-7, colour=angle)
    assert 0.01 < alone < picture(larger, tmp_path)
    lifted = np.concatenate([np.pad(normals, ((0, 0), (0, 1))), [[0.0, 0.0, 1.0]]])
    assert picture(plot.boundary_particles(lifted, lifted), tmp_path) > 0.01


def test_boundary_particles_of_a_wall_bring_their_normals(canvas, tmp_path):
    scene = sdpd.scenes.load("couette")
    assert (
        picture(plot.boundary_particles(scene.walls[1].boundary_particles(scene)), tmp_path) > 0.01
    )


def test_boundary_particles_refuse_what_has_no_direction():
    places = np.eye(3)
    with pytest.raises(ValueError, match="`normals` must not be zero, got row 1"):
        plot.boundary_particles(places, [[1.0, 0.0, 0.0], [0.0] * 3, [0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="`normals`"):
        plot.boundary_particles(places, places[:2])
    with pytest.raises(ValueError, match="`points` must be 2 rows or more"):
        plot.boundary_particles(places[:1], places[:1])
    with pytest.raises(TypeError, match="`normals` must be given"):
        plot.boundary_particles(places)


def test_html(canvas, tmp_path):
    pytest.importorskip("trame_pyvista")
    sim = sdpd.Simulation(water_scene(resolution=sdpd.Resolution(particles=216)), threads=1)
    path = plot.save(plot.particles(sim), tmp_path / "particles.html")
    assert path.read_text(encoding="utf-8").lower().lstrip().startswith("<!doctype html>")

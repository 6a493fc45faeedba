"""Speed of steps, cost of effects and LAMMPS side by side, by `sdpd.bench`; JSON of it all, too.

Times are wall times on whatever machine runs this: run it on a quiet one. LAMMPS takes part where
it is found; else its table stays as it is.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from typing import Any

from report import Report, grid

from sdpd import bench

SIZES = (3375, 32768, 216000)
SMALL = (3375, 32768)
LARGEST = (1_000_000,)  # with the larger support alone, two turns
SUPPORTS = (2.4, 3.0)
LARGE = 1e7  # particles, of which the memory is stated


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("performance", __doc__, argv)
    import matplotlib as mpl

    mpl.use("Agg")
    options: dict[str, Any] = {"quick": report.quick, "progress": False}
    sizes, small, supports = SIZES, SMALL, SUPPORTS
    if report.quick:
        options["rounds"] = 2
        sizes, small, supports = (512, 729), (512,), (2.4,)
    lucy = bench.run_speed(sizes, supports=supports, **options)
    wendland = bench.run_speed(small, supports=supports, kernels=("wendland_c2",), **options)
    studies: dict[str, bench.Study] = {"speed": lucy, "wendland_c2": wendland}
    tables = [lucy, wendland]
    if not report.quick:
        tables.append(bench.run_speed(LARGEST, supports=supports[-1:], rounds=2, progress=False))
        studies["large"] = tables[-1]
    if lucy.machine.processors > 1:
        tables.append(bench.run_speed(small, supports=supports, threads=2, **options))
        studies["two_threads"] = tables[-1]
    report.document(*steps(tables))
    report.figure(bench.plot_sizes(lucy))

    costs = bench.run_effects(small[0], support=supports[-1], **options)
    report.write("generated", "performance_effects.md", page(report, *effects(costs)))
    report.figure(bench.plot_effects(costs), "effects")
    studies["effects"] = costs
    try:
        peer = bench.run_peer(sizes=small, supports=supports, **options)
    except FileNotFoundError as absent:
        print(f"no peer: {absent}", file=sys.stderr)
    else:
        report.write("generated", "performance_peer.md", page(report, *contests(peer)))
        report.figure(bench.plot_peer(peer), "peer")
        text = json.dumps(peer.document(), indent=1) + "\n"
        report.write("generated", "performance_peer.json", text)
    document = {name: study.document() for name, study in studies.items()}
    report.write("generated", "performance.json", json.dumps(document, indent=1) + "\n")


def page(report: Report, *parts: str) -> str:
    """Tables and what they mean, then the command."""
    return "\n\n".join([*parts, f"Written by `{report.command}`."]) + "\n"


def steps(studies: Sequence[bench.Speed]) -> list[str]:
    """Full steps of all, then flatness, parts, lists and memory of the first."""
    lucy = studies[0]
    header = ["particles", "$h/\\Delta x$ (pairs)", "kernel", "step", "threads"]
    header += ["$\\Delta t/\\tau$", "thousand particle-steps/s", "ns a pair", "bytes"]
    rows = [
        [
            f"{row.particles:,}",
            f"{row.support:g} ({row.pairs:.0f})",
            row.kernel.replace("_", " "),
            row.step,
            f"{study.threads}",
            f"{row.dt_over_tau:.3f}",
            row.rate.scaled(1e-3).shown(".0f"),
            f"{row.time_per_pair.median:.1f}",
            f"{row.bytes_per_particle:.0f}",
        ]
        for study in studies
        for row in study.rows
    ]
    flat = [
        [step, f"{support:g}", f"{ratio:.2f}"]
        for (step, _, support), ratio in lucy.flatness().items()
    ]
    parts = [[f"{part.support:g}", part.name, *part.cells()] for part in lucy.parts]
    lists = [
        [f"{row.support:g}", row.step, f"{row.lists.interval:.0f}", f"{row.lists.cost:.0f}"]
        for row in lucy.rows
        if row.particles == lucy.rows[0].particles and row.lists.cost > 0.0
    ]
    memory = [
        [f"{row.support:g}", row.step, f"{row.bytes_per_particle:.0f}", _gigabytes(row)]
        for row in lucy.rows
        if row.particles == lucy.rows[-1].particles
    ]
    best = dict.fromkeys(study.best() for study in studies)
    shares = [row for study in studies for row in study.shares()]
    sizes = f"{lucy.rows[0].particles:,} to {lucy.rows[-1].particles:,} particles"
    note = (
        "Particle-steps a second, all threads together, median and quartiles of "
        f'{lucy.rounds} turns; every step at its own `dt="auto"`; bytes of state and lists of a '
        f"particle. All of one kernel, support and number of threads took turns. {lucy.machine}."
    )
    return [
        grid(header, rows),
        note,
        f"Flatness: largest over smallest time of a particle-step, {sizes}.",
        grid(["step", "$h/\\Delta x$", "largest/smallest"], flat),
        f"What the machine can do, and what steps reach of it: {'; '.join(best)}.",
        grid(bench.SHARES, shares),
        "Parts of a Verlet step, by steps that do without one thing each:",
        grid(["$h/\\Delta x$", "part", "ns a particle", "ns a pair"], parts),
        "Neighbour lists, whose share is contained in all of the above:",
        grid(["$h/\\Delta x$", "step", "steps from one to the next", "ns a particle"], lists),
        f"Memory, and what {LARGE:.0e} particles take at that:",
        grid(["$h/\\Delta x$", "step", "bytes a particle", "GB"], memory),
    ]


def _gigabytes(row: bench.Row) -> str:
    return f"{row.bytes_per_particle * LARGE * 1e-9:.1f}"


def effects(costs: bench.EffectCosts) -> list[str]:
    """What each costs, and what those switched off cost."""
    header = ["effect", "compared with", "ns without", "ns with", "it costs [ns]", "%"]
    words = {True: "the same", False: "not the same", None: "cannot tell"}
    absent = [[*_difference(each), words[bench.same(each)]] for each in costs.absent]
    note = (
        f"Time of a particle-step, {costs.particles:,} particles, $h/\\Delta x={costs.support:g}$, "
        f"Lucy unless said otherwise; cost: median and quartiles of {costs.rounds} turns of both. "
        f"{costs.machine}."
    )
    return [
        grid(header, [_difference(each) for each in costs.effects]),
        note,
        "Switched off, against absent:",
        grid([*header, "verdict"], absent),
    ]


def _difference(each: bench.Difference) -> list[str]:
    return [
        each.name,
        each.base,
        f"{each.without.median:.0f}",
        f"{each.with_it.median:.0f}",
        each.cost.shown("+.0f"),
        f"{100.0 * each.relative:+.1f}",
    ]


def contests(peer: bench.Peer) -> list[str]:
    """Speed at the same time step, and time to a result."""
    header = ["particles", "$h/\\Delta x$", "here", "LAMMPS [k/s]", "here [k/s]"]
    header += ["ratio", "lowest–highest", "T LAMMPS [K]", "T here [K]"]
    rows = [
        [
            f"{row.particles:,}",
            f"{row.support:g}",
            row.step,
            row.theirs.scaled(1e-3).shown(".0f"),
            row.ours.scaled(1e-3).shown(".0f"),
            row.ratio.shown(".1f"),
            f"{row.lowest:.1f}–{row.highest:.1f}",
            "" if row.their_temperature is None else f"{row.their_temperature}",
            "" if row.our_temperature is None else f"{row.our_temperature}",
        ]
        for row in peer.contests
    ]
    journeys = [
        [
            f"{row.support:g}",
            row.code,
            f"{row.dt:.3g}" + f" ± {row.dt_error:.0%}" * (row.dt_error > 0.0),
            row.seconds.shown(),
            row.ratio.shown(),
            f"{row.temperature}",
            _percent(row.diffusion_error),
            _percent(row.shear_error),
        ]
        for row in peer.journeys
    ]
    names = ["$h/\\Delta x$", "code", "$\\Delta t$ [s]", "seconds", "ratio", "T [K]"]
    note = (
        f"Particle-steps a second of one core, LAMMPS {peer.lammps.version} and this package in "
        f"{peer.rounds} rounds of turns, at $\\Delta t$ = {peer.contests[0].dt:g} s; the water is "
        f"at 300 K. {peer.machine}."
    )
    return [
        grid(header, rows),
        note,
        "Time to simulate one $h^2\\rho/\\eta$, each code at the time step that suits it:",
        grid([*names, "short-time D", "shear wave"], journeys),
    ]


def _percent(value: float) -> str:
    return "not checked" if math.isnan(value) else f"{value:+.2%}"


if __name__ == "__main__":
    main()

"""Nitrogen with an energy at equilibrium: Tables 9 to 11 of Yang (2013), all twenty cases."""

from __future__ import annotations

from collections.abc import Sequence

from report import Report, grid, shown

from sdpd import nitrogen


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("nitrogen", __doc__, argv)
    numbers = [1] if report.quick else sorted(nitrogen.CASES)
    size = 216 if report.quick else None
    study = nitrogen.run_nitrogen(numbers, quick=True, particles=size, threads=1)
    rows = []
    for found in study.cases:
        table = {row.name: row for row in found.rows}
        cells = [str(found.case.number), f"{found.scene.stiffness:.3g}"]
        cells.append(f"{found.case.support / found.case.spacing:.2f}")
        for name in ("T_kin", "Var T", "Var V", "Var rho", "Var P"):
            row = table[name]
            ratio = row.measured.value / row.expected
            cells.append(shown(ratio, row.measured.stderr / row.expected))
            if name != "T_kin":
                cells.append(f"{(row.published or 0.0) / row.expected:.3g}")
        rows.append(cells)
    header = ["case", "$N_i$", r"$h/\Delta x$", "$T_{kin}$"]
    for name in ("T", "V", r"\rho", "P"):
        header += [rf"Var ${name}$", "published"]
    report.document(
        grid(header, rows),
        "Ratios to what is exact ($T$, $V$) or expected ($\\rho$ and $P$: random-phase estimate), "
        "with standard errors; published values likewise. $N_i$: molecules a particle.",
    )
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    report.figure(nitrogen.plot(study, plt.figure(figsize=(9.0, 3.6), layout="constrained")))


if __name__ == "__main__":
    main()

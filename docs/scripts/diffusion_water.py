"""The main job on Table 7 of Yang (2013): its tables, figures and conclusions.

`python docs/scripts/diffusion_water.py` takes about four minutes on two cores.
"""

from __future__ import annotations

from collections.abc import Sequence

from report import Report

import sdpd


def main(argv: Sequence[str] | None = None) -> None:
    report = Report.from_arguments("diffusion_water", __doc__, argv)
    study = sdpd.diffusion.run_study(quick=report.quick)
    report.document("```text\n" + str(study) + "\n```")
    folder = report.output / "figures"
    for path in sdpd.diffusion.write_figures(study, folder):
        path.replace(folder / f"{report.name}_{path.name}")


if __name__ == "__main__":
    main()

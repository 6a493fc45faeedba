"""Run a problem over settings: what accuracy costs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from sdpd import validation
from sdpd.accuracy.files import Store
from sdpd.accuracy.problem import Problem
from sdpd.accuracy.problems import PROBLEMS
from sdpd.accuracy.results import Study
from sdpd.accuracy.row import Row, run_setting
from sdpd.accuracy.settings import Settings, grid
from sdpd.analysis import Estimate
from sdpd.progress import bar

__all__ = ["study"]


def study(
    problem: Problem | str,
    settings: Sequence[Settings] | Mapping[str, Sequence[Any]],
    *,
    seeds: Sequence[int] = (1,),
    repeats: int = 1,
    folder: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
) -> Study:
    """Run a problem at each setting, on one thread, and tell errors and costs.

    Parameters
    ----------
    problem : Problem or str
        Yours, or the name of a ready one in ``sdpd.accuracy.PROBLEMS``.
    settings : sequence of Settings, or mapping
        Or all combinations of values by name, see `grid`; what is not named is the problem's.
    seeds : sequence of int
        A run for each; without noise one is enough.
    repeats : int
        Runs of each seed, for the clock: the smallest processor time counts.
    folder : path, optional
        Each finished setting is written to NAME.jsonl there at once, and not run again by this
        version with the same seeds and repeats. Take another one when you change a problem.
    progress : bool, optional
        Show a progress bar; None: where somebody is likely to look.

    Returns
    -------
    Study

    Raises
    ------
    TypeError, ValueError
        For a bad argument, or a setting that the problem does not take.

    Notes
    -----
    A setting that blows up, or that the scene refuses, has an infinite error and the reason as a
    note; the others go on.

    Examples
    --------
    >>> from sdpd import accuracy
    >>> found = accuracy.study("couette", {"across": (8, 12), "support": (2.6, 3.0)})
    >>> len(found), found.pareto()[0].settings.across
    (4, 8)
    """
    chosen = _problem(problem)
    if isinstance(settings, Mapping):
        settings = grid(chosen.base, **settings)
    points = list(dict.fromkeys(settings))
    if not points:
        raise ValueError("`settings` must be at least one, got none")
    for point in points:
        validation.instance("settings", point, Settings, "sdpd.accuracy.Settings")
        chosen.check(point)
    keys = [validation.integer(f"seeds[{i}]", seed, minimum=0) for i, seed in enumerate(seeds)]
    if not keys or len(set(keys)) < len(keys):
        raise ValueError(f"`seeds` must be different numbers, at least one, got {list(seeds)}")
    number = validation.integer("repeats", repeats, minimum=1)
    runner = _Runner(chosen, keys, number, folder)
    rows = []
    with bar(total=len(points), progress=progress, unit="setting") as shown:
        for point in points:
            rows.append(runner.row(point))
            shown.update(1)
    return Study(problem=chosen, rows=tuple(rows))


def _problem(problem: Problem | str) -> Problem:
    if isinstance(problem, str):
        return PROBLEMS[validation.choice("problem", problem, list(PROBLEMS))]
    expected = "sdpd.accuracy.Problem or the name of a ready one"
    return validation.instance("problem", problem, Problem, expected)


class _Runner:
    """Runs settings, or takes them from the store; references by finer runs are kept."""

    def __init__(
        self,
        problem: Problem,
        seeds: Sequence[int],
        repeats: int,
        folder: str | os.PathLike[str] | None,
    ) -> None:
        self._problem, self._seeds, self._repeats = problem, seeds, repeats
        self._finer: dict[Settings, Estimate] = {}
        self._store = None
        if folder is not None:
            self._store = Store(folder, problem.name, seeds=seeds, repeats=repeats)

    def row(self, settings: Settings) -> Row:
        """Of a setting."""
        known = None if self._store is None else self._store.get(settings)
        if known is not None:
            return known
        row = run_setting(
            self._problem,
            settings,
            seeds=self._seeds,
            repeats=self._repeats,
            finer=self._reference(settings),
        )
        if self._store is not None:
            self._store.add(row)
        return row

    def _reference(self, settings: Settings) -> Estimate | None:
        """By the finer run, if that is the reference; with a seed of its own."""
        if not isinstance(self._problem.reference, Mapping):
            return None
        finer = self._problem.finer(settings)
        if finer not in self._finer:
            sim = self._problem.simulation(finer, seed=max(self._seeds) + 1)
            self._finer[finer] = self._problem.measure(sim, finer)
        return self._finer[finer]

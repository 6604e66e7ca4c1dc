"""The results of `nocdyn sweep`, read from their folder."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import f90nml
import h5netcdf
import numpy as np
import pandas as pd

from .columns import Column, read_column_list
from .failure import ResultsError
from .speed_results import short_unit
from .trajectory_files import need_folder, text_of

DONE, REFUSED, FAILED = 0, 1, 2
STATUS_WORDS = {"done": DONE, "refused": REFUSED, "failed": FAILED}
DESIGN_NAMES = {"latin": "Latin", "sobol": "Sobol"}  # names of people and of squares
BANDS = "bands.csv"
LABEL = re.compile(r"(?P<name>.+?)(?: \[(?P<unit>[^]]*)\])?")


@dataclass(frozen=True)
class Variable:
    """A varied number or a result, with its value in each variant."""

    name: str
    unit: str
    long_name: str
    values: np.ndarray
    statistic: str = ""  # of a result
    words: str = ""  # of a result: the end of its long name

    @property
    def is_curve(self) -> bool:
        """Whether it has a value at each of several speeds: [variants, points]."""
        return self.values.ndim > 1

    @property
    def label(self) -> str:
        """As in tables."""
        return self._in_unit(self.name)

    @property
    def title(self) -> str:
        """A result in words; a varied number as the input has it."""
        return self.long_name if self.words else self.name

    @property
    def full_label(self) -> str:
        return self._in_unit(self.title)

    @property
    def short_label(self) -> str:
        """Where the long name is beside it."""
        return self._in_unit(self.words or self.name)

    def _in_unit(self, text: str) -> str:
        return f"{text} [{self.shown_unit}]" if self.shown_unit else text

    def in_short(self) -> "Variable":
        """In kN m, MN m or MPa, if the numbers are large, but for outliers."""
        finite = np.abs(self.values[np.isfinite(self.values)])
        factor, unit = short_unit(self.unit, float(np.quantile(finite, 0.95)) if finite.size else 0.0)
        return replace(self, unit=unit, values=self.values / factor)

    @property
    def shown_unit(self) -> str:
        return "" if self.unit == "1" else self.unit

    @property
    def key(self) -> str:
        """Of a varied number: the last part of its path, without the place in a list."""
        return self.name.rsplit(".", 1)[-1].split("(")[0]

    @property
    def is_minimum(self) -> bool:
        """Of a result: whether it is the smallest value of something."""
        return self.statistic == "min"


@dataclass(frozen=True)
class Sweep:
    title: str
    design: str
    varied: list[Variable]
    results: list[Variable]
    status: np.ndarray
    curves: list[Variable] = field(default_factory=list)  # results over the speed

    def known(self, result: Variable) -> np.ndarray:
        """The variants that have the result."""
        return np.flatnonzero((self.status == DONE) & np.isfinite(result.values))

    def in_short(self) -> "Sweep":
        """For figures."""
        varied, results = ([one.in_short() for one in variables] for variables in (self.varied, self.results))
        return replace(self, varied=varied, results=results)

    @property
    def not_done(self) -> np.ndarray:
        return np.flatnonzero(self.status != DONE)

    @property
    def is_grid(self) -> bool:
        return self.design == "grid"

    @property
    def remark(self) -> str:
        """What the sweep was, in a line."""
        counts = [
            f"{np.count_nonzero(self.status == status)} {word}"
            for word, status in STATUS_WORDS.items()
            if status != DONE and (self.status == status).any()
        ]
        variants = f"{self.status.size:,} variants".replace(",", " ")
        return ", ".join([f"{DESIGN_NAMES.get(self.design, self.design)} design", variants, *counts])

    @property
    def not_done_words(self) -> str:
        """What became of the variants that were not done."""
        return " or ".join(word for word, status in STATUS_WORDS.items() if status != DONE and (self.status == status).any())


def read_sweep(folder: Path) -> Sweep:
    need_folder(folder)
    if (folder / "sweep.nc").is_file():
        sweep = _read_netcdf(folder / "sweep.nc")
    elif (folder / "sweep.csv").is_file():
        sweep = _read_table(folder / "sweep.csv")
    elif any(folder.glob("sweep*.journal")):
        raise ResultsError(
            f"{folder}: the sweep is not finished; 'nocdyn sweep --resume' goes on with it, "
            "'nocdyn merge' joins the shards of one"
        )
    else:
        raise ResultsError(f"{folder}: no sweep.nc or sweep.csv here; is this the results folder of a 'nocdyn sweep'?")
    results = len(sweep.results) + len(sweep.curves)
    if not sweep.varied or not results:
        raise ResultsError(f"{folder}: nothing to draw: the sweep has {len(sweep.varied)} varied numbers and {results} results")
    if not (sweep.status == DONE).any():
        raise ResultsError(f"{folder}: nothing to draw: none of the {sweep.status.size} variants was done")
    drawn = [result for result in sweep.results if sweep.known(result).size]
    if not drawn and not sweep.curves:
        raise ResultsError(f"{folder}: nothing to draw: no variant has any of the results")
    return replace(sweep, results=drawn)


def _read_netcdf(file: Path) -> Sweep:
    try:
        with h5netcdf.File(file, "r") as content:
            status = content.variables["status"][...].astype(int)
            results = _with_statistics(_variables(content, "result"), read_column_list(file.parent))
            return Sweep(
                title=text_of(content.attrs.get("title", "")) or file.resolve().parent.name,
                design=text_of(content.attrs["design"]),
                varied=_variables(content, "parameter"),
                results=[result for result in results if not result.is_curve],
                status=status,
                curves=[result for result in results if result.is_curve],
            )
    except KeyError as error:
        raise ResultsError(f"{file}: this is no sweep.nc of nocdyn: {error.args[0]} is missing") from None
    except (OSError, ValueError) as error:
        raise ResultsError(f"{file}: cannot be read: {' '.join(str(error).split())}") from None


def _variables(content: h5netcdf.File, role: str) -> list[Variable]:
    return [
        Variable(
            *(
                text_of(variable.attrs.get(attribute, default))
                for attribute, default in (("label", name), ("units", ""), ("long_name", name))
            ),
            values=np.asarray(variable[...], dtype=float).T,
        )
        for name, variable in content.variables.items()
        if text_of(variable.attrs.get("role", "")) == role
    ]


def _read_table(file: Path) -> Sweep:
    """sweep.csv: variant, what varies, the results, status, steps, reason."""
    try:
        table = pd.read_csv(file, index_col=False)
        labels = list(table)
        variables = [_variable(table, label) for label in labels[labels.index("variant") + 1 : labels.index("status")]]
        status = np.array([STATUS_WORDS[word] for word in table["status"]], dtype=int)
    except KeyError as error:
        raise ResultsError(
            f"{file}: not the table of a sweep: the status {error.args[0]!r} is none of {', '.join(STATUS_WORDS)}"
        ) from None
    except (ValueError, OSError) as error:  # pandas' own parser errors are ValueErrors
        raise ResultsError(f"{file}: not the table of a sweep: {' '.join(str(error).split())}") from None
    machine = _read_input(file.with_name("input.nml"))
    columns = read_column_list(file.parent)
    curves = [_curve(column, variables) for column in columns if column.statistic == "curve" and column.file != BANDS]
    points = {variable.name for curve, names in curves for variable in names}
    variables = [variable for variable in variables if variable.name not in points]
    results = {column.label for column in columns}
    return Sweep(
        title=machine.get("case", {}).get("title") or file.resolve().parent.name,
        design=machine["sweep"]["design"],
        varied=[variable for variable in variables if variable.label not in results],
        results=_with_statistics([variable for variable in variables if variable.label in results], columns),
        status=status,
        curves=[curve for curve, _ in curves],
    )


def _curve(column: Column, variables: list[Variable]) -> tuple[Variable, list[Variable]]:
    """A curve of a table, which has a column for each of its points, and these."""
    number = re.compile(rf"{re.escape(column.name)}_(\d+)")
    points = [variable for variable in variables if number.fullmatch(variable.name)]
    values = np.column_stack([point.values for point in points])
    return Variable(column.name, column.unit, column.name, values, column.statistic), points


def _with_statistics(results: list[Variable], columns: list[Column]) -> list[Variable]:
    known = {column.label: column for column in columns if column.file != BANDS}
    return [_described(result, known[result.label]) if result.label in known else result for result in results]


def _described(result: Variable, column: Column) -> Variable:
    long_name, words = column.described(column.long_name or result.long_name)
    return replace(result, statistic=column.statistic, long_name=long_name, words=words)


def _variable(table: pd.DataFrame, label: str) -> Variable:
    match = LABEL.fullmatch(label)
    return Variable(match["name"], match["unit"] or "", match["name"], table[label].to_numpy(dtype=float))


def _read_input(file: Path) -> f90nml.Namelist:
    try:
        content = f90nml.read(file)
    except OSError:
        raise ResultsError(f"{file}: missing; the figures of a table need the input of the sweep beside it") from None
    if "design" not in content.get("sweep", {}):
        raise ResultsError(f"{file}: this is not the input of a sweep: there is no &sweep with a design")
    return content

"""What a command has written: its report, and its tables with units and captions."""

import json
import re
from functools import cached_property
from pathlib import Path

_LABEL = re.compile(r"(?P<name>.+) \[(?P<unit>[^\]]*)\]")


class Result:
    """The results of one command on a machine or a load case, from the files of a folder.

    `report` is the report, a dictionary. `tables` has a pandas DataFrame for each table, by the name of its file, and `table` is
    the first one. Their columns have the names of signals; `attrs` has `units` and `long_name` of each. `datasets` and `dataset`
    are the same as xarray Datasets, over the first column if that numbers the rows.
    """

    def __init__(self, folder, report, tables=()):
        folder = Path(folder)
        self.report = json.loads((folder / report).read_text(encoding="utf-8"))
        captions = {}
        for file in folder.glob("*columns.json"):
            captions |= {column["label"]: column for column in json.loads(file.read_text(encoding="utf-8"))["columns"]}
        captions |= {column["label"]: column for column in self.report.get("columns", ()) if isinstance(column, dict)}
        self.tables = {name: _read(folder / f"{name}.csv", captions) for name in tables if (folder / f"{name}.csv").exists()}
        if "steady_states" in self.report:
            self.tables["equilibrium"] = _table([state["values"] for state in self.report["steady_states"]], captions)

    def __repr__(self):
        shapes = ", ".join(f"{name} {table.shape[0]} x {table.shape[1]}" for name, table in self.tables.items())
        return f"<{type(self).__name__} of {self.report.get('title') or self.report['input']!r}: {shapes}>"

    @property
    def table(self):
        """The main table."""
        return next(iter(self.tables.values()))

    @cached_property
    def datasets(self):
        """The tables as Datasets."""
        return {name: _dataset(table) for name, table in self.tables.items()}

    @property
    def dataset(self):
        """The main table as a Dataset."""
        return next(iter(self.datasets.values()))

    @property
    def notes(self):
        """What the program noted."""
        return self.report.get("notes", [])

    @property
    def verdict(self):
        """Limits and what was found, if there are any."""
        return self.report.get("verdict")


class SweepResult(Result):
    """The results of a sweep: the Dataset of sweep.nc, over the variants or the axes of a grid."""

    def __init__(self, folder, report):
        import xarray

        super().__init__(folder, report)
        with xarray.open_dataset(Path(folder) / "sweep.nc", engine="h5netcdf") as file:
            dataset = file.load()
        of_variants = [name for name in dataset if "failure" not in dataset[name].dims]
        self.tables = {"sweep": dataset[of_variants].to_dataframe()}
        self.__dict__["datasets"] = {"sweep": dataset}


def _read(path, captions):
    import pandas

    table = pandas.read_csv(path)
    return _name(table, captions)


def _table(rows, captions):
    import pandas

    return _name(pandas.DataFrame(rows), captions)


def _name(table, captions):
    """Replaces labels by names where these are different, and keeps units and captions."""
    found = [_LABEL.fullmatch(label) for label in table.columns]
    names = [match["name"] if match else label for label, match in zip(table.columns, found)]
    names = [name if names.count(name) == 1 else label for label, name in zip(table.columns, names)]
    units = {name: match["unit"] for name, match in zip(names, found) if match}
    long_name = {name: captions[label]["caption"] for label, name in zip(table.columns, names) if label in captions}
    table.columns = names
    table.attrs = {"units": units, "long_name": long_name}
    return table


def _dataset(table):
    import xarray

    first = table.columns[0]
    is_axis = table[first].is_unique and table[first].notna().all()
    attrs, rows = table.attrs, table.set_index(first) if is_axis else table.rename_axis("row")
    dataset = xarray.Dataset.from_dataframe(rows)
    for name, variable in dataset.variables.items():
        variable.attrs = {kind: attrs[kind][name] for kind in ("units", "long_name") if name in attrs[kind]}
    return dataset

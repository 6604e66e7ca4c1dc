"""The two forms of a trajectory: trajectory.csv and trajectory.nc."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
import pandas as pd

from .failure import ResultsError


def need_folder(folder: Path) -> None:
    """Refuses what is no folder, as that of results."""
    if folder.is_file():
        raise ResultsError(f"{folder}: is a file; the folder that it is in is what is drawn")
    if not folder.is_dir():
        raise ResultsError(f"{folder}: there is no such results folder")


def labels_of(file: Path) -> list[str]:
    """The columns, as 'omega_motor [rad/s]'."""
    return list(_variables_of(file)) if file.suffix == ".nc" else list(_read_csv(file, nrows=0))


def need_whole(file: Path) -> None:
    """Refuses a table that is cut inside its last row, which another program or a full disk has left."""
    if file.suffix == ".nc":
        return
    with file.open("rb") as content:
        content.seek(0, 2)
        content.seek(max(0, content.tell() - 1))
        if content.read() not in (b"\n", b""):
            raise ResultsError(f"{file}: is cut inside its last row; compute the results again")


def read_columns(file: Path, labels: Collection[str]) -> pd.DataFrame:
    """Some of them: to read a column of trajectory.csv takes ten times as long as to skip it."""
    if file.suffix == ".nc":
        return pd.DataFrame(_variables_of(file, labels))
    return _read_csv(file, dtype=float, usecols=labels)


def _read_csv(file: Path, **options: object) -> pd.DataFrame:
    try:
        return pd.read_csv(file, index_col=False, **options)
    except (ValueError, OSError) as error:  # pandas' own parser errors are ValueErrors
        raise ResultsError(f"{file}: not a table of numbers: {' '.join(str(error).split())}") from None


def _variables_of(file: Path, labels: Collection[str] = ()) -> dict[str, np.ndarray | None]:
    """The labels of all variables, or some labels with their values."""
    import h5py  # takes a while; and reads many variables in a hundredth of the time of h5netcdf

    try:
        with h5py.File(file) as content:
            variables = {
                f"{text_of(variable.attrs['long_name'])} [{text_of(variable.attrs['units'])}]": variable
                for variable in content.values()
            }
            if not labels:
                return dict.fromkeys(variables)
            return {label: variable[...] for label, variable in variables.items() if label in labels}
    except (KeyError, OSError, ValueError) as error:
        raise ResultsError(f"{file}: cannot be read: {' '.join(str(error).split())}") from None


def text_of(value: object) -> str:
    """The text of an attribute: UTF-8, which the NetCDF library marks as ASCII; what is no UTF-8 is taken for Latin-1."""
    stored = value if isinstance(value, bytes) else str(value).encode("utf-8", "surrogateescape")
    try:
        return stored.decode("utf-8")
    except UnicodeDecodeError:
        return stored.decode("latin-1")

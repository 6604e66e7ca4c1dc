"""Sweeps for tests, and the programs that run them."""

import os
import resource
import shutil
from pathlib import Path

import pytest

# The first four groups are a machine that rings down; the sweep of it takes milliseconds.
TWO_DISCS = """\
&case     title = 'Two discs' /
&body     name = 'disc'  inertia = 2.0  speed = 1.0 /
&body     name = 'wheel' inertia = 1.0  speed = 0.0 /
&coupling name = 'shaft' bodies = 'disc', 'wheel' stiffness = 40.0 damping = 0.2 /
&load     name = 'drag'  body = 'wheel' viscous = 0.5 /
&run      t_end = 2.0 rtol = 1e-8 atol = 1e-8 /
&output   points = 11 /
"""
SWEEP = """\
&sweep    design = 'random' samples = 60 seed = 3 /
&vary     target = 'coupling.shaft.stiffness' low = 20.0 high = 60.0 /
&vary     target = 'load.drag.viscous' low = 0.1 high = 1.0 /
&record   quantity = 'omega_wheel' statistic = 'final', 'max', 'time_of_max' /
&record   quantity = 'moment_shaft' statistic = 'max_abs', 'rms' from = 0.5 /
"""

# A sweep in which something of everything happens: variants are done, refused, run alone and fail.
MIXED = """\
&body     name = 'disc'  inertia = 1.0  speed = 1.0 /
&coupling name = 'shaft' bodies = 'ground', 'disc' stiffness = 1.0 cubic_stiffness = 0.0 /
&run      t_end = 4.0 rtol = 1e-8 atol = 1e-8 max_steps = 2000 /
&output   points = 11 /
&sweep    design = 'grid' /
&vary     target = 'run.t_end' low = 4.0 high = 5.0 count = 2 /
&vary     target = 'body.disc.inertia' low = -0.5 high = 1.5 count = 5 /
&vary     target = 'coupling.shaft.cubic_stiffness' low = -4.0 high = 4.0 count = 5 /
&record   quantity = 'omega_disc' statistic = 'final', 'max_abs' /
"""

MPI_ENVIRONMENT = os.environ | {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}

SWEEP_PROGRAM = Path(os.environ["NOCDYN"]).with_name("nocdyn-sweep")
MPI_PROGRAM = Path(os.environ["NOCDYN"]).with_name("nocdyn-mpi")

needs_sweeps = pytest.mark.skipif(not SWEEP_PROGRAM.exists(), reason="built without NetCDF")
needs_mpi = pytest.mark.skipif(not MPI_PROGRAM.exists() or not shutil.which("mpirun"), reason="built without MPI")


def mpirun(ranks):
    """The words before those of a sweep on so many ranks."""
    return ["mpirun", "-n", str(ranks), str(MPI_PROGRAM)]


def limited_to(size):
    """Files of the process cannot grow beyond so many bytes."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

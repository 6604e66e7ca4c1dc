"""Dynamics of drivetrains: the commands of nocdyn as functions, and machines that run step by step in this process."""

from nocdyn._analyses import campbell, equilibrium, modes, orbit, response, run, sweep, transit
from nocdyn._errors import InputError, Mistake, NocdynError
from nocdyn._fmu import fmu
from nocdyn._input import Group, Input
from nocdyn._machine import Machine, State
from nocdyn._results import Result

__all__ = [
    "Group",
    "Input",
    "InputError",
    "Machine",
    "Mistake",
    "NocdynError",
    "Result",
    "State",
    "campbell",
    "equilibrium",
    "fmu",
    "modes",
    "orbit",
    "response",
    "run",
    "sweep",
    "transit",
]

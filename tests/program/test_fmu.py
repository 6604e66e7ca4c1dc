"""Units for co-simulation: `nocdyn fmu`, and the functions of FMI 2.0 and 3.0, as FMPy sees and calls them."""

import ctypes
import doctest
import os
import re
import shutil
import subprocess
import sys
import threading
import zipfile
from contextlib import contextmanager
from pathlib import Path

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np
import pytest
from conftest import CASE_2, SOURCE, all_if_fast, fast_only, first_case
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

sys.path.insert(0, str(SOURCE / "python"))

import nocdyn as package

ROTOR = """&body name = 'rotor' inertia = 2.0 speed = 3.0 /
&load name = 'work' body = 'rotor' viscous = 1.0 /
&excitation name = 'outside' body = 'rotor' kind = 'external' amplitude = 0.0 /
&run t_end = 4.0 rtol = 1e-11 atol = 1e-11 /
&output points = 41 /
"""
TORQUE = "excitation.outside.torque"
CLUTCHES = SOURCE / "input/examples/coupled_clutches/coupled_clutches.nml"
FAN = SOURCE / "input/examples/fan_start/fan_start.nml"  # a motor on the mains
DIFFERENTIAL = SOURCE / "input/examples/differential/differential.nml"  # a table in a file
GENSET = SOURCE / "input/examples/generator_set/generator_set.nml"  # load cases
MACHINES = all_if_fast(CASE_2, CLUTCHES, FAN, DIFFERENTIAL, GENSET)
VERSIONS = (2, 3)
EQUAL = 1e-9  # of the largest value of a column: communication points are those of rows but for rounding
INTEGRATED = 1e-8  # rtol and atol are 1e-11
PYTHON = {**os.environ, "NOCDYN_PYTHON": sys.executable}
HEADERS = Path(fmpy.__file__).parent / "c-code"


def write(nocdyn, given, version, *words):
    """An FMU by the command: of a file, or of a text."""
    path = nocdyn.write("machine.nml", given) if isinstance(given, str) else given
    outcome = nocdyn("fmu", path, "--out", "machine.fmu", "--fmi", version, *words, env=PYTHON)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout == f"machine.fmu: FMI {version}.0, co-simulation\n"
    return str(nocdyn.folder / "machine.fmu")


class Unit:
    """An instance of an FMU by FMPy, whose calls are the same in both versions; `log` has what it told."""

    def __init__(self, fmu, folder, logs=False):
        self.description = fmpy.read_model_description(fmu)
        self.references = {variable.name: variable.valueReference for variable in self.description.modelVariables}
        self.is_2 = self.description.fmiVersion == "2.0"
        self.log = []
        where = {"guid": self.description.guid, "modelIdentifier": self.description.coSimulation.modelIdentifier}
        slave = fmpy.fmi2.FMU2Slave if self.is_2 else fmpy.fmi3.FMU3Slave
        self.slave = slave(unzipDirectory=fmpy.extract(fmu, folder), instanceName="it", **where)
        self.instantiate(logs)

    def instantiate(self, logs=False):
        if self.is_2:
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(lambda *words: self.log.append(words[-1].decode()))
            callbacks.allocateMemory = fmpy.fmi2.defaultCallbacks.allocateMemory
            callbacks.freeMemory = fmpy.fmi2.defaultCallbacks.freeMemory
            self.slave.instantiate(callbacks=callbacks, loggingOn=logs)
        else:
            self.slave.instantiate(loggingOn=logs, logMessage=lambda *words: self.log.append(words[-1].decode()))

    def initialise(self, stop=None, **values):
        if self.is_2:
            self.slave.setupExperiment(startTime=0.0, stopTime=stop)
        self.set(**values)
        self.slave.enterInitializationMode(**({} if self.is_2 else {"startTime": 0.0, "stopTime": stop}))
        self.slave.exitInitializationMode()

    def set(self, **values):
        for name, value in values.items():
            (self.slave.setReal if self.is_2 else self.slave.setFloat64)([self.references[name]], [value])

    def get(self, *names):
        references = [self.references[name] for name in names]
        return list((self.slave.getReal if self.is_2 else self.slave.getFloat64)(references))

    def outputs(self):
        return self.get(*(v.name for v in self.description.modelVariables if v.causality == "output"))

    def step(self, time, size):
        self.slave.doStep(time, size)

    def refused(self, call, *words, **values):
        """What is told of a call that fails."""
        self.log.clear()
        with pytest.raises(FMICallException) as caught:
            call(*words, **values)
        assert caught.value.status == fmpy.fmi2.fmi2Error
        return "\n".join(self.log)


@contextmanager
def unit(fmu, folder, **options):
    one = Unit(fmu, str(folder / f"unzipped_{len(list(folder.iterdir()))}"), **options)
    instance = one.slave.component
    yield one
    one.slave.component = instance
    one.slave.terminate()
    one.slave.freeInstance()


def assert_equal(found, expected, header):
    """By the largest value of each column, of energies by that of all: their residual is a difference."""
    scale = np.abs(expected).max(axis=0)
    energies = [label.endswith(" [J]") for label in header]
    scale[energies] = scale[energies].max(initial=0.0)
    assert np.all(np.abs(found - expected) <= EQUAL * scale)


def table_of(result):
    return np.array([list(row) for row in result])


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("path", MACHINES, ids=lambda path: path.stem)
def test_an_fmu_is_valid_and_has_the_rows_of_a_run(nocdyn, path, version):
    case = first_case(path)
    fmu = write(nocdyn, path, version, *case)
    assert validate_fmu(fmu) == []
    nocdyn("run", path, "--out", "out", *case)
    header, rows = nocdyn.table(Path("out", *case[1:]))
    rows = np.array(rows)
    for divisor in (1, 3):
        interval = (rows[-1, 0] - rows[0, 0]) / (len(rows) - 1) / divisor
        result = fmpy.simulate_fmu(fmu, output_interval=interval)
        assert list(result.dtype.names) == ["time", *(label.split(" [")[0] for label in header[1:])]
        assert_equal(table_of(result)[::divisor], rows, header)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_description_tells_names_units_and_captions(nocdyn, version):
    description = fmpy.read_model_description(write(nocdyn, ROTOR, version, "--set", "output.units=rpm"))
    variables = {variable.name: variable for variable in description.modelVariables}
    assert [name for name, one in variables.items() if one.causality == "input"] == [TORQUE]
    assert (variables[TORQUE].unit, variables[TORQUE].start) == ("N m", "0.0")
    assert {name: one.variability for name, one in variables.items() if one.causality == "parameter"} == {
        "body.rotor.inertia": "fixed",
        "body.rotor.speed": "fixed",
        "load.work.viscous": "tunable",
    }
    assert variables["load.work.viscous"].start == "1.0"
    assert variables["load.work.viscous"].description == "viscous of &load 'work': torque per speed"
    assert variables["omega_rotor"].description == "speed, body rotor"
    units = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
    rpm, damping = units["rpm"], units["N m s/rad"]
    assert (rpm.rad, rpm.s, rpm.factor) == (1, -1, pytest.approx(2 * np.pi / 60, rel=1e-15))
    assert (damping.kg, damping.m, damping.s, damping.rad, damping.factor) == (1, 2, -1, -1, 1.0)
    experiment = description.defaultExperiment
    assert [float(number) for number in (experiment.startTime, experiment.stopTime, experiment.tolerance)] == [0, 4, 1e-11]
    assert description.variableNamingConvention == "structured"


def test_a_name_that_is_none_of_a_language_makes_the_names_flat(nocdyn):
    fmu = write(nocdyn, ROTOR.replace("'work'", "'work 2'"), 2)
    assert fmpy.read_model_description(fmu).variableNamingConvention == "flat"
    assert validate_fmu(fmu) == []
    assert fmpy.simulate_fmu(fmu, start_values={"load.work 2.viscous": 2.0})["omega_rotor"][-1] == pytest.approx(
        3 * np.exp(-4.0), abs=INTEGRATED
    )


@pytest.mark.parametrize("version", VERSIONS)
def test_parameters_change_before_the_start_and_tunable_ones_later(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    with unit(fmu, nocdyn.folder) as one:
        one.initialise(**{"body.rotor.inertia": 4.0, "load.work.viscous": 2.0, "body.rotor.speed": 5.0, TORQUE: 2.0})
        assert one.get("omega_rotor", TORQUE, "body.rotor.inertia") == [5.0, 2.0, 4.0]
        one.step(0.0, 1.0)
        assert one.get("omega_rotor") == pytest.approx([1 + 4 * np.exp(-0.5)], abs=INTEGRATED)
        one.set(**{"load.work.viscous": 4.0, TORQUE: 0.0})
        one.step(1.0, 1.0)
        assert one.get("time", "omega_rotor") == [2.0, pytest.approx((1 + 4 * np.exp(-0.5)) * np.exp(-1.0), abs=INTEGRATED)]
        message = one.refused(one.set, **{"body.rotor.inertia": 1.0})
        assert "body.rotor.inertia is fixed: it can be set before the unit leaves its initialisation mode only" in message
        message = one.refused(one.set, **{"load.work.viscous": 0.0})
        assert "load.work.viscous = 0 has another sign than 4" in message


def signal(*points):
    return np.array(list(points), dtype=[("time", float), (TORQUE, float)])


def test_a_torque_that_changes_evenly_is_that_of_a_table(nocdyn):
    table = ROTOR.replace("kind = 'external' amplitude = 0.0", "kind = 'table' table_time = 0, 1, 3 table_torque = 0, 4, -2")
    nocdyn.done(table)
    columns = nocdyn.values()
    with unit(write(nocdyn, ROTOR, 2), nocdyn.folder) as one:
        one.initialise()
        for i, time in enumerate(columns["t"][:-1]):
            torque, rate = (0.0, 4.0) if i < 10 else (4.0, -3.0) if i < 30 else (-2.0, 0.0)
            one.set(**{TORQUE: torque + rate * (time - (0.0, 1.0, 3.0)[(i >= 10) + (i >= 30)])})
            one.slave.setRealInputDerivatives([one.references[TORQUE]], [1], [rate])
            one.step(time, columns["t"][i + 1] - time)
            expected = [columns["omega_rotor"][i + 1], columns["torque_outside"][i + 1]]
            assert one.get("omega_rotor", "torque_outside") == pytest.approx(expected, abs=INTEGRATED)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_torque_that_jumps_is_that_of_a_step(nocdyn, version):
    nocdyn.done(ROTOR.replace("kind = 'external' amplitude = 0.0", "kind = 'step' time = 1.0 amplitude = 4.0"))
    result = fmpy.simulate_fmu(write(nocdyn, ROTOR, version), input=signal((0, 0), (1, 0), (1, 4), (4, 4)), output_interval=0.1)
    assert result["omega_rotor"] == pytest.approx(nocdyn.values()["omega_rotor"], abs=INTEGRATED)


GOVERNED = """&body name = 'rotor' inertia = 2.0 /
&motor name = 'drive' body = 'rotor' kind = 'inverter' torque_limit = 100.0
       governor_speed = 0.0 governor_gain = 0.05 governor_time = 0.5 /
&run t_end = 4.0 rtol = 1e-11 atol = 1e-11 /
"""


def governed(state, set_speed, t):
    """Speed and integral of the rotor after a time: 2 omega' = 100 y, y = z + 0.05 (set_speed - omega), z' = (y - z) / 0.5."""
    rates, modes = np.linalg.eig(np.array([[-2.5, 50.0], [-0.1, 0.0]]))
    steady = np.array([set_speed, 0.0])
    return steady + (modes @ np.diag(np.exp(rates * t)) @ np.linalg.inv(modes) @ (state - steady)).real


@pytest.mark.parametrize("version", VERSIONS)
def test_the_set_speed_of_a_governor_is_an_input_of_any_sign(nocdyn, version):
    fmu = write(nocdyn, GOVERNED, version)
    assert validate_fmu(fmu) == []
    name, state = "motor.drive.governor_speed", np.array([0.0, 0.0])
    with unit(fmu, nocdyn.folder) as one:
        (found,) = (variable for variable in one.description.modelVariables if variable.causality == "input")
        assert (found.name, found.unit) == (name, "rad/s")
        one.initialise()
        for i, set_speed in enumerate([0.0, 10.0, 10.0, -5.0, 0.0]):
            one.set(**{name: set_speed})
            one.step(float(i), 1.0)
            state = governed(state, set_speed, 1.0)
            assert one.get("omega_rotor", name) == [pytest.approx(state[0], abs=INTEGRATED), set_speed]
        if version == 2:
            message = one.refused(one.slave.setRealInputDerivatives, [one.references[name]], [1], [6.0])
            assert "motor.drive.governor_speed has no rate: it changes at once" in message


def test_a_rate_holds_for_one_step_and_its_torque_stays(nocdyn):
    fmu = write(nocdyn, ROTOR, 2)
    with unit(fmu, nocdyn.folder) as one:
        one.initialise()
        one.slave.setRealInputDerivatives([one.references[TORQUE]], [1], [6.0])
        one.step(0.0, 0.5)
        assert one.get(TORQUE, "torque_outside") == [3.0, 3.0]
        one.step(0.5, 0.5)
        assert one.get(TORQUE, "torque_outside") == [3.0, 3.0]
        second = one.refused(one.slave.setRealInputDerivatives, [one.references[TORQUE]], [2], [6.0])
        assert "the first derivative can be set, not that of order 2" in second
        of_output = one.refused(one.slave.setRealInputDerivatives, [one.references["omega_rotor"]], [1], [6.0])
        assert "is of no input or parameter" in of_output


@pytest.mark.parametrize("version", VERSIONS)
def test_an_input_that_stays_as_it_is_ends_no_step(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    nocdyn.done(ROTOR, "--set", "excitation.outside.amplitude=2")
    with unit(fmu, nocdyn.folder) as one:
        one.initialise(stop=4.0, **{TORQUE: 2.0})
        times = nocdyn.values()["t"]
        for time, following, speed in zip(times, times[1:], nocdyn.values()["omega_rotor"], strict=False):
            assert one.get("omega_rotor") == [speed]
            one.set(**{TORQUE: 2.0})
            one.step(time, following - time)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("path", all_if_fast(CLUTCHES, FAN), ids=lambda path: path.stem)
def test_a_state_that_is_kept_goes_on_with_the_same_bits(nocdyn, path, version):
    fmu = write(nocdyn, path, version)
    with unit(fmu, nocdyn.folder) as one:
        get, go_back, free = (
            getattr(one.slave, f"{word}FMU{'s' if version == 2 else 'S'}tate") for word in ("get", "set", "free")
        )
        early = get()
        one.initialise()
        for i in range(5):
            one.step(0.1 * i, 0.1)
        state, ways = get(), []
        for _ in range(3):
            go_back(state)
            assert one.get("time") == [0.5]
            for i in range(5, 12):
                one.step(0.1 * i, 0.1)
            ways.append(one.outputs())
        assert ways[0] == ways[1] == ways[2]
        go_back(early)  # before its initialisation
        one.initialise()
        for i in range(12):
            one.step(0.1 * i, 0.1)
        assert one.outputs() == ways[0]
        for kept in (state, early):
            free(kept)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_unit_that_is_reset_begins_anew(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    with unit(fmu, nocdyn.folder) as one:
        one.initialise()
        one.step(0.0, 1.0)
        expected = one.outputs()
        one.slave.reset()
        one.initialise(**{"load.work.viscous": 3.0})
        one.step(0.0, 1.0)
        assert one.outputs() != expected
        one.slave.reset()
        one.initialise()
        one.step(0.0, 1.0)
        assert one.outputs() == expected


def test_units_in_threads_have_the_bits_that_they_have_alone(nocdyn):
    fmu = write(nocdyn, CLUTCHES, 3)

    def work(one, found):
        one.initialise()
        for i in range(30):
            one.step(0.05 * i, 0.05)
        found.append(one.outputs())

    alone, together = [], []
    with unit(fmu, nocdyn.folder) as one:
        work(one, alone)
    with unit(fmu, nocdyn.folder) as one, unit(fmu, nocdyn.folder) as two:
        threads = [threading.Thread(target=work, args=(each, together)) for each in (one, two)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert together == 2 * alone


@pytest.mark.parametrize("version", VERSIONS)
def test_without_a_stop_time_there_is_no_end(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    with unit(fmu, nocdyn.folder) as one:
        one.initialise()
        one.step(0.0, 10.0)
        assert one.get("omega_rotor") == pytest.approx([3 * np.exp(-5.0)], abs=INTEGRATED)
    with unit(fmu, nocdyn.folder) as one:
        one.initialise(stop=2.0)
        one.step(0.0, 2.0)
        assert "to the end, 2 s" in one.refused(one.step, 2.0, 1.0)


@pytest.mark.parametrize("version", VERSIONS)
def test_an_experiment_has_its_own_start_and_tolerance(nocdyn, version):
    text = ROTOR.replace("kind = 'external' amplitude = 0.0", "kind = 'step' time = 6.0 amplitude = 4.0")
    text = text.replace("&run", "&run method = 'rk45'")
    result = fmpy.simulate_fmu(write(nocdyn, text, version), start_time=5.0, stop_time=7.0, relative_tolerance=1e-9)
    expected = 4 + (3 * np.exp(-0.5) - 4) * np.exp(-0.5)
    assert result["time"][0] == 5.0
    assert result["omega_rotor"][-1] == pytest.approx(expected, abs=1e-6)  # of the tolerance
    assert result["omega_rotor"][-1] != fmpy.simulate_fmu(write(nocdyn, text, version), start_time=5.0, stop_time=7.0)[-1][2]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_loop_with_a_controller_has_the_bits_of_a_machine_in_python(nocdyn, version):
    fmu, machine, speeds = write(nocdyn, ROTOR, version), package.Machine(ROTOR), []
    machine.end_time = sys.float_info.max  # as that of the unit, which is given no stop time: a first step may be that long
    with unit(fmu, nocdyn.folder) as one:
        one.initialise()
        for i in range(20):
            for read, set_torque in (
                (lambda: one.get("omega_rotor")[0], lambda torque: one.set(**{TORQUE: torque})),
                (lambda: machine["omega_rotor"], lambda torque: machine.set_torque("outside", torque)),
            ):
                set_torque(2.0 + 5.0 * (2.0 - read()))
            one.step(0.1 * i, 0.1)
            machine.run_to(0.1 * i + 0.1)
            speeds.append((one.get("omega_rotor")[0], machine["omega_rotor"]))
    assert all(found == expected for found, expected in speeds)
    assert speeds[-1][0] == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("version", VERSIONS)
def test_calls_that_may_not_be_are_refused_and_the_unit_goes_on(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    with unit(fmu, nocdyn.folder) as one:
        assert "a step is for a unit that is in its step mode; this one is instantiated" in one.refused(one.step, 0.0, 1.0)
        one.initialise()
        assert "a step begins at the present time, 0 s; here 0.5 s" in one.refused(one.step, 0.5, 1.0)
        assert "the size of a step must be greater than 0; here -1 s" in one.refused(one.step, 0.0, -1.0)
        assert "excitation.outside.amplitude must be a finite number" in one.refused(one.set, **{TORQUE: np.nan})
        get = one.slave.getReal if version == 2 else one.slave.getFloat64
        assert "the value reference 1000 is of no input or parameter" in one.refused(get, [1000])
        other = one.slave.getInteger if version == 2 else one.slave.getInt32
        assert "Get" in one.refused(other, [1]) and "is not offered" in one.log[0]
        one.step(0.0, 1.0)
        assert one.get("omega_rotor") == pytest.approx([3 * np.exp(-0.5)], abs=INTEGRATED)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_parameter_out_of_range_is_told_as_the_program_tells_it(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    with unit(fmu, nocdyn.folder) as one:
        message = one.refused(one.initialise, **{"body.rotor.inertia": -1.0})
        assert "body.rotor.inertia=-1: inertia = -1 is out of range; allowed: >= 0 [kg m2]" in message


@pytest.mark.parametrize("version", VERSIONS)
def test_a_machine_that_fails_can_be_taken_back(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version, "--set", "run.max_steps=100")
    with unit(fmu, nocdyn.folder) as one:
        one.initialise()
        one.step(0.0, 0.01)
        state = one.slave.getFMUstate() if version == 2 else one.slave.getFMUState()
        message = one.refused(lambda: [step_with_torque(one, 0.01 + 0.01 * i, (-1.0) ** i) for i in range(200)])
        assert "max_steps" in message
        assert "max_steps" in one.refused(one.outputs)
        (one.slave.setFMUstate if version == 2 else one.slave.setFMUState)(state)
        assert one.get("time") == [0.01]
        one.step(0.01, 0.01)


def step_with_torque(one, time, torque):
    one.set(**{TORQUE: torque})
    one.step(time, 0.01)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_notes_of_a_run_are_logged_if_asked_for(nocdyn, version):
    fmu = write(nocdyn, ROTOR.replace("&run", "&run method = 'rk45'").replace("viscous = 1.0", "viscous = 1e6"), version)
    notes = package.Machine(nocdyn.folder / "machine.nml").notes
    with unit(fmu, nocdyn.folder) as one:
        assert one.log == []
    with unit(fmu, nocdyn.folder, logs=True) as one:
        assert "\n".join(one.log).replace("%%", "%") == "\n".join(notes)


@pytest.mark.parametrize("version", VERSIONS)
def test_an_fmu_of_another_machine_is_not_instantiated(nocdyn, version):
    fmu = write(nocdyn, ROTOR, version)
    with unit(fmu, nocdyn.folder) as one:
        one.slave.guid = "{another}"
        with pytest.raises(Exception, match="nstantiate"):
            one.instantiate()
        assert "variables.txt' is of another FMU: its token is {" in one.log[-1]


def test_an_event_mode_is_not_offered(nocdyn):
    with unit(write(nocdyn, ROTOR, 3), nocdyn.folder) as one, pytest.raises(Exception, match="nstantiate"):
        one.slave.instantiate(eventModeUsed=True)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_library_has_every_function_of_the_standard(version):
    names = set(
        re.findall(rf"Export fmi{version}\w+TYPE\s+(fmi{version}\w+);", (HEADERS / f"fmi{version}Functions.h").read_text())
    )
    if version == 2:  # those of model exchange need not be there
        header = (HEADERS / "fmi2Functions.h").read_text()
        names = set(re.findall(r"fmi2\w+TYPE +(fmi2\w+);", header[: header.rindex("for FMI2 for Model Exchange")]))
        names |= set(re.findall(r"fmi2\w+TYPE +(fmi2\w+);", header[header.rindex("for FMI2 for Co-Simulation") :]))
    assert len(names) > 30
    library = ctypes.CDLL(os.environ["NOCDYN_LIBRARY"])
    assert [name for name in sorted(names) if not hasattr(library, name)] == []


def test_the_same_machine_gives_the_same_file(nocdyn):
    first = Path(write(nocdyn, ROTOR, 2)).read_bytes()
    assert Path(write(nocdyn, ROTOR, 2)).read_bytes() == first
    changed = write(nocdyn, ROTOR, 2, "--set", "load.work.viscous=2")
    with zipfile.ZipFile(changed) as archive:
        assert b"viscous = 2\n" in archive.read("resources/machine.nml")
        names = [name for name in archive.namelist() if not name.startswith("binaries/")]
    assert names == [
        "modelDescription.xml",
        "resources/machine.nml",
        "resources/variables.txt",
        "documentation/licenses/license.txt",
    ]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_unit_brings_all_libraries_but_glibc(nocdyn, version):
    folder = Path(fmpy.extract(write(nocdyn, ROTOR, version), str(nocdyn.folder / "elsewhere")))
    (library,) = folder.glob("binaries/*/machine.so")
    assert library.parent.name == ("linux64" if version == 2 else "x86_64-linux")
    found = dict(
        re.findall(r"(\S+) => (/\S+)", subprocess.run(["ldd", library], capture_output=True, text=True, check=True).stdout)
    )
    assert {name for name, file in found.items() if Path(file).parent != library.parent} == {"libc.so.6", "libm.so.6"}
    assert "libgfortran.so.5" in found


@fast_only
def test_a_note_tells_that_load_cases_are_left_out(nocdyn):
    assert "generator_set.nml: note: the machine by itself, without its load cases" in nocdyn("fmu", GENSET, env=PYTHON).stdout


def test_the_name_is_that_of_the_input_and_of_the_load_case(nocdyn):
    case = first_case(GENSET)[1]
    assert nocdyn("fmu", GENSET, "--case", case, env=PYTHON).returncode == 0
    assert nocdyn("fmu", nocdyn.write("3 rotors.nml", ROTOR), env=PYTHON).stdout == "3 rotors.fmu: FMI 2.0, co-simulation\n"
    assert nocdyn.files(".") == ["3 rotors.fmu", "3 rotors.nml", f"generator_set_{case}.fmu"]
    assert fmpy.read_model_description(str(nocdyn.folder / "3 rotors.fmu")).coSimulation.modelIdentifier == "m_3_rotors"


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["none.nml"], 3, "nocdyn: none.nml: cannot be read: there is no such file\n"),
        (["wrong.nml"], 2, "nocdyn: wrong.nml:1: &body 'a': inertia = -1.0 is out of range; allowed: >= 0 [kg m2]\n"),
        (["good.nml", "--set", "load.work.viscus=1"], 2, "did you mean 'viscous'?"),
        (["good.nml", "--set", "load.work.viscous"], 2, "--set needs PATH=VALUE; here 'load.work.viscous'\n"),
        (["good.nml", "--case", "storm"], 2, "'storm'"),
        (["good.nml", "--fmi", "1"], 2, "--fmi: invalid choice: 1"),
        (["good.nml", "--out", "none/a.fmu"], 3, "nocdyn: 'none/a.fmu' cannot be written: No such file or directory\n"),
        ([], 2, "FILE"),
    ],
)
def test_what_is_wrong_is_told_and_nothing_is_written(nocdyn, words, code, message):
    nocdyn.write("good.nml", ROTOR)
    nocdyn.write("wrong.nml", "&body name = 'a' inertia = -1.0 /\n&run t_end = 1.0 /\n")
    outcome = nocdyn("fmu", *words, env=PYTHON)
    assert (outcome.returncode, outcome.stdout) == (code, "")
    assert message in outcome.stderr and "Traceback" not in outcome.stderr
    assert nocdyn.files(".") == ["good.nml", "wrong.nml"]


def test_the_examples_of_the_page_give_what_it_shows(tmp_path, monkeypatch):
    shutil.copy(SOURCE / "docs/tutorial/speed_control.nml", tmp_path)
    monkeypatch.chdir(tmp_path)
    failed, tried = doctest.testfile(str(SOURCE / "docs/pages/fmu.md"), module_relative=False, verbose=False)
    assert failed == 0 and tried > 10


def test_a_library_that_is_not_there_is_named(nocdyn, monkeypatch, capsys):
    for name in ("NOCDYN", "NOCDYN_LIBRARY"):
        monkeypatch.delenv(name)
    monkeypatch.setenv("PATH", "/none")
    monkeypatch.setattr(package._find, "BUILD", nocdyn.folder)
    assert package._fmu.main([str(nocdyn.write("machine.nml", ROTOR)), "--out", str(nocdyn.folder / "a.fmu")]) == 3
    assert capsys.readouterr().err.startswith("nocdyn: libnocdyn_c.so is not installed; the variable NOCDYN_LIBRARY")
    assert nocdyn.files(".") == ["machine.nml"]

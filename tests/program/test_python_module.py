"""The Python package of python/nocdyn: analyses by the program, machines in this process by the library."""

import csv
import doctest
import re
import sys
import threading

import numpy as np
import pytest
from conftest import CASE_1, SOURCE, all_if_fast, first_case
from sweep_inputs import needs_sweeps

sys.path.insert(0, str(SOURCE / "python"))

import nocdyn as package

ROTOR = """&body name = 'rotor' inertia = 2.0 speed = 3.0 /
&load name = 'work' body = 'rotor' viscous = 1.0 /
&excitation name = 'outside' body = 'rotor' kind = 'external' amplitude = 0.0 /
&run t_end = 10.0 rtol = 1e-10 atol = 1e-10 /
"""
CLUTCHES = SOURCE / "input/examples/coupled_clutches/coupled_clutches.nml"
BACKLASH = SOURCE / "input/examples/backlash/backlash.nml"
ENGINE = SOURCE / "input/examples/engine/engine.nml"
GENSET = SOURCE / "input/examples/generator_set/generator_set.nml"
INTEGRATED = 1e-8  # rtol and atol are 1e-10


def rotor():
    machine = package.Input()
    machine.add("body", name="rotor", inertia=2.0, speed=3.0)
    machine.add("load", name="work", body="rotor", viscous=1.0)
    machine.add("run", t_end=2.0, rtol=1e-10, atol=1e-10)
    return machine


@pytest.mark.parametrize("path", all_if_fast(CASE_1, CLUTCHES, BACKLASH, GENSET), ids=lambda path: path.stem)
@pytest.mark.parametrize("between", [0, 3])
def test_a_machine_in_pieces_has_the_bits_of_the_rows_of_a_run(nocdyn, path, between):
    case = first_case(path)[1:]
    nocdyn("run", path, "--out", "out", *first_case(path))
    with (nocdyn.folder / "out" / "".join(case) / "trajectory.csv").open() as file:
        labels, *rows = csv.reader(file)
    with package.Machine(path, case=case[0] if case else None) as machine:
        assert [f"{name} [{signal['unit']}]" for name, signal in machine.signals.items()] == labels
        for row in rows:
            values = [float(value) for value in row]
            for t in np.linspace(machine.time, values[0], between + 2)[1:-1]:
                machine.run_to(t)
            machine.run_to(values[0])
            assert list(machine.read().values()) == values


def test_a_number_and_a_torque_are_set_between_calls():
    machine = package.Machine(ROTOR)
    machine.run_to(1.0)
    assert machine["omega_rotor"] == pytest.approx(3 * np.exp(-0.5), abs=INTEGRATED)
    kept = machine.keep()
    machine["load.work.viscous"] = 4.0
    machine.run_to(2.0)
    assert machine["omega_rotor"] == pytest.approx(3 * np.exp(-2.5), abs=INTEGRATED)
    machine.restore(kept)
    assert machine.time == 1.0
    machine.set_torque("outside", 1.0)
    machine.run_to(2.0)
    assert machine["omega_rotor"] == pytest.approx(1 + (3 * np.exp(-0.5) - 1) * np.exp(-0.5), abs=INTEGRATED)
    with pytest.raises(ValueError, match="another machine"):
        package.Machine(ROTOR).restore(kept)
    machine.close()
    with pytest.raises(ValueError, match="closed"):
        machine.run_to(3.0)


def test_a_machine_tells_its_numbers_and_its_input_and_moves_its_end():
    machine = package.Machine(ROTOR, set={"load.work.viscous": 2.0})
    changes = {path: (number["value"], number["unit"], number["change"]) for path, number in machine.numbers.items()}
    assert changes == {
        "body.rotor.inertia": (2.0, "kg m2", "at start"),
        "body.rotor.speed": (3.0, "rad/s", "at start"),
        "load.work.viscous": (2.0, "N m s/rad", "in motion"),
        "excitation.outside.amplitude": (0.0, "N m", "by torque"),
    }
    again = package.Machine(machine.input)
    for one in (machine, again):
        one.end_time = 20.0
        one.run_to(20.0)
    assert machine.read() == again.read()
    with pytest.raises(package.InputError, match="a time after the present one, 20 s"):
        machine.end_time = 30.0


def test_machines_in_threads_have_the_bits_that_they_have_alone():
    def work(found):
        machine = package.Machine(CASE_1)
        for t in np.linspace(0.0, 5.0, 101):
            machine.run_to(t)
        found.append(machine.read())

    alone, together = [], []
    work(alone)
    threads = [threading.Thread(target=work, args=(together,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == 4 * alone


@pytest.mark.parametrize("call", [package.Machine, package.run])
def test_mistakes_are_told_with_file_line_group_and_key(call):
    text = ROTOR.replace("inertia = 2.0", "inertia = -2.0").replace("t_end = 10.0", "t_ent = 10.0")
    with pytest.raises(package.InputError) as caught:
        call(text, set={"load.work.viscus": 3})
    places = [(mistake.file, mistake.line, mistake.group, mistake.key) for mistake in caught.value.mistakes]
    assert ("input.nml", 1, "&body 'rotor'", "inertia") in places
    assert ("input.nml", 4, "&run", "t_ent") in places
    assert any(mistake.file.endswith("load.work.viscus=3") and mistake.key == "viscus" for mistake in caught.value.mistakes)
    assert "inertia = -2.0 is out of range; allowed: >= 0 [kg m2]" in str(caught.value)


def test_a_file_that_is_not_there_is_no_mistake_of_the_input(tmp_path):
    for call in (package.Machine, package.run):
        with pytest.raises(package.NocdynError) as caught:
            call(tmp_path / "none.nml")
        assert caught.value.code == 3


def test_an_input_is_built_changed_and_checked():
    machine = rotor()
    machine.check()
    machine.groups[0].inertia = -1.0
    with pytest.raises(package.InputError, match="out of range"):
        machine.check()
    machine.groups[0]["inertia"] = 1.0
    machine["run.t_end"] = 4.0
    assert machine.groups[0].inertia == 1.0
    result = package.run(machine, set={"output.points": 5})
    assert list(result.table["t"]) == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert result.table["omega_rotor"].iloc[-1] == pytest.approx(3 * np.exp(-4.0), abs=INTEGRATED)


def test_values_are_written_as_an_input_has_them():
    group = package.Group("anything", kind="table", text="it's", flag=True, list=np.array([1.0, 2.5]), words=["a", "b"], whole=3)
    assert str(group) == "&anything kind = 'table' text = 'it''s' flag = .true. list = 1.0, 2.5 words = 'a', 'b' whole = 3 /"


def test_groups_are_added_to_a_file_whose_tables_are_beside_it(tmp_path):
    (tmp_path / "history.csv").write_text("0, 0\n1, 4\n2, 4\n")
    file = tmp_path / "machine.nml"
    file.write_text("&body name = 'rotor' inertia = 2.0 /\n&run t_end = 2.0 /\n")
    machine = package.Input(file)
    machine.add("excitation", name="push", body="rotor", kind="table", table_file="history.csv")
    expected = package.run(machine).table["omega_rotor"].iloc[-1]
    assert expected == pytest.approx(3.0, abs=1e-5)
    with package.Machine(machine) as same:
        same.run_to(2.0)
        assert same["omega_rotor"] == expected
    assert sorted(path.name for path in tmp_path.iterdir()) == ["history.csv", "machine.nml"]


def test_tables_have_units_and_captions():
    result = package.run(CASE_1, set={"output.points": 11, "output.units": "rpm"})
    assert result.table.attrs["units"]["omega_motor"] == "rpm"
    assert result.table.attrs["long_name"]["omega_motor"] == "speed"
    variable = result.dataset["omega_motor"]
    assert (variable.dims, variable.attrs) == (("t",), {"units": "rpm", "long_name": "speed"})
    assert result.report["status"] == "done"


def test_every_analysis_gives_its_tables_and_its_report(tmp_path):
    states = package.equilibrium(CASE_1)
    assert len(states.table) == len(states.report["steady_states"]) == 2
    assert states.table.attrs["units"]["omega_motor"] == "rad/s"
    modes = package.modes(CASE_1)
    assert modes.table["frequency"].max() == pytest.approx(0.838158, abs=1e-6)
    campbell = package.campbell(ENGINE)
    assert campbell.dataset["frequency_1"].attrs["units"] == "Hz"
    response = package.response(ENGINE, out=tmp_path / "kept")
    assert set(response.tables) == {"response", "response_orders"}
    assert response.verdict["lines"]
    assert (tmp_path / "kept/response.json").exists()


def test_load_cases_come_by_their_names():
    results = package.run(GENSET, set={"output.points": 3})
    names = re.findall(r"^&load_case +name = '(\w+)'", GENSET.read_text(), re.MULTILINE)
    assert set(results) <= set(names) and len(results) > 1
    one = package.run(GENSET, case=names[0], set={"output.points": 3})
    assert one.table.equals(results[names[0]].table)


@pytest.mark.parametrize("command", ["run", "modes"])
def test_load_cases_are_in_the_order_of_the_input(command):
    train = ROTOR + "&coupling name = 'mount' bodies = 'ground', 'rotor' stiffness = 10.0 /\n"
    results = getattr(package, command)(train + "&load_case name = 'zeta' /\n&load_case name = 'alpha' /\n")
    assert list(results) == ["zeta", "alpha"]


def test_arguments_that_are_no_numbers_signals_or_states_are_told_in_words():
    machine = package.Machine(ROTOR)
    for call, kind, words in (
        (lambda: machine.run_to("1"), TypeError, "a time must be a number, not '1'"),
        (lambda: machine.__setitem__("load.work.viscous", "a"), TypeError, "'load.work.viscous' must be a number, not 'a'"),
        (lambda: machine.set_torque("outside", None), TypeError, "a torque must be a number, not None"),
        (lambda: machine.restore(None), TypeError, "restore needs a state that keep has given, not None"),
        (lambda: machine["omega_rotr"], KeyError, "there is no signal 'omega_rotr'; did you mean 'omega_rotor'?"),
        (lambda: machine["x"], KeyError, "there is no signal 'x'; signals has all of them"),
    ):
        with pytest.raises(kind) as raised:
            call()
        assert raised.value.args == (words,)
    machine.run_to(np.float64(0.5))
    assert machine.time == 0.5


def test_passages_have_a_table(nocdyn):
    nocdyn("new", "ship.nml", "--kind", "ship")
    results = package.transit(nocdyn.folder / "ship.nml")
    assert all(len(result.table) > 0 for result in results.values()) and results


def test_periodic_motions_have_a_table():
    result = package.orbit(SOURCE / "docs/tutorial/hardening.nml", set={"orbit.speed_rpm": [600, 700]})
    assert result.table["mean_speed_engine"].iloc[-1] == pytest.approx(700 * np.pi / 30)


@needs_sweeps
def test_a_sweep_is_the_dataset_of_its_file_with_a_bar_for_its_progress(monkeypatch):
    bars = []

    class Bar:
        def __init__(self, total):
            self.total, self.n = total, 0
            bars.append(self)

        def update(self, more):
            self.n += more

        def close(self):
            self.is_closed = True

    from nocdyn import _analyses

    monkeypatch.setattr(_analyses, "_new_bar", Bar)
    text = ROTOR + (
        "&sweep design = 'grid' /\n&vary target = 'load.work.viscous' low = 1.0 high = 2.0 count = 3 /\n"
        "&record quantity = 'omega_rotor' statistic = 'final' /\n"
    )
    result = package.sweep(text, set={"run.t_end": 1.0}, threads=1)
    final = [3 * np.exp(-0.5 * viscous) for viscous in (1.0, 1.5, 2.0)]
    assert list(result.dataset["omega_rotor_final"].values) == pytest.approx(final, abs=INTEGRATED)
    assert list(result.table["omega_rotor_final"]) == list(result.dataset["omega_rotor_final"].values)
    assert bars == []  # it takes no time
    program = [sys.executable, "-c", "import sys; sys.stderr.write('x: 3 of 8 variants, 2 per second, 1 s left\\n'); sys.exit(1)"]
    with pytest.raises(package.NocdynError) as caught:
        _analyses._execute(program, None, True)
    assert (bars[0].total, bars[0].n, bars[0].is_closed) == (8, 8, True)
    assert str(caught.value) == ""


@needs_sweeps
def test_the_examples_of_the_page_give_what_it_shows(monkeypatch):
    monkeypatch.chdir(SOURCE)
    failed, tried = doctest.testfile(str(SOURCE / "docs/pages/python.md"), module_relative=False, verbose=False)
    assert failed == 0 and tried > 25


def test_numbers_with_a_unit_are_texts():
    machine = package.Input()
    machine.add("body", name="rotor", inertia="1383 lbm ft2", speed="60 rpm")
    machine.add("run", t_end="10 ms")
    machine["body.rotor.inertia"] = "2000 kg cm2"
    machine.check()
    machine.groups[0].inertia = "5 kg m"
    with pytest.raises(package.InputError, match="'kg m' is no unit of moment of inertia; needed: one of that, such as kg m2"):
        package.Input(machine.text).check()

"""The energy account: where the energy of a run came from and where it went."""

import pytest
from conftest import CASE_2, DATA

# Sums of the same numbers in another order.
SAME = 1e-12


@pytest.fixture(scope="module")
def full(shared_nocdyn):
    assert shared_nocdyn("run", DATA / "full_machine.nml", "--out", "full").returncode == 0
    return shared_nocdyn


def test_the_works_of_the_elements_add_up_to_the_columns(full):
    account = full.summary("full")["energy_account"]
    header, rows = full.table("full")
    last = dict(zip(header, rows[-1]))
    works = account["work_in_J"]
    assert list(works) == [
        "coupling shaft",
        "coupling anchor",
        "motor drive",
        "motor booster",
        "load fan",
        "excitation engine",
        "excitation gust",
    ]
    put_in = sum(work for name, work in works.items() if name.startswith(("motor", "excitation")))
    assert put_in == pytest.approx(last["work_in [J]"], rel=SAME)
    assert put_in - sum(works.values()) == pytest.approx(last["work_out [J]"], rel=SAME)
    assert account["kinetic_J"][1] == last["kinetic_energy [J]"]
    assert account["kinetic_J"][0] == rows[0][header.index("kinetic_energy [J]")]
    assert list(account["stored_J"]) == ["shaft", "belt", "anchor"]
    for moment, label in enumerate((rows[0], rows[-1])):
        stored = sum(energies[moment] for energies in account["stored_J"].values())
        assert stored == pytest.approx(label[header.index("elastic_energy [J]")], rel=SAME)
    assert account["residual_J"] == pytest.approx(last["energy_residual [J]"], abs=SAME * last["work_in [J]"])


def test_the_printed_lists_are_sorted_and_their_shares_are_of_all_that_was_put_in(nocdyn):
    text = nocdyn("run", CASE_2).stdout
    account = nocdyn.summary("results/case2")["energy_account"]
    _, table = text.split("energy came from [J]\n")
    sources, rest = table.split("and went to [J]\n")
    sinks, rest = rest.split("energy balance error ")
    put_in = account["work_in_J"]["motor drive"] + account["work_in_J"]["excitation shaker"]
    expected = {
        "motor drive": account["work_in_J"]["motor drive"],
        "excitation shaker": account["work_in_J"]["excitation shaker"],
        "load work": -account["work_in_J"]["load work"],
        "kinetic energy": account["kinetic_J"][1],
        "stored in coupling": account["stored_J"]["coupling"][1],
    }
    entries = [line.rsplit(maxsplit=3) for line in (sources + sinks).splitlines()]
    assert [name.strip() for name, *_ in entries] == list(expected)
    for name, energy, share, unit in entries:
        assert float(energy) == pytest.approx(expected[name.strip()], rel=1e-6)
        assert (float(share), unit) == (pytest.approx(100 * expected[name.strip()] / put_in, rel=1e-2), "%")
    assert float(rest.split()[0]) == pytest.approx(account["residual_J"], rel=1e-6)


def test_energy_of_the_start_that_is_given_away_counts_as_put_in(nocdyn, spinner):
    text = nocdyn("run", spinner).stdout
    _, table = text.split("energy came from [J]\n")
    lines = table.splitlines()
    assert lines[0].startswith("  kinetic energy ") and lines[0].endswith("  100 %")
    assert lines[1] == "and went to [J]"
    assert lines[2].startswith("  load drag ") and lines[2].endswith("  100 %")


def test_of_many_entries_the_smallest_are_one(nocdyn):
    bodies = "".join(f"&body name = 'b{i}' inertia = {1 + i}.0 speed = 1.0 /\n" for i in range(15))
    loads = "".join(f"&load name = 'l{i}' body = 'b{i}' viscous = 1.0 /\n" for i in range(15))
    text = nocdyn("run", nocdyn.write("many.nml", bodies + loads + "&run t_end = 1.0 /\n")).stdout
    _, table = text.split("and went to [J]\n")
    lines = table.splitlines()
    energies = [float(line.split()[-3]) for line in lines[:5]]
    assert lines[4].startswith("  11 others ") and lines[5].startswith("energy balance error")
    assert energies[:4] == sorted(energies[:4], reverse=True)
    works = nocdyn.summary("results/many")["energy_account"]["work_in_J"]
    assert sum(energies) == pytest.approx(-sum(works.values()), rel=1e-6)


def test_a_machine_that_turns_over_no_energy_has_no_lists(nocdyn):
    text = nocdyn("run", nocdyn.write("free.nml", "&body name = 'a' inertia = 1.0 /\n&run t_end = 1.0 /\n")).stdout
    assert "energy came from" not in text


def test_a_run_that_fails_has_the_account_of_its_rows(nocdyn):
    assert nocdyn("run", CASE_2, "--set", "run.max_steps=100").returncode == 1
    account = nocdyn.summary("results/case2")["energy_account"]
    header, rows = nocdyn.table("results/case2", "trajectory.partial.csv")
    assert account["kinetic_J"][1] == rows[-1][header.index("kinetic_energy [J]")]


ROTOR = "&body name = 'rotor' inertia = 2.0 speed = {speed} /\n{elements}\n&run t_end = 5.0 rtol = 1e-10 atol = 1e-10 {run} /\n"
LISTS = {
    # what an element takes out stands on the other side, whatever its kind
    "a dc motor that drives": (
        ROTOR.format(
            speed=0.0,
            run="",
            elements="&motor name = 'dc' body = 'rotor' kind = 'dc' voltage = 100.0 resistance = 0.5 "
            "flux_constant = 1.2 inductance = 0.01 /\n&load name = 'mill' body = 'rotor' viscous = 0.8 /",
        ),
        ["motor dc"],
        ["load mill", "kinetic energy"],
    ),
    "a dc motor that brakes": (
        ROTOR.format(
            speed=200.0,
            run="",
            elements="&motor name = 'dc' body = 'rotor' kind = 'dc' voltage = 0.0 resistance = 0.5 "
            "flux_constant = 1.2 inductance = 0.01 /",
        ),
        ["kinetic energy"],
        ["motor dc"],
    ),
    "a load that drives": (
        ROTOR.format(
            speed=0.0,
            run="",
            elements="&load name = 'river' body = 'rotor' table_speed = -10.0, 10.0 "
            "table_torque = -5.0, -5.0 /\n&motor name = 'brake' body = 'rotor' a = 0.0 b = 1.0 c = 0.0 /",
        ),
        ["load river"],
        ["motor brake", "kinetic energy"],
    ),
    "a gap that is hit": (
        ROTOR.format(
            speed=5.0,
            run="",
            elements="&coupling name = 'stop' bodies = 'ground', 'rotor' stiffness = 2e4 damping = 50.0 "
            "gap = 0.8 rest_twist = -1.0 /",
        ),
        ["stored in stop", "kinetic energy"],
        ["coupling stop"],
    ),
    "a start that is projected": (
        ROTOR.format(
            speed=20.0,
            run="start = 'projected'",
            elements="&body name = 'wheel' inertia = 3.0 /\n"
            "&gear name = 'mesh' bodies = 'rotor', 'wheel' teeth = 20, 40 /\n&load name = 'drag' body = 'rotor' viscous = 0.8 /",
        ),
        ["kinetic energy"],
        ["load drag"],
    ),
}


@pytest.mark.parametrize("machine", LISTS)
def test_every_entry_stands_on_its_side_and_both_sides_add_up(nocdyn, machine):
    text, sources, sinks = LISTS[machine]
    _, table = nocdyn("run", nocdyn.write("machine.nml", text)).stdout.split("energy came from [J]\n")
    sides = table.split("energy balance error")[0].split("and went to [J]\n")
    entries = [
        {name.strip(): float(energy) for name, energy, *_ in (line.rsplit(maxsplit=3) for line in side.splitlines())}
        for side in sides
    ]
    assert [sorted(side) for side in entries] == [sorted(sources), sorted(sinks)]
    came, went = (sum(side.values()) for side in entries)
    account = nocdyn.summary("results/machine")["energy_account"]
    assert came == pytest.approx(went, rel=1e-5)  # seven digits are printed, and the step control leaves a residual
    assert abs(account["residual_J"]) < 1e-5 * came


def test_the_energy_that_a_projected_start_loses_is_no_part_of_the_run(nocdyn):
    outcome = nocdyn("run", nocdyn.write("machine.nml", LISTS["a start that is projected"][0]))
    speed = 2 * 20 / (2 + 3 * 0.5**2)  # the wheel turns half as fast, backwards
    start = 0.5 * (2 + 3 * 0.5**2) * speed**2
    assert f"kinetic energy lost: {0.5 * 2 * 20**2 - start:.4f} J" in outcome.stdout + outcome.stderr
    assert nocdyn.summary("results/machine")["energy_account"]["kinetic_J"][0] == pytest.approx(start, rel=1e-12)


@pytest.mark.parametrize("method", ["rk45", "auto", "rodas4", "rodas5p"])
@pytest.mark.parametrize(
    "torque",
    [
        "kind = 'ramp'  amplitude = 10.0  time = 0.5  duration = 3.0",
        "kind = 'table'  table_time = 0.3, 0.8, 1.1, 1.9  table_torque = 1.0, -2.0, 5.0, 3.0  interpolation = 'cubic'",
    ],
)
def test_works_are_right_where_nothing_else_limits_the_steps(nocdyn, tmp_path, method, torque):
    # the speed is a polynomial of the time, which a method may follow without any error; its power is not
    tmp_path.joinpath("lone.nml").write_text(f"""
&body name = 'rotor' inertia = 2.0 speed = 1.0 /
&excitation name = 'drive' body = 'rotor' {torque} /
&run t_end = 4.0 method = '{method}' rtol = 1.0e-10 atol = 1.0e-10 /
""")
    assert nocdyn("run", tmp_path / "lone.nml", "--out", "lone").returncode == 0
    header, rows = nocdyn.table("lone")
    residual, work = header.index("energy_residual [J]"), header.index("work_in [J]")
    assert max(abs(row[residual]) for row in rows) < 1e-6 * max(abs(row[work]) for row in rows)

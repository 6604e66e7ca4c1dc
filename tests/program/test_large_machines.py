"""Machines of thousands of bodies: memory in proportion to their number, and results that are right."""

import math
import resource

import pytest
from conftest import TRAPS_EXCEPTIONS, peak_memory

STAGES = 2000
OUTPUT = "&load name = 'load' body = 'b0' viscous = 0.1 /\n&motor name = 'motor' body = 'b0' a = 10 b = 0 c = 0 /\n"
RUN = "&run t_end = 0.01 rtol = 1e-9 /\n&output points = 2 /\n"


def ratio(stage):
    return (20 + stage % 3, 21 - stage % 2)


def train(gears):
    """Wheels in a row, with this many gears between each and the next."""
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(STAGES + 1)]
    for i in range(STAGES):
        teeth = "{}, {}".format(*ratio(i))
        lines += [f"&gear name = 'g{i}_{k}' bodies = 'b{i}', 'b{i + 1}' teeth = {teeth} /" for k in range(gears)]
    return "\n".join(lines) + "\n" + OUTPUT + RUN


@pytest.mark.parametrize("gears", [1, 2])
def test_a_train_of_2000_stages_needs_no_dense_matrix(nocdyn, gears):
    nocdyn.write("train.nml", train(gears))
    megabytes, _ = peak_memory(nocdyn, "run", "train.nml", "--out", "out")
    assert megabytes < 75 + 25 * gears  # one matrix of all wheels and all gears has 32 for each, and there would be several
    header, rows = nocdyn.table("out")
    last = dict(zip(header, rows[-1]))
    speeds = [last[f"omega_b{i} [rad/s]"] for i in range(STAGES + 1)]
    for i in range(STAGES):
        a, b = ratio(i)
        assert speeds[i + 1] == pytest.approx(-a / b * speeds[i], rel=1e-12)
    # J omega0' = 10 - 0.1 omega0 with the inertias as the first wheel feels them
    inertia = sum((speed / speeds[0]) ** 2 for speed in speeds)
    assert speeds[0] == pytest.approx(100 * (1 - math.exp(-0.1 * 0.01 / inertia)), rel=1e-8)
    # gears in parallel share what one would carry: inertia * acceleration of the wheels behind
    behind = sum(speed**2 for speed in speeds[1:]) / speeds[0] ** 2
    torque = -behind / inertia * (10 - 0.1 * speeds[0])
    for k in range(gears):
        assert last[f"reaction_g0_{k} [N m]"] == pytest.approx(torque / gears, rel=1e-9)


def test_a_reduction_beyond_all_numbers_is_no_lock(nocdyn):
    wheels = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(1201)]
    gears = [f"&gear name = 'g{i}' bodies = 'b{i}', 'b{i + 1}' radii = 1.0, 2.0 /" for i in range(1200)]
    nocdyn.write("steep.nml", "\n".join([*wheels, *gears, OUTPUT, RUN]))
    assert nocdyn("run", "steep.nml", "--out", "out").returncode == 0
    header, rows = nocdyn.table("out")
    last = dict(zip(header, rows[-1]))
    assert last["omega_b1 [rad/s]"] == pytest.approx(-last["omega_b0 [rad/s]"] / 2, rel=1e-14)
    outcome = nocdyn("check", "steep.nml", "--set", "run.independent='b1200'")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert "independent 'b1200' cannot be independent: 'b0' turns more than 1e100 times as fast" in outcome.stderr


def test_long_reports_stay_readable(nocdyn):
    nocdyn.write("train.nml", train(2))
    lines = nocdyn("check", "train.nml").stdout.splitlines()
    assert len(lines) < 80 and max(map(len, lines)) < 250
    assert lines[1] == "  1 degree of freedom"
    assert "  and 1960 more dependent speeds" in lines
    assert "  note: 1988 more constraints repeat others" in lines


def test_a_chain_of_10000_bodies_needs_memory_in_proportion(nocdyn):
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(10000)]
    lines += [f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e4 damping = 1.0 /" for i in range(9999)]
    nocdyn.write("chain.nml", "\n".join(lines) + "\n" + OUTPUT + RUN)
    megabytes, _ = peak_memory(nocdyn, "check", "chain.nml")
    assert megabytes < 300  # a dense matrix has 800


without_checks = pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build checks every index")


def chain(count):
    lines = [f"&body name = 'b{i}' inertia = 1.0 speed = {i % 2} /" for i in range(count)]
    lines += [f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e4 damping = 1.0 /" for i in range(count - 1)]
    return "\n".join(lines) + "\n" + OUTPUT + "&run t_end = 0.02 /\n"


def processor_time(nocdyn, *words):
    """The least of three runs [s]."""
    times = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        assert nocdyn(*words).returncode == 0
        times.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    return min(times)


@without_checks
@pytest.mark.parametrize("method", ["rk853", "rodas5p"])
def test_the_time_of_a_run_grows_with_the_length_of_a_chain(nocdyn, method):
    times = []
    for count in (1500, 6000):
        nocdyn.write("chain.nml", chain(count))
        words = ("--set", f"run.method={method}", "--set", "output.points=2")
        times.append(processor_time(nocdyn, "run", "chain.nml", "--out", "out", "-q", *words))
    assert times[1] < 8 * times[0]  # four bodies for one: 4 times, and 16 where a matrix were dense


@without_checks
def test_the_time_of_a_check_grows_with_the_length_of_a_chain(nocdyn):
    times = []
    for count in (2500, 10000):
        nocdyn.write("chain.nml", chain(count))
        times.append(processor_time(nocdyn, "check", "chain.nml"))
    assert times[1] < 8 * times[0]

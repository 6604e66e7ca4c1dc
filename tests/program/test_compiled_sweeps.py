"""Programs that a sweep compiles for its series: the bits of the results, the cache, and what happens without a compiler."""

import os
import shutil
import stat
import time

import pytest
from sweep_inputs import SWEEP, TWO_DISCS, needs_sweeps

pytestmark = needs_sweeps

# An engine, in which orders, quadratic laws and cubic springs meet.
ENGINE = """\
&body name = 'crank' inertia = 0.4 speed = 100.0 /
&body name = 'wheel' inertia = 2.0 speed = 100.0 /
&body name = 'rotor' inertia = 1.5 speed = 100.0 /
&coupling name = 'shaft' bodies = 'crank', 'wheel' stiffness = 4e4 damping = 3.0 /
&coupling name = 'rubber' bodies = 'wheel', 'rotor' stiffness = 8e3 cubic_stiffness = 5e4 damping = 40.0 /
&engine name = 'gas' stroke = 4 cylinders = 'crank', 'wheel' firing_deg = 0, 180 orders = 0.5, 1, 2.5 amplitudes = 40, 60, 25 /
&motor name = 'mean' body = 'crank' kind = 'constant' torque = 30.0 /
&load name = 'fan' body = 'rotor' viscous = 0.3 /
&excitation name = 'pulse' body = 'rotor' amplitude = 5.0 frequency_hz = 20.0 /
&run t_end = 0.4 method = 'METHOD' rtol = 1e-7 atol = 1e-7 /
&output points = 11 /
&sweep design = 'random' samples = 61 seed = 2 /
&vary target = 'coupling.rubber.stiffness' low = 6e3 high = 1e4 /
&vary target = 'coupling.rubber.cubic_stiffness' low = 0.0 high = 1e5 /
&vary target = 'body.rotor.inertia' low = 1.0 high = 2.0 /
&record quantity = 'omega_rotor' statistic = 'final', 'max', 'time_of_max' /
&record quantity = 'moment_shaft' statistic = 'max_abs', 'rms' /
&record quantity = 'moment_rubber' statistic = 'max_abs', 'min', 'mean' /
"""

# A mill, whose steps end at the edges of a gap and at the points of a table.
MILL = """\
&body name = 'motor' inertia = 60.0 speed = 6.3 /
&body name = 'stand' inertia = 2.5 speed = 6.3 /
&body name = 'roll' inertia = 1.8 speed = 6.3 /
&coupling name = 'shaft' bodies = 'motor', 'stand' stiffness = 6e4 damping = 50.0 /
&coupling name = 'spindle' bodies = 'stand', 'roll' stiffness = 4.5e4 damping = 40.0 gap = 0.02 /
&motor name = 'drive' body = 'motor' a = 1.2e4 b = 1.9e3 c = 0.0 /
&load name = 'fan' body = 'roll' viscous = 0.8 quadratic = 0.3 /
&excitation name = 'billet' body = 'roll' kind = 'table' table_time = 0.0, 0.05, 0.07, 0.3, 0.31
  table_torque = 0.0, 0.0, -600.0, -560.0, 0.0 /
&run t_end = 0.4 method = 'METHOD' rtol = 1e-7 atol = 1e-7 /
&output points = 11 /
&sweep design = 'random' samples = 61 seed = 2 /
&vary target = 'coupling.spindle.stiffness' low = 3.6e4 high = 5.4e4 /
&vary target = 'coupling.spindle.gap' low = 0.016 high = 0.024 /
&vary target = 'body.roll.inertia' low = 1.5 high = 2.0 /
&record quantity = 'omega_roll' statistic = 'final', 'max', 'time_of_max' /
&record quantity = 'moment_shaft' statistic = 'max_abs', 'rms' /
&record quantity = 'twist_spindle' statistic = 'max', 'min' /
"""


class Compiler:
    """A compiler that counts what it compiles, and a cache folder of its own."""

    def __init__(self, folder, before=""):
        self.log = folder / "compiled"
        self.cache = folder / "cache"
        self.cache.mkdir()
        script = folder / "compiler"
        real = shutil.which("cc")
        script.write_text(f'#!/bin/sh\ncase "$*" in *-shared*) echo x >> {self.log}; {before} ;; esac\nexec {real} "$@"\n')
        script.chmod(0o755)
        self.environment = os.environ | {"CC": str(script), "XDG_CACHE_HOME": str(self.cache)}

    @property
    def folder(self):
        return self.cache / "nocdyn"

    @property
    def count(self):
        return len(self.log.read_text().split()) if self.log.exists() else 0


@pytest.fixture
def compiler(tmp_path):
    return Compiler(tmp_path)


def sweep(nocdyn, out, compiler, *words, text=TWO_DISCS + SWEEP):
    file = nocdyn.write("sweep.nml", text)
    outcome = nocdyn("sweep", file, "--out", out, *words, env=compiler.environment)
    assert outcome.returncode == 0, outcome.stderr
    return outcome.stdout


def results(nocdyn, out):
    return (nocdyn.folder / out / "sweep.nc").read_bytes()


@pytest.mark.parametrize("machine", [ENGINE, MILL], ids=["engine", "mill"])
@pytest.mark.parametrize("method", ["taylor", "auto"])
def test_results_have_the_bits_of_the_recurrence(nocdyn, compiler, method, machine):
    text = machine.replace("METHOD", method)
    sweep(nocdyn, "without", compiler, "--compile", "never", text=text)
    assert compiler.count == 0
    sweep(nocdyn, "with", compiler, "--compile", "always", "--threads", "2", text=text)
    assert compiler.count == 1
    assert results(nocdyn, "with") == results(nocdyn, "without")


def test_a_program_is_compiled_once(nocdyn, compiler):
    """Numbers of the machine are arguments: another stiffness needs no other program."""
    sweep(nocdyn, "first", compiler, "--compile", "always")
    assert "note" not in sweep(nocdyn, "second", compiler, "--compile", "always", "--set", "body.wheel.inertia=2.5")
    assert compiler.count == 1
    sweep(nocdyn, "third", compiler, "--compile", "always", "--set", "load.drag.quadratic=0.01")
    assert compiler.count == 2


def test_the_cache_is_for_its_owner_alone(nocdyn, compiler):
    sweep(nocdyn, "out", compiler, "--compile", "always")
    assert stat.S_IMODE(compiler.folder.stat().st_mode) == 0o700
    assert {path.suffix for path in compiler.folder.iterdir()} == {".c", ".so", ".lock"}


def test_nothing_is_loaded_from_a_folder_that_others_may_write(nocdyn, compiler):
    sweep(nocdyn, "first", compiler, "--compile", "always")
    compiler.folder.chmod(0o777)
    before = {path: path.stat().st_mtime_ns for path in compiler.folder.iterdir()}
    sweep(nocdyn, "second", compiler, "--compile", "always")
    assert compiler.count == 2
    assert {path: path.stat().st_mtime_ns for path in compiler.folder.iterdir()} == before


def test_a_program_with_another_source_is_not_loaded(nocdyn, compiler):
    sweep(nocdyn, "first", compiler, "--compile", "always")
    [source] = compiler.folder.glob("*.c")
    source.write_text(source.read_text().replace("1.0", "2.0", 1))
    sweep(nocdyn, "second", compiler, "--compile", "always")
    assert compiler.count == 2
    assert results(nocdyn, "second") == results(nocdyn, "first")


def test_programs_that_are_not_used_are_removed(nocdyn, compiler):
    sweep(nocdyn, "first", compiler, "--compile", "always")
    long_ago = time.time() - 31 * 86400
    old = compiler.folder / "0123456789abcdef.so"
    old.touch()
    os.utime(old, (long_ago, long_ago))
    for path in compiler.folder.glob("*.c"):
        os.utime(path, (long_ago, long_ago))  # its use makes it new
    sweep(nocdyn, "second", compiler, "--compile", "always")
    assert not old.exists()
    assert compiler.count == 1
    assert list(compiler.folder.glob("*.c"))


def test_processes_wait_for_the_one_that_compiles(nocdyn, tmp_path):
    compiler = Compiler(tmp_path, before="sleep 0.5")
    file = nocdyn.write("sweep.nml", TWO_DISCS + SWEEP)
    words = ("sweep", file, "--compile", "always", "--out")
    processes = [nocdyn.start(*words, f"out_{i}", env=compiler.environment) for i in range(3)]
    assert [process.wait() for process in processes] == [0, 0, 0]
    assert compiler.count == 1
    assert results(nocdyn, "out_0") == results(nocdyn, "out_2")


def test_without_a_compiler_there_is_a_note_if_a_program_was_asked_for(nocdyn, compiler):
    compiler.environment["CC"] = "no_such_compiler"
    printed = sweep(nocdyn, "always", compiler, "--compile", "always")
    assert "note: no program was compiled for the series: there is no compiler no_such_compiler\n" in printed
    assert "note" not in sweep(nocdyn, "auto", compiler)
    assert results(nocdyn, "always") == results(nocdyn, "auto")


@pytest.mark.parametrize("kind", ["missing", "file"])
def test_without_a_folder_for_programs_a_sweep_goes_on_without_one(nocdyn, compiler, tmp_path, kind):
    compiler.folder.mkdir(mode=0o777)
    compiler.folder.chmod(0o777)
    folder = tmp_path / "temporary"
    if kind == "file":
        folder.touch()
    compiler.environment["TMPDIR"] = str(folder)
    printed = sweep(nocdyn, "out", compiler, "--compile", "always")
    reason = "there is neither a private cache folder nor a temporary folder"
    assert f"note: no program was compiled for the series: {reason}\n" in printed
    assert compiler.count == 0
    assert list(compiler.folder.iterdir()) == []


def test_a_compiler_that_fails_is_named_with_what_it_says(nocdyn, tmp_path):
    compiler = Compiler(tmp_path, before="echo 'no room' >&2; exit 1")
    printed = sweep(nocdyn, "out", compiler, "--compile", "always")
    assert f"note: no program was compiled for the series: {compiler.environment['CC']} failed: no room\n" in printed
    assert {path.suffix for path in compiler.folder.iterdir()} == {".c", ".lock"}


def test_a_sweep_that_has_no_program_says_why(nocdyn, compiler):
    record = "&record quantity = 'energy_residual' statistic = 'max_abs' /\n"
    printed = sweep(nocdyn, "out", compiler, "--compile", "always", text=TWO_DISCS + SWEEP + record)
    assert "note: no program was compiled for the series: work is integrated\n" in printed
    assert compiler.count == 0


def test_auto_compiles_where_the_work_is_worth_it(nocdyn, compiler):
    sweep(nocdyn, "little", compiler)
    assert compiler.count == 0
    words = ("--set", "sweep.samples=40000", "--set", "run.t_end=30", "--set", "run.rtol=1e-6", "--set", "run.atol=1e-6")
    sweep(nocdyn, "much", compiler, *words)
    assert compiler.count == 1


def test_other_choices_are_refused(nocdyn):
    outcome = nocdyn("sweep", "sweep.nml", "--compile", "sometimes")
    assert outcome.returncode == 2
    assert outcome.stderr == "nocdyn: --compile sometimes: allowed: auto|always|never\n"

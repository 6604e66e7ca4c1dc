"""The scripts around the program: figures, numbers, and what scripts/setup installs."""

import importlib.util
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from figure_files import assert_figures, call, chain, refusal, run_input
from verified import known

NOCDYN = os.environ["NOCDYN"]
SOURCE = Path(os.environ["NOCDYN_SOURCE"])
SCRIPTS = SOURCE / "scripts"
SETUP = SCRIPTS / "setup"
CASES = [SOURCE / "input" / "paper" / f"case{number}.nml" for number in (1, 2)]

# The uniform motion of the paper's machine: the root of w^2 + (10 + 100 (2/3)^2) w - 200 = 0.
UNIFORM_SPEED = known("steady_states.falling_motor.stable")
# The paper's case 1 has settled to this after 10 s.
SETTLED = 1e-6


@pytest.fixture(scope="session")
def paper_results(tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("paper results")
    subprocess.run([NOCDYN, "run", "--quiet", "--out", folder, *CASES], check=True)
    return [folder / case.stem for case in CASES]


def test_paper_figures_appear_in_three_formats(paper_results, tmp_path, monkeypatch):
    call(monkeypatch, "paper_figures", *paper_results, "--out", tmp_path)
    assert_figures(tmp_path, "figure2", "figure3", "figure4", "figure5")
    assert "Paper, case 2" in (tmp_path / "figure5.svg").read_text(encoding="utf-8")


def test_numbers_stand_beside_their_closed_forms(paper_results, monkeypatch, capsys):
    call(monkeypatch, "paper_numbers", *paper_results)
    case1, case2 = capsys.readouterr().out.split("\n\n")
    moment = -100.0 * 4.0 / 9.0 * UNIFORM_SPEED
    uniform = [UNIFORM_SPEED, UNIFORM_SPEED, -2.0 / 3.0 * UNIFORM_SPEED, moment, moment / 2.0]
    last_columns = [
        [float(word) for word in line.split("]")[1].replace("..", " ").split()]
        for case in (case1, case2)
        for line in case.splitlines()[2:]
    ]
    for expected, (end, steady, difference) in zip(uniform, last_columns[:5], strict=True):
        assert steady == pytest.approx(expected, rel=1e-8)
        assert end == pytest.approx(expected, rel=SETTLED)
        assert abs(difference) < SETTLED * abs(expected)
    for expected, (end, steady, low, high) in zip(uniform, last_columns[5:], strict=True):
        assert steady == pytest.approx(expected, rel=1e-8)
        assert low <= end <= high
        assert low < expected < high


def test_numbers_of_another_machine_are_refused(tmp_path, monkeypatch, capsys):
    results = run_input(tmp_path, chain(2, "t_end = 1.0"))
    with pytest.raises(SystemExit):
        call(monkeypatch, "paper_numbers", results)
    assert "not the paper's machine" in capsys.readouterr().err


def modes_of(folder: Path, text: str) -> Path:
    file = folder / "machine.nml"
    file.write_text(text, encoding="utf-8")
    subprocess.run([NOCDYN, "modes", file, "--out", folder / "modes"], check=True, capture_output=True)
    return folder / "modes"


def test_modes_of_a_geared_machine_on_the_ground_are_drawn(tmp_path, monkeypatch):
    results = modes_of(
        tmp_path,
        """
&case title = 'Costs $5' /
&body name = 'a $ b' inertia = 1.0 /
&body name = 'wheel' inertia = 1.0 /
&body name = 'disc' inertia = 1.0 /
&coupling name = 'mount' bodies = 'ground', 'a $ b' stiffness = 100.0 damping = 5.0 /
&coupling name = 'shaft' bodies = 'wheel', 'disc' stiffness = 100.0 damping = 0.1 /
&gear name = 'g' bodies = 'a $ b', 'wheel' teeth = 20, 50 /
&run t_end = 1.0 /
""",
    )
    call(monkeypatch, "mode_figures", results, "--format", "pdf,svg")
    assert_figures(results / "figures", "modes", formats=("pdf", "svg"))
    text = (results / "figures" / "modes.svg").read_text(encoding="utf-8")
    assert "1 : -0.4" in text and "Costs $5" in text.replace("\\$", "$") and "modes about the steady state" in text


def test_many_modes_of_many_bodies_are_drawn_in_several_figures(tmp_path, monkeypatch):
    results = modes_of(tmp_path, chain(30, "t_end = 1.0"))
    call(monkeypatch, "mode_figures", results, "--modes", 8, "--format", "svg")
    assert_figures(results / "figures", "modes", "modes_2", formats=("svg",))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no modes.json here; 'nocdyn modes FILE --out "),
        ("{", "modes.json: is no complete JSON: line 1"),
        ("{}", "this is no modes.json of nocdyn"),
    ],
)
def test_a_folder_without_modes_is_refused(tmp_path, monkeypatch, content, message):
    if content is not None:
        (tmp_path / "modes.json").write_text(content)
    assert message in refusal(monkeypatch, "mode_figures", tmp_path)


def test_a_machine_that_does_not_oscillate_is_refused(tmp_path, monkeypatch):
    results = modes_of(tmp_path, chain(1, "t_end = 1.0"))
    assert "nothing to draw: no mode oscillates" in refusal(monkeypatch, "mode_figures", results)


def test_results_of_two_programs_are_compared_column_by_column():
    import pandas as pd

    largest_difference = importlib.import_module("nocdyn_report.differences").largest_difference
    one = pd.DataFrame({"t [s]": [0.0, 1.0], "a": [1.0, -8.0], "work_in [J]": [0.0, 100.0], "energy_residual [J]": [0.0, 1e-9]})
    assert largest_difference(one, one) == (0.0, "t [s]")
    assert largest_difference(one, one.assign(a=[2.0, -8.0])) == (0.125, "a")
    assert largest_difference(one, one.assign(**{"energy_residual [J]": 1.0})) == (0.01, "energy_residual [J]")
    assert largest_difference(one, one.assign(a=[2.0, float("nan")])) == (math.inf, "numbers that are not finite")
    assert largest_difference(one, one.rename(columns={"a": "b"}))[0] == math.inf


class BareMachine:
    """A PATH with the plain tools and stand-ins: apt-get notes its arguments and 'installs' the compilers and mpirun."""

    TOOLS = ("bash", "cat", "chmod", "dirname", "env", "mktemp", "rm", "tail", "cmake", "ninja", "g++", "python3")
    COMPILERS = ("gfortran", "mpifort", "mpirun")
    COMPILER = '#!/usr/bin/env bash\necho "/lib/${1#*=}"\n'
    PACKAGES = "gfortran liblapack-dev libblas-dev libnetcdff-dev libnlopt-dev libopenmpi-dev openmpi-bin"

    def __init__(self, folder: Path):
        self.folder = folder
        self.calls = folder / "calls"
        for tool in self.TOOLS:
            (folder / tool).symlink_to(shutil.which(tool))

    def stand_in(self, name: str, text: str) -> None:
        file = self.folder / name
        file.write_text(text, encoding="utf-8")
        file.chmod(0o755)

    def setup(self, *parts: str) -> subprocess.CompletedProcess:
        environment = {"PATH": str(self.folder), "HOME": str(self.folder)}
        return subprocess.run(
            [SETUP, *parts], text=True, capture_output=True, stdin=subprocess.DEVNULL, env=environment, cwd=self.folder
        )


@pytest.fixture
def bare_machine(tmp_path) -> BareMachine:
    machine = BareMachine(tmp_path)
    machine.stand_in("id", "#!/usr/bin/env bash\necho 1000\n")
    machine.stand_in(
        "apt-get",
        f"""#!/usr/bin/env bash
echo "$@" >> '{machine.calls}'
[[ $1 == install ]] || exit 0
for name in {" ".join(machine.COMPILERS)}; do
  printf '%s\\n' '{machine.COMPILER}' > '{tmp_path}'/$name
  chmod +x '{tmp_path}'/$name
done
""",
    )
    return machine


def test_setup_is_silent_when_nothing_is_missing(bare_machine):
    for name in bare_machine.COMPILERS:
        bare_machine.stand_in(name, bare_machine.COMPILER)
    result = bare_machine.setup("build")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert not bare_machine.calls.exists()


def test_setup_installs_the_second_compiler_where_it_makes_no_program(bare_machine):
    assert "flang-22 libflang-22-dev libomp-22-dev\n" in bare_machine.setup("flang").stderr
    bare_machine.stand_in("flang-22", bare_machine.COMPILER)
    result = bare_machine.setup("flang")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_setup_installs_the_browser_of_reports_where_it_is_missing(bare_machine):
    assert "chromium chromium-driver fonts-liberation\n" in bare_machine.setup("browser").stderr
    for name in ("chromium", "chromedriver"):
        bare_machine.stand_in(name, "#!/usr/bin/env bash\n")
    bare_machine.stand_in("fc-list", "#!/usr/bin/env bash\necho LiberationSans-Regular.ttf\n")
    result = bare_machine.setup("browser")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_a_report_says_that_it_can_do_without_a_browser(bare_machine):
    environment = {"PATH": str(bare_machine.folder), "HOME": str(bare_machine.folder)}
    result = subprocess.run(
        [SCRIPTS / "report", "m.nml"], text=True, capture_output=True, env=environment, cwd=bare_machine.folder
    )
    assert result.returncode == 3
    assert result.stderr.endswith("scripts/report: Chromium prints the PDF; with --no-pdf it is not needed\n")


def test_setup_without_root_and_sudo_says_what_to_run(bare_machine):
    result = bare_machine.setup("build")
    assert result.returncode == 3
    assert f"apt-get update && apt-get install --no-install-recommends {bare_machine.PACKAGES}\n" in result.stderr
    assert not bare_machine.calls.exists()


def test_setup_installs_what_is_missing_by_sudo(bare_machine):
    bare_machine.stand_in("sudo", '#!/usr/bin/env bash\n[[ $1 == true ]] || exec "$@"\n')
    result = bare_machine.setup("build")
    assert (result.returncode, result.stderr) == (0, "")
    assert bare_machine.calls.read_text(encoding="utf-8").splitlines() == [
        "update",
        f"install --yes --no-install-recommends {bare_machine.PACKAGES}",
    ]


def test_setup_says_when_an_installation_did_not_help(bare_machine):
    bare_machine.stand_in("id", "#!/usr/bin/env bash\necho 0\n")
    bare_machine.stand_in("apt-get", "#!/usr/bin/env bash\n")
    result = bare_machine.setup("build")
    assert result.returncode == 3
    assert f"still not found or too old: {bare_machine.PACKAGES}" in result.stderr


def test_setup_on_another_system_says_what_is_needed(bare_machine):
    (bare_machine.folder / "apt-get").unlink()
    result = bare_machine.setup("build")
    assert result.returncode == 3
    assert f"must be installed first: {bare_machine.PACKAGES}" in result.stderr


def test_setup_refuses_an_unknown_part(bare_machine):
    result = bare_machine.setup("building")
    assert result.returncode == 2
    assert "there is no part 'building'" in result.stderr


def test_the_cost_of_a_step_is_measured_for_every_kind_of_machine():
    options = ["--nocdyn", NOCDYN, "--sizes", "10", "20", "--rounds", "1", "--methods", "rk45"]
    command = [sys.executable, "-m", "nocdyn_bench.scale", *options]
    outcome = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(SCRIPTS)})
    assert (outcome.returncode, outcome.stderr) == (0, "")
    header, _, *rows = [line.strip("| ").split(" | ") for line in outcome.stdout.splitlines()[2:]]
    assert header == ["machine", "method", "10", "20"]
    assert [row[:2] for row in rows] == [[kind, "rk45"] for kind in ("chain", "gaps", "train", "pairs")]
    assert all(float(cell.split()[0]) > 0 for row in rows for cell in row[2:])


def test_sizes_that_make_no_machine_are_refused():
    command = [sys.executable, "-m", "nocdyn_bench.scale", "--nocdyn", NOCDYN, "--sizes", "2"]
    outcome = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(SCRIPTS)})
    assert outcome.returncode == 2 and "--sizes must be at least 4" in outcome.stderr

"""nocdyn sensitivity: derivatives against central differences of numbers of 200 bits, and of the program's own answers."""

import json
import random

import mpmath
import pytest
from conftest import SOURCE

DIGITS = 40
STEP = mpmath.mpf("1e-14")  # relative, of central differences with so many digits
TURN = 2 * mpmath.pi
ORDER, TORQUE = 2.0, 7.0


def random_chain(dice, bodies):
    """Inertias and couplings (stiffness, relative damping, viscous damping) of a chain with a load at its end."""
    inertias = [dice.uniform(0.5, 3) for _ in range(bodies)]
    couplings = [(dice.uniform(1e4, 4e4), dice.uniform(0.05, 0.4), dice.uniform(0.5, 3)) for _ in range(bodies - 1)]
    return {f"body.b{i}.inertia": inertia for i, inertia in enumerate(inertias)} | {
        f"coupling.c{i}.{key}": value
        for i, values in enumerate(couplings)
        for key, value in zip(("stiffness", "relative_damping", "damping"), values, strict=True)
    }


def chain_text(numbers, bodies):
    text = "".join(f"&body name = 'b{i}' inertia = {numbers[f'body.b{i}.inertia']!r} /\n" for i in range(bodies))
    for i in range(bodies - 1):
        keys = " ".join(f"{key} = {numbers[f'coupling.c{i}.{key}']!r}" for key in ("stiffness", "relative_damping", "damping"))
        text += f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' {keys} /\n"
    return text + (
        f"&load name = 'l' body = 'b{bodies - 1}' viscous = 0.1 /\n"
        f"&excitation name = 'e' body = 'b0' kind = 'orders' orders = {ORDER} amplitudes = {TORQUE} /\n"
        "&response body = 'b0' speed = 20, 150 count = 200 operating = 120, 140 /\n&run t_end = 1 start = 'equilibrium' /\n"
    )


class Chain:
    """The same machine with exact numbers."""

    def __init__(self, numbers, bodies):
        self.bodies = bodies
        self.inertia = [numbers[f"body.b{i}.inertia"] for i in range(bodies)]
        self.couplings = [
            [numbers[f"coupling.c{i}.{key}"] for key in ("stiffness", "relative_damping", "damping")] for i in range(bodies - 1)
        ]

    def stiffness(self, i, value):
        """D of a coupling for motions exp(value t): the relative damping is 2 pi times the loss factor."""
        k, psi, c = self.couplings[i]
        return k + value * c + value / mpmath.im(value) * k * psi / (2 * mpmath.pi)

    def matrix(self, value):
        matrix = mpmath.matrix(self.bodies)
        for i, inertia in enumerate(self.inertia):
            matrix[i, i] += value**2 * inertia
        matrix[self.bodies - 1, self.bodies - 1] += value * mpmath.mpf("0.1")
        for i in range(self.bodies - 1):
            d = self.stiffness(i, value)
            for a, b, sign in ((i, i, 1), (i + 1, i + 1, 1), (i, i + 1, -1), (i + 1, i, -1)):
                matrix[a, b] += sign * d
        return matrix

    def eigenvalue(self, start):
        """Near a start: of both parts, because relative damping is no analytic function."""
        scale = mpmath.det(self.matrix(start * mpmath.mpc(1, "0.2")))

        def residual(real, imaginary):
            determinant = mpmath.det(self.matrix(mpmath.mpc(real, imaginary))) / scale
            return [mpmath.re(determinant), mpmath.im(determinant)]

        found = mpmath.findroot(
            residual, (mpmath.re(start), mpmath.im(start)), tol=mpmath.mpf(10) ** (8 - 2 * DIGITS), maxsteps=30
        )
        return mpmath.mpc(found[0], found[1])

    def amplitude(self, coupling, speed):
        """Of the moment of a coupling, by the only line."""
        value = mpmath.mpc(0, ORDER * speed)
        force = mpmath.matrix(self.bodies, 1)
        force[0] = mpmath.mpf(TORQUE)
        motion = mpmath.lu_solve(self.matrix(value), force)
        return abs(self.stiffness(coupling, value) * (motion[coupling + 1] - motion[coupling]))


def sensitivity(nocdyn, text, *words):
    nocdyn.done(text, *words, command="sensitivity")
    report = json.loads((nocdyn.folder / "out/sensitivity.json").read_text())
    paths = [number["path"] for number in report["numbers"]]
    return [one | {"by": dict(zip(paths, one["derivative"], strict=True))} for one in report["answers"]], report


class Changed:
    """What a chain with one number p (1 + sign STEP) answers, each mode found once."""

    def __init__(self, numbers, bodies, starts, path=None, sign=0):
        exact = {key: mpmath.mpf(value) for key, value in numbers.items()}
        if path:
            exact[path] *= 1 + sign * STEP
        self.chain = Chain(exact, bodies)
        self.modes = {number: self.chain.eigenvalue(start) for number, start in starts.items()}

    def critical(self, number):
        return mpmath.im(self.modes[number]) / ORDER

    def answer(self, one, number, beside):
        value = self.modes[number]
        match one["kind"]:
            case "frequency":
                return mpmath.im(value) / TURN
            case "damping ratio":
                return -mpmath.re(value) / abs(value)
            case "critical speed":
                return self.critical(number) * 60 / TURN
            case "margin":
                return max(0, (120 - self.critical(number)) / 120, (self.critical(number) - 140) / 140)
        coupling = int(one["of"].split("_c")[1].split(" ")[0])
        return self.chain.amplitude(coupling, self.critical(number) + beside[number])


def mode_of(one):
    return int(one["of"].split("mode ")[1].split(",")[0])


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_a_chain_are_those_of_exact_numbers(nocdyn, seed):
    dice = random.Random(seed)
    bodies = 3
    numbers = random_chain(dice, bodies)
    answers, _ = sensitivity(nocdyn, chain_text(numbers, bodies))
    nocdyn.done(chain_text(numbers, bodies), command="response")
    criticals = json.loads((nocdyn.folder / "out/response.json").read_text())["critical_speeds"]
    assert {one["kind"] for one in answers} == {"frequency", "damping ratio", "critical speed", "margin", "half range"}
    known = {(one["kind"], mode_of(one)): one["value"] for one in answers if one["kind"] in {"frequency", "damping ratio"}}
    with mpmath.workdps(DIGITS):
        starts = {}
        for number in {number for _, number in known}:
            ratio = known["damping ratio", number]
            size = known["frequency", number] * TURN / mpmath.sqrt(1 - ratio**2)
            starts[number] = size * mpmath.mpc(-ratio, mpmath.sqrt(1 - ratio**2))
        here = Changed(numbers, bodies, starts)
        ends = {path: [Changed(numbers, bodies, here.modes, path, sign) for sign in (1, -1)] for path in numbers}
        beside = {place["mode"]: place["peak_speed_rad_s"] - here.critical(place["mode"]) for place in criticals}
        for one in answers:
            number = mode_of(one)
            assert one["value"] == pytest.approx(float(here.answer(one, number, beside)), rel=1e-9, abs=1e-12)
            for path, value in numbers.items():
                high, low = (end.answer(one, number, beside) for end in ends[path])
                expected = float((high - low) / (2 * STEP * mpmath.mpf(value)))
                # what a change of the whole number does, beside the answer itself
                assert abs(one["by"][path] - expected) * value <= 1e-8 * (abs(one["value"]) or 1), (one["kind"], one["of"], path)


DRIVES = {
    "motor": {"motor.d.a": 900.0, "motor.d.b": 3.0},
    "governor": {"motor.d.a": 900.0, "motor.d.b": 3.0, "motor.d.governor_gain": 0.01, "motor.d.governor_time": 0.7},
    "torque": {},
}
SET_SPEED = 90.0


def bent_text(numbers, drive):
    """A motor, a coupling with a cubic law and a load; the speed is held by the motor, by its throttle or by a torque."""

    def keys(name):
        return " ".join(f"{key.split('.')[2]} = {value!r}" for key, value in numbers.items() if key.startswith(name))

    text = (
        f"&body name = 'm' {keys('body.m')} speed = 95 /\n&body name = 'l' {keys('body.l')} /\n"
        f"&coupling name = 'k' bodies = 'm', 'l' {keys('coupling.k')} /\n&load name = 'w' body = 'l' {keys('load.w')} /\n"
        f"&excitation name = 'e' body = 'm' kind = 'orders' orders = {ORDER} amplitudes = {TORQUE} /\n"
        "&response body = 'm' speed = 30, 150 count = 200 operating = 120, 140 /\n&run t_end = 1 /\n"
    )
    if drive != "torque":
        governor = f"governor_speed = {SET_SPEED}" if drive == "governor" else ""
        text += f"&motor name = 'd' body = 'm' {keys('motor.d')} c = 0 {governor} /\n"
    return text


class Bent:
    """The same machine with exact numbers."""

    def __init__(self, numbers, drive):
        self.drive = drive
        for path, value in numbers.items():
            setattr(self, path.replace(".", "_"), mpmath.mpf(value))

    def load(self, n):
        return self.load_w_viscous * n + self.load_w_quadratic * n**2

    def free_speed(self):
        if self.drive == "torque":
            return mpmath.mpf(0)
        if self.drive == "governor":
            return mpmath.mpf(SET_SPEED)
        return mpmath.findroot(lambda n: self.motor_d_a - self.motor_d_b * n - self.load(n), 100)

    def terms(self, value, n):
        """The stiffness of the coupling and what the motor adds, at a speed and for motions exp(value t)."""
        k, cubic = self.coupling_k_stiffness, self.coupling_k_cubic_stiffness
        twist = mpmath.findroot(lambda u: k * u + cubic * u**3 - self.load(n), self.load(n) / k)
        slope = k + 3 * cubic * twist**2
        d = slope + value * self.coupling_k_damping
        d += value / mpmath.im(value) * slope * self.coupling_k_relative_damping / (2 * mpmath.pi)
        driving = mpmath.mpf(0)
        if self.drive != "torque":
            full = self.motor_d_a - self.motor_d_b * n
            driving = self.load(n) / full * self.motor_d_b
            if self.drive == "governor":
                driving += full * self.motor_d_governor_gain * (1 + 1 / (value * self.motor_d_governor_time))
        return d, value * driving

    def matrix(self, value, n):
        d, driving = self.terms(value, n)
        braking = value * (self.load_w_viscous + 2 * self.load_w_quadratic * n)
        return mpmath.matrix(
            [
                [value**2 * self.body_m_inertia + driving + d, -d],
                [-d, value**2 * self.body_l_inertia + braking + d],
            ]
        )

    def eigenvalue(self, start):
        n = self.free_speed()
        scale = mpmath.det(self.matrix(start * mpmath.mpc(1, "0.2"), n))

        def residual(real, imaginary):
            determinant = mpmath.det(self.matrix(mpmath.mpc(real, imaginary), n)) / scale
            return [mpmath.re(determinant), mpmath.im(determinant)]

        found = mpmath.findroot(residual, (mpmath.re(start), mpmath.im(start)), tol=mpmath.mpf(10) ** (8 - 2 * DIGITS))
        return mpmath.mpc(found[0], found[1])

    def critical(self, start):
        """The speed at which the mode has the frequency of the order, and its decay."""
        scale = mpmath.det(self.matrix(mpmath.mpc("0.1", ORDER * start[1]), start[1]))

        def residual(real, n):
            determinant = mpmath.det(self.matrix(mpmath.mpc(real, ORDER * n), n)) / scale
            return [mpmath.re(determinant), mpmath.im(determinant)]

        return tuple(mpmath.findroot(residual, start, tol=mpmath.mpf(10) ** (8 - 2 * DIGITS)))

    def amplitude(self, n):
        value = mpmath.mpc(0, ORDER * n)
        motion = mpmath.lu_solve(self.matrix(value, n), mpmath.matrix([mpmath.mpf(TORQUE), 0]))
        return abs(self.terms(value, n)[0] * (motion[1] - motion[0]))


@pytest.mark.parametrize("drive", DRIVES)
def test_derivatives_of_bent_states_are_those_of_exact_numbers(nocdyn, drive):
    """Every number moves the steady state, by whatever holds the speed: modes about the free state, a response at held ones."""
    numbers = {
        "body.m.inertia": 2.3, "body.l.inertia": 1.7, "coupling.k.stiffness": 2.0e4, "coupling.k.cubic_stiffness": 4.0e6,
        "coupling.k.damping": 2.5, "coupling.k.relative_damping": 0.3, "load.w.quadratic": 0.04, "load.w.viscous": 0.8,
    } | DRIVES[drive]  # fmt: skip
    answers, report = sensitivity(nocdyn, bent_text(numbers, drive))
    assert not report["notes"]
    nocdyn.done(bent_text(numbers, drive), command="response")
    place = json.loads((nocdyn.folder / "out/response.json").read_text())["critical_speeds"][0]
    known = {one["kind"]: one["value"] for one in answers}
    assert set(known) == {"frequency", "damping ratio", "critical speed", "margin", "half range"}
    with mpmath.workdps(DIGITS):
        ratio = known["damping ratio"]
        size = known["frequency"] * TURN / mpmath.sqrt(1 - ratio**2)
        here = Bent(numbers, drive)
        value = here.eigenvalue(size * mpmath.mpc(-ratio, mpmath.sqrt(1 - ratio**2)))
        critical = here.critical((mpmath.re(value), mpmath.mpf(place["speed_rad_s"])))
        beside = place["peak_speed_rad_s"] - critical[1]

        def all_answers(path=None, sign=0):
            changed = {key: mpmath.mpf(number) * (1 + sign * STEP * (key == path)) for key, number in numbers.items()}
            machine = Bent(changed, drive)
            mode, meeting = machine.eigenvalue(value), machine.critical(critical)
            return {
                "frequency": mpmath.im(mode) / TURN,
                "damping ratio": -mpmath.re(mode) / abs(mode),
                "critical speed": meeting[1] * 60 / TURN,
                "margin": (120 - meeting[1]) / 120,
                "half range": machine.amplitude(meeting[1] + beside),
            }

        for kind, exact in all_answers().items():
            assert known[kind] == pytest.approx(float(exact), rel=1e-9), kind
        for path, number in numbers.items():
            high, low = all_answers(path, 1), all_answers(path, -1)
            for one in answers:
                expected = float((high[one["kind"]] - low[one["kind"]]) / (2 * STEP * mpmath.mpf(number)))
                assert abs(one["by"][path] - expected) * number <= 1e-8 * abs(one["value"]), (one["kind"], path, expected)


CURVED = """\
&body name = 'motor' inertia = 10 speed = 100 /
&body name = 'pinion' inertia = 1.5 /
&body name = 'wheel' inertia = 6 /
&body name = 'machine' inertia = 8 /
&coupling name = 'rubber' bodies = 'motor', 'pinion' stiffness = 3e4 cubic_stiffness = 4e6 relative_damping = 0.5 /
&gear name = 'reducer' bodies = 'pinion', 'wheel' radii = 0.1, 0.23 /
&shaft name = 'line' bodies = 'wheel', 'machine' lengths = 2 diameters = 0.12 shear_modulus = 8e10 density = 7850 nodes = 2 /
&load name = 'brake' body = 'machine' quadratic = 0.5 viscous = 2 /
&motor name = 'drive' body = 'motor' a = 4000 b = 30 c = 0 /
&excitation name = 'fire' body = 'motor' kind = 'orders' orders = 1, 1.5, 3 amplitudes = 40, 60, 25 phases_deg = 0, 50, 130 /
&response body = 'motor' speed = 40, 140 count = 200 operating = 60, 110 /
&limit coupling = 'rubber' vibratory_moment = 500 /
&run t_end = 1 start = 'equilibrium' /
"""


def answers_of(nocdyn, text, *words):
    """Modes, critical speeds and half ranges at given speeds, as the other commands answer."""
    nocdyn.done(text, *words, command="modes")
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    nocdyn.done(text, *words, command="response")
    response = json.loads((nocdyn.folder / "out/response.json").read_text())
    return [mode for mode in modes if mode["kind"] == "oscillating"], response["critical_speeds"]


def half_range(nocdyn, text, signal, speed, *words):
    nocdyn.done(text, *words, "--set", f"response.speed={speed!r}", command="response")
    return nocdyn.values(name="response.csv").by_name()[f"half_range_{signal}"][0]


MOTOR = "&motor name = 'drive' body = 'motor' a = 4000 b = 30 c = 0 /\n"
MAINS = """\
&motor name = 'drive' body = 'motor' kind = 'induction' breakdown_torque = 9000 breakdown_slip = 0.1 synchronous_speed = 105 /
"""
HELD = {
    "motor": CURVED,
    "supply": CURVED.replace(MOTOR, MAINS),
    "bearing": CURVED.replace("inertia = 6 /", "inertia = 6 bearing_friction = 40 /"),
    "drive": CURVED.replace(MOTOR, "&drive name = 'turn' body = 'motor' speed = 100 /\n").replace(
        "name = 'fire' body = 'motor'", "name = 'fire' body = 'machine'"
    ),
}


@pytest.mark.parametrize(
    ("held", "path"),
    [("motor", path) for path in ("coupling.rubber.stiffness", "gear.reducer.radii(2)", "body.wheel.inertia", "motor.drive.a")]
    + [("motor", "shaft.line.diameters"), ("supply", "motor.drive.synchronous_speed"), ("bearing", "body.wheel.bearing_friction")]
    + [(held, "load.brake.quadratic") for held in ("supply", "bearing", "drive")],
)
def test_derivatives_of_a_curved_machine_are_those_of_its_answers(nocdyn, held, path):
    """A number that moves the steady state, a ratio, nodes of a shaft: against the commands themselves."""
    check_against_answers(nocdyn, HELD[held], path)


def check_against_answers(nocdyn, text, path):
    answers, report = sensitivity(nocdyn, text)
    value = next(number["value"] for number in report["numbers"] if number["path"] == path)
    step = 1e-3 * value
    modes, criticals = answers_of(nocdyn, text)
    ends = {k: answers_of(nocdyn, text, "--set", f"{path}={value + k * step!r}") for k in (-2, -1, 1, 2)}
    halves = [one for one in answers if one["kind"] == "half range"]

    def by_differences(values):
        return (values[-2] - 8 * values[-1] + 8 * values[1] - values[2]) / (12 * step)

    def check(kind, of, values):
        one = next(one for one in answers if (one["kind"], one["of"]) == (kind, of))
        expected = by_differences(values)
        assert abs(one["by"][path] - expected) * value <= 1e-7 * abs(one["value"]), (kind, of, one["by"][path], expected)

    for i, mode in enumerate(modes):
        check("frequency", f"mode {mode['mode']}", {k: end[0][i]["frequency_Hz"] for k, end in ends.items()})
    assert len(criticals) == (1 if "&drive" in text else 3)
    for i, place in enumerate(criticals):
        of = f"mode {place['mode']}, order {place['order']:g}"
        speeds = {k: end[1][i]["speed_rad_s"] for k, end in ends.items()}
        one = next(one for one in answers if (one["kind"], one["of"]) == ("critical speed", of))
        assert abs(one["by"][path] * 0.10471975511965977 - by_differences(speeds)) * value <= 2e-6 * place["speed_rad_s"], of
        if i > 1:
            continue
        peak = place["peak_speed_rad_s"]
        moved = one["by"][path] * 0.10471975511965977  # the speed moves with the critical one
        half = next(one for one in halves if one["of"].endswith(of))
        signal = half["of"].split(" ")[0]
        assert place["coupling"] in signal
        values = {
            k: half_range(nocdyn, text, signal, peak + moved * k * step, "--set", f"{path}={value + k * step!r}") for k in ends
        }
        expected = by_differences(values)
        assert half["value"] == pytest.approx(half_range(nocdyn, text, signal, peak), rel=1e-9)
        assert abs(half["by"][path] - expected) * value <= 1e-6 * half["value"], (of, half["by"][path], expected)
    nearest = [one for one in halves if one["of"].endswith("nearest to its limit")]
    assert [one["of"].split(" ")[0] for one in nearest] == ["moment_rubber"]


TWINS = """\
&body name = 'hub' inertia = 1000 speed = 10 /
&body name = 'left' inertia = 2 /
&body name = 'right' inertia = 2 /
&body name = 'third' inertia = 2 /
&coupling name = 'k1' bodies = 'hub', 'left' stiffness = 2e4 relative_damping = 0.2 /
&coupling name = 'k2' bodies = 'hub', 'right' stiffness = 2e4 relative_damping = 0.2 /
&coupling name = 'k3' bodies = 'hub', 'third' stiffness = 2e4 relative_damping = 0.2 /
&load name = 'l' body = 'hub' viscous = 1 /
&motor name = 'm' body = 'hub' a = 10 b = 0 c = 0 /
&run t_end = 1 /
"""


def test_equal_frequencies_are_said_and_split(nocdyn):
    answers, report = sensitivity(nocdyn, TWINS)
    assert any("mode 1 and mode 2 have the same frequency" in note for note in report["notes"])
    both = [one for one in answers if one["kind"] == "frequency" and one["of"] in {"mode 1", "mode 2"}]
    step = 2e-6
    nocdyn.done(TWINS, "--set", f"coupling.k1.stiffness={2e4 * (1 + step)!r}", command="modes")
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    moved = sorted(mode["frequency_Hz"] for mode in modes if mode["kind"] == "oscillating")[:2]
    for one, frequency in zip(both, moved, strict=True):
        assert one["by"]["coupling.k1.stiffness"] * 2e4 * step == pytest.approx(frequency - one["value"], rel=1e-3, abs=1e-11)


def test_a_range_without_modes_is_said_as_modes_says_it(nocdyn):
    answers, report = sensitivity(nocdyn, TWINS, "--range_hz", "1000,2000")
    printed = nocdyn("modes", "machine.nml", "--range_hz", "1000,2000").stdout
    (note,) = [note for note in report["notes"] if "oscillating modes" in note]
    assert (answers, note) == ([], "0 oscillating modes are from 1000 to 2000 Hz; of 3 undamped ones, 3 are below")
    assert f"note: {note}\n" in printed


RUBBER = TWINS.replace("'left' stiffness", "'left' kind = 'rubber'{} stiffness")


@pytest.mark.parametrize(
    ("keys", "is_refused"),
    [
        (" table_frequency = 1, 10 frequency_stiffness = 1, 1.2", True),
        (" table_amplitude = 1, 100 amplitude_stiffness = 1, 0.8", True),
        ("", False),
    ],
)
def test_a_stiffness_that_follows_from_the_vibration_is_refused(nocdyn, keys, is_refused):
    outcome = nocdyn("sensitivity", nocdyn.write("machine.nml", RUBBER.format(keys)), "--out", "out")
    assert outcome.returncode == (2 if is_refused else 0), outcome.stderr
    assert ("the stiffness of 'k1' follows from its frequency" in outcome.stderr) == is_refused
    assert (nocdyn.folder / "out/sensitivity.json").exists() != is_refused


def test_teeth_that_lose_power_are_refused(nocdyn):
    outcome = nocdyn("sensitivity", SOURCE / "input/examples/winch/winch.nml", "--out", "out")
    assert outcome.returncode == 2
    assert "the teeth of this machine lose power" in outcome.stderr
    assert not (nocdyn.folder / "out/sensitivity.json").exists()


STRUCK = """\
&body name = 'a' inertia = 2.0 speed = 3.0 /
&body name = 'b' inertia = 1.0 speed = 2.0 /
&body name = 'c' inertia = 3.0 speed = 1.0 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 2e4 damping = 4.0 /
&coupling name = 'q' bodies = 'b', 'c' stiffness = 3e4 damping = 6.0 /
&load name = 'l' body = 'c' viscous = 1.5 /
&excitation name = 'e' body = 'a' kind = 'step' amplitude = 200 time = 0.05 /
&limit coupling = 'k' moment = 500 /
&limit coupling = 'q' moment = 500 /
&limit coupling = 'q' quantity = 'total_moment' largest = 400 /
&run t_end = 0.3 /
"""


def struck_peak(numbers, coupling, near):
    """The extreme of a moment next to a time after the step, by the exponential of the matrix of the machine."""
    inertia = [numbers[f"body.{name}.inertia"] for name in "abc"]
    matrix = mpmath.zeros(7)  # angles, speeds, and the torque that is switched on
    rows = {}
    for name, first in (("k", 0), ("q", 1)):
        stiffness, damping = numbers[f"coupling.{name}.stiffness"], numbers[f"coupling.{name}.damping"]
        row = mpmath.zeros(1, 7)
        row[first], row[first + 1], row[first + 3], row[first + 4] = stiffness, -stiffness, damping, -damping
        rows[name] = row
        for column in range(7):
            matrix[3 + first, column] -= row[column] / inertia[first]
            matrix[4 + first, column] += row[column] / inertia[first + 1]
    for i in range(3):
        matrix[i, 3 + i] = 1
    matrix[5, 5] -= numbers["load.l.viscous"] / inertia[2]
    matrix[3, 6] = numbers["excitation.e.amplitude"] / inertia[0]
    switched = numbers["excitation.e.time"]
    state = mpmath.matrix([0, 0, 0, *(numbers[f"body.{name}.speed"] for name in "abc"), 0])
    state = mpmath.expm(matrix * switched) * state
    state[6] = 1

    def state_at(time):
        return mpmath.expm(matrix * (time - switched)) * state

    time = mpmath.findroot(lambda t: (rows[coupling] * matrix * state_at(t))[0], (near, near + 1e-5))
    return (rows[coupling] * state_at(time))[0], time


def test_derivatives_of_peaks_after_a_step_are_those_of_the_closed_form(nocdyn):
    """Also by the time of the step, at which the derivatives jump, and by the speeds at the start."""
    answers, report = sensitivity(nocdyn, STRUCK, "--at", "rest", "--peaks")
    peaks = [one for one in answers if one["kind"] == "peak of a run"]
    assert [one["of"].split(" ")[0] for one in peaks] == ["total_moment_k", "total_moment_q"]
    numbers = {number["path"]: number["value"] for number in report["numbers"]}
    assert len(numbers) == 13
    with mpmath.workdps(DIGITS):
        for one in peaks:
            near, coupling = float(one["of"].split(" ")[2]), one["of"][13]
            exact = {path: mpmath.mpf(value) for path, value in numbers.items()}
            value, time = struck_peak(exact, coupling, near)
            assert abs(time - near) < 1e-6
            assert time > exact["excitation.e.time"]
            assert one["value"] == pytest.approx(abs(float(value)), rel=1e-9)
            for path in numbers:
                ends = [struck_peak(exact | {path: exact[path] * (1 + sign * STEP)}, coupling, time)[0] for sign in (1, -1)]
                change = float((ends[0] - ends[1]) / (2 * STEP)) * (1 if value > 0 else -1)  # of the whole number
                assert abs(one["by"][path] * numbers[path] - change) <= 1e-7 * one["value"], (one["of"], path, change)


LOOSE = """\
&body name = 'a' inertia = 2.0 speed = 30.0 /
&body name = 'b' inertia = 1.0 speed = 30.0 /
&body name = 'c' inertia = 3.0 speed = -15.0 /
&body name = 'd' inertia = 1.2 speed = -15.0 /
&coupling name = 'bent' bodies = 'a', 'b' stiffness = 2e4 cubic_stiffness = 4e8 damping = 4.0 /
&gear name = 'g' bodies = 'b', 'c' radii = 0.1, 0.2 /
&coupling name = 'loose' bodies = 'c', 'd' stiffness = 3e4 damping = 6.0 gap = 0.004 /
&motor name = 'm' body = 'a' a = 90 b = 1 c = 0 /
&load name = 'l' body = 'd' quadratic = 0.3 /
&excitation name = 'e' body = 'a' kind = 'step' amplitude = 200 time = 0.05 /
&excitation name = 'o' body = 'a' kind = 'orders' orders = 2 amplitudes = 50 phases_deg = 20 /
&limit coupling = 'bent' moment = 500 /
&limit coupling = 'loose' moment = 500 /
&output extremes_from = 0.06 /
&run t_end = 0.4 rtol = 1e-12 atol = 1e-15 start = 'projected' /
"""


def run_peaks(nocdyn, text, *words):
    nocdyn.done(text, *words)
    return {line["quantity"]: line["value"] for line in nocdyn.summary("out")["verdict"]["lines"] if line["analysis"] == "run"}


def test_derivatives_of_peaks_of_a_curved_machine_are_those_of_runs(nocdyn):
    """A cubic law, a gap whose edges are crossed, a ratio, a step."""
    answers, report = sensitivity(nocdyn, LOOSE, "--peaks")
    peaks = [one for one in answers if one["kind"] == "peak of a run"]
    assert len(peaks) == 2
    values = {number["path"]: number["value"] for number in report["numbers"]}
    assert {"coupling.loose.gap", "excitation.e.time", "gear.g.radii(2)", "body.a.speed"} <= set(values)
    for path, value in values.items():
        step = 1e-4 * value
        ends = {k: run_peaks(nocdyn, LOOSE, "--set", f"{path}={value + k * step!r}") for k in (-2, -1, 1, 2)}
        for one in peaks:
            a, b, c, d = (ends[k][one["of"].split(" ")[0]] for k in (-2, -1, 1, 2))
            change = (a - 8 * b + 8 * c - d) / (12 * 1e-4)
            assert abs(one["by"][path] * value - change) <= 1e-6 * one["value"], (one["of"], path, change)


def test_a_peak_at_an_end_is_said(nocdyn):
    answers, report = sensitivity(nocdyn, LOOSE, "--peaks", "--set", "run.t_end=0.0602")
    assert sum("is at an end of the time in which it is sought" in note for note in report["notes"]) >= 1
    peak = next(one for one in answers if one["kind"] == "peak of a run")
    assert max(map(abs, peak["derivative"])) > 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("&limit coupling = 'k' moment = 500 /", "&clutch name = 'x' bodies = 'c', 'ground' capacity = 5 /", "joints that"),
        ("moment = 500", "vibratory_moment = 500", "there is no &limit of a run; required: one with moment, force or largest"),
    ],
)
def test_peaks_that_have_no_derivatives_are_refused(nocdyn, old, new, message):
    text = STRUCK.replace("&limit coupling = 'q' quantity = 'total_moment' largest = 400 /", "")
    assert old in text
    file = nocdyn.write("machine.nml", text.replace(old, new))
    outcome = nocdyn("sensitivity", file, "--at", "rest", "--peaks", "--out", "out")
    assert outcome.returncode == 2, outcome.stderr
    assert message in outcome.stderr
    assert not (nocdyn.folder / "out/sensitivity.json").exists()

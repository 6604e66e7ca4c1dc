"""The example machines with load cases, one case of each computed a second time: equations written down by hand, SciPy.

usage: python load_case_references.py [NAME]...     prints the numbers that test_example_load_cases.py holds

The couplings of a train are matrices here. Induction motor: flux linkages in the stationary frame. Elastic shafts: elements of
Lagrange polynomials with a full mass matrix for the motion, and the exact solution of the continuous shaft for frequencies and
responses. Damage: the PyPI package rainflow on samples of the motion.
"""

import sys

import numpy as np
from example_references import EXAMPLES, UNITS, Curve, Machine, motion_of
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

# the case that is computed
CASES = {
    "reciprocating_compressor": "reconnection",
    "generator_set": "two_phase",
    "ice_propeller": "case_2",
    "vfd_compressor": "full_load",
}
INERTIA_ORDERS = 17  # of pistons: the ones from here on are below rounding errors
ARC = 1e-3  # time constant of the currents in opening contacts [s]


def listed(value):
    return [] if value is None else value if isinstance(value, list) else [value]


class LoadCase(Machine):
    """The groups of an input as one of its load cases has them."""

    def __init__(self, name, case):
        super().__init__(EXAMPLES / name / f"{name}.nml")
        cases = self.kinds["load_case"]
        left_out = {element for other in cases.values() if other["name"] != case for element in listed(other.get("with"))}
        left_out -= set(listed(cases[case].get("with")))
        for element in left_out | set(listed(cases[case].get("without"))):
            for kind, groups in self.kinds.items():
                if kind not in ("body", "load_case"):
                    groups.pop(element, None)
        for setting in listed(cases[case].get("set")):
            self.change(*(part.strip() for part in setting.split("=")))
        self.settings = self.run.get(case, self.run.get(""))

    def change(self, path, text):
        kind, *name, key = path.split(".")
        values = np.array([float(value) for value in text.split(",")])
        for unit, one in UNITS.items():
            if key.endswith(unit):
                key, values = key.removesuffix(unit), values * one
        group = self.kinds.setdefault(kind, {}).setdefault(name[0] if name else "", {})
        group[key] = values[0] if len(values) == 1 else values

    def end(self):
        return self.settings["t_end"]

    def since(self):
        """Beginning of the time of extremes and cycles."""
        return self.output[""].get("extremes_from", 0.0) if "output" in self.kinds else 0.0


class Train:
    """Bodies and couplings: matrices of inertia, stiffness and damping, twists by name."""

    def __init__(self, m):
        self.names = list(m.body)
        self.inertia = m.inertia()
        self.couplings = m.coupling
        unit = np.eye(len(self.names))
        self.row = {
            name: unit[self.names.index(group["bodies"][1])] - unit[self.names.index(group["bodies"][0])]
            for name, group in m.coupling.items()
        }
        self.stiffness = self.summed(lambda group: group.get("stiffness", 0.0))
        self.damping = self.summed(viscous)

    def summed(self, constant):
        return sum(constant(group) * np.outer(self.row[name], self.row[name]) for name, group in self.couplings.items())

    def index(self, *names):
        return [self.names.index(name) for name in names]

    def moment(self, name, angle, speed):
        """Elastic moment and damping."""
        group, row = self.couplings[name], self.row[name]
        return group.get("stiffness", 0.0) * (row @ angle) + viscous(group) * (row @ speed)


def viscous(group):
    loss = group.get("relative_damping", 0.0) / (2 * np.pi)
    return group.get("damping", 0.0) + loss * group.get("stiffness", 0.0) / group.get("damping_frequency", 1.0)


def damage(fatigue, values):
    """By Miner's rule of the half ranges of a sampled stress or moment."""
    import rainflow

    strength = fatigue.get("ultimate_stress", np.inf)
    total = 0.0
    for full, mean, count, _, _ in rainflow.extract_cycles(values):
        half = full / 2 * fatigue.get("notch_factor", 1.0) / (1 - abs(mean) / strength)
        reference = fatigue.get("reference_stress", fatigue.get("reference_moment"))
        total += count / fatigue["reference_cycles"] * (half / reference) ** fatigue["slope"]
    return total


def sampled(motion, since, end, step):
    """States at equal distances, [component, time]."""
    times = np.linspace(since, end, round((end - since) / step) + 1)
    at = np.searchsorted([piece[0] for piece in motion.pieces], times, side="right") - 1
    return np.concatenate([piece[3](times[at == i]) for i, piece in enumerate(motion.pieces) if np.any(at == i)], axis=1)


def damages_of_couplings(m, train, motion, step):
    y = sampled(motion, m.since(), m.end(), step)
    n = len(train.names)
    result = {}
    for name, fatigue in m.fatigue.items():
        coupling = fatigue["coupling"]
        values = train.moment(coupling, y[:n], y[n : 2 * n])
        if "reference_stress" in fatigue:
            values = values / (np.pi * train.couplings[coupling]["diameter"] ** 3 / 16)
        result[f"damage {name}"] = damage(fatigue, values)
    return result


def static_angles(train, torque):
    """Angles under torques that balance; the first body is at 0, and couplings without stiffness are not twisted."""
    stiffness = train.summed(lambda group: group.get("stiffness", 1.0))
    return np.concatenate([[0.0], np.linalg.lstsq(stiffness[:, 1:], torque, rcond=None)[0]])


# --- reciprocating compressor


def gas_harmonics(m, engine):
    """Complex amplitudes of exp(i k phi) of the gas torque of a cylinder with its dead centre at 0, its mean the first."""
    lines = (m.folder / engine["pressure_file"]).read_text().splitlines()[2:]
    degrees, pressure = np.array([line.split(",") for line in lines], dtype=float).T
    angles = np.radians(degrees)
    curve = Curve((np.concatenate([angles - 2 * np.pi, angles, angles + 2 * np.pi]), np.tile(pressure, 3)), cubic=True)
    ratio = engine["crank_radius"] / engine["rod_length"]

    def torque(x):
        lever = engine["crank_radius"] * np.sin(x) * (1 + ratio * np.cos(x) / np.sqrt(1 - (ratio * np.sin(x)) ** 2))
        return curve(curve.segment(x), x) * np.pi / 4 * engine["bore"] ** 2 * lever

    samples = np.array([torque(x) for x in 2 * np.pi * np.arange(4096) / 4096])
    harmonics = np.fft.rfft(samples)[: engine["harmonics_up_to"] + 1] / 2048
    harmonics[0] /= 2
    return harmonics


def inertia_amplitudes(engine):
    """Of the sines of the orders 1, 2, ... of -x' x'', x the exact position of a piston over the radius of its crank."""
    ratio = engine["crank_radius"] / engine["rod_length"]
    sine, cosine = np.sin(2 * np.pi * np.arange(512) / 512), np.cos(2 * np.pi * np.arange(512) / 512)
    reach = np.sqrt(1 / ratio**2 - sine**2)
    first = -sine - sine * cosine / reach
    second = -cosine - (cosine**2 - sine**2) / reach - (sine * cosine) ** 2 / reach**3
    shares = -np.fft.rfft(-first * second)[1:INERTIA_ORDERS].imag / 256
    return engine["reciprocating_mass"] * engine["crank_radius"] ** 2 * shares


class InductionMotor:
    """Complex flux linkages in the frame of the stator."""

    def __init__(self, motor):
        self.mains, self.pairs = motor["frequency"], motor["poles"] / 2
        self.peak = np.sqrt(2 / 3) * motor["voltage"]
        self.r_s, self.r_r = motor["stator_resistance"], motor["rotor_resistance"]
        self.l_m = motor["mutual_reactance"] / self.mains
        self.l_s = self.l_m + motor["stator_reactance"] / self.mains
        self.l_r = self.l_m + motor["rotor_reactance"] / self.mains
        self.inverse = np.linalg.inv([[self.l_s, self.l_m], [self.l_m, self.l_r]])

    def torque(self, stator, current):
        return 1.5 * self.pairs * np.imag(np.conj(stator) * current)

    def rates(self, t, stator, rotor, speed, share):
        """Of both fluxes, and the torque."""
        i_s, i_r = self.inverse @ [stator, rotor]
        turning = 1j * self.pairs * speed
        rate_r = turning * rotor - self.r_r * i_r
        if share > 0:
            rate_s = share * self.peak * np.exp(1j * self.mains * t) - self.r_s * i_s
        else:
            part = self.l_m / self.l_r
            rate_s = part * rate_r + (turning - 1 / ARC) * (stator - part * rotor)
        return rate_s, rate_r, self.torque(stator, i_s)

    def response(self, speed, frequency):
        """Amplitude of the torque per amplitude of the speed, about the steady state; fluxes in the frame of the mains."""
        slip_frequency = self.mains - self.pairs * speed
        complex_matrix = -np.diag([self.r_s, self.r_r]) @ self.inverse - 1j * np.diag([self.mains, slip_frequency])
        matrix = np.block([[complex_matrix.real, -complex_matrix.imag], [complex_matrix.imag, complex_matrix.real]])
        stator, rotor, _ = self.steady(speed)
        fluxes = np.array([stator, rotor])
        by_speed = np.array([0.0, 1j * self.pairs * rotor])
        turned = np.linalg.solve(1j * frequency * np.eye(4) - matrix, np.concatenate([by_speed.real, by_speed.imag]))
        part = 1.5 * self.pairs * self.inverse[0]  # torque = Im(conj(stator) part . fluxes)
        weights = np.conj(stator) * part  # of both fluxes
        direct = np.conj(part @ fluxes)  # of the stator flux, conjugated
        by_real = weights.imag + np.array([-direct.imag, 0.0])
        by_imaginary = weights.real + np.array([-direct.real, 0.0])
        return by_real @ turned[:2] + by_imaginary @ turned[2:]

    def steady(self, speed):
        """Fluxes at t = 0 and torque."""
        slip = 1 - self.pairs * speed / self.mains
        w = 1j * self.mains
        matrix = [[self.r_s + w * self.l_s, w * self.l_m], [slip * w * self.l_m, self.r_r + slip * w * self.l_r]]
        currents = np.linalg.solve(matrix, [self.peak, 0.0])
        stator, rotor = np.array([[self.l_s, self.l_m], [self.l_m, self.l_r]]) @ currents
        return stator, rotor, self.torque(stator, currents[0])


def compressor_parts(m):
    """Mean torques of the bodies over the speed, and their gas and inertia torques over angle and speed."""
    train = Train(m)
    gas = []  # body, dead centre, harmonics
    for engine in m.engine.values():
        if "pressure_file" in engine:
            harmonics = gas_harmonics(m, engine)
            gas += [(body, angle, harmonics) for body, angle in zip(train.index(*engine["cylinders"]), engine["firing"])]
    masses = m.engine["masses"]
    inertia = inertia_amplitudes(masses)
    cranks, angles = train.index(*masses["cylinders"]), np.array(masses["firing"])
    bearing = m.load["bearings"]
    bearing_at = train.index(bearing["body"])[0]
    k = np.arange(len(gas[0][2]))

    def mean(speed):
        torque = np.zeros(len(train.names))
        for body, _, harmonics in gas:
            torque[body] += harmonics[0].real
        torque[bearing_at] -= bearing["constant"] * np.tanh(speed / bearing["constant_speed"])
        return torque

    def torques(angle, speed):
        torque = np.zeros(len(train.names))
        for body, dead_centre, harmonics in gas:
            torque[body] += np.real(harmonics @ np.exp(1j * k * (angle[body] - dead_centre)))
        waves = np.sin(np.outer(np.arange(1, INERTIA_ORDERS), angle[cranks] - angles))
        np.add.at(torque, cranks, speed[cranks] ** 2 * (inertia @ waves))
        torque[bearing_at] -= bearing["constant"] * np.tanh(speed[bearing_at] / bearing["constant_speed"])
        return torque

    return train, mean, torques, gas


def compressor_speed(m):
    _, mean, *_ = compressor_parts(m)
    motor = InductionMotor(m.motor["mains"])
    return brentq(lambda speed: motor.steady(speed)[2] + mean(speed).sum(), 60.0, 62.8, xtol=1e-14, rtol=1e-15)


def reciprocating_compressor(with_damage=True):
    m = LoadCase("reciprocating_compressor", CASES["reciprocating_compressor"])
    train, mean, torques, _ = compressor_parts(m)
    motor, supply = InductionMotor(m.motor["mains"]), m.motor["mains"]
    n, rotor = len(train.names), train.index("rotor")[0]
    speed = compressor_speed(m)
    stator_flux, rotor_flux, torque = motor.steady(speed)
    load = mean(speed)
    load[rotor] += torque

    def rate(t, y, mode, middle):
        angle, omega = y[:n], y[n : 2 * n]
        share = supply["supply_factors"][np.searchsorted(supply["supply_times"], middle) - 1]
        stator, rotating = y[2 * n] + 1j * y[2 * n + 1], y[2 * n + 2] + 1j * y[2 * n + 3]
        rate_s, rate_r, torque = motor.rates(t, stator, rotating, omega[rotor], share)
        total = torques(angle, omega) - train.stiffness @ angle - train.damping @ omega
        total[rotor] += torque
        return np.concatenate([omega, total / train.inertia, [rate_s.real, rate_s.imag, rate_r.real, rate_r.imag]])

    fluxes = [stator_flux.real, stator_flux.imag, rotor_flux.real, rotor_flux.imag]
    start = np.concatenate([static_angles(train, load), np.full(n, speed), fluxes])
    motion = motion_of(rate, start, m.end(), breaks=supply["supply_times"])

    def electric(t, y, mode=None):
        i_s = motor.inverse[0] @ [y[2 * n] + 1j * y[2 * n + 1], y[2 * n + 2] + 1j * y[2 * n + 3]]
        return motor.torque(y[2 * n] + 1j * y[2 * n + 1], i_s)

    def moment(name):
        return lambda t, y, mode: train.moment(name, y[:n], y[n : 2 * n])

    y = motion.at(m.end())
    result = {
        "phi_rotor [rad]": y[0],
        "omega_rotor [rad/s]": y[n],
        "omega_throw_4 [rad/s]": y[2 * n - 1],
        "total_moment_rubber [N m]": train.moment("rubber", y[:n], y[n : 2 * n]),
        "total_moment_crank_2 [N m]": train.moment("crank_2", y[:n], y[n : 2 * n]),
        "torque_mains [N m]": electric(m.end(), y),
        "max torque_mains [N m]": motion.largest(electric),
        "min total_moment_rubber [N m]": motion.largest(moment("rubber"), sign=-1),
        "max total_moment_rubber [N m]": motion.largest(moment("rubber")),
        "min total_moment_crank_2 [N m]": motion.largest(moment("crank_2"), sign=-1),
    }
    return result | (damages_of_couplings(m, train, motion, 1e-5) if with_damage else {})


# --- generator set


def two_phase_torque(group, end):
    """Torque on the rotor over the seconds after the fault, which begins when the voltage between the two phases is zero.

    Flux linkages in the frame of the stator, of its axis across the open phase and of two rotor circuits in both axes.
    """
    w, reactance = group["frequency"], group["subtransient_reactance"]
    shares = np.array([1 / reactance - 1 / group["transient_reactance"], 1 / group["transient_reactance"]])
    times = np.array([group["subtransient_time"], group["transient_time"]])

    def currents(t, y):
        wave, circuits = 1j * np.exp(1j * w * t), shares @ (y[1:3] + 1j * y[3:5])
        flux = (wave + reactance * circuits).real + 1j * y[0]
        return wave, flux, (flux - wave) / reactance - circuits

    def rate(t, y):
        wave, flux, current = currents(t, y)
        z = y[1:3] + 1j * y[3:5]
        change = 1j * w * z + (flux - wave - z) / times
        return np.concatenate([[-reactance / group["armature_time"] * current.imag], change.real, change.imag])

    solution = solve_ivp(rate, (0, end), [1.0, 0, 0, 0, 0], method="DOP853", rtol=1e-12, atol=1e-14, dense_output=True).sol

    def torque(t):
        _, flux, current = currents(t, solution(t))
        return group["rated_torque"] * (flux.conjugate() * current).imag

    return torque


def generator_set(with_damage=True):
    """States: angles, speeds, integrator of the governor; mode: the limit at which the throttle is."""
    case = CASES["generator_set"]
    m = LoadCase("generator_set", case)
    train, diesel, fuel = Train(m), m.engine["diesel"], m.motor["fuel"]
    n = len(train.names)
    cylinders, firing = train.index(*diesel["cylinders"]), np.array(diesel["firing"])[:, None]
    orders, amplitudes, phases = (np.array(diesel[key]) for key in ("orders", "amplitudes", "phases"))
    flywheel, rotor = train.index("flywheel", "rotor")
    grid, friction, fault, step = m.load["grid"], m.load["friction"]["viscous"], m.excitation[case], m.excitation["no_load"]
    speed = fuel["governor_speed"]
    fault_torque = two_phase_torque(fault, m.end() - fault["time"])

    def throttle(y):
        return y[2 * n] + fuel["governor_gain"] * (speed - y[n + flywheel])

    def rate(t, y, limit, middle):
        angle, omega = y[:n], y[n : 2 * n]
        opened = throttle(y) if limit is None else limit
        torque = -train.stiffness @ angle - train.damping @ omega
        torque[cylinders] += np.sin(orders * (angle[cylinders][:, None] - firing) + phases) @ amplitudes
        torque[flywheel] += fuel["torque"] * opened - friction * omega[flywheel]
        torque[rotor] -= grid["constant"] * np.tanh(omega[rotor] / grid.get("constant_speed", 0.01))
        if middle > fault["time"]:
            torque[rotor] += step["amplitude"] + fault_torque(t - fault["time"])
        return np.concatenate([omega, torque / train.inertia, [(opened - y[2 * n]) / fuel["governor_time"]]])

    def borders(limit):
        if limit is None:
            yield lambda t, y: 1 - throttle(y), 1
            yield lambda t, y: throttle(y), 0
        else:
            yield lambda t, y: (throttle(y) - limit) * (1 if limit == 1 else -1), None

    mean = np.zeros(n)
    mean[flywheel], mean[rotor] = grid["constant"], -grid["constant"]
    start = [(grid["constant"] + friction * speed) / fuel["torque"]]
    start = np.concatenate([static_angles(train, mean), np.full(n, speed), start])
    motion = motion_of(rate, start, m.end(), None, borders, [fault["time"], m.since()])

    def moment(name):
        return lambda t, y, mode: train.moment(name, y[:n], y[n : 2 * n])

    def largest(name, sign):
        return motion.largest(moment(name), sign=sign, since=m.since())

    y = motion.at(m.end())
    result = {
        "phi_rotor [rad]": y[rotor],
        "omega_ring [rad/s]": y[n],
        "omega_cylinder_1 [rad/s]": y[n + 2],
        "omega_rotor [rad/s]": y[n + rotor],
        "omega_exciter [rad/s]": y[2 * n - 1],
        "total_moment_rubber [N m]": train.moment("rubber", y[:n], y[n : 2 * n]),
        "torque_fuel [N m]": fuel["torque"] * min(max(throttle(y), 0), 1),
        "min total_moment_rubber [N m]": largest("rubber", -1),
        "max total_moment_rubber [N m]": largest("rubber", 1),
        "min total_moment_tail [N m]": largest("tail", -1),
        "min total_moment_crank_6 [N m]": largest("crank_6", -1),
        f"min torque_{case} [N m]": motion.largest(lambda t, y, mode: fault_torque(t - fault["time"]), sign=-1, since=m.since()),
    }
    return result | (damages_of_couplings(m, train, motion, 1e-5) if with_damage else {})


# --- propulsion line in ice

Q_MAX = 531e3  # [N m], by the formula in notes.md
ICE = {"case_1": (0.75, 90, 1, 150.0), "case_2": (1.0, 135, 1, 150.0), "case_3": (0.5, 45, 2, 150.0), "slow": (0.75, 90, 1, 80.0)}
TURNS, BLADES, RAMP, BEGIN = 3, 4, 270, 0.5  # turns in ice, blades, ramp [degrees], begin [s]


def largest_ice_torque(diameter=4.2, hub=0.25, pitch=0.78, speed=2.5, ice=1.5):
    """[kN m] of an open propeller that is larger than 1.8 times the thickness of the ice."""
    return 20.7 * (1 - hub) * pitch**0.16 * (speed * diameter) ** 0.17 * diameter**1.9 * ice**1.1


def ice_table(case):
    """Times and torques of the file of a case."""
    share, width, blocks, rpm = ICE[case]
    angles = np.arange(0, 360 * TURNS + 1, 5)
    torque = np.zeros(len(angles))
    for block in range(blocks):
        for blade in range(BLADES):
            x = (angles - 360 / BLADES * blade - 45 * block) % 360
            torque += np.where(x < width, share * Q_MAX * np.sin(np.pi * x / width), 0.0)
    ramp = np.clip(np.minimum(angles, 360 * TURNS - angles) / RAMP, 0, 1)
    return BEGIN + angles / (6 * rpm), -torque * ramp


class ShaftElement:
    """A uniform shaft as one element with Lagrange polynomials through Chebyshev points, both ends among them."""

    def __init__(self, shaft, degree):
        self.length, diameter, bore = shaft["lengths"], shaft["diameters"], shaft.get("bores", 0.0)
        self.polar = np.pi / 32 * (diameter**4 - bore**4)
        self.modulus = self.polar / (diameter / 2)
        self.rigidity, self.inertia = shaft["shear_modulus"] * self.polar, shaft["density"] * self.polar
        self.loss = 2 * shaft["damping_ratio"]
        self.viscous = self.loss / shaft["damping_frequency"]
        x = -np.cos(np.pi * np.arange(degree + 1) / degree)
        polynomials = []
        for i in range(degree + 1):
            others = np.delete(x, i)
            polynomials.append(Polynomial.fromroots(others) / np.prod(x[i] - others))
        self.slopes = [p.deriv() * (2 / self.length) for p in polynomials]
        at, weight = np.polynomial.legendre.leggauss(degree + 2)
        values = np.array([p(at) for p in polynomials])
        slopes = np.array([slope(at) for slope in self.slopes])
        self.mass = self.inertia * self.length / 2 * (values * weight) @ values.T
        self.stiffness = self.rigidity * self.length / 2 * (slopes * weight) @ slopes.T

    def moment(self, x, angle, speed):
        """Elastic moment and damping at x, from -1 to 1; angles and speeds of the nodes."""
        slopes = np.array([slope(x) for slope in self.slopes])
        return self.rigidity * (slopes @ angle + self.viscous * (slopes @ speed))

    def exact(self, frequency, hysteretic=True):
        """Dynamic stiffness of the two ends of the continuous shaft."""
        rigidity = self.rigidity * (1 + 1j * self.loss * hysteretic)
        b = frequency * self.length * np.sqrt(self.inertia / rigidity)
        matrix = np.array([[np.cos(b), -1], [-1, np.cos(b)]]) * rigidity / self.length * b / np.sin(b)
        return matrix if hysteretic else matrix.real


def propeller_shafts(m, degree=7):
    return [ShaftElement(m.shaft[name], degree) for name in ("intermediate", "tail")]


def dynamic_stiffness(m, frequency, hysteretic=True):
    """Of motor, flange and propeller."""
    matrix = -np.diag(m.inertia()) * frequency**2 + (0j if hysteretic else 0.0)
    for i, shaft in enumerate(propeller_shafts(m)):
        matrix[i : i + 2, i : i + 2] += shaft.exact(frequency, hysteretic)
    return matrix


def ice_propeller(with_damage=True):
    """States: angles and speeds of the nodes, integrator of the governor; mode: the limit at which the throttle is."""
    case = CASES["ice_propeller"]
    m = LoadCase("ice_propeller", case)
    shafts = propeller_shafts(m)
    ends = np.cumsum([0, *(len(shaft.mass) - 1 for shaft in shafts)])  # motor, flange, propeller
    n, last = ends[-1] + 1, ends[-1]
    mass, stiffness, damping = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    mass[ends, ends] = m.inertia()
    for shaft, first, final in zip(shafts, ends, ends[1:]):
        part = slice(first, final + 1)
        mass[part, part] += shaft.mass
        stiffness[part, part] += shaft.stiffness
        damping[part, part] += shaft.viscous * shaft.stiffness
    inverse = np.linalg.inv(mass)
    by_angle, by_speed = inverse @ stiffness, inverse @ damping
    drive, water, blades = m.motor["converter"], m.load["water"]["quadratic"], m.excitation["blades"]
    orders, shares = np.array(blades["orders"]), np.array(blades["share_of_load"])
    ice = Curve(ice_table(case), cubic=True, constant=True)
    speed = drive["governor_speed"]

    def throttle(y):
        return y[2 * n] + drive["governor_gain"] * (speed - y[n])

    def rate(t, y, limit, middle):
        angle, omega = y[:n], y[n : 2 * n]
        opened = throttle(y) if limit is None else limit
        load = water * omega[last] * abs(omega[last])
        at_propeller = -load + load * (shares @ np.sin(orders * angle[last])) + ice(ice.segment(middle), t)
        turn = inverse[:, 0] * drive["torque_limit"] * opened + inverse[:, last] * at_propeller
        return np.concatenate([omega, turn - by_angle @ angle - by_speed @ omega, [(opened - y[2 * n]) / drive["governor_time"]]])

    def borders(limit):
        if limit is None:
            yield lambda t, y: 1 - throttle(y), 1
            yield lambda t, y: throttle(y) + 1, -1
        else:
            yield lambda t, y: (throttle(y) - limit) * limit, None

    mean = water * speed**2
    torque = np.zeros(n)
    torque[0], torque[last] = mean, -mean
    angles = np.concatenate([[0.0], np.linalg.lstsq(stiffness[:, 1:], torque, rcond=None)[0]])
    start = np.concatenate([angles, np.full(n, speed), [mean / drive["torque_limit"]]])
    motion = motion_of(rate, start, m.end(), None, borders, ice.x)
    column = {"intermediate": ends[:2], "tail": ends[1:]}

    def twist(name, y):
        first, final = column[name]
        return y[final] - y[first]

    y = motion.at(m.end())
    result = {
        "phi_motor [rad]": y[0],
        "omega_motor [rad/s]": y[n],
        "omega_flange [rad/s]": y[n + ends[1]],
        "omega_propeller [rad/s]": y[n + last],
        "twist_intermediate [rad]": twist("intermediate", y),
        "twist_tail [rad]": twist("tail", y),
        "torque_converter [N m]": drive["torque_limit"] * throttle(y),
        "max twist_intermediate [rad]": motion.largest(lambda t, y, mode: twist("intermediate", y)),
        "min twist_intermediate [rad]": motion.largest(lambda t, y, mode: twist("intermediate", y), sign=-1),
        "min twist_tail [rad]": motion.largest(lambda t, y, mode: twist("tail", y), sign=-1),
        "max omega_motor [rad/s]": motion.largest(lambda t, y, mode: y[n]),
        "min omega_motor [rad/s]": motion.largest(lambda t, y, mode: y[n], sign=-1),
    }
    if not with_damage:
        return result

    y = sampled(motion, 0.0, m.end(), 1e-4)
    for name, fatigue in m.fatigue.items():
        first, final = column[fatigue["shaft"]]
        shaft, part = shafts[list(column).index(fatigue["shaft"])], slice(first, final + 1)
        stresses = [shaft.moment(x, y[:n][part], y[n : 2 * n][part]) / shaft.modulus for x in np.linspace(-1, 1, 21)]
        result[f"damage {name}"] = max(damage(fatigue, stress) for stress in stresses)
    return result


def vfd_parts(m):
    """Inertias of motor, wheel with pinion, and compressor; rows and groups of disc and quill with their stiffnesses."""
    teeth, quill = m.gear["gearbox"]["teeth"], m.shaft["quill"]
    ratio = teeth[0] / teeth[1]
    motor, wheel, pinion, compressor = m.inertia("motor", "wheel", "pinion", "compressor")
    sections = np.pi * np.array(quill["diameters"]) ** 4 / 32
    stiffness = {"disc": m.coupling["disc"]["stiffness"], "quill": quill["shear_modulus"] / sum(quill["lengths"] / sections)}
    losses = {"disc": m.coupling["disc"]["relative_damping"] / (2 * np.pi), "quill": 2 * quill["damping_ratio"]}
    frequencies = {"disc": m.coupling["disc"]["damping_frequency"], "quill": quill["damping_frequency"]}
    rows = {"disc": np.array([-1.0, 1.0, 0.0]), "quill": np.array([0.0, ratio, 1.0])}  # the pinion turns with -ratio
    inertia = np.array([motor, wheel + ratio**2 * pinion, compressor])
    return inertia, rows, stiffness, losses, frequencies, ratio


def vfd_compressor():
    """States: angles and speeds of motor, wheel and compressor, integrator of the governor, which is within its limits."""
    m = LoadCase("vfd_compressor", CASES["vfd_compressor"])
    inertia, rows, stiffness, losses, frequencies, ratio = vfd_parts(m)
    drive, gas = m.motor["drive"], m.load["gas"]
    pairs, multiples, shares = drive["poles"] / 2, np.array(drive["harmonics"]), np.array(drive["harmonic_shares"])
    speed = drive["governor_speed"]

    def throttle(y):
        return y[6] + drive["governor_gain"] * (speed - y[3])

    def driving(y):
        return drive["torque_limit"] * throttle(y) * (1 + shares @ np.sin(multiples * pairs * y[0]))

    def moment(name, y):
        """On the first body."""
        damping = stiffness[name] * losses[name] / frequencies[name]
        return stiffness[name] * (rows[name] @ y[:3]) + damping * (rows[name] @ y[3:6])

    def braking(omega):
        return gas["quadratic"] * omega * abs(omega) + gas["constant"] * np.tanh(omega / 0.01)

    def rate(t, y, mode, middle):
        torque = -sum(rows[name] * moment(name, y) for name in rows)
        torque += np.array([driving(y), 0.0, -braking(y[5])])
        return np.concatenate([y[3:6], torque / inertia, [(throttle(y) - y[6]) / drive["governor_time"]]])

    load = braking(-ratio * speed)  # negative
    mean = -ratio * load
    wheel = -mean / stiffness["disc"]
    angles = [0.0, wheel, -ratio * wheel - load / stiffness["quill"]]
    motion = motion_of(rate, [*angles, speed, speed, -ratio * speed, mean / drive["torque_limit"]], m.end())
    end = motion.at(m.end())
    return {
        "phi_motor [rad]": end[0],
        "omega_motor [rad/s]": end[3],
        "omega_wheel [rad/s]": end[4],
        "omega_compressor [rad/s]": end[5],
        "total_moment_disc [N m]": moment("disc", end),
        "total_moment_quill_1 [N m]": moment("quill", end),
        "torque_drive [N m]": driving(end),
        "min total_moment_disc [N m]": motion.largest(lambda t, y, mode: moment("disc", y), -1),
        "max total_moment_quill_1 [N m]": motion.largest(lambda t, y, mode: moment("quill", y)),
    }


# --- natural frequencies, steady speeds, responses


def frequencies():
    """Without damping [Hz], the lowest first."""
    result = {}
    for name in ("reciprocating_compressor", "generator_set"):
        train = Train(LoadCase(name, CASES[name]))
        root = 1 / np.sqrt(train.inertia)
        squares = np.linalg.eigvalsh(train.stiffness * np.outer(root, root))
        result[name] = np.sqrt(squares[squares > 1e-6 * squares[-1]]) / (2 * np.pi)
    m = LoadCase("ice_propeller", CASES["ice_propeller"])
    result["ice_propeller"] = continuous_frequencies(m, 6)
    inertia, rows, stiffness, *_ = vfd_parts(LoadCase("vfd_compressor", CASES["vfd_compressor"]))
    root = 1 / np.sqrt(inertia)
    squares = np.linalg.eigvalsh(sum(stiffness[name] * np.outer(rows[name], rows[name]) for name in rows) * np.outer(root, root))
    result["vfd_compressor"] = np.sqrt(squares[1:]) / (2 * np.pi)
    return result


def continuous_frequencies(m, count):
    """The zeros of the determinant, of which those of the sines in its denominators are taken out."""

    def determinant(hertz):
        w = 2 * np.pi * hertz
        sines = [np.sin(w * shaft.length * np.sqrt(shaft.inertia / shaft.rigidity)) for shaft in propeller_shafts(m, 1)]
        return np.linalg.det(dynamic_stiffness(m, w, hysteretic=False) / 1e6) * np.prod(sines)

    found, grid = [], np.arange(1.0, 1000.0, 0.5)
    values = [determinant(f) for f in grid]
    for i in np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1])):
        found.append(brentq(determinant, grid[i], grid[i + 1], xtol=1e-13, rtol=1e-15))
    return np.array(found[:count])


def steady_speeds():
    """[rad/s]"""
    m = LoadCase("reciprocating_compressor", "full_load")
    return {"reciprocating_compressor": ("omega_flywheel [rad/s]", compressor_speed(m))}


def speed_control(motor, torque, frequency):
    """Dynamic stiffness of a governor that holds the speed with a throttle between its limits."""
    return torque * motor["governor_gain"] * (1j * frequency + 1 / motor["governor_time"])


def generator_response(m, order, speed):
    """Amplitudes of the moments of the couplings: dense complex matrices."""
    train, diesel = Train(m), m.engine["diesel"]
    frequency = order * speed
    k = list(diesel["orders"]).index(order)
    force = np.zeros(len(train.names), complex)
    for body, firing in zip(train.index(*diesel["cylinders"]), diesel["firing"]):
        force[body] += diesel["amplitudes"][k] * np.exp(1j * (diesel["phases"][k] - order * firing))

    def stiffness(group):
        loss = group.get("relative_damping", 0.0) / (2 * np.pi)
        return group.get("stiffness", 0.0) * (1 + 1j * loss) + 1j * frequency * group.get("damping", 0.0)

    matrix = train.summed(stiffness) - np.diag(train.inertia) * frequency**2
    flywheel, fuel = train.index("flywheel")[0], m.motor["fuel"]
    matrix[flywheel, flywheel] += 1j * frequency * m.load["friction"]["viscous"] + speed_control(fuel, fuel["torque"], frequency)
    angle = np.linalg.solve(matrix, force)
    return {f"total_moment_{name}": abs(stiffness(group) * (train.row[name] @ angle)) for name, group in m.coupling.items()}


def compressor_response(m, order, speed):
    """The same; the supply of the motor follows the speed: it has the slip on its mains that carries the load."""
    train, mean, _, gas = compressor_parts(m)
    motor, masses, bearing = InductionMotor(m.motor["mains"]), m.engine["masses"], m.load["bearings"]
    frequency, rotor, load = order * speed, train.index("rotor")[0], mean(speed)
    synchronous = motor.mains / motor.pairs
    on_mains = brentq(lambda at: motor.steady(at)[2] + load.sum(), 0.98 * synchronous, synchronous, xtol=1e-14, rtol=1e-15)
    load[rotor] -= load.sum()
    angle = static_angles(train, load)
    force = np.zeros(len(train.names), complex)
    for body, dead_centre, harmonics in gas:
        force[body] += harmonics[order] * np.exp(1j * order * (angle[body] - dead_centre))
    if order < INERTIA_ORDERS:
        for body, dead_centre in zip(train.index(*masses["cylinders"]), masses["firing"]):
            amplitude = -1j * inertia_amplitudes(masses)[order - 1] * speed**2
            force[body] += amplitude * np.exp(1j * order * (angle[body] - dead_centre))

    def stiffness(group):
        loss = group.get("relative_damping", 0.0) / (2 * np.pi)
        return group["stiffness"] * (1 + 1j * loss) + 1j * frequency * group.get("damping", 0.0)

    matrix = train.summed(stiffness) - np.diag(train.inertia) * frequency**2
    matrix[rotor, rotor] -= 1j * frequency * motor.response(on_mains, frequency)
    brake, scale = train.index(bearing["body"])[0], bearing["constant_speed"]
    matrix[brake, brake] += 1j * frequency * bearing["constant"] / scale / np.cosh(speed / scale) ** 2
    angle = np.linalg.solve(matrix, force)
    return {f"total_moment_{name}": abs(stiffness(group) * (train.row[name] @ angle)) for name, group in m.coupling.items()}


def propeller_response(m, order, speed):
    """Amplitudes of the moments at both ends of the shafts, which are continuous."""
    frequency, water = order * speed, m.load["water"]["quadratic"]
    blades = m.excitation["blades"]
    force = blades["share_of_load"][blades["orders"].index(order)] * water * speed**2
    matrix = dynamic_stiffness(m, frequency)
    matrix[0, 0] += speed_control(m.motor["converter"], m.motor["converter"]["torque_limit"], frequency)
    matrix[2, 2] += 1j * frequency * 2 * water * speed
    angle = np.linalg.solve(matrix, [0.0, 0.0, force])
    result = {}
    for i, (name, shaft) in enumerate(zip(("intermediate", "tail"), propeller_shafts(m, 1))):
        ends = abs(shaft.exact(frequency) @ angle[i : i + 2])
        result |= {f"total_moment_{name}_1": ends[0], f"total_moment_{name}_2": ends[1]}
    return result


def vfd_response(m, order, speed):
    """Amplitudes of the moments: dense complex matrices, with the governor, and harmonics of the mean torque."""
    inertia, rows, stiffness, losses, _, ratio = vfd_parts(m)
    frequency, drive, gas = order * speed, m.motor["drive"], m.load["gas"]
    mean = ratio * (gas["quadratic"] * (ratio * speed) ** 2 + gas["constant"])
    share = drive["harmonic_shares"][drive["harmonics"].index(order / (drive["poles"] / 2))]
    complex_stiffness = {name: stiffness[name] * (1 + 1j * losses[name]) for name in rows}
    matrix = sum(complex_stiffness[name] * np.outer(rows[name], rows[name]) for name in rows) - np.diag(inertia) * frequency**2
    matrix[0, 0] += speed_control(drive, drive["torque_limit"], frequency)
    matrix[2, 2] += 1j * frequency * 2 * gas["quadratic"] * ratio * speed
    angle = np.linalg.solve(matrix, [share * mean, 0.0, 0.0])
    columns = {"disc": "total_moment_disc", "quill": "total_moment_quill_1"}
    return {columns[name]: abs(complex_stiffness[name] * (rows[name] @ angle)) for name in rows}


RESPONSES = {
    "reciprocating_compressor": (compressor_response, [(1, 590), (2, 590), (4, 590), (8, 590), (3, 235), (2, 350), (9, 550)]),
    "generator_set": (generator_response, [(4.5, 840), (6, 630), (3, 150), (0.5, 545)]),
    "ice_propeller": (propeller_response, [(4, 64), (8, 32), (4, 150)]),
    "vfd_compressor": (vfd_response, [(2, 1030), (4, 510), (12, 170), (12, 1150), (24, 570)]),
}


def responses():
    """By machine, order and speed [rpm]."""
    result = {}
    for name, (response, points) in RESPONSES.items():
        m = LoadCase(name, CASES[name])
        result[name] = {(order, rpm): response(m, order, rpm * np.pi / 30) for order, rpm in points}
    return result


def main(names):
    for name in names or CASES:
        if name in CASES:
            print(f'    "{name}": {{')
            for column, value in globals()[name]().items():
                print(f'        "{column}": {value:.13g},')
            print("    },", flush=True)
    if not names or "steady_speeds" in names:
        for name, (column, value) in steady_speeds().items():
            print(f'    "{name}": ("{column}", {value:.13g}),')
    if not names or "frequencies" in names:
        for name, values in frequencies().items():
            print(f'    "{name}": [{", ".join(f"{value:.13g}" for value in values)}],')
    if not names or "responses" in names:
        for name, points in responses().items():
            print(f'    "{name}": {{')
            for point, amplitudes in points.items():
                print(f"        {point}: {{")
                for column, value in amplitudes.items():
                    print(f'            "{column}": {value:.13g},')
                print("        },")
            print("    },")


if __name__ == "__main__":
    main(sys.argv[1:])

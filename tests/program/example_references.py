"""The example machines, computed a second time: equations of motion written down by hand for each, integrated with SciPy.

usage: python example_references.py [NAME]...     prints the numbers that test_example_machines.py holds

The inputs are read by f90nml. Coordinates are the fewest possible. Where a law has a kink (edges of a gap, points of a table,
limits of a governor, beginnings of steps), the integration stops there and starts again beyond.
"""

import sys
from pathlib import Path

import f90nml
import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.linalg import eigh
from scipy.optimize import brentq, minimize_scalar

EXAMPLES = Path(__file__).parents[2] / "input/examples"
DATA = Path(__file__).parent / "data"


UNITS = {"_rpm": np.pi / 30, "_hz": 2 * np.pi, "_deg": np.pi / 180}


def in_si(group):
    """A group with the keys in rad/s and rad of those in other units beside them."""
    si = {
        key.removesuffix(end): np.multiply(value, one)
        for end, one in UNITS.items()
        for key, value in group.items()
        if key.endswith(end)
    }
    return group | si


class Machine:
    """The groups of an input: machine.body["motor"]["inertia"]."""

    def __init__(self, path):
        self.folder = path.parent
        self.kinds = {}
        for kind, groups in f90nml.read(path).items():
            for group in groups if isinstance(groups, list) else [groups]:
                self.kinds.setdefault(kind, {})[group.get("name", group.get("load_case", ""))] = in_si(group)

    def __getattr__(self, kind):
        return self.kinds[kind]

    def inertia(self, *names):
        values = [self.body[name]["inertia"] for name in names or self.body]
        return values[0] if len(names) == 1 else np.array(values)

    def start(self, key, *names):
        return np.array([float(self.body[name].get(key, 0.0)) for name in names])

    def end(self):
        return self.run[""]["t_end"]

    def table(self, group):
        rows = [
            line.replace(",", " ").split()
            for line in (self.folder / group["table_file"]).read_text().splitlines()
            if line.strip() and line.lstrip()[0] not in "#!"
        ]
        return np.array(rows, dtype=float).T


def example(name):
    return Machine(EXAMPLES / name / f"{name}.nml")


class Motion:
    """A solution in pieces; in each the laws are on one branch."""

    def __init__(self):
        self.pieces = []  # (start, end, mode, solution)

    def at(self, t):
        return next(piece[3](t) for piece in reversed(self.pieces) if piece[0] <= t)

    def largest(self, value, sign=1, since=0.0):
        """Largest value(t, y, mode) in the pieces that begin at `since` or later; with sign = -1 the smallest."""
        best = -np.inf
        for start, end, mode, solution in self.pieces:
            if start < since:
                continue
            t = np.linspace(start, end, max(5, min(4000, int(1e5 * (end - start)))))

            def objective(s, mode=mode, solution=solution):
                return sign * value(s, solution(s), mode)

            values = [objective(s) for s in t]
            i = int(np.argmax(values))
            bounds = (t[max(i - 1, 0)], t[min(i + 1, len(t) - 1)])
            found = minimize_scalar(lambda s, f=objective: -f(s), bounds=bounds, method="bounded", options={"xatol": 1e-12})
            best = max(best, values[i], -found.fun)
        return sign * best


def motion_of(rate, state, end, mode=None, borders=None, breaks=()):
    """Integrates y' = rate(t, y, mode, middle); `middle` tells on which side of the `breaks` in time a piece lies, and
    borders(mode) yields pairs of a function of (t, y), positive while the mode holds, and the mode beyond its zero."""
    motion = Motion()
    t, state = 0.0, np.array(state, dtype=float)
    for stop in sorted({time for time in breaks if 0 < time < end} | {end}):
        middle = (t + stop) / 2
        while t < stop:
            events, beyond = [], []
            for function, other in borders(mode) if borders else ():

                def event(s, y, function=function):
                    return function(s, y)

                event.terminal, event.direction = True, -1
                events.append(event)
                beyond.append(other)
            piece = solve_ivp(
                lambda s, y, mode=mode, middle=middle: rate(s, y, mode, middle),
                (t, stop),
                state,
                method="DOP853",
                rtol=1e-13,
                atol=1e-14,
                dense_output=True,
                events=events,
            )
            assert piece.success, piece.message
            motion.pieces.append((t, piece.t[-1], mode, piece.sol))
            t, state = piece.t[-1], piece.y[:, -1]
            if piece.status == 1:
                mode = next(other for times, other in zip(piece.t_events, beyond) if len(times))
    return motion


class Curve:
    """A table, a polynomial in each segment; beyond the ends the end slope goes on, or the end value holds."""

    def __init__(self, points, cubic=False, constant=False):
        self.x, y = points
        n = len(self.x)
        secants = np.diff(y) / np.diff(self.x)
        inner = PchipInterpolator(self.x, y).c[::-1] if cubic else np.array([y[:-1], secants])
        slopes = PchipInterpolator(self.x, y).derivative()(self.x[[0, -1]]) if cubic else secants[[0, -1]]
        slopes = 0 * slopes if constant else slopes
        self.polynomial = [np.polynomial.Polynomial([y[0], slopes[0]])]
        self.polynomial += [np.polynomial.Polynomial(inner[:, i]) for i in range(n - 1)]
        self.polynomial += [np.polynomial.Polynomial([y[-1], slopes[1]])]
        self.origin = [self.x[0], *self.x]

    def segment(self, x):
        return int(np.searchsorted(self.x, x, side="right"))

    def __call__(self, segment, x):
        return self.polynomial[segment](x - self.origin[segment])

    def borders(self, segment, component):
        if segment > 0:
            yield lambda t, y: y[component] - self.x[segment - 1], segment - 1
        if segment < len(self.x):
            yield lambda t, y: self.x[segment] - y[component], segment + 1


class Gap:
    """Backlash: contact beyond +-gap/2 with a damping moment that is never larger than the elastic one."""

    FREE, CONTACT, CLOSING, SEPARATING = range(4)

    def __init__(self, coupling, twist, rate):
        self.stiffness, self.damping, self.gap = coupling["stiffness"], coupling["damping"], coupling["gap"]
        self.twist, self.rate = twist, rate  # functions of the state

    def elastic(self, mode, y):
        side, phase = mode
        return 0.0 if phase == self.FREE else self.stiffness * (self.twist(y) - side * self.gap / 2)

    def moment(self, mode, y):
        """Total: positive if it turns the first body forwards."""
        elastic = self.elastic(mode, y)
        return {
            self.FREE: 0.0,
            self.CONTACT: elastic + self.damping * self.rate(y),
            self.CLOSING: 2 * elastic,
            self.SEPARATING: 0.0,
        }[mode[1]]

    def borders(self, mode):
        side, phase = mode
        if phase == self.FREE:
            for other in (1, -1):
                yield lambda t, y, other=other: self.gap / 2 - other * self.twist(y), (other, self.CLOSING)
            return

        def elastic(y):
            return side * self.elastic(mode, y)

        def viscous(y):
            return side * self.damping * self.rate(y)

        if phase == self.CLOSING:
            yield lambda t, y: viscous(y) - elastic(y), (side, self.CONTACT)
        elif phase == self.CONTACT:
            yield lambda t, y: elastic(y) - viscous(y), (side, self.CLOSING)
            yield lambda t, y: elastic(y) + viscous(y), (side, self.SEPARATING)
        else:
            yield lambda t, y: elastic(y), (0, self.FREE)
            yield lambda t, y: -elastic(y) - viscous(y), (side, self.CONTACT)


def three_rotors():
    m = example("three_rotors")
    motor, gear, load = m.inertia()
    k, c, shake, ratio = m.coupling["shaft"]["stiffness"], m.load["bearing"]["viscous"], m.excitation["drive"], 10

    def torque(t):
        return shake["amplitude"] * np.sin(shake["frequency"] * t)

    def rate(t, y, *_):
        moment = k * (y[1] - y[0])
        return [y[2], y[3], (moment - c * y[2] + ratio * torque(t)) / (gear + ratio**2 * motor), -moment / load]

    y = motion_of(rate, np.zeros(4), m.end()).at(m.end())
    return {
        "phi_gear [rad]": y[0],
        "phi_load [rad]": y[1],
        "omega_gear [rad/s]": y[2],
        "omega_load [rad/s]": y[3],
        "reaction_reducer [N m]": motor * ratio * rate(m.end(), y)[2] - torque(m.end()),
    }


def backlash(times=(0.1, 0.25, 0.5)):
    m = example("backlash")
    j, spring = m.inertia("held"), m.coupling["spring"]
    gap = Gap(m.coupling["play"], lambda y: y[0], lambda y: y[1])
    start = [m.start("angle", "loose")[0], 0.0]
    loose = motion_of(
        lambda t, y, mode, _: [y[1], -gap.moment(mode, y) / m.inertia("loose")], start, m.end(), (1, Gap.CONTACT), gap.borders
    )
    # a damped oscillation in closed form
    decay = spring["damping"] / (2 * j)
    frequency = np.sqrt(spring["stiffness"] / j - decay**2)
    held = [np.pi / 2 * np.exp(-decay * t) * (np.cos(frequency * t) + decay / frequency * np.sin(frequency * t)) for t in times]
    return {f"phi_loose [rad] at {t}": loose.at(t)[0] for t in times} | {f"phi_held [rad] at {t}": x for t, x in zip(times, held)}


def motor_coupling_gear():
    """Coordinates: twist, pinion."""
    m = Machine(DATA / "motor_coupling_gear.nml")
    motor, pinion, wheel = m.inertia()
    c, ratio, shake = m.coupling["coupling"], 4, m.excitation["pulse"]
    viscous = m.load["work"]["viscous"] / ratio**2

    def rate(t, y, *_):
        moment = c["stiffness"] * y[0] + c["cubic_stiffness"] * y[0] ** 3 + c["damping"] * y[2]
        torque = m.motor["drive"]["a"] + shake["amplitude"] * np.sin(shake["frequency"] * t)
        acceleration = -(moment + viscous * y[3]) / (pinion + wheel / ratio**2)
        return [y[2], y[3], acceleration - (torque + moment) / motor, acceleration]

    y = motion_of(rate, np.zeros(4), m.end()).at(m.end())
    return {
        "phi_motor [rad]": y[1] - y[0],
        "phi_wheel [rad]": y[1] / ratio,
        "omega_motor [rad/s]": y[3] - y[2],
        "omega_wheel [rad/s]": y[3] / ratio,
        "reaction_reducer [N m]": -(wheel / ratio**2 * rate(m.end(), y)[3] + viscous * y[3]),
    }


def kloss_run_up():
    """The integral of J domega / M over the slip, inverted."""
    m = Machine(DATA / "kloss_run_up.nml")
    motor = m.motor["motor"]
    s_k, full = motor["breakdown_slip"], motor["synchronous_speed"]

    def time(slip):
        return m.inertia("rotor") * full / (2 * motor["breakdown_torque"]) * ((1 - slip**2) / (2 * s_k) - s_k * np.log(slip))

    slip = brentq(lambda slip: time(slip) - m.end(), 1e-4, 1.0, xtol=1e-16, rtol=1e-15)
    return {"omega_rotor [rad/s]": full * (1 - slip)}


def fan_law():
    m = Machine(DATA / "fan_law.nml")
    torque, k = m.motor["drive"]["torque"], m.load["air"]["quadratic"]
    return {"omega_fan [rad/s]": np.sqrt(torque / k) * np.tanh(np.sqrt(torque * k) * m.end() / m.inertia("fan"))}


def kloss(motor, speed):
    s, s_k = 1 - speed / motor["synchronous_speed"], motor["breakdown_slip"]
    return 2 * motor["breakdown_torque"] * s * s_k / (s**2 + s_k**2)


def fan_start():
    m = example("fan_start")
    rotor, fan = m.inertia()
    tyre, air, motor = m.coupling["tyre"], m.load["air"], m.motor["motor"]

    def moment(y):
        return tyre["stiffness"] * (y[1] - y[0]) + tyre["damping"] * (y[3] - y[2])

    def rate(t, y, *_):
        load = air["viscous"] * y[3] + air["quadratic"] * abs(y[3]) * y[3]
        return [y[2], y[3], (kloss(motor, y[2]) + moment(y)) / rotor, -(moment(y) + load) / fan]

    motion = motion_of(rate, np.zeros(4), m.end())
    y = motion.at(m.end())
    return {
        "phi_rotor [rad]": y[0],
        "omega_rotor [rad/s]": y[2],
        "omega_fan [rad/s]": y[3],
        "max torque_motor [N m]": motion.largest(lambda t, y, mode: kloss(motor, y[2])),
        "min moment_tyre [N m]": motion.largest(lambda t, y, mode: tyre["stiffness"] * (y[1] - y[0]), sign=-1),
    }


def half_sine(shake, t):
    return shake["amplitude"] * np.sin(np.pi * (t - shake["time"]) / shake["duration"])


def orders(shake, angle):
    as_array = np.atleast_1d
    phases = as_array(shake.get("phases", 0.0))
    return np.sum(as_array(shake["amplitudes"]) * np.sin(as_array(shake["orders"]) * angle + phases))


def wind_turbine():
    """Coordinates: rotor, carrier. Sun 6 times, intermediate shaft -97/24 * 6 times, generator 97 times the carrier."""
    m = example("wind_turbine")
    rotor, carrier, sun, middle_shaft, generator = m.inertia()
    shaft, gust, fault = m.coupling["main_shaft"], m.excitation["gust"], m.excitation["fault"]
    to_sun, to_middle, to_generator = 6.0, -6.0 * 97 / 24, 97.0
    reduced = carrier + sun * to_sun**2 + middle_shaft * to_middle**2 + generator * to_generator**2

    def ramp(t, middle):
        if middle < gust["time"]:
            return 0.0
        return gust["amplitude"] * ((t - gust["time"]) / gust["duration"] if middle < gust["time"] + gust["duration"] else 1.0)

    def electric(t, y, middle):
        speed = to_generator * y[3]
        on = fault["time"] < middle < fault["time"] + fault["duration"]
        return -m.load["grid"]["quadratic"] * speed * abs(speed) + (half_sine(fault, t) if on else 0.0)

    def rate(t, y, mode, middle):
        moment = shaft["stiffness"] * (y[1] - y[0]) + shaft["damping"] * (y[3] - y[2])
        wind = m.motor["wind"]["torque"] + ramp(t, middle) + orders(m.excitation["tower"], y[0])
        return [y[2], y[3], (wind + moment) / rotor, (-moment + to_generator * electric(t, y, middle)) / reduced]

    start = np.concatenate([m.start(key, "rotor", "carrier") for key in ("angle", "speed")])
    breaks = [gust["time"], gust["time"] + gust["duration"], fault["time"], fault["time"] + fault["duration"]]
    motion = motion_of(rate, start, m.end(), breaks=breaks)

    def on_sun(t, y, middle):
        """The planets turn the sun, the sun's wheel the rest."""
        acceleration = rate(t, y, None, middle)[3]
        on_middle = (generator * to_generator**2 + middle_shaft * to_middle**2) * acceleration - to_generator * electric(
            t, y, middle
        )
        return sun * to_sun * acceleration + on_middle / to_sun

    t, y = m.end(), motion.at(m.end())
    return {
        "phi_rotor [rad]": y[0],
        "omega_rotor [rad/s]": y[2],
        "omega_generator [rad/s]": to_generator * y[3],
        "reaction_planets [N m]": on_sun(t, y, t),
        "reaction_planets_ring [N m]": 5 * on_sun(t, y, t),
        "reaction_planets_carrier [N m]": -6 * on_sun(t, y, t),
        "min moment_main_shaft [N m]": motion.largest(lambda t, y, mode: shaft["stiffness"] * (y[1] - y[0]), sign=-1),
    }


SHIP = ("propeller", "bull", "hp_wheel", "hp_turbine", "lp_wheel", "lp_turbine")


def ship_matrices(m, pinions=True):
    """Inertia, stiffness and damping of propeller, bull gear, wheels and turbines; pinions and drivers turn with the gears."""
    gear = {name: -group["radii"][0] / group["radii"][1] for name, group in m.gear.items()}
    inertia = np.diag(m.inertia(*SHIP))
    unit = np.eye(6)
    twist = {"line_shaft": unit[0] - unit[1]}
    for side, i in (("hp", 2), ("lp", 4)):
        pinion, driver = gear[f"{side}_second"] * unit[1], gear[f"{side}_first"] * unit[i]
        twist[f"{side}_quill"], twist[f"{side}_shaft"] = unit[i] - pinion, unit[i + 1] - driver
        for name, row in ((f"{side}_pinion", pinion), (f"{side}_driver", driver)):
            inertia += pinions * m.inertia(name) * np.outer(row, row)

    def summed(key):
        return sum(m.coupling[name][key] * np.outer(row, row) for name, row in twist.items())

    return inertia, summed("stiffness"), summed("damping")


def ship_turbine():
    m = example("ship_turbine")
    inertia, stiffness, damping = ship_matrices(m)
    inverse = np.linalg.inv(inertia)
    steam, blades = [m.motor["hp_steam"], m.motor["lp_steam"]], m.excitation["blades"]

    def rate(t, y, *_):
        angle, speed = y[:6], y[6:]
        torque = -stiffness @ angle - damping @ speed
        torque[[3, 5]] += [group["a"] - group["b"] * w for group, w in zip(steam, speed[[3, 5]])]
        torque[0] += orders(blades, angle[0]) - m.load["water"]["quadratic"] * abs(speed[0]) * speed[0]
        return np.concatenate([speed, inverse @ torque])

    motion = motion_of(rate, np.concatenate([np.zeros(6), m.start("speed", *SHIP)]), m.end())
    y, k = motion.at(m.end()), m.coupling["line_shaft"]["stiffness"]
    acceleration = rate(m.end(), y)[6:]
    # torque of the wheel on its driver is force times radius
    driver = -m.gear["hp_first"]["radii"][0] / m.gear["hp_first"]["radii"][1]
    shaft = m.coupling["hp_shaft"]
    moment = shaft["stiffness"] * (y[3] - driver * y[2]) + shaft["damping"] * (y[9] - driver * y[8])
    force = (m.inertia("hp_driver") * driver * acceleration[2] - moment) / m.gear["hp_first"]["radii"][1]
    return {
        "phi_propeller [rad]": y[0],
        "omega_propeller [rad/s]": y[6],
        "omega_hp_turbine [rad/s]": y[9],
        "omega_lp_turbine [rad/s]": y[11],
        "reaction_hp_first [N]": force,
        "max moment_line_shaft [N m]": motion.largest(lambda t, y, mode: k * (y[0] - y[1])),
        "min moment_line_shaft [N m]": motion.largest(lambda t, y, mode: k * (y[0] - y[1]), sign=-1),
    }


def torque_split():
    """Coordinates: engine, bull, rotor. Each path carries half of what the bull gear needs."""
    m = example("torque_split")
    engine, pinion, left, right, bull, rotor = m.inertia()
    quill, mast, cut = m.coupling["quill"], m.coupling["mast"], m.excitation["cut"]
    to_shaft = -m.gear["left_second"]["radii"][1] / m.gear["left_second"]["radii"][0]
    to_pinion = -to_shaft * m.gear["left_first"]["radii"][1] / m.gear["left_first"]["radii"][0]
    reduced = bull + (left + right) * to_shaft**2 + pinion * to_pinion**2

    def moments(y):
        return (
            quill["stiffness"] * (to_pinion * y[1] - y[0]) + quill["damping"] * (to_pinion * y[4] - y[3]),
            mast["stiffness"] * (y[2] - y[1]) + mast["damping"] * (y[5] - y[4]),
        )

    def rate(t, y, mode, middle):
        first, last = moments(y)
        torque = m.motor["turbine"]["torque"] + (cut["amplitude"] if middle > cut["time"] else 0.0)
        air = m.load["air"]["quadratic"] * abs(y[5]) * y[5]
        return [y[3], y[4], y[5], (torque + first) / engine, (-to_pinion * first + last) / reduced, (-last - air) / rotor]

    start = np.concatenate([m.start(key, "engine", "bull", "rotor") for key in ("angle", "speed")])
    motion = motion_of(rate, start, m.end(), breaks=[cut["time"]])
    y = motion.at(m.end())
    acceleration = rate(m.end(), y, None, m.end())[4]
    first, last = moments(y)
    on_pinion = pinion * to_pinion * acceleration + first
    on_bull = bull * acceleration - last
    force = {"first": on_pinion / m.gear["left_first"]["radii"][0] / 2, "second": on_bull / m.gear["left_second"]["radii"][1] / 2}
    return {"omega_engine [rad/s]": y[3], "omega_bull [rad/s]": y[4], "omega_rotor [rad/s]": y[5]} | {
        f"reaction_{side}_{stage} [N]": force[stage] for side in ("left", "right") for stage in force
    }


def rolling_mill_motion(m):
    """Angles and speeds of motor, stand and roll; the moments of shaft and spindle as functions of (t, y, mode)."""
    motor, stand, roll = m.inertia()
    shaft, drive = m.coupling["shaft"], m.motor["drive"]
    billet = Curve(m.table(m.excitation["billet"]), constant=True)
    gap = Gap(m.coupling["spindle"], lambda y: y[2] - y[1], lambda y: y[5] - y[4])

    def rate(t, y, mode, middle):
        first = shaft["stiffness"] * (y[1] - y[0]) + shaft["damping"] * (y[4] - y[3])
        last = gap.moment(mode, y)
        torque = billet(billet.segment(middle), t) - m.load["bearings"]["viscous"] * y[5]
        return [*y[3:], (drive["a"] - drive["b"] * y[3] + first) / motor, (last - first) / stand, (torque - last) / roll]

    start = np.concatenate([m.start(key, "motor", "stand", "roll") for key in ("angle", "speed")])
    motion = motion_of(rate, start, m.end(), (0, Gap.FREE), gap.borders, billet.x)
    return motion, lambda t, y, mode: shaft["stiffness"] * (y[1] - y[0]), lambda t, y, mode: gap.elastic(mode, y)


def rolling_mill():
    m = example("rolling_mill")
    motion, shaft, spindle = rolling_mill_motion(m)
    y = motion.at(m.end())
    return {
        "phi_motor [rad]": y[0],
        "phi_roll [rad]": y[2],
        "omega_motor [rad/s]": y[3],
        "omega_stand [rad/s]": y[4],
        "omega_roll [rad/s]": y[5],
        "min moment_shaft [N m]": motion.largest(shaft, sign=-1),
        "min moment_spindle [N m]": motion.largest(spindle, sign=-1),
    }


def engine():
    m = example("engine")
    names = list(m.body)
    inertia, cylinders = m.inertia(), [names.index(f"cylinder_{i}") for i in range(1, 7)]
    chain = [m.coupling["oil"], *(m.coupling[f"crank_{i}"] for i in range(1, 9)), m.coupling["rubber"]]
    stiffness = np.array([group.get("stiffness", 0.0) for group in chain])
    damping = np.array([group["damping"] for group in chain])
    diesel = m.engine["diesel"]
    orders, amplitudes = np.array(diesel["orders"]), np.array(diesel["amplitudes"])
    firing = diesel["firing"][:, None]
    n = len(names)

    def rate(t, y, *_):
        moment = stiffness * np.diff(y[:n]) + damping * np.diff(y[n:])
        torque = np.zeros(n)
        torque[:-1] += moment
        torque[1:] -= moment
        torque[cylinders] += np.sin(orders * (y[cylinders][:, None] - firing)) @ amplitudes
        torque[names.index("flywheel")] += m.motor["gas"]["torque"]
        torque[-1] -= m.load["grid"]["viscous"] * y[-1]
        return np.concatenate([y[n:], torque / inertia])

    motion = motion_of(rate, np.concatenate([np.zeros(n), m.start("speed", *names)]), m.end())
    y = motion.at(m.end())
    picked = ("ring", "hub", "cylinder_6", "generator")
    return {f"omega_{name} [rad/s]": y[n + names.index(name)] for name in picked} | {
        "phi_flywheel [rad]": y[names.index("flywheel")],
        "max moment_crank_8 [N m]": motion.largest(lambda t, y, mode: stiffness[8] * (y[9] - y[8])),
        "min moment_rubber [N m]": motion.largest(lambda t, y, mode: stiffness[9] * (y[10] - y[9]), sign=-1),
    }


def modal_pulse(inertia, stiffness, struck, shake, t):
    """Angles and speeds at t of a machine at rest after a half-sine on the body `struck`: the sum of all modes."""
    square, shape = eigh(stiffness, np.diag(inertia))
    frequency = np.sqrt(np.abs(square))
    frequency[0] = 0.0  # rigid
    height, length = shake["amplitude"] * shape[struck], shake["duration"]
    pulse, s = np.pi / length, min(t - shake["time"], shake["duration"])
    w = np.where(frequency > 0, frequency, 1.0)
    q = height / (w**2 - pulse**2) * (np.sin(pulse * s) - pulse / w * np.sin(w * s))
    v = height * pulse / (w**2 - pulse**2) * (np.cos(pulse * s) - np.cos(w * s))
    rest = max(t - shake["time"] - length, 0.0)
    q, v = q * np.cos(w * rest) + v / w * np.sin(w * rest), v * np.cos(w * rest) - q * w * np.sin(w * rest)
    v[0] = height[0] / pulse * (1 - np.cos(pulse * s))
    q[0] = height[0] / pulse * (s - np.sin(pulse * s) / pulse) + v[0] * rest
    return shape @ q, shape @ v


def chain_stiffness(values):
    matrix = np.zeros((len(values) + 1,) * 2)
    for i, k in enumerate(values):
        matrix[i : i + 2, i : i + 2] += k * np.array([[1, -1], [-1, 1]])
    return matrix


def chain_200():
    m = example("chain_200")
    stiffness = chain_stiffness([group["stiffness"] for group in m.coupling.values()])
    angle, speed = modal_pulse(m.inertia(), stiffness, 0, m.excitation["blow"], m.end())
    return {f"phi_r{i:03} [rad]": angle[i - 1] for i in (1, 100, 200)} | {
        f"omega_r{i:03} [rad/s]": speed[i - 1] for i in (1, 100, 110, 200)
    }


def ieee_first_benchmark():
    m = example("ieee_first_benchmark")
    names = list(m.body)
    stiffness = chain_stiffness([group["stiffness"] for group in m.coupling.values()])
    angle, speed = modal_pulse(m.inertia(), stiffness, names.index("generator"), m.excitation["fault"], m.end())
    mean = m.start("speed", *names)
    angle, speed = angle + m.start("angle", *names) + mean * m.end(), speed + mean
    return {f"omega_{name} [rad/s]": speed[names.index(name)] for name in ("hp", "lpb", "generator", "exciter")} | {
        f"twist_{group['name']} [rad]": angle[i + 1] - angle[i] for i, group in enumerate(m.coupling.values())
    }


def synchronous_start():
    """Coordinates: motor, wheel, compressor; the pinion turns -6 times the wheel."""
    m = example("synchronous_start")
    motor, wheel, pinion, compressor = m.inertia()
    low, high, shake = m.coupling["low_speed"], m.coupling["high_speed"], m.excitation["pulsation"]
    cage = Curve(m.table(m.motor["cage"]), cubic=True)
    ratio = -m.gear["speed_up"]["teeth"][0] / m.gear["speed_up"]["teeth"][1]

    def rate(t, y, segment, middle):
        first = low["stiffness"] * (y[1] - y[0]) + low["damping"] * (y[4] - y[3])
        last = high["stiffness"] * (y[2] - ratio * y[1]) + high["damping"] * (y[5] - ratio * y[4])
        pulsation = shake["amplitude"] * np.sin(2 * (shake["frequency"] * t - shake["pole_pairs"] * y[0]))
        gas = m.load["gas"]["quadratic"] * abs(y[5]) * y[5]
        return [
            *y[3:],
            (cage(segment, y[3]) + pulsation + first) / motor,
            (ratio * last - first) / (wheel + ratio**2 * pinion),
            (-last - gas) / compressor,
        ]

    motion = motion_of(rate, np.zeros(6), m.end(), cage.segment(0.0), lambda segment: cage.borders(segment, 3))
    y = motion.at(m.end())
    return {
        "phi_motor [rad]": y[0],
        "omega_motor [rad/s]": y[3],
        "omega_wheel [rad/s]": y[4],
        "omega_compressor [rad/s]": y[5],
        "min moment_low_speed [N m]": motion.largest(lambda t, y, mode: low["stiffness"] * (y[1] - y[0]), sign=-1),
        "max moment_low_speed [N m]": motion.largest(lambda t, y, mode: low["stiffness"] * (y[1] - y[0])),
    }


def dc_governed():
    """States: angles and speeds of armature and machine, current, integrator."""
    m = example("dc_governed")
    armature, machine = m.inertia()
    shaft, drive, viscous = m.coupling["shaft"], m.motor["drive"], m.load["friction"]["viscous"]
    gain, flux = drive["governor_gain"], drive["flux_constant"]

    def throttle(y):
        return y[5] + gain * (drive["governor_speed"] - y[2])

    # mode: the limit at which the throttle is; there the integrator follows it with the integral time
    def rate(t, y, limit, middle):
        moment = shaft["stiffness"] * (y[1] - y[0]) + shaft["damping"] * (y[3] - y[2])
        steps = sum(group["amplitude"] for group in m.excitation.values() if middle > group["time"])
        opened = throttle(y) if limit is None else limit
        current = (drive["voltage"] * opened - drive["resistance"] * y[4] - flux * y[2]) / drive["inductance"]
        return [
            y[2],
            y[3],
            (flux * y[4] + moment) / armature,
            (steps - viscous * y[3] - moment) / machine,
            current,
            (opened - y[5]) / drive["governor_time"],
        ]

    def borders(limit):
        if limit is None:
            yield lambda t, y: 1 - throttle(y), 1
            yield lambda t, y: throttle(y), 0
        else:
            yield lambda t, y: (throttle(y) - limit) * (1 if limit == 1 else -1), None

    speed = m.start("speed", "armature", "machine")
    start = [0.0, 0.0, *speed, 0.0, drive["governor_start"] - gain * (drive["governor_speed"] - speed[0])]
    motion = motion_of(rate, start, m.end(), None, borders, [group["time"] for group in m.excitation.values()])
    y = motion.at(m.end())
    return {
        "phi_armature [rad]": y[0],
        "omega_armature [rad/s]": y[2],
        "omega_machine [rad/s]": y[3],
        "torque_drive [N m]": flux * y[4],
        "max torque_drive [N m]": motion.largest(lambda t, y, mode: flux * y[4]),
        "min omega_machine [rad/s]": motion.largest(lambda t, y, mode: y[3], sign=-1),
    }


def differential():
    """Coordinates: engine, left, right, both wheels, vehicle; the case turns at the mean of left and right."""
    m = example("differential")
    j = {name: m.inertia(name) for name in m.body}
    to_output = -m.gear["final"]["teeth"][1] / m.gear["final"]["teeth"][0]
    to_input = -to_output * m.gear["first"]["teeth"][1] / m.gear["first"]["teeth"][0]
    at_case = j["case"] + j["output"] * to_output**2 + j["input"] * to_input**2
    inertia = np.array([[j["left"] + at_case / 4, at_case / 4], [at_case / 4, j["right"] + at_case / 4]])
    clutch, shafts = m.coupling["clutch"], [m.coupling["left_shaft"], m.coupling["right_shaft"]]
    tyres, resistance = [m.coupling["road"], m.coupling["ice"]], m.load["resistance"]
    curve = Curve(m.table(m.motor["throttle"]), constant=True)

    def spring(group, twist, rate_of_twist):
        return group["stiffness"] * twist + group["damping"] * rate_of_twist

    def sides(y):
        """Torques on left and right from their shafts and, by way of the case, from the engine."""
        at_input = -spring(clutch, to_input * (y[1] + y[2]) / 2 - y[0], to_input * (y[7] + y[8]) / 2 - y[6])
        moments = np.array([spring(group, y[3 + i] - y[1 + i], y[9 + i] - y[7 + i]) for i, group in enumerate(shafts)])
        return at_input, moments

    def rate(t, y, segment, middle):
        at_input, moments = sides(y)
        slip = np.array(
            [group["friction"] * np.tanh((y[11] - y[9 + i]) / group["friction_speed"]) for i, group in enumerate(tyres)]
        )
        drag = resistance["constant"] * np.tanh(y[11] / resistance["constant_speed"])
        drag += resistance["quadratic"] * abs(y[11]) * y[11]
        axle = np.linalg.solve(inertia, moments + at_input * to_input / 2)
        wheels = (slip - moments) / [j["left_wheel"], j["right_wheel"]]
        return [*y[6:], (curve(segment, y[6]) - at_input) / j["engine"], *axle, *wheels, (-slip.sum() - drag) / j["vehicle"]]

    names = ("engine", "left", "right", "left_wheel", "right_wheel", "vehicle")
    start = np.concatenate([m.start(key, *names) for key in ("angle", "speed")])
    motion = motion_of(rate, start, m.end(), curve.segment(start[6]), lambda segment: curve.borders(segment, 6))
    y = motion.at(m.end())
    segment = motion.pieces[-1][2]
    acceleration = rate(m.end(), y, segment, m.end())
    return {f"omega_{name} [rad/s]": y[6 + i] for i, name in enumerate(names)} | {
        "omega_case [rad/s]": (y[7] + y[8]) / 2,
        "reaction_axle [N m]": j["left"] * acceleration[7] - sides(y)[1][0],
    }


def coupled_clutches():
    """Speeds and angles of four inertias; mode: the sign of the slip of each clutch, 0 where it is locked."""
    m = example("coupled_clutches")
    inertia, clutches, torque = m.inertia(), list(m.clutch.values()), m.excitation["torque"]
    curve = Curve((np.array(clutches[0]["table_time"]), clutches[0]["table_level"]), cubic=True, constant=True)

    def levels(t, middle):
        return [curve(curve.segment(middle), t), *(float(middle > group["times"]) for group in clutches[1:])]

    def solve(t, mode, middle):
        """Accelerations and torques of the clutches, those of locked ones from the rows that hold."""
        held = [i for i in range(3) if mode[i] == 0]
        torques = np.array([mode[i] * clutches[i]["capacity"] * levels(t, middle)[i] for i in range(3)])
        applied = np.array([torque["amplitude"] * np.sin(torque["frequency"] * t), 0, 0, 0])
        applied[:3] -= torques
        applied[1:] += torques
        rows = np.array([np.eye(4)[i] - np.eye(4)[i + 1] for i in held]).reshape(-1, 4)
        matrix = np.block([[np.diag(inertia), rows.T], [rows, np.zeros((len(held), len(held)))]])
        found = np.linalg.solve(matrix, np.concatenate([applied, np.zeros(len(held))]))
        torques[held] = found[4:]
        return found[:4], torques

    def rate(t, y, mode, middle):
        return [*y[4:], *solve(t, mode, middle)[0]]

    def borders(mode):
        for i in range(3):

            def other(sign, i=i):
                return (*mode[:i], sign, *mode[i + 1 :])

            if mode[i]:
                closes = clutches[i].get("times", 0.0)  # before, it does not lock
                yield lambda t, y, i=i, t_0=closes: mode[i] * (y[4 + i] - y[5 + i]) if t >= t_0 else 1.0, other(0)
            else:
                for sign in (1, -1):
                    yield (
                        lambda t, y, i=i, s=sign: clutches[i]["static_capacity"] * levels(t, t)[i] - s * solve(t, mode, t)[1][i],
                        other(sign),
                    )

    breaks = [*clutches[0]["table_time"], *(group["times"] for group in clutches[1:])]
    start = [0.0] * 4 + list(m.start("speed", *m.body))
    motion = motion_of(rate, start, m.end(), (1, 1, 1), borders, breaks)
    y = motion.at(m.end())
    locks = [begin for (begin, _, mode, _), (_, _, before, _) in zip(motion.pieces[1:], motion.pieces) if mode != before]
    assert len(locks) == 6
    return {f"omega_J{i + 1} [rad/s]": y[4 + i] for i in range(4)} | {f"phi_J{i + 1} [rad]": y[i] for i in range(4)}


def hooke(group, angle):
    """Angle behind a cardan joint and its first two derivatives by the angle before it, which is zero at the start."""
    phase = group.get("phase", 0.0)
    c, s = np.cos(group["angle"]), np.sin(group["angle"]) ** 2

    def turned(x):
        return x + np.arctan2((1 - c) * np.sin(x) * np.cos(x), c + (1 - c) * np.sin(x) ** 2)

    d = 1 - s * np.cos(angle + phase) ** 2
    return turned(angle + phase) - turned(phase), c / d, -c * s * np.sin(2 * (angle + phase)) / d**2


def car_driveline():
    """Angles of engine, output shaft and vehicle; mode: whether the clutch slips."""
    m = example("car_driveline")
    j = {name: m.inertia(name) for name in m.body}
    teeth = {name: m.gear[name]["teeth"] for name in m.gear}
    to_input = -teeth["first"][1] / teeth["first"][0]
    to_axle = -teeth["final"][0] / teeth["final"][1]
    clutch, shafts, resistance = m.clutch["dry"], m.coupling["half_shafts"], m.load["resistance"]
    curve = Curve((np.array(clutch["table_time"]), clutch["table_level"]), constant=True)

    def geometry(v):
        """Angle of the axle, its derivatives by that of the output, the inertia at the output and half its derivative."""
        s, s1, s2 = hooke(m.cardan["front"], v)
        p, p1, p2 = hooke(m.cardan["rear"], s)
        p1, p2 = p1 * s1, p2 * s1**2 + p1 * s2
        behind = j["pinion"] + j["axle"] * to_axle**2
        inertia = j["output"] + j["input"] * to_input**2 + j["shaft"] * s1**2 + behind * p1**2
        return to_axle * p, to_axle * p1, to_axle * p2, inertia, j["shaft"] * s1 * s2 + behind * p1 * p2

    def drive(y):
        return m.motor["throttle"]["torque"] - m.load["friction"]["viscous"] * y[3]

    def behind(y):
        axle, axle1, _, inertia, change = geometry(y[1])
        moment = shafts["stiffness"] * (y[2] - axle) + shafts["damping"] * (y[5] - axle1 * y[4])
        drag = resistance["viscous"] * y[5] + resistance["quadratic"] * abs(y[5]) * y[5]
        return axle1 * moment - change * y[4] ** 2, inertia, -(moment + drag) / j["vehicle"]

    def accelerations(t, y, slips, middle):
        """Of engine, output, vehicle."""
        load, inertia, vehicle = behind(y)
        if not slips:
            output = (load + to_input * drive(y)) / (inertia + j["engine"] * to_input**2)
            return [to_input * output, output, vehicle]
        torque = clutch["capacity"] * curve(curve.segment(middle), t)
        return [(drive(y) - torque) / j["engine"], (load + to_input * torque) / inertia, vehicle]

    def rate(t, y, slips, middle):
        return [*y[3:], *accelerations(t, y, slips, middle)]

    def borders(slips):
        if slips:
            yield lambda t, y: y[3] - to_input * y[4], False

    start = [0.0, 0.0, 0.0, *m.start("speed", "engine"), 0.0, 0.0]
    motion = motion_of(rate, start, m.end(), True, borders, clutch["table_time"])
    y = motion.at(m.end())
    axle, axle1, *_ = geometry(y[1])
    engine_acceleration = accelerations(m.end(), y, False, m.end())[0]
    return {
        "omega_engine [rad/s]": y[3],
        "omega_vehicle [rad/s]": y[5],
        "omega_shaft [rad/s]": hooke(m.cardan["front"], y[1])[1] * y[4],
        "omega_axle [rad/s]": axle1 * y[4],
        "torque_dry [N m]": drive(y) - j["engine"] * engine_acceleration,
        "twist_half_shafts [rad]": y[2] - axle,
        "max omega_vehicle [rad/s]": motion.largest(lambda t, y, mode: y[5]),
    }


def compressor():
    """Angles of rotor and flywheel."""
    m = example("compressor")
    rotor, flywheel = m.inertia()
    shaft, motor, crank = m.coupling["shaft"], m.motor["motor"], m.crank["piston"]
    r, length, share = crank["crank_radius"], crank["rod_length"], crank["rod_center"] / crank["rod_length"]
    lines = (m.folder / crank["pressure_file"]).read_text().splitlines()[2:]
    degrees, pressure = np.array([line.split(",") for line in lines], dtype=float).T
    angles = np.radians(degrees)
    points = np.concatenate([angles - 2 * np.pi, angles, angles + 2 * np.pi])
    curve = Curve((points, np.tile(crank["crankcase_pressure"] - pressure, 3)), cubic=True)
    samples = 2 * np.pi * np.arange(4096) / 4096
    harmonics = np.fft.rfft([curve(curve.segment(x), x) for x in samples])[: crank["harmonics_up_to"] + 1] / 2048
    harmonics[0] /= 2
    area = np.pi / 4 * crank["bore"] ** 2

    def force(v):
        return area * np.real(np.sum(harmonics * np.exp(1j * np.arange(len(harmonics)) * v)))

    def motions(v):
        """First and second derivatives of what moves with the crank: piston, rod along and across, rod angle."""
        p, p1, p2 = r * np.sin(v), r * np.cos(v), -r * np.sin(v)
        w = np.sqrt(length**2 - p**2)
        w1 = -p * p1 / w
        w2 = -(p1**2 + p * p2 + w1**2) / w
        first = [-p + w1, -p + share * w1, (1 - share) * p1, p1 / w]
        return np.array(first), np.array([-p1 + w2, -p1 + share * w2, (1 - share) * p2, (p2 - w1 * p1 / w) / w])

    masses = np.array([crank["piston_mass"], crank["rod_mass"], crank["rod_mass"], crank["rod_inertia"]])

    def torques(y):
        moment = shaft["stiffness"] * (y[1] - y[0]) + shaft["damping"] * (y[3] - y[2])
        return motor["a"] - motor["b"] * y[2], moment

    def rate(t, y, *_):
        drive, moment = torques(y)
        first, second = motions(y[1])
        inertia = flywheel + masses @ first**2
        turn = (force(y[1]) * first[0] - moment - masses @ (first * second) * y[3] ** 2) / inertia
        return [y[2], y[3], (drive + moment) / rotor, turn]

    motion = motion_of(rate, np.zeros(4), m.end())
    y = motion.at(m.end())
    first, second = motions(y[1])
    acceleration = rate(m.end(), y)[3]
    return {
        "phi_flywheel [rad]": y[1],
        "omega_rotor [rad/s]": y[2],
        "omega_flywheel [rad/s]": y[3],
        "position_piston [m]": r * np.cos(y[1]) + np.sqrt(length**2 - (r * np.sin(y[1])) ** 2),
        "velocity_piston [m/s]": first[0] * y[3],
        "gas_force_piston [N]": force(y[1]),
        "force_piston [N]": masses[0] * (first[0] * acceleration + second[0] * y[3] ** 2) - force(y[1]),
        "min moment_shaft [N m]": motion.largest(lambda t, y, mode: shaft["stiffness"] * (y[1] - y[0]), sign=-1),
    }


def hybrid():
    """Angles of engine, ring and vehicle; mode: whether the freewheel holds the engine."""
    m = example("hybrid")
    j = {name: m.inertia(name) for name in m.body}
    sun, ring = m.planetary["split"]["teeth"]
    carrier, back = (sun + ring) / sun, -ring / sun  # the sun turns with carrier * engine + back * ring
    to_axle = m.gear["final"]["teeth"][0] / m.gear["final"]["teeth"][1]
    shafts = m.coupling["half_shafts"]
    inertia = np.array([[j["engine"], 0.0], [0.0, j["motor"] + j["axle"] * to_axle**2]])
    inertia += j["generator"] * np.outer([carrier, back], [carrier, back])
    tables = {name: Curve((np.array(group["table_time"]), group["table_torque"])) for name, group in m.excitation.items()}

    def torques(t, y, middle):
        """Generalised ones on engine and ring, and that of the half shafts."""
        traction, control, fuel = (tables[name](tables[name].segment(middle), t) for name in ("traction", "control", "fuel"))
        moment = shafts["stiffness"] * (y[2] - to_axle * y[1]) + shafts["damping"] * (y[5] - to_axle * y[4])
        at_engine = fuel - m.load["drag"]["viscous"] * y[3] + carrier * control
        return np.array([at_engine, traction + to_axle * moment + back * control]), moment

    def accelerations(t, y, holds, middle):
        applied, moment = torques(t, y, middle)
        ring = [0.0, applied[1] / inertia[1, 1]]
        found = ring if holds else np.linalg.solve(inertia, applied)
        return [*found, -(moment + m.load["resistance"]["viscous"] * y[5]) / j["vehicle"]]

    def rate(t, y, holds, middle):
        return [*y[3:], *accelerations(t, y, holds, middle)]

    def held(t, y):
        """The torque on the engine that would turn it forward."""
        applied, _ = torques(t, y, t)
        return applied[0] - inertia[0, 1] * applied[1] / inertia[1, 1]

    def borders(holds):
        if holds:
            yield lambda t, y: -held(t, y), False
        else:
            yield lambda t, y: y[3], True

    breaks = [time for group in m.excitation.values() for time in group["table_time"]]
    motion = motion_of(rate, np.zeros(6), m.end(), False, borders, breaks)
    y = motion.at(m.end())
    return {
        "omega_engine [rad/s]": y[3],
        "omega_motor [rad/s]": y[4],
        "omega_generator [rad/s]": carrier * y[3] + back * y[4],
        "omega_vehicle [rad/s]": y[5],
        "phi_engine [rad]": y[0],
        "max omega_generator [rad/s]": motion.largest(lambda t, y, mode: carrier * y[3] + back * y[4]),
        "min torque_backstop [N m]": motion.largest(lambda t, y, mode: held(t, y) if mode else 0.0, sign=-1),
    }


def winch():
    """Angles of motor and load; mode: the direction of the motor and whether it drives the worm, (0, None) at rest."""
    m = example("winch")
    j, worm, rope = {name: m.inertia(name) for name in m.body}, m.gear["worm"], m.coupling["rope"]
    ratio = worm["teeth"][1] / worm["teeth"][0]
    share = {True: 1 / worm["efficiency"], False: worm["reverse_efficiency"]}  # of the torque of the teeth, for the motor
    drive = m.excitation["drive"]
    table = Curve((np.array(drive["table_time"]), drive["table_torque"]))
    switches, levels = m.clutch["brake"]["times"], m.clutch["brake"]["levels"]

    def friction(t):
        """Of brake and bearing."""
        level = [level for time, level in zip(switches, levels) if time <= t][-1]
        return level * m.clutch["brake"]["capacity"] + m.body["motor"]["bearing_friction"]

    def moment(y):
        return rope["stiffness"] * (y[1] - y[0] / ratio) + rope["damping"] * (y[3] - y[2] / ratio)

    def torque(t, y, middle):
        return table(table.segment(middle), t) - m.load["fan"]["viscous"] * y[2]

    def turn(t, y, mode, middle):
        """The acceleration of the motor."""
        if mode[0] == 0:
            return 0.0
        part = share[mode[1]]
        total = torque(t, y, middle) - mode[0] * friction(middle) + part * moment(y) / ratio
        return total / (j["motor"] + part * j["drum"] / ratio**2)

    def teeth(t, y, mode, middle):
        return (moment(y) - j["drum"] * turn(t, y, mode, middle) / ratio) / ratio

    def rate(t, y, mode, middle):
        return [y[2], y[3], turn(t, y, mode, middle), (m.excitation["weight"]["amplitude"] - moment(y)) / j["load"]]

    def borders(mode):
        direction, drives = mode
        if direction == 0:
            yield lambda t, y: friction(t) - torque(t, y, t) - min(s * moment(y) / ratio for s in share.values()), (1, True)
            yield lambda t, y: friction(t) + torque(t, y, t) + max(s * moment(y) / ratio for s in share.values()), (-1, False)
        else:
            sign = -direction if drives else direction
            yield lambda t, y: direction * y[2], (0, None)
            yield lambda t, y: sign * teeth(t, y, mode, t), (direction, not drives)

    start = [*m.start("angle", "motor", "load"), 0.0, 0.0]
    motion = motion_of(rate, start, m.end(), (0, None), borders, sorted({*drive["table_time"], *switches}))
    y = motion.at(m.end())
    return {
        "phi_motor [rad]": y[0],
        "phi_load [rad]": y[1],
        "omega_load [rad/s]": y[3],
        "reaction_worm [N m]": moment(y) / ratio,
        "max omega_motor [rad/s]": motion.largest(lambda t, y, mode: y[2]),
        "min omega_motor [rad/s]": motion.largest(lambda t, y, mode: y[2], sign=-1),
        "min moment_rope [N m]": motion.largest(lambda t, y, mode: rope["stiffness"] * (y[1] - y[0] / ratio), sign=-1),
    }


def natural_frequencies(inertia, stiffness):
    """[Hz], without damping and without the rigid motion."""
    return np.sqrt(eigh(stiffness, inertia, eigvals_only=True)[1:]) / (2 * np.pi)


def frequencies():
    """Natural frequencies [Hz] by machine."""
    ieee, ship = example("ieee_first_benchmark"), example("ship_turbine")
    discs, wind = Machine(DATA / "two_discs.nml"), example("wind_turbine")
    reduced = [
        wind.inertia("rotor"),
        wind.inertia("carrier")
        + 36 * wind.inertia("sun")
        + 24.25**2 * wind.inertia("intermediate")
        + 97**2 * wind.inertia("generator"),
    ]
    return {
        "two_discs": natural_frequencies(np.diag(discs.inertia()), chain_stiffness([discs.coupling["shaft"]["stiffness"]])),
        "ieee_first_benchmark": natural_frequencies(
            np.diag(ieee.inertia()), chain_stiffness([group["stiffness"] for group in ieee.coupling.values()])
        ),
        "ship_turbine": natural_frequencies(*ship_matrices(ship)[:2]),
        # the published ones
        "ship_turbine without pinions": natural_frequencies(*ship_matrices(ship, pinions=False)[:2]),
        "wind_turbine": natural_frequencies(np.diag(reduced), chain_stiffness([wind.coupling["main_shaft"]["stiffness"]])),
        # the five lowest
        "chain_200": 2 * np.sqrt(2.0e4 / 0.02) * np.sin(np.arange(1, 200) * np.pi / 400)[:5] / (2 * np.pi),
    }


def steady_speeds():
    """Speeds [rad/s] at which the torques balance when all disturbances are over: steps and ramps hold, waves have no mean."""
    fan, wind, ship, split = (example(name) for name in ("fan_start", "wind_turbine", "ship_turbine", "torque_split"))
    start, engine_, dc = example("synchronous_start"), example("engine"), example("dc_governed")

    def fan_balance(w):
        return kloss(fan.motor["motor"], w) - fan.load["air"]["viscous"] * w - fan.load["air"]["quadratic"] * w**2

    def ship_balance(w):
        steam = sum(
            ratio * (ship.motor[name]["a"] - ship.motor[name]["b"] * ratio * w)
            for name, ratio in (("hp_steam", 9.4094 * 7.82365 / 0.94094), ("lp_steam", 9.4094 * 4.00424 / 0.94094))
        )
        return steam - ship.load["water"]["quadratic"] * w**2

    cage = Curve(start.table(start.motor["cage"]), cubic=True)

    def start_balance(w):
        return cage(cage.segment(w), w) - 6 * start.load["gas"]["quadratic"] * (6 * w) ** 2

    pinion = 124 / 32 * 176 / 27
    turbine = split.motor["turbine"]["torque"] + split.excitation["cut"]["amplitude"]
    return {
        "fan_start": ("omega_fan [rad/s]", brentq(fan_balance, 140, 157, xtol=1e-13)),
        "wind_turbine": (
            "omega_generator [rad/s]",
            np.sqrt((wind.motor["wind"]["torque"] + wind.excitation["gust"]["amplitude"]) / 97 / wind.load["grid"]["quadratic"]),
        ),
        "ship_turbine": ("omega_propeller [rad/s]", brentq(ship_balance, 1, 10, xtol=1e-13)),
        "torque_split": ("omega_rotor [rad/s]", np.sqrt(turbine * pinion / split.load["air"]["quadratic"])),
        "synchronous_start": ("omega_motor [rad/s]", brentq(start_balance, 150, 157.08, xtol=1e-13)),
        "engine": ("omega_generator [rad/s]", engine_.motor["gas"]["torque"] / engine_.load["grid"]["viscous"]),
        "dc_governed": ("omega_machine [rad/s]", dc.motor["drive"]["governor_speed"]),
    }


EXAMPLE_MACHINES = (
    three_rotors,
    backlash,
    fan_start,
    wind_turbine,
    ship_turbine,
    torque_split,
    rolling_mill,
    engine,
    chain_200,
    synchronous_start,
    ieee_first_benchmark,
    dc_governed,
    differential,
    coupled_clutches,
    car_driveline,
    compressor,
    hybrid,
    winch,
    motor_coupling_gear,
    kloss_run_up,
    fan_law,
)


def main(names):
    for function in EXAMPLE_MACHINES:
        if not names or function.__name__ in names:
            print(f'    "{function.__name__}": {{')
            for column, value in function().items():
                print(f'        "{column}": {value:.13g},')
            print("    },", flush=True)
    if not names or "steady_speeds" in names:
        for name, (column, value) in steady_speeds().items():
            print(f'    "{name}": ("{column}", {value:.13g}),')
    if not names or "frequencies" in names:
        for name, values in frequencies().items():
            print(f'    "{name}": [{", ".join(f"{value:.13g}" for value in values)}],')


if __name__ == "__main__":
    main(sys.argv[1:])

"""Random trains of joints that lock, lose, move and hold: chains of bodies with every kind of joint between and beside them."""

import random

LINKS = ["coupling", "clutch", "clutch", "gear", "lossy gear", "lossy gear", "cardan", "freewheel", "lossy mesh", "dog clutch"]


def link(chance, name, pair):
    """A joint of two bodies."""
    kind = chance.choice(LINKS)
    bodies = f"name = '{name}' bodies = {pair}"
    radii = f"radii = {chance.uniform(0.5, 2):.3f}, 1 internal = {chance.choice(['.true.', '.false.'])}"
    losses = f"efficiency = {chance.uniform(0.5, 0.98):.3f} "
    losses += f"reverse_efficiency = {chance.choice([-0.1, 0.0, 0.3, 0.5, 0.8, 0.95])}"
    late = f"times = {chance.uniform(0.1, 1):.3f} levels = 1" if chance.random() < 0.3 else ""
    texts = {
        "coupling": f"&coupling {bodies} stiffness = {chance.choice([100, 1000, 5000])} damping = {chance.choice([0, 2])} /",
        "clutch": f"&clutch {bodies} capacity = {chance.uniform(1, 50):.3f} {late} /",
        "dog clutch": f"&clutch {bodies} kind = 'dog' times = {chance.uniform(0.1, 1):.3f} levels = 1 /",
        "gear": f"&gear {bodies} {radii} /",
        "lossy gear": f"&gear {bodies} {radii} {losses} /",
        "lossy mesh": f"&mesh {bodies} {radii} stiffness = {chance.choice([1e4, 1e5])} "
        f"damping = {chance.choice([0, 50])} {losses} /",
        "cardan": f"&cardan {bodies} angle_deg = {chance.uniform(5, 35):.1f} phase = {chance.uniform(0, 3):.2f} /",
        "freewheel": f"&freewheel {bodies} direction = '{chance.choice(['forward', 'backward'])}' /",
    }
    return texts[kind] + "\n"


def beside(chance, i):
    """What acts on one body."""
    text = ""
    if chance.random() < 0.2:
        late = f"times = {chance.uniform(0.1, 1):.3f} levels = 1" if chance.random() < 0.5 else ""
        text += f"&clutch name = 'brake{i}' bodies = 'b{i}', 'ground' capacity = {chance.uniform(1, 60):.3f} {late} /\n"
    if chance.random() < 0.1:
        text += f"&freewheel name = 'stop{i}' bodies = 'b{i}', 'ground' /\n"
    if chance.random() < 0.15:
        text += f"&crank name = 'crank{i}' body = 'b{i}' crank_radius = 0.05 rod_length = 0.2\n"
        text += f"  piston_mass = {chance.uniform(0.5, 10):.2f} phase = {chance.uniform(0, 6):.2f} /\n"
    if chance.random() < 0.3:
        text += f"&excitation name = 'e{i}' body = 'b{i}' amplitude = {chance.uniform(3, 90):.2f}\n"
        text += f"  frequency = {chance.uniform(2, 40):.2f} phase = {chance.uniform(0, 6):.2f} /\n"
    if chance.random() < 0.2:
        text += f"&motor name = 'm{i}' body = 'b{i}' kind = 'constant' torque = {chance.uniform(-50, 50):.2f} /\n"
    if chance.random() < 0.2:
        text += f"&load name = 'l{i}' body = 'b{i}' viscous = {chance.uniform(0.05, 1):.3f}\n"
        text += f"  constant = {chance.uniform(0, 10):.2f} constant_speed = 1 /\n"
    return text


def random_train(seed):
    """The text of an input."""
    chance = random.Random(seed)
    count = chance.randint(2, 8)
    text = ""
    for i in range(count):
        friction = f"bearing_friction = {chance.uniform(0.2, 3):.2f}" if chance.random() < 0.3 else ""
        speed = f"speed = {chance.uniform(-40, 40):.2f}" if chance.random() < 0.5 else ""
        text += f"&body name = 'b{i}' inertia = {10 ** chance.uniform(-1.3, 0.7):.3f} {speed} {friction} /\n"
        if i > 0:
            first = i - 1 if chance.random() < 0.8 else chance.randrange(i)
            text += link(chance, f"j{i}", f"'b{first}', 'b{i}'")
        text += beside(chance, i)
    return text + "&run t_end = 2 start = 'projected' /\n&output points = 51 /\n"

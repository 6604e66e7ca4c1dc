"""Friction smoothed by tanh: far from standstill it is a constant to all digits, and a Taylor series shows no more of it."""

import pytest

# the wheel swings 0.5 rad at 3 rad/s; its friction reverses within about 1 ms
SWING = """\
&body     name = 'wheel'  inertia = 1.0  angle = 0.5 /
&coupling name = 'spring' bodies = 'ground', 'wheel' stiffness = 9.0  friction = 0.3  friction_speed = {speed} /
&run      t_end = 4.0  rtol = {rtol}  atol = {rtol}  method = '{method}' /
&output   points = 9 /
"""


@pytest.mark.parametrize("speed", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_series_does_not_step_over_a_reversal(nocdyn, speed, rtol):
    rows = {}
    for method, tolerance in [("taylor", rtol), ("rodas5p", 1e-11)]:
        nocdyn.write("swing.nml", SWING.format(speed=speed, rtol=tolerance, method=method))
        assert nocdyn("run", "swing.nml", "--out", method, "--quiet").returncode == 0
        header, rows[method] = nocdyn.table(method)
    columns = [header.index(name) for name in ("phi_wheel [rad]", "omega_wheel [rad/s]")]
    for row, reference in zip(rows["taylor"], rows["rodas5p"], strict=True):
        for i in columns:
            assert row[i] == pytest.approx(reference[i], abs=100 * rtol), header[i]

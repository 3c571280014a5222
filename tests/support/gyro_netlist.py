"""The same circuit as an ngspice netlist: an independent solver's view of it.

Each mechanical axis is its series RLC analogue (force: voltage, velocity: current, displacement:
charge), in units of force that keep the currents and voltages near one. The capacitances,
the amplifier around C_FB and the RC are components; the solver, not khr_models, derives V_out.
"""

import math

from khr_models.gyro_circuit.circuit import KRG4, Circuit, Resonator

DRIVE_FORCE_UNIT = 1e-6  # N per V of the drive axis' analogue
SENSE_FORCE_UNIT = 1e-11  # N per V of the sense axis' analogue
VECTORS = ('rate', 'drive_velocity', 'sense', 'carrier', 'demodulated')
AMPLIFIER_GAIN = 1e7
BLEED = 1e15  # ohm over C_FB: a path for direct current, 4000 s
LOW_PASS_RESISTANCE = 1e5  # ohm


def netlist(
    rate: str, duration: float, output: str, circuit: Circuit = KRG4, *, steps_per_cycle: int = 100
) -> str:
    """Write a batch netlist; ngspice then writes time and VECTORS, column pairs, to a file.

    Args:
        rate: the rate in rad/s, an ngspice expression of ``time``.
        duration: s.
        output: path of the file that ngspice writes.
        circuit: the constants.
        steps_per_cycle: ngspice's largest time step is this part of a carrier's cycle.
    """
    step = 1.0 / (circuit.carrier_frequency * steps_per_cycle)
    return '\n'.join(
        [
            '* vibratory gyro',
            *_mechanics(rate, circuit),
            *_electronics(circuit),
            '.options method=trap reltol=1e-6 abstol=1e-15 vntol=1e-9 chgtol=1e-22',
            '.control',
            'set wr_singlescale',
            'set numdgt=12',
            f'tran {step!r} {duration!r} 0 {step!r} uic',
            f'wrdata {output} ' + ' '.join(f'v({name})' for name in VECTORS),
            'quit',
            '.endc',
            '.end',
            '',
        ]
    )


def _mechanics(rate: str, circuit: Circuit) -> list[str]:
    turn = f'{circuit.carrier!r}*time'
    force = circuit.drive_force / DRIVE_FORCE_UNIT
    coriolis = 2.0 * circuit.mass / SENSE_FORCE_UNIT
    return [
        f'Brate rate 0 V={rate}',
        f'Bdrive d1 0 V={force!r}*cos({turn})',
        *_axis('drive', 'd', circuit.drive, DRIVE_FORCE_UNIT),
        'Bvelocity drive_velocity 0 V=i(Vdrive)',
        f'Bcoriolis s1 0 V={coriolis!r}*v(drive_velocity)*v(rate)',
        *_axis('sense', 's', circuit.sense, SENSE_FORCE_UNIT),
        f'Bsense sense 0 V={SENSE_FORCE_UNIT / circuit.sense_stiffness!r}*v(s4)',
    ]


def _axis(name: str, node: str, axis: Resonator, unit: float) -> list[str]:
    return [
        f'L{name} {node}1 {node}2 {axis.mass / unit!r} ic=0',
        f'R{name} {node}2 {node}3 {axis.damping / unit!r}',
        f'V{name} {node}3 {node}4 0',
        f'C{name} {node}4 0 {unit / axis.stiffness!r} ic=0',
    ]


def _electronics(circuit: Circuit) -> list[str]:
    tilt = f'v(sense)/{circuit.finger_spacing!r}'
    phase = f'{circuit.carrier!r}*time+{circuit.reference_phase!r}'
    capacitor = circuit.time_constant / LOW_PASS_RESISTANCE
    return [
        f'Vplus plus 0 {-circuit.sense_bias!r}',  # the amplifier inverts
        f'Vminus minus 0 {circuit.sense_bias!r}',
        f"C1 plus sum q='{circuit.capacitance!r}*(1+{tilt})*v(plus,sum)'",
        f"C2 minus sum q='{circuit.capacitance!r}*(1-{tilt})*v(minus,sum)'",
        f'Cfeedback sum carrier {circuit.feedback_capacitance!r}',
        f'Rfeedback sum carrier {BLEED!r}',
        f'Eamplifier carrier 0 0 sum {AMPLIFIER_GAIN!r}',
        f'Bmultiplier product 0 V={2.0 * circuit.gain!r}*cos({phase})*v(carrier)',
        f'Rlow product demodulated {LOW_PASS_RESISTANCE!r}',
        f'Clow demodulated 0 {capacitor!r} ic=0',
    ]


def sine(amplitude: float, frequency: float) -> str:
    """Write a sinusoidal rate of ``amplitude`` (rad/s) and ``frequency`` (Hz)."""
    return f'{amplitude!r}*sin({math.tau * frequency!r}*time)'

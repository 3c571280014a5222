"""The gyro's circuit as an ngspice netlist: an independent solver's view of it.

Each mechanical axis is its series RLC analogue (force: voltage, velocity: current, displacement:
charge), in units of force that keep the currents and voltages near one. The capacitances,
the amplifier around C_FB and the RC are components; the solver, not khr_models, derives V_out.
"""

VECTORS = ('rate', 'drive_velocity', 'sense', 'carrier', 'demodulated')
DRIVE, SENSE = 1e-6, 1e-11  # N per V of the analogues of the axes
# The amplifier inverts, so the bias of the plates does too; the resistor over C_FB, 4000 s, is a
# path for direct current.
NETLIST = """* vibratory gyro
Brate rate 0 V={rate}
Bdrive d1 0 V={force!r}*cos({c.carrier!r}*time)
{drive}
Bvelocity drive_velocity 0 V=i(Vd)
Bcoriolis s1 0 V={coriolis!r}*v(drive_velocity)*v(rate)
{sense}
Bsense sense 0 V={shift!r}*v(s4)
Vplus plus 0 -{c.sense_bias!r}
Vminus minus 0 {c.sense_bias!r}
C1 plus sum q='{c.capacitance!r}*(1+v(sense)/{c.finger_spacing!r})*v(plus,sum)'
C2 minus sum q='{c.capacitance!r}*(1-v(sense)/{c.finger_spacing!r})*v(minus,sum)'
Cfeedback sum carrier {c.feedback_capacitance!r}
Rfeedback sum carrier 1e15
Eamplifier carrier 0 0 sum 1e7
Bmultiplier product 0 V={mixing!r}*cos({c.carrier!r}*time+{c.reference_phase!r})*v(carrier)
Rlow product demodulated 1e5
Clow demodulated 0 {low!r} ic=0
.options method=trap reltol=1e-6 abstol=1e-15 vntol=1e-9 chgtol=1e-22
.control
set wr_singlescale
set numdgt=12
tran {step!r} {duration!r} 0 {step!r} uic
wrdata {output} {vectors}
quit
.endc
.end
"""


def netlist(rate, duration, output, circuit, steps_per_cycle):
    """Return a batch netlist; ngspice then writes time and VECTORS, in columns, to a file.

    The rate in rad/s is an ngspice expression of ``time``; ngspice's largest time step is such a
    part of a carrier's cycle.
    """
    return NETLIST.format(
        rate=rate,
        force=circuit.drive_force / DRIVE,
        drive=_axis('d', circuit.drive, DRIVE),
        coriolis=2.0 * circuit.mass / SENSE,
        sense=_axis('s', circuit.sense, SENSE),
        shift=SENSE / circuit.sense_stiffness,
        mixing=2.0 * circuit.gain,
        low=circuit.time_constant / 1e5,
        step=1.0 / (circuit.carrier_frequency * steps_per_cycle),
        duration=duration,
        output=output,
        vectors=' '.join(f'v({name})' for name in VECTORS),
        c=circuit,
    )


def _axis(name, axis, unit):
    return (
        f'L{name} {name}1 {name}2 {axis.mass / unit!r} ic=0\n'
        f'R{name} {name}2 {name}3 {axis.damping / unit!r}\n'
        f'V{name} {name}3 {name}4 0\n'
        f'C{name} {name}4 0 {unit / axis.stiffness!r} ic=0'
    )

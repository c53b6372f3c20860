import marimo

__generated_with = "0.25.2"

app = marimo.App(app_title="A case from Python")


@app.cell(hide_code=True)
def _():
    import marimo as mo

    return (mo,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    One robot, two motions, its gains: what `rx90 run` does, step by step. Open it with `marimo edit examples/case.py`,
    change a number, and everything below follows.
    """)
    return


@app.cell
def _():
    import ident
    import scenarios

    exp = scenarios.load("nominal")
    exp.arm.joint_names
    return exp, ident


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Record

    The simulated robot moves once with a bare flange and once with its payload. Of each motion is left what a real
    controller logs, and nothing else: times, positions, currents.
    """)
    return


@app.cell
def _(exp):
    s = exp.simulate(seed=3)
    bare, loaded = (motion.recording for motion in s.logs)
    bare.t.shape, bare.q.shape, bare.v.shape
    return bare, loaded, s


@app.cell
def _(bare, exp, loaded):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4), layout="constrained")
    for joint, axes in enumerate(figure.subplots(2, 3, sharex=True).flat):
        axes.plot(bare.t[::10], bare.v[::10, joint], label="bare", linewidth=1)
        axes.plot(loaded.t[::10], loaded.v[::10, joint], label="loaded", linewidth=1)
        axes.set_title(exp.arm.joint_names[joint])
    figure.supxlabel("time [s]")
    figure.supylabel("current [drive units]")
    figure.axes[0].legend()
    figure
    return (figure,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Identify

    From here on only what a real cell has: two recordings, the arm's kinematics, the weighed payload. Logs of your own
    are `[ident.read("bare.csv"), ident.read("loaded.csv", payload="p.toml")]`. `r.gain` and `r.std` are
    masked where a joint is refused; `r.to_frame()` is this table, `r.plot()` a chart of it.
    """)
    return


@app.cell
def _(exp, ident, s):
    r = ident.identify(exp.arm, s.logs)
    r
    return (r,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Judge

    The simulator knows what it injected. Errors should be a few tenths of a percent, and two deviations should hold
    them.
    """)
    return


@app.cell
def _(r, s):
    right = 100.0 * (r.gain / s.truth.gain - 1.0)
    right.round(2).tolist()  # per cent
    return (right,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Spoil it

    The payload is specified 3 % heavier than it is. No log can reveal this: every gain is estimated 3 % too large,
    and no interval includes this error. Therefore `rx90 verify` estimates another known mass, not used for the gains.
    """)
    return


@app.cell
def _(bare, exp, ident, loaded, s):
    from dataclasses import replace

    payload = s.logs[1].payload
    inertia = tuple(1.03 * each for each in payload.inertia)
    heavier = replace(payload, mass=1.03 * payload.mass, inertia=inertia)
    logs = [ident.Motion(bare), ident.Motion(loaded, heavier)]
    spoilt = 100.0 * (ident.identify(exp.arm, logs).gain / s.truth.gain - 1.0)
    spoilt.round(2).tolist()
    return (spoilt,)


@app.cell
def _(right, spoilt):
    shift = (spoilt - right).mean()
    round(float(shift), 2)  # all gains together, in per cent
    return (shift,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Repeat

    One run is one draw. `monte_carlo` repeats the scenario with seeds that count up, `sweep` with every combination of
    some of its values; rows come as a table of pandas. More trials: `workers=scenarios.local_processes(4)`.
    """)
    return


@app.cell
def _(exp):
    rows = exp.sweep({"observe.cutoff_hz": [8, 15, 30]}, seeds=2).to_frame()
    rows.groupby(["identification.observe.cutoff_hz", "joint"])["rel_error"].std().unstack()
    return (rows,)


if __name__ == "__main__":
    app.run()

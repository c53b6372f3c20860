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

    A scenario is a value. `bench` turns it into what simulator and identification work with.
    """)
    return


@app.cell
def _():
    from scenarios import load_scenario
    from scenarios.experiments.build import bench

    cell = bench(load_scenario("nominal"))
    cell.protocol
    return (cell,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Record

    The simulated robot moves once with a bare flange and once with its payload. Of each motion is left what a real
    controller logs, and nothing else: times, positions, currents.
    """)
    return


@app.cell
def _(cell):
    import numpy as np

    from sim.record import record
    from sim.sensors import noise_streams

    streams = [noise_streams(np.random.default_rng(seed)) for seed in (1, 2)]
    bare, loaded = record(cell.experiments, streams, threads=1)
    bare.t.shape, bare.q.shape, bare.v.shape
    return bare, loaded, np


@app.cell
def _(bare, cell, loaded):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4), layout="constrained")
    for joint, axes in enumerate(figure.subplots(2, 3, sharex=True).flat):
        axes.plot(bare.t[::10], bare.v[::10, joint], label="bare", linewidth=1)
        axes.plot(loaded.t[::10], loaded.v[::10, joint], label="loaded", linewidth=1)
        axes.set_title(cell.structure.arm.joint_names[joint])
    figure.supxlabel("time [s]")
    figure.supylabel("current [drive units]")
    figure.axes[0].legend()
    figure
    return (figure,)


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Identify

    From here on only what a real cell has: two recordings, the arm's kinematics, the weighed payload. A joint comes
    back as an `IdentifiedGain` with its interval, or as a `RefusedGain` with the reason.
    """)
    return


@app.cell
def _(bare, cell, loaded):
    from ident import IdentifiedGain, identify

    found = identify(bare, loaded, cell.structure, cell.payloads["loaded"])
    for each in found.estimate.joints:
        if isinstance(each, IdentifiedGain):
            print(f"{each.value:.4f} N m/unit, 2 sigma {200.0 * each.std / abs(each.value):.2f} %")
        else:
            print(f"refused: {each.reason}")
    return IdentifiedGain, found, identify


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Judge

    The simulator knows what it injected. Errors should be a few tenths of a percent, and two deviations should hold
    them.
    """)
    return


@app.cell
def _(IdentifiedGain, cell, found, np):
    def errors(estimate):
        """Relative error of each gain [%], NaN where it is refused."""
        values = [each.value if isinstance(each, IdentifiedGain) else np.nan for each in estimate.joints]
        return 100.0 * (np.array(values) / cell.true_gain - 1.0)

    right = errors(found.estimate)
    right.round(2)
    return errors, right


@app.cell(hide_code=True)
def _(mo):
    mo.md("""
    ## Spoil it

    The payload is believed 3 % heavier than it is. Nothing in the logs can tell: every gain comes out 3 % too large,
    and its interval does not know. That is why `rx90 verify` weighs another mass that identification has not seen.
    """)
    return


@app.cell
def _(bare, cell, errors, identify, loaded):
    from dataclasses import replace

    payload = cell.payloads["loaded"]
    inertia = tuple(1.03 * each for each in payload.inertia)
    heavier = replace(payload, mass=1.03 * payload.mass, inertia=inertia)
    spoilt = errors(identify(bare, loaded, cell.structure, heavier).estimate)
    spoilt.round(2)
    return (spoilt,)


@app.cell
def _(np, right, spoilt):
    shift = np.nanmean(spoilt - right)
    print(f"all gains together moved by {shift:+.2f} %")
    return (shift,)


if __name__ == "__main__":
    app.run()

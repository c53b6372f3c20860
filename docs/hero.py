"""Draws the pictures of the README: hero.png, an arm, its currents and its gains; page.png, the page of a run.

Needs an off-screen OpenGL, MUJOCO_GL=egl or osmesa, and for the page a Chromium.
"""

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import scenarios
from scenarios.cli import main
from sim.viewer import pictures, scene

JOINT = 2
"""The joint whose currents are drawn: it lifts the payload."""
BARE, LOADED, FOUND = "#6b7280", "#e8590c", "#1f6fb2"
T = 10.0
"""Time of the picture, and of currents that are drawn [s]: half of the motion."""
HERE = Path(__file__).parent


def page(folder: Path) -> None:
    """The top of the page of a run, as a browser shows it."""
    from playwright.sync_api import sync_playwright

    assert main(["run", "nominal", "--quiet", "--save", str(folder)]) == main(["report", str(folder), "--quiet"]) == 0
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        view = browser.new_page(viewport={"width": 1280, "height": 1004})
        view.goto((folder / "report.html").as_uri())
        view.screenshot(path=HERE / "page.png")
        browser.close()


def hero() -> None:
    nominal = scenarios.load("nominal")
    run = nominal.run()
    plt.rcParams.update({"font.size": 12.5, "axes.spines.top": False, "axes.spines.right": False})
    figure, (arms, currents, gains) = plt.subplots(1, 3, figsize=(13.6, 4.2), layout="constrained")

    (picture,) = pictures(scene(nominal.setup.experiments, [T]), [T], width=900, height=800)
    arms.imshow(picture)
    arms.set(title="One motion, bare and loaded", xticks=[], yticks=[])
    arms.spines[:].set_visible(False)

    for log, colour, label in zip(run.recordings, (BARE, LOADED), ("bare", "with 7.025 kg"), strict=True):
        shown = log.t < T
        currents.plot(log.t[shown], log.v[shown, JOINT - 1], color=colour, linewidth=1.2, label=label)
    currents.set(
        title=f"Its currents, here of joint {JOINT}", xlabel="time [s]", ylabel="current [units]", ylim=(None, 330)
    )
    currents.legend(frameon=False, loc="upper center", ncols=2)

    for k, each in enumerate(run.verdict.gains):
        gains.plot(each.joint + np.array([-0.3, 0.3]), [each.true] * 2, color=BARE, label=None if k else "injected")
        if each.estimate is None or each.std is None:
            gains.annotate("refused: hardly any torque\nfrom this payload", (6.4, 1.03), ha="right")
            continue
        bar = gains.errorbar(each.joint, each.estimate, 2.0 * each.std, fmt="o", color=FOUND, markersize=5, capsize=6)
        bar.set_label(None if k else "identified, ± 2 sigma")
    gains.set(title="Torque per unit of current", xlabel="joint", ylabel="gain [N m/unit]", ylim=(0.89, 1.19))
    gains.legend(frameon=False, loc="upper center", ncols=2)
    figure.savefig(HERE / "hero.png", dpi=110)


if __name__ == "__main__":
    hero()
    with TemporaryDirectory() as place:
        page(Path(place) / "cell")

import re
from pathlib import Path

import pytest
from protocols import FOUR, scenario_of

from ident.support.errors import IdentificationError
from scenarios.experiments.draws import check_draws
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.support.errors import ScenarioError
from sim.errors import PlantError

REFUSED = (ScenarioError, PlantError, IdentificationError)


def prepare(path: Path) -> None:
    scenario = load_scenario(str(path))
    setup_of(scenario)
    check_draws(scenario)


def refusal(path: Path) -> str:
    with pytest.raises(REFUSED) as caught:
        prepare(path)
    assert "\n" not in str(caught.value), path.read_bytes()[:200]
    return str(caught.value)


def assert_refused(path: Path, content: str, message: str) -> None:
    path.write_text(content)
    said = refusal(path)
    assert re.search(message, said), f"{content[:300]!r}: {said}"


# Below `extends = "nominal"` unless they extend something else themselves.
SCENARIOS = {
    "[plant]\ngian = [1]": "unknown key plant.gian; did you mean 'gain'?",
    'extends = "nominl"': "unknown scenario 'nominl'; did you mean 'nominal'?",
    'extends = "mine.toml"': "extends itself through mine.toml -> mine.toml",
    "extends = 3": "expected the name of one scenario",
    'description = "x"': "plant is missing",
    "[plant]\ngain = [1, 2]": "plant.gain: 2 values, but tolerance.gain has 6",
    '[experiment]\nmotion = "drive-gain"': "unknown motion .* did you mean 'drive-gains'?",
    '[belief]\npayload = "7 kg"': "unknown payload '7 kg'; did you mean '7.025 kg'?",
    "[belief]\ncontroller_gain = [1, 1, 1, 1, 1, 0]": "a gain of zero commands nothing",
    "[belief]\ncouplings = [[5, 7]]": "belief.couplings: joints 5 and 7; .* from 1 to 6",
    "[experiment.controller]\nrate_hz = 0.0": "rate_hz: input .* equal to 1, got 0",
    "[plant.payload]\nmass = 0\ncom = [0, 0, 0]": "payload.(mass: .*greater|inertia is missing)",
    "[plant.errors]\njoint_compliance = [1e-5]": "joint_compliance: 1 values .* expected 6",
}

DRAWS = {
    '[random.it]\ntarget = "plant.gian"\ndistribution = "norm"': "random.it: no 'gian' in plant; did you mean 'gain'?",
    '[random.it]\ntarget = "plant.payload"\ndistribution = "norm"': "random.it: plant.payload holds a table",
    '[random.it]\ntarget = "plant.gain"\ndistribution = "nrom"': "no continuous distribution 'nrom' in scipy.stats;",
    '[random.it]\ntarget = "plant.gain"\ndistribution = "norm"\nparameters = { scael = 1 }': "did you mean 'scale'?",
    '[random.it]\ntarget = "plant.gain"\ndistribution = "norm"\nparameters = { scale = -1 }': "gives no finite numbers",
    '[random.it]\ntarget = "plant.gain"\ndistribution = "norm"\nparameters = { loc = [1, 2] }': "or arrays of 6",
    '[random.it]\ntarget = "plant.gain"\ndistribution = "levy_stable"\nparameters = { alpha = 1.7, beta = 0.2 }': (
        "levy_stable has no quantile function of its own; choose one that has"
    ),
    '[random.it]\ntarget = "plant.gain"\ndistribution = "lognorm"': "lognorm needs the parameter s",
    '[random.it]\ntarget = "plant.gain"': "give either a distribution, or a choice, or for a source its stream",
    '[random.it]\ntarget = "experiment.motion"\ndistribution = "norm"': "a name, 'drive-gains'; draw it with choice",
    '[random.it]\ntarget = "experiment.motion"\nchoice = []': "choice is empty",
    '[sources.it]\ntarget = "plant.gain"\nstream = "white"\ndistribution = "norm"': "sources.it: give either",
    '[sources.it]\ntarget = "plant.gain"\ndistribution = "norm"\nsize = 1.0': "sources.it: size applies to noise only",
    '[sources.it]\ntarget = "plant.gain"\nstream = "whit"': "sources.it.stream: input should be 'encoder', 'white', ",
    '[sources.it]\ntarget = "plant.gain"\nstream = "white"': (
        "the stream white is already used by sources.white current noise"
    ),
    '[random.it]\ntarget = []\ndistribution = "norm"': "random.it: target is empty; name the value to draw",
    '[random.it]\ntarget = "tolerance.pass_rate"\ndistribution = "norm"': "'tolerance.pass_rate' cannot be drawn",
    '[random.a]\ntarget = "plant.gain"\ndistribution = "norm"\n[random.b]\ntarget = "plant.gain"\n'
    'distribution = "norm"': "random.b: plant.gain is already used by random.a; draw each value once",
    '[random.it]\ntarget = "identification.method"\nchoice = ["ls-2011", "foo"]': "unknown 'foo'",
}

COSTS = {
    '[cost]\npayload = "4.3 kg"\n': "unknown payload '4.3 kg'; did you mean '4.275 kg'",
    '[cost]\npayload = "4.275 kg"\nmas_error = 0.1\n': "unknown key cost.mas_error; did you mean 'mass_error'",
    '[experiment]\nprotocol = ["loaded"]\n[cost]\npayload = "4.275 kg"\n': (
        "cost: needs a bare and a loaded motion in experiment.protocol, got loaded"
    ),
}

PROTOCOLS = {
    'experiment.protocol = ["bare", "haevy"]': r"no payload 'haevy'; did you mean 'heavy'\?; known: bare, loaded",
    "experiment.protocol = []": r"experiment\.protocol: 0 motions; expected 1 to 64",
    'plant.payloads."7 kg" = "7.025 kg"': r"plant\.payloads: '7 kg' is no name for a payload",
    'plant.payloads.bare = "7.025 kg"': r"'bare' is no name for a payload; expected small .*not bare or unloaded",
    'plant.payloads.loaded = "7.025 kg"': r"plant: payload and payloads\.loaded denote the same payload",
    'plant.payloads.haevy = "7.025 kg"': r"plant: belief has no payload 'haevy'; did you mean 'heavy'\?",
    'belief.payloads.lihgt = "7.025 kg"': r"belief: plant has no payload 'lihgt'; did you mean 'light'\?",
    "belief.payloads.heavy.mas = 3.0": r"belief\.payloads\.heavy: payload: unknown key 'mas'; did you mean 'mass'\?",
    'belief.known = "com"': r"belief\.known: .*'all' or 'mass', got 'com'",
}

MOTION = (
    "duration = 8.0\ncenter = [0.1, 0.2]\nsine = [[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]]\n"
    "cosine = [[0.05, -0.08, 0.03], [0.1, -0.16, 0.06]]\n"
)
MOTIONS = {
    "no duration": (MOTION.replace("duration", "# duration"), "duration is missing"),
    "just too long": (MOTION.replace("8.0", "600.001"), "less than or equal to 600, got 600.001"),
    "nan": (MOTION.replace("-0.08", "nan"), "cosine.1.2: input should be a finite number, got nan"),
    "ragged": (MOTION.replace("-0.1, 0.0]", "-0.1]"), r"rows of \[3, 2, 3, 3\] in sine and cosine, do not fit"),
    "a start": (MOTION.replace("-0.08", "-0.09"), "the motion does not start at rest"),
    "not two": (MOTION, "moves 2 joints of 6"),
}


def test_a_faulty_scenario_is_refused_in_one_line(tmp_path):
    path = tmp_path / "mine.toml"
    for text, message in SCENARIOS.items():
        own = text.startswith(("extends", "description = "))
        assert_refused(path, text if own else f'extends = "nominal"\n{text}', message)
    for text, message in (DRAWS | COSTS).items():
        assert_refused(path, f'extends = "nominal"\n{text}\n', re.escape(message))
    assert_refused(path, "", "the file is empty")


def test_a_faulty_protocol_is_refused_in_one_line(tmp_path):
    scenario_of(tmp_path, FOUR)
    for text, message in PROTOCOLS.items():
        assert_refused(tmp_path / "faulty.toml", f'extends = "mine.toml"\n{text}\n', message)
    (tmp_path / "none.toml").write_text(
        'description = "x"\nplant = {}\nbelief.controller_gain = [1]\nexperiment.step = 0.001\n'
        'experiment.motion = "drive-gains"\ntolerance = { gain = [0.1], identifiable = [true] }\n'
    )
    assert "plant: no payload; state payload, or payloads by name" in refusal(tmp_path / "none.toml")


def test_a_faulty_motion_is_refused_in_one_line(tmp_path):
    for number, (text, message) in enumerate(MOTIONS.values()):  # a motion is read once a process
        (tmp_path / f"motion-{number}.toml").write_text(text)
        assert_refused(
            tmp_path / "mine.toml", f"extends = 'nominal'\n[experiment]\nmotion = 'motion-{number}.toml'\n", message
        )

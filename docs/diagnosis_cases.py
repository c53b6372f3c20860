"""Sound logs of which a diagnosis must say nothing: simulated twice over, and real ones; kept once made.

`--build` makes all that are not there yet, and counts them.
"""

import argparse
import hashlib
import json
import os
import pickle
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import diagnosis_scenarios
import diagnosis_simulator
import numpy as np
from diagnosis_arms import ARMS
from threadpoolctl import threadpool_limits

from ident.model.arm import load_arm
from ident.model.structure import Structure, structure_of
from ident.payload.files import read_payload
from ident.payload.payload import Payload
from ident.recordings.files import read_recording
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array

KEPT = Path(__file__).parent.parent / "out" / "diagnosis" / "cases"
SET, APART = "set", "apart"
AS_IT_IS = "as it is"
MUJOCO, PINOCCHIO, REAL = "mujoco", "pinocchio", "real"
SEEDS: dict[str, int] = {
    AS_IT_IS: 4,
    "mild": 3,
    "targets": 2,
    "two motions": 2,
    "all together": 2,
    "field": 6,
    "fleet": 5,
}
SEEDS |= dict.fromkeys(("paper-noise", "coarse-encoder", "drift", "mass-only", "offset-payload"), 4)
"""Of a condition; one of any other."""
FIRST_SEED = 300


@dataclass(frozen=True, slots=True)
class Spec:
    """A sound case by name, nothing simulated yet.

    Attributes:
        arm: Name of the arm.
        condition: Of the motion and the robot.
        seed: Of every random number; of real logs their number.
        source: Which simulator it comes from, or `real`.
        group: Whether constants may be set on it, or it is kept apart for judgement.
    """

    arm: str
    condition: str
    seed: int
    source: str
    group: str

    @property
    def name(self) -> str:
        """Unique."""
        return f"{self.source} {self.arm}, {self.condition}, {self.seed}"


@dataclass(frozen=True, slots=True, eq=False)
class SoundCase:
    """Logs without a fault.

    Attributes:
        spec: Where they come from.
        structure: Of the arm as the model has it.
        motions: The logs in order of time.
        gain: True gains [N m / drive unit], shape (n,); None for a real robot.
    """

    spec: Spec
    structure: Structure
    motions: tuple[Motion, ...]
    gain: Array | None

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def arm(self) -> str:
        return self.spec.arm

    @property
    def condition(self) -> str:
        return self.spec.condition

    @property
    def group(self) -> str:
        return self.spec.group

    @property
    def biased(self) -> bool:
        """Whether its present gains have significant errors."""
        return self.spec.source == MUJOCO and self.spec.condition in diagnosis_scenarios.BIASED

    @property
    def real(self) -> bool:
        return self.spec.source == REAL


def simulated_specs() -> list[Spec]:
    """All that can be simulated."""
    pairs = [
        (robot, each) for robot in diagnosis_scenarios.ROBOTS for each in (AS_IT_IS, *diagnosis_scenarios.CONDITIONS)
    ]
    pairs += [("rx90", each) for each in diagnosis_scenarios.RX90_ONLY]
    found = [
        Spec(arm, condition, FIRST_SEED + k, MUJOCO, APART if arm in diagnosis_scenarios.APART else SET)
        for arm, condition in pairs
        for k in range(SEEDS.get(condition, 1))
    ]
    return found + [
        Spec(arm, condition, FIRST_SEED + k, PINOCCHIO, APART if diagnosis_simulator.built(arm).apart else SET)
        for arm in ARMS
        for condition in diagnosis_simulator.CONDITIONS
        for k in range(SEEDS.get(condition, 1))
    ]


def sound_cases(wanted: Callable[[Spec], bool] = lambda spec: True) -> Iterator[SoundCase]:
    """Sound cases that are wanted, each read or simulated when its turn comes; those of real robots last."""
    for spec in filter(wanted, simulated_specs()):
        case = loaded(spec)
        if case is not None:
            yield case
    yield from real_cases(wanted)


def loaded(spec: Spec) -> SoundCase | None:
    """A simulated case, None where the robot cannot carry it out."""
    path = _path(spec)
    if not path.is_file():
        _simulate(spec)
    with np.load(path) as kept:
        if "words" not in kept:
            return None
        words = json.loads(str(kept["words"]))
        mounted = [Payload(**_tuples(each)) for each in words["payloads"]]
        motions = tuple(
            Motion(
                Recording(kept[f"t{k}"], kept[f"q{k}"].astype(float), kept[f"v{k}"].astype(float), name),
                None if payload is None else mounted[payload],
            )
            for k, (name, payload) in enumerate(words["logs"])
        )
        return SoundCase(spec, _structure(spec.source, spec.arm), motions, kept["gain"])


def _simulate(spec: Spec) -> None:
    """Simulate a case and keep it, with all seeds of its arm and condition where these share a batch."""
    if spec.source == PINOCCHIO:
        motions = diagnosis_simulator.simulated(spec.arm, spec.condition, spec.seed)
        _keep(spec, motions, diagnosis_simulator.drives(spec.arm).gain)
        return
    family = [
        each
        for each in simulated_specs()
        if (each.source, each.arm, each.condition) == (MUJOCO, spec.arm, spec.condition)
    ]
    with threadpool_limits(1):
        found = diagnosis_scenarios.simulated(spec.arm, spec.condition, [each.seed for each in family])
    made = {each.seed: each for each in found}
    for each in family:
        if each.seed not in made:
            _path(each).parent.mkdir(parents=True, exist_ok=True)
            np.savez(_path(each))
            continue
        _keep(each, made[each.seed].motions, made[each.seed].gain)
        place = KEPT / f"{spec.arm}.structure"
        if not place.is_file():
            place.write_bytes(pickle.dumps(made[each.seed].structure))


def _keep(spec: Spec, motions: tuple[Motion, ...], gain: Array) -> None:
    """Positions and currents in single precision, finer than an encoder's step."""
    payloads = list({id(each.payload): each.payload for each in motions if each.payload is not None}.values())
    index = {id(each): k for k, each in enumerate(payloads)}
    words = {
        "payloads": [asdict(each) for each in payloads],
        "logs": [(each.recording.name, None if each.payload is None else index[id(each.payload)]) for each in motions],
    }
    arrays: dict[str, np.ndarray] = {"gain": np.asarray(gain), "words": np.array(json.dumps(words))}
    for k, each in enumerate(motions):
        log = each.recording
        arrays |= {f"t{k}": log.t, f"q{k}": log.q.astype(np.float32), f"v{k}": log.v.astype(np.float32)}
    _path(spec).parent.mkdir(parents=True, exist_ok=True)
    np.savez(_path(spec), **arrays)  # pyright: ignore[reportArgumentType]


def _path(spec: Spec) -> Path:
    """Named by what it is made of, so that a changed condition is another file."""
    if spec.source == PINOCCHIO:
        made_of = f"{diagnosis_simulator.VERSION} {diagnosis_simulator.CONDITIONS[spec.condition]}"
    else:
        words = diagnosis_scenarios.overlay(spec.arm, spec.condition)
        made_of = "\n".join((str(diagnosis_scenarios.VERSION), *words))
    digest = hashlib.sha256(made_of.encode()).hexdigest()[:8]
    words = "-".join((spec.source, spec.arm, spec.condition, str(spec.seed))).replace(" ", "_").replace("%", "percent")
    return KEPT / f"{words}-{digest}.npz"


@lru_cache(maxsize=64)
def _structure(source: str, arm: str) -> Structure:
    if source == PINOCCHIO:
        return diagnosis_simulator.structure(arm)
    return pickle.loads((KEPT / f"{arm}.structure").read_bytes())  # written by this script


def _tuples(table: dict[str, object]) -> dict[str, object]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}


def real_cases(wanted: Callable[[Spec], bool] = lambda spec: True) -> Iterator[SoundCase]:
    """Pairs of a UR10e, bare and loaded motions of two months crossed, and one motion of a TX-40."""
    if "REAL_RECORDINGS" not in os.environ:
        return
    folder = Path(os.environ["REAL_RECORDINGS"])
    months = ("ur10e", "ur10e_december")
    pairs = [(bare, loaded) for bare in months for loaded in months]
    specs = [Spec("real-ur10e", f"bare {a}, loaded {b}", k, REAL, APART) for k, (a, b) in enumerate(pairs)]
    if any(map(wanted, specs)):
        ur = structure_of(load_arm(folder / "ur10e" / "ur10e.urdf"))
        for spec, (bare, loaded) in zip(specs, pairs, strict=True):
            if wanted(spec):
                payload = read_payload(folder / loaded / "payload.toml")
                logs = [_named(folder / a, b) for a, b in ((bare, "unloaded"), (loaded, "loaded"))]
                yield SoundCase(spec, ur, (Motion(logs[0]), Motion(logs[1], payload)), None)
    spec = Spec("real-tx40", "bare", 0, REAL, APART)
    if wanted(spec):
        tx40 = structure_of(load_arm(folder / "tx40" / "tx40.urdf", couplings=((4, 5),)))
        yield SoundCase(spec, tx40, (Motion(_named(folder / "tx40", "recording")),), None)


def _named(folder: Path, name: str) -> Recording:
    """A recording that no diagnosis calls by the place of its file."""
    log = read_recording(folder / f"{name}.parquet")
    return Recording(log.t, log.q, log.v, name)


def build() -> None:
    """Make every case, and print how many there are."""
    seconds: defaultdict[tuple[str, str], float] = defaultdict(float)
    cases: Counter[tuple[str, str, str]] = Counter()
    conditions: Counter[tuple[str, str]] = Counter()
    missing: list[str] = []
    for spec in simulated_specs():
        started = time.perf_counter()
        case = loaded(spec)
        seconds[spec.source, spec.arm] += time.perf_counter() - started
        if case is None:
            missing.append(spec.name)
            continue
        cases[spec.source, spec.arm, spec.group] += 1
        conditions[spec.source, spec.condition] += 1
    for case in real_cases():
        cases[REAL, case.arm, case.group] += 1
    for (source, arm, group), count in cases.items():
        print(f"{source:10} {arm:16} {group:6} {count:4d} cases {seconds[source, arm]:7.1f} s")
    for (source, condition), count in conditions.items():
        print(f"{source:10} {condition:30} {count:4d} cases")
    print(f"{len({arm for _, arm, _ in cases})} arms, {sum(cases.values())} cases, {sum(seconds.values()):.0f} s")
    for name in missing:
        print(f"not simulated: {name}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", action="store_true", help="simulate what is not there yet, and count")
    if parser.parse_args().build:
        build()

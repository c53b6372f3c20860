"""What a user's files can be besides right: each ends with one line on stderr that names it, and status 2."""

import gzip
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from model_files import mjcf, urdf
from places import ROOT

from ident.recording import Recording
from ident.recording_files import write_recording
from scenarios.cli import main
from scenarios.errors import ScenarioError
from scenarios.files.loading import load_scenario

ELBOW = "0 -0.131 0.613"
JOINT = '<joint name="elbow_joint" axis="0 1 0" range="-170 175"/>'
HINGE = '<joint name="elbow_joint" type="revolute">'
BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> Path:
    """A folder with a model, two recordings and a payload that can be read."""
    folder = tmp_path_factory.mktemp("good")
    (folder / "arm.xml").write_text(mjcf())
    t = 0.004 * np.arange(500)
    for name, phase in (("a", 0.3), ("b", 0.7)):
        q = 0.8 * np.sin(2.0 * t[:, None] + np.arange(6) + phase)
        write_recording(Recording(t, q, 3.0 * np.cos(q) + 0.1 * q, name), folder / f"{name}.csv")
    (folder / "payload.toml").write_text("mass = 2.805\nknown = 'mass'\n")
    return folder


@pytest.fixture
def identify(good, capsys) -> Callable[..., str]:
    """Runs `rx90 identify` with some files replaced; gives its one line."""

    def run(**files: Path) -> str:
        paths = {
            "model": good / "arm.xml",
            "unloaded": good / "a.csv",
            "loaded": good / "b.csv",
            "payload": good / "payload.toml",
        } | files
        status = main(["identify", *(word for kind, path in paths.items() for word in (f"--{kind}", str(path)))])
        out, err = capsys.readouterr()
        assert status == 2
        assert out == ""
        assert err.count("\n") == 1
        assert "Traceback" not in err
        return err

    return run


MJCF_FAULTS = {
    "letter O": (mjcf(swap=(ELBOW, "0 -0.131 O.613")), r"line 6: body 'elbow_link': pos = .*'O.613' is not a number"),
    "nan": (mjcf(swap=(ELBOW, "0 nan 0.613")), r"'nan' is not a number"),
    "infinite": (mjcf(swap=(ELBOW, "0 inf 0.613")), r"'inf' is not a number"),
    "underscore": (mjcf(swap=(ELBOW, "0 -0.131 0.6_13")), r"'0.6_13' is not a number"),
    "huge": (mjcf(swap=(ELBOW, "0 -0.131 1e300")), r"pos = .*: beyond 50;"),
    "overflow": (mjcf(swap=(ELBOW, "0 -0.131 1e999")), r"pos = .*: beyond 50;"),
    "millimetres": (mjcf(swap=(ELBOW, "0 -131 613")), r"pos = .*: beyond 50; .* check the number and its unit"),
    "commas": (mjcf(swap=(ELBOW, "0,-0.131,0.613")), r"is not a number; numbers are separated by spaces"),
    "two numbers": (mjcf(swap=(ELBOW, "-0.131 0.613")), r"2 numbers, expected 3"),
    "four numbers": (mjcf(swap=(ELBOW, "0 0 -0.131 0.613")), r"4 numbers, expected 3"),
    "no numbers": (mjcf(swap=(ELBOW, "")), r"0 numbers, expected 3"),
    "zero axis": (mjcf(swap=(JOINT, '<joint name="elbow_joint" axis="0 0 0"/>')), r"axis = '0 0 0' has no direction"),
    "zero quat": (mjcf(swap=('euler="0 90 0"', 'quat="0 0 0 0"')), r"quat = '0 0 0 0' has no direction"),
    "zero zaxis": (mjcf(swap=('euler="0 90 0"', 'zaxis="0 0 0"')), r"zaxis = '0 0 0' has no direction"),
    "zero axisangle": (mjcf(swap=('euler="0 90 0"', 'axisangle="0 0 0 90"')), r"axisangle has no direction"),
    "parallel axes": (
        mjcf(swap=('euler="0 90 0"', 'xyaxes="1 2 3 2 4 6"')),
        r"the axes of xyaxes are parallel or zero",
    ),
    "two turns": (mjcf(swap=('euler="0 90 0"', 'euler="0 90 0" quat="1 0 0 0"')), r"quat and euler both turn it"),
    "angle": (mjcf(swap=('euler="0 90 0"', 'euler="0 9O 0"')), r"'9O' is not a number"),
    "range": (mjcf(swap=("-170 175", "-170")), r"range = '-170': 1 numbers, expected 2"),
    "ref": (mjcf(swap=(JOINT, JOINT.replace("/>", ' ref="x"/>'))), r"ref = 'x': 'x' is not a number"),
    "default axis": (
        mjcf(head='<default><joint axis="0 O 1"/></default>'),
        r"joint: axis = '0 O 1': 'O' is not a number",
    ),
    "gravity": (mjcf(head='<option gravity="0 0 -9,81"/>'), r"gravity = '0 0 -9,81': '-9,81' is not a number"),
    "strong gravity": (mjcf(head='<option gravity="0 0 -9810"/>'), r"gravity = '0 0 -9810': beyond 100"),
    "zero gravity": (mjcf(head='<option gravity="0 -0 0.0"/>'), r"line 2: option: gravity is 0; a payload without"),
    "no gravity": (mjcf(head='<option><flag gravity="disable"/></option>'), r"gravity is disabled"),
    "unknown class": (mjcf(swap=(JOINT, JOINT.replace("/>", ' class="arm"/>'))), r"unknown default class 'arm'"),
    "unknown childclass": (mjcf(base='childclass="arm"'), r"line 3: body 'base': unknown default class 'arm'"),
    "renamed class": (mjcf(head='<default class="ur"/>'), r"line 2: default: the outermost default class is main"),
    "eulerseq": (mjcf(head='<compiler eulerseq="xyw"/>'), r"compiler eulerseq = 'xyw'; expected three of x, y, z"),
    "mixed eulerseq": (
        mjcf(head='<compiler eulerseq="xYz"/>'),
        r"compiler eulerseq = 'xYz'; expected three of x, y, z",
    ),
    "angle unit": (mjcf(head='<compiler angle="degrees"/>'), r"compiler angle = 'degrees'; did you mean 'degree'\?"),
    "nameless class": (mjcf(head="<default><default/></default>"), r"a default class inside another needs a name"),
    "joint twice": (mjcf(swap=("elbow_joint", "wrist_1_joint")), r"joint 'wrist_1_joint' is there twice; .*line 6"),
    "body twice": (mjcf(swap=("wrist_1_link", "elbow_link")), r"line 7: body 'elbow_link' is there twice; .*line 6"),
    "free base": (mjcf(swap=("<inertial", "<freejoint/><inertial")), r"freejoint: a free joint is not supported"),
    "ball": (mjcf(swap=(JOINT, '<joint name="elbow_joint" type="ball"/>')), r"'elbow_joint': a ball joint is not"),
    "hing": (mjcf(swap=(JOINT, '<joint type="hing"/>')), r"type 'hing' is unknown; did you mean 'hinge'\?"),
    "two joints": (mjcf(swap=(JOINT, f'{JOINT}<joint name="x"/>')), r"joint 'x': a second joint in one body"),
    "gripper": (mjcf(swap=("</body>", "</body><body><joint/></body><body><joint/></body>")), r"branches off"),
    "two arms": (mjcf(world='<body name="l"><joint name="j"/></body>'), r"branches off; only serial arms"),
    "axs": (mjcf(swap=("axis=", "axs=")), r"unknown attribute 'axs'; did you mean 'axis'\?"),
    "eular": (mjcf(swap=("euler=", "eular=")), r"unknown attribute 'eular'; did you mean 'euler'\?"),
    "boddy": (mjcf(world="<boddy/>"), r"line 3: boddy: unknown element; did you mean 'body'\?"),
    "frame": (mjcf(world='<frame pos="1 0 0"><body/></frame>'), r"frame is not supported; let MuJoCo write the model"),
    "replicate": (mjcf(world='<replicate count="2"><body/></replicate>'), r"replicate is not supported"),
    "composite": (mjcf(world='<composite type="cable"/>'), r"composite is not supported"),
    "loop": (mjcf(tail='<equality><connect body1="base"/></equality>'), r"an equality of kind connect ties joints"),
    "mimic": (
        mjcf(tail='<equality><joint joint1="elbow_joint"/></equality>'),
        r"an equality of kind joint ties joints",
    ),
    "coordinate": (mjcf(head='<compiler coordinate="global"/>'), r"coordinate = 'global' is not supported"),
    "no joint": (mjcf(links=()), r"it has no moving joint"),
    "many joints": (mjcf(links=[(f"l{k}", "0 0 0.1", "0 0 0", "0 1 0") for k in range(25)]), r"25 joints; arms of up"),
    "nested": (mjcf(links=[(f"l{k}", "0 0 0.1", "0 0 0", "0 1 0") for k in range(20_000)]), r"nested deeper than 200"),
    "include missing": (mjcf(head='<include file="no.xml"/>'), r"line 2: include: .*no\.xml: no such file"),
    "include nothing": (mjcf(head="<include/>"), r"line 2: include names no file"),
    "include itself": (mjcf(head='<include file="arm.xml"/>'), r"line 2: include file = 'arm.xml' is there already"),
    "unknown to MuJoCo": (mjcf(swap=(JOINT, JOINT.replace("/>", ' colour="1"/>'))), r"MuJoCo cannot read it: .*colour"),
    "entities": (BOMB + mjcf(), r"line 1: it declares a document type; entities are not read"),
    "no XML": ("MuJoCo", r"line 1, column 1: not XML: syntax error"),
    "cut off": (mjcf()[:400], r"line 5, column \d+: not XML: "),
    "URDF": (urdf(), r"line 1: robot is no <mujoco>; URDF files end in .urdf"),
    "blank": (" \n ", r"not XML: no element found"),
}


@pytest.mark.parametrize("name", MJCF_FAULTS)
def test_a_faulty_mjcf_is_one_line(identify, tmp_path, name):
    text, message = MJCF_FAULTS[name]
    path = tmp_path / "arm.xml"
    path.write_text(text)
    _names(identify(model=path), path, message)


URDF_FAULTS = {
    "letter O": (urdf(swap=(ELBOW, "0 -0.131 O.613")), r"line 5: origin: xyz = .*'O.613' is not a number"),
    "roll": (urdf(swap=('rpy="0 1.57', 'rpy="O 1.57')), r"rpy = .*'O' is not a number"),
    "huge": (urdf(swap=(ELBOW, "0 -0.131 1e300")), r"xyz = .*: beyond 50"),
    "zero axis": (urdf(swap=('xyz="0 1 0"', 'xyz="0 0 0"')), r"axis: xyz = '0 0 0' has no direction"),
    "no axis": (urdf(swap=('<axis xyz="0 1 0"/>', "<axis/>")), r"axis: xyz is missing"),
    "xzy": (urdf(swap=('<axis xyz="0 1 0"/>', '<axis xzy="0 1 0"/>')), r"unknown attribute 'xzy'; did you mean 'xyz'"),
    "orgin": (urdf(swap=("<origin", "<orgin")), r"orgin in joint 'shoulder_pan_joint' is unknown; .* 'origin'\?"),
    "two origins": (urdf(swap=("<axis", "<origin/><axis")), r"origin: there twice in joint 'shoulder_pan_joint'"),
    "limit": (urdf(swap=('lower="-2.97"', 'lower="-2,97"')), r"lower = '-2,97': '-2,97' is not a number"),
    "limits": (urdf(swap=('upper="3.05"', 'upper="-3.05"')), r"limit: lower = -2.97 is above upper = -3.05"),
    "no limit": (urdf(swap=("<limit", "<dynamics")), r"limit is missing; a joint without limits is of type continuous"),
    "floating": (urdf(swap=(HINGE, HINGE.replace("revolute", "floating"))), r"type 'floating' is not supported"),
    "planar": (urdf(swap=(HINGE, HINGE.replace("revolute", "planar"))), r"type 'planar' is not supported"),
    "revolut": (
        urdf(swap=(HINGE, HINGE.replace("revolute", "revolut"))),
        r"type 'revolut' is unknown; did you mean 'rev",
    ),
    "no type": (urdf(swap=(HINGE, '<joint name="elbow_joint">')), r"'elbow_joint': type None is unknown"),
    "mimic": (urdf(swap=("<axis", '<mimic joint="wrist_3_joint"/><axis')), r"it mimics another joint"),
    "no parent": (urdf(swap=('<parent link="base"/>', "")), r"its parent link '' is not there"),
    "lost parent": (
        urdf(swap=('<parent link="base"/>', '<parent link="bse"/>')),
        r"'bse' is not there; did you mean 'base",
    ),
    "link twice": (urdf(more='<link name="base"/>'), r"line 9: link 'base' is there twice; the first one is in line 2"),
    "joint twice": (urdf(swap=("wrist_1_joint", "elbow_joint")), r"joint 'elbow_joint' is there twice"),
    "nameless": (urdf(more="<link/>"), r"line 9: a link without a name"),
    "two bases": (urdf(more='<link name="table"/>'), r"expected one base link .*, found base, table"),
    "loop": (
        urdf(
            more='<joint name="l" type="fixed"><parent link="base"/><child link="elbow_link"/></joint>',
        ),
        r"link 'elbow_link' hangs on two joints; closed loops",
    ),
    "circle": (
        urdf(
            more='<link name="x"/><link name="y"/>'
            '<joint name="l" type="fixed"><parent link="x"/><child link="y"/></joint>'
            '<joint name="k" type="fixed"><parent link="y"/><child link="x"/></joint>',
        ),
        r"link 'x' hangs on itself through its joints",
    ),
    "no link": ("<robot name='x'/>", r"0 links, expected 1 to 1000"),
    "many links": ("<robot>" + "".join(f"<link name='{k}'/>" for k in range(1001)) + "</robot>", r"1001 links"),
    "xacro": ("<robot xmlns:xacro='http://x'>\n<xacro:include/></robot>", r"line 2: xacro:include: run xacro first"),
    "xacro number": (urdf(swap=(ELBOW, "0 ${offset} 0.613")), r"'\$\{offset\}' is not a number"),
    "MJCF": (mjcf(), r"line 1: mujoco is no <robot>; MJCF files end in .xml or .mjcf"),
    "no XML": ("<robot><link></robot>", r"line 1, column \d+: not XML: mismatched tag"),
}


@pytest.mark.parametrize("name", URDF_FAULTS)
def test_a_faulty_urdf_is_one_line(identify, tmp_path, name):
    text, message = URDF_FAULTS[name]
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    _names(identify(model=path), path, message)


def _log(**columns: object) -> dict[str, object]:
    t = 0.004 * np.arange(400)
    return {"t": t, "q1": np.sin(3.0 * t), "q2": 0.5 * np.cos(2.0 * t), "v1": np.cos(t), "v2": np.sin(t)} | columns


def _csv(columns: dict[str, object], separator: str = ",", decimal: str = ".") -> str:
    rows = [separator.join(columns)]
    rows += [separator.join(str(x).replace(".", decimal) for x in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(rows) + "\n"


def _with(values: object, **at: float) -> np.ndarray:
    changed = np.array(values)
    for row, value in at.items():
        changed[int(row[1:]) - 1] = value
    return changed


GOOD = _log()
T, Q1, V1, V2 = (np.asarray(GOOD[name]) for name in ("t", "q1", "v1", "v2"))
LOG_FAULTS = {
    "no header": (_csv(GOOD).split("\n", 1)[1], r"line 1 has numbers where column names are expected; begin with t,q1"),
    "upper case": (_csv(GOOD).replace("t,q1", "T,Q1"), r"column 'T': names are lower case; rename it t"),
    "q0": (_csv({"q0": Q1, "v0": V1, **GOOD}), r"column q0: joints are numbered from 1"),
    "q1 twice": (_csv(GOOD).replace("q2", "q1", 1), r"column q1 appears twice in the header"),
    "no v": (_csv({k: GOOD[k] for k in ("t", "q1", "q2")}), r"columns v1, v2, \.\. are missing; found t, q1, q2"),
    "no v2": (_csv({k: GOOD[k] for k in ("t", "q1", "q2", "v1")}), r"joint 2 has only one of the columns q2 and v2"),
    "no t": (_csv({k: GOOD[k] for k in ("q1", "v1")}), r"column t is missing; found q1, v1"),
    "other names": ("time,pos,cur\n1,2,3\n", r"names no column t, q1\.\. or v1\.\.; found time, pos, cur"),
    "many joints": (
        _csv({"t": T} | {f"{k}{j}": Q1 for k in "qv" for j in range(1, 66)}),
        r"65 joints; recordings of up",
    ),
    "a million columns": (",".join(f"q{k}" for k in range(1, 1_000_000)) + "\n1\n", r"999999 columns; files of up to"),
    "text": (_csv(GOOD).replace("\n0.004,", "\n0.004s,", 1), r"line 3, column t: '0.004s' is not a number"),
    "empty cell": (_csv(GOOD).replace("\n0.004,", "\n,", 1), r"line 3, column t: '' is not a number"),
    "short row": (_csv(GOOD) + "1.6,1,2\n", r"line 402, column v1: '' is not a number"),
    "long row": (_csv(GOOD) + "1.6,1,2,3,4,5\n", r"line 402 has 6 cells, but the header names 5"),
    "decimal commas": (_csv(GOOD, ",", ","), r"line 2 has \d+ cells, but the header names 5; separate columns with ;"),
    "thousands": (_csv(GOOD, ";", ",") + "1.001,6;1,0;2,0;3,0;4,0\n", r"line 402, column t: '1.001,6' is not a number"),
    "header twice": (_csv(GOOD) + "t,q1,q2,v1,v2\n", r"line 402, column t: 't' is not a number"),
    "nan": (_csv(_log(q1=_with(Q1, r7=np.nan))), r"q1 is not a finite number at row 7 \(1 such values\)"),
    "inf": (_csv(_log(v2=_with(V2, r8=np.inf))), r"v2 is not a finite number at row 8"),
    "no rows": ("t,q1,v1\n\n# nothing\n", r"expected a header line and at least one row"),
    "one row": ("t,q1,v1\n0,1,2\n", r"1 samples are too few"),
    "time stands": (_csv(_log(t=_with(T, r9=T[7]))), r"time does not increase at row 9: t = 0.028 s after 0.028 s"),
    "time descends": (_csv(_log(t=T[::-1])), r"time does not increase at row 2"),
    "milliseconds": (_csv(_log(t=1e3 * T)), r"t advances by 4 a row; is it in milliseconds\? t is in seconds"),
    "rows counted": (
        _csv(_log(t=np.arange(len(T), dtype=float))),
        r"t advances by 1 a row; is it in milliseconds, or the number of the row\? t is in seconds",
    ),
    "microseconds": (_csv(_log(t=1e6 * T)), r"t advances by 4e\+03 a row; is it in microseconds\?"),
    "nanoseconds": (_csv(_log(t=1e9 * T)), r"t advances by 4e\+06 a row; is it in nanoseconds\?"),
    "hours": (_csv(_log(t=T / 3600.0)), r"t advances by 1.11e-06 a row; is it in hours\?"),
    "constant q": (_csv(_log(q2=0.0 * T)), r"q2 never changes; the joint did not move or the channel was not logged"),
    "constant v": (_csv(_log(v1=0.0 * T + 2.0)), r"v1 never changes"),
    "v x 1e300": (_csv(_log(v1=1e300 * V1)), r"v1 = 1e\+300 at row 1 \(400 such values\); beyond 1e\+12"),
    "q x 1e300": (_csv(_log(q1=1e300 * (Q1 + 2.0))), r"q1 = 2e\+300 at row 1 .* beyond 1e\+06 nothing is a position"),
    "spike of v": (
        _csv(_log(v2=_with(V2, r50=1e6, r51=1e6, r90=-1e6))),
        r"v2 = 1e\+06 at row 50, while 99 % of it are within .*; 3 such samples \(rows 50, 51, 90\)",
    ),
    "spike of q": (_csv(_log(q1=_with(Q1, r60=9.0))), r"q1 jumps by .* from row 59 to the next, .* and 1 more such"),
    "wrapped": (
        _csv(_log(q1=(Q1 * 4.0 + np.pi) % (2 * np.pi) - np.pi)),
        r"q1 jumps by -6\.2.*wrapped; .* np\.unwrap\(q, ax",
    ),
    "UTF-16 without mark": (_csv(GOOD).encode("utf-16-le"), r"not a text file; is it UTF-16\?"),
    "binary": (bytes(range(256)) * 9, r"not a text file; expected CSV"),
    "cut gzip": (gzip.compress(_csv(GOOD).encode())[:-30], r"the gzip file is cut off"),
    "broken gzip": (b"\x1f\x8b" + b"abc" * 30, r"not a readable gzip file"),
    "broken UTF-16": (_csv(GOOD).encode("utf-16")[:-1], r"broken UTF-16"),
    "too few joints": (_csv(GOOD), r"2 joints, but robot ur has 6"),
}


@pytest.mark.parametrize("name", LOG_FAULTS)
def test_a_faulty_csv_is_one_line(identify, tmp_path, name):
    content, message = LOG_FAULTS[name]
    path = tmp_path / "log.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    _names(identify(unloaded=path), path, message)


PARQUET_FAULTS = {
    "text": (_log(q1=[str(x) for x in Q1]), r"column q1 is string, expected numbers"),
    "yes or no": (_log(v1=V1 > 0.5), r"column v1 is bool, expected numbers"),
    "nested": (_log(v1=[[x] for x in V1]), r"column v1 is list<.*>, expected numbers"),
    "a record": (_log(q2=[{"a": x} for x in V1]), r"column q2 is struct<.*>, expected numbers"),
    "dates": (_log(t=pa.array(range(400), pa.timestamp("ns"))), r"column t is timestamp\[ns\].*; t is in seconds"),
    "nulls": (_log(v2=[None, *V2[1:]]), r"v2 is not a finite number at row 1"),
    "all null": (_log(v2=[None] * 400), r"column v2 is null, expected numbers"),
    "too large": (_log(t=[2**60 + k for k in range(400)]), r"time does not increase at row 2: t = 1\.15292.*e\+18 s"),
    "no rows": ({k: np.empty(0) for k in GOOD}, r"0 samples are too few"),
    "no columns": ({"x": V1}, r"the header names no column t, q1\.\. or v1\.\.; found x"),
    "two many columns": ({f"c{k}": [1.0] for k in range(10_001)}, r"10001 columns; files of up to 10000 are read"),
}


@pytest.mark.parametrize("name", PARQUET_FAULTS)
def test_a_faulty_parquet_file_is_one_line(identify, tmp_path, name):
    columns, message = PARQUET_FAULTS[name]
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns), path)
    _names(identify(loaded=path), path, message)


def test_a_cut_or_doubled_parquet_file_is_one_line(identify, tmp_path):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(_log()), path)
    whole = path.read_bytes()
    for content, message in (
        (whole[:-20], "not a readable Parquet file"),
        (whole[:6], "not a readable Parquet file"),
        (b"PAR1" + whole[: len(whole) // 2] + (10**9).to_bytes(4, "little") + b"PAR1", "1000 MB describe its columns"),
        (whole[:4] + bytes(200) + whole[204:], "not a readable Parquet file"),
    ):
        path.write_bytes(content)
        _names(identify(loaded=path), path, message)
    pq.write_table(pa.table([pa.array(T), pa.array(Q1), pa.array(V1), pa.array(V2)], ["t", "q1", "v1", "v1"]), path)
    _names(identify(loaded=path), path, "column v1 appears twice")


INERTIA = "inertia = { ixx = 0.02, iyy = 0.03, izz = 0.04 }"
WHOLE = f"mass = 2.8\ncom = [0.01, 0.02, 0.1]\n{INERTIA}\n"
PAYLOAD_FAULTS = {
    "no mass": ("known = 'mass'", "mass is missing; without it"),
    "mass 1e9": (WHOLE.replace("2.8", "1e9"), r"mass = 1e\+09 kg; expected a positive number from 0.001 to 2000"),
    "a grain": (WHOLE.replace("2.8", "1e-300"), r"mass = 1e-300 kg; expected"),
    "negative": (WHOLE.replace("2.8", "-2.8"), r"mass = -2.8 kg; expected a positive number"),
    "nan": (WHOLE.replace("2.8", "nan"), "mass = nan is not finite"),
    "text": (WHOLE.replace("2.8", "'2.8'"), "mass = '2.8' is not a number"),
    "date": (WHOLE.replace("2.8", "2020-02-02"), r"mass = datetime.date\(2020, 2, 2\) is not a number"),
    "huge whole number": (WHOLE.replace("2.8", "9" * 400), "mass is too large a number"),
    "5000 digits": (WHOLE.replace("2.8", "9" * 5000), "not TOML: Exceeds the limit"),
    "huge hex": ("mass = 1\ncom = [0x" + "f" * 9000 + "]", r"com = \[a whole number of 36000 bits\]; expected three"),
    "mass_std 1e300": (WHOLE + "mass_std = 1e300", r"mass_std = 1e\+300 exceeds the mass itself"),
    "mass_std negative": (WHOLE + "mass_std = -0.1", r"mass_std = -0.1: a standard deviation is negative"),
    "com in mm": (WHOLE.replace("0.1]", "100]"), r"com = .*; farther than 5 m; expected metres"),
    "com_std in mm": (WHOLE + "com_std = [1, 1, 10]", r"com_std = .* exceeds 5; check its unit"),
    "com of two": (WHOLE.replace("0.1]", "]"), r"com = \[0.01, 0.02\]; expected three numbers"),
    "inertia in mm": (WHOLE.replace("0.04", "40000"), r"inertia.izz = 40000 is that of 2.8 kg more than 5 m away"),
    "inertia_std 1e9": (WHOLE + "inertia_std = { ixx = 1e9, iyy = 1, izz = 1 }", r"inertia_std = .* exceeds 70"),
    "no izz": (WHOLE.replace(", izz = 0.04", ""), "inertia.izz is missing; ixx, iyy and izz are needed"),
    "izx": (WHOLE.replace("}", ", izx = 0 }"), r"unknown key inertia.izx; did you mean 'i..'\?"),
    "inertia a list": (
        WHOLE.replace("{ ixx = 0.02, iyy = 0.03, izz = 0.04 }", "[1, 2, 3]"),
        r"inertia = \[1, 2, 3\]; exp",
    ),
    "wedge": (WHOLE.replace("0.04", "0.4"), "inertia violates the triangle inequality"),
    "std alone": ("mass = 2\nknown = 'mass'\ncom_std = [1, 1, 1]", "com_std is given, but com is missing"),
    "mas_std": (WHOLE + "mas_std = 0.1", r"unknown key 'mas_std'; did you mean 'mass_std'\?"),
    "known some": (WHOLE + "known = 'some'", "known = 'some'; expected 'all', 'com', 'mass' or 'none'"),
    "decimal comma": (WHOLE.replace("2.8", "2,8"), r"\(at line \d+, column \d+\); numbers have a decimal point"),
    "no TOML": ("mass : 2.8", "not TOML: Expected '='"),
    "nested": ("mass = " + "[" * 50_000, "nested deeper than 16"),
    "nested tables": ("mass = " + "{a=" * 50_000, "nested deeper than 16"),
    "dotted": ("a." * 50_000 + "a = 1", "nested deeper than 16"),
    "headed": ("[" + "a." * 50_000 + "a]", "nested deeper than 16"),
    "not UTF-8": (b"mass = 2.8 # gr\xf6\xdfe", "byte 15 is not UTF-8; save it as UTF-8"),
    "a novel": (b"# " + b"x" * 4_000_001, "4 MB are too much; such files are read up to 4 MB"),
}


@pytest.mark.parametrize("name", PAYLOAD_FAULTS)
def test_a_faulty_payload_is_one_line(identify, tmp_path, name):
    content, message = PAYLOAD_FAULTS[name]
    path = tmp_path / "payload.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    _names(identify(payload=path), path, message)


@pytest.mark.parametrize("kind", ["model", "unloaded", "loaded", "payload"])
def test_what_is_no_regular_file_is_one_line_whatever_it_is_given_for(identify, tmp_path, kind):
    ending = {"model": "xml", "payload": "toml"}.get(kind, "csv")
    folder, pipe, device, absent, empty, long = (
        tmp_path / f"{name}.{ending}" for name in ("folder", "pipe", "zero", "absent", "empty", "x" * 300)
    )
    folder.mkdir()
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    empty.touch()
    for path, message in (
        (folder, "is a folder; expected a regular file"),
        (pipe, "is a pipe; expected a regular file"),
        (device, "is a device; expected a regular file"),
        (absent, "no such file"),
        (empty, "the file is empty"),
        (long, "File name too long"),
    ):
        _names(identify(**{kind: path}), path, message)


def test_a_name_with_a_line_break_stays_on_one_line(identify, tmp_path):
    assert "a b.toml: no such file" in identify(payload=tmp_path / "a\nb.toml")
    assert "a b.csv: no such file" in identify(loaded=tmp_path / "a\nb.csv")
    assert "a b.urdf: no such file" in identify(model=tmp_path / "a\nb.urdf")


def test_a_model_of_an_unknown_ending_is_one_line(identify, tmp_path):
    (tmp_path / "arm.txt").write_text(mjcf())
    assert "expected a .urdf, .xml or .mjcf file" in identify(model=tmp_path / "arm.txt")


def test_twenty_thousand_bodies_do_not_end_the_process(good, tmp_path):
    path = tmp_path / "deep.xml"
    path.write_text(MJCF_FAULTS["nested"][0])
    files = [
        "--model",
        path,
        "--unloaded",
        good / "a.csv",
        "--loaded",
        good / "b.csv",
        "--payload",
        good / "payload.toml",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "scenarios", "identify", *files], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "nested deeper than 200" in done.stderr


SCENARIO_FAULTS = {
    "nested": ("a = " + "[" * 50_000, "nested deeper than 16"),
    "dotted": ("a." * 50_000 + "a = 1", "nested deeper than 16"),
    "not UTF-8": (b"description = '\xe9'", "byte 15 is not UTF-8"),
    "a novel": (b"# " + b"x" * 4_000_001, "4 MB are too much"),
    "empty": ("", "the file is empty"),
    "decimal comma": (WHOLE.replace("2.8", "2,8"), r"\(at line \d+, column \d+\); numbers have a decimal point"),
    "no TOML": ("description : 1", "not TOML"),
    "extends a list": ("extends = ['nominal']", r"extends = \['nominal'\]; expected the name of one scenario"),
    "extends itself": ("extends = 'mine.toml'", "extends itself through mine.toml -> mine.toml"),
    "extends a stranger": ("extends = 'nominl'", "unknown scenario 'nominl'; did you mean 'nominal'"),
}


@pytest.mark.parametrize("name", SCENARIO_FAULTS)
def test_a_faulty_scenario_is_one_line(capsys, tmp_path, name):
    content, message = SCENARIO_FAULTS[name]
    path = tmp_path / "mine.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert main(["run", str(path)]) == 2
    _names(_only_line(capsys), path, message)


MOTION = (
    "duration = 8.0\ncenter = [0.1, 0.2]\nsine = [[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]]\n"
    "cosine = [[0.05, -0.08, 0.03], [0.1, -0.16, 0.06]]\n"
)
MOTION_FAULTS = {
    "no duration": (MOTION.replace("duration", "# duration"), "duration is missing; expected duration, center, sine"),
    "durations": (MOTION.replace("duration", "durations"), "unknown key 'durations'; did you mean 'duration'"),
    "text": (MOTION.replace("8.0", "'8.0'"), "duration = '8.0'; expected a number"),
    "a year": (MOTION.replace("8.0", "3600"), r"duration = 3600; expected up to 600 s"),
    "just too long": (MOTION.replace("8.0", "600.001"), r"duration = 600.001; expected up to 600 s"),
    "no time": (MOTION.replace("8.0", "0.0"), "duration = 0; expected up to 600 s"),
    "nan": (MOTION.replace("-0.08", "nan"), "cosine holds a number that is not finite or beyond 10000"),
    "huge": (MOTION.replace("[0.1, 0.2]", "[0.1, 1e300]"), "center holds a number that is not finite or beyond"),
    "huge whole number": (MOTION.replace("0.2]", "9" * 400 + "]", 1), r"center = .* bits\]; expected an array"),
    "true": (MOTION.replace("[0.1, 0.2]", "[0.1, true]"), r"center = \[0.1, True\]; expected an array of numbers"),
    "ragged": (MOTION.replace("-0.1, 0.0]", "-0.1]"), "sine = .*; expected rows of numbers, all of one length"),
    "flat": (
        MOTION.replace("[[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]]", "[0.1, 0.2]"),
        "sine = .*; expected rows of numbers",
    ),
    "sizes": (MOTION.replace("[0.1, 0.2]", "[0.1]"), r"center \(1,\), sine \(2, 3\) and cosine \(2, 3\) do not fit"),
    "a start": (MOTION.replace("-0.08", "-0.09"), "the motion does not start at rest"),
    "not two": (MOTION, "moves 2 joints of 6"),
    "nested": ("a = " + "[" * 50_000, "nested deeper than 16"),
}


@pytest.mark.parametrize("name", MOTION_FAULTS)
def test_a_faulty_motion_is_one_line(capsys, tmp_path, name):
    text, message = MOTION_FAULTS[name]
    (tmp_path / "motion.toml").write_text(text)
    (tmp_path / "mine.toml").write_text("extends = 'nominal'\n[experiment]\nmotion = 'motion.toml'\n")
    assert main(["run", str(tmp_path / "mine.toml")]) == 2
    _names(_only_line(capsys), Path("motion.toml"), message)


def test_a_motion_or_scenario_that_is_no_regular_file_is_one_line(capsys, tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    for name, message in (("pipe.toml", "is a pipe"), ("folder.toml", "is a folder"), ("absent.toml", "no such file")):
        assert main(["run", str(tmp_path / name)]) == 2
        assert message in _only_line(capsys)
    for name, message in (("pipe.toml", "is a pipe"), ("absent.toml", "unknown motion 'absent.toml'")):
        (tmp_path / "mine.toml").write_text(f"extends = 'nominal'\n[experiment]\nmotion = '{name}'\n")
        assert main(["run", str(tmp_path / "mine.toml")]) == 2
        assert message in _only_line(capsys)


def _only_line(capsys) -> str:
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err


def _names(line: str, path: Path, message: str) -> None:
    assert path.name in line
    assert len(line) < 500
    assert re.search(message, line), line


def test_a_circle_of_scenarios_is_told_once(tmp_path):
    (tmp_path / "one.toml").write_text("extends = 'two.toml'")
    (tmp_path / "two.toml").write_text("extends = 'one.toml'")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(str(tmp_path / "one.toml"))
    assert str(caught.value) == f"{tmp_path / 'one.toml'}: extends itself through one.toml -> two.toml -> one.toml"

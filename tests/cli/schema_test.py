#!/usr/bin/python3
"""The JSON Schema for editors says what the reader says of each key by itself. Run as schema_test.py PROGRAM; with Debian's
python3-jsonschema scenes are validated too."""
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from harness import finish, need, program, root

ROOT = Path(root)


def call(*arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=120)


def parsed(text):
    """A scene as a tree, or nothing where it is not TOML."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return None


def described(schema, path=""):
    """Every key of a schema with what is said of it: soil.*.density, wall.*.surface.friction_angle."""
    for name, inside in schema.get("properties", {}).items():
        yield path + name, inside
        yield from described(inside, f"{path}{name}.")
    for inside in schema.get("patternProperties", {}).values():
        yield from described(inside, path + "*.")
    for inside in schema.get("anyOf", []):
        yield from described(inside, path)
    if schema.get("type") == "array":
        yield from described(schema["items"], path + "*.")


def main():
    # ---- what it is made of ----
    done = call("schema")
    need(done.returncode == 0 and not done.stderr, f"kuzure schema: exit {done.returncode}, {done.stderr!r}")
    need(done.stdout == call("schema").stdout, "kuzure schema says the same twice")
    schema = json.loads(done.stdout)
    need(schema["$schema"] == "https://json-schema.org/draft/2020-12/schema", "the draft is named")
    keys = dict(described(schema))

    # Every row of the reference is a key of the schema, needed or with its default as it is printed there.
    section, rows = "", 0
    for line in (ROOT / "docs/scene.md").read_text().splitlines():
        if line.startswith("## "):
            section = re.sub(r"[\[\]`]", "", line[3:]).replace("Top level", "").replace("soil.<name>", "soil.*")
            if section in ("body", "wall", "load", "event", "probe"):
                section += ".*"
            section = section.replace("event.soil", "event.*.soil").replace("uncertain.key", "uncertain.key.*")
        row = re.match(r"\| `([^`]+)` \| .* \| .* \| (.*) \| .* \| (.*) \|$", line)
        if not row:
            continue
        rows += 1
        path = f"{section}.{row[1]}" if section else row[1]
        known = keys.get(path)
        if known is None:
            need(False, f"{path} is in docs/scene.md, but not in the schema")
            continue
        need(known["description"].startswith(row[3]), f"{path}: described as {known['description']!r}, not {row[3]!r}")
        parent, leaf = path.rpartition(".")[::2]
        if row[2].startswith("`"):
            value = tomllib.loads("v = " + row[2].strip("`"))["v"]
            need(known.get("default") == value, f"{path}: default {known.get('default')!r}, not {value!r}")
        else:
            need("default" not in known, f"{path}: has a default, but is {row[2]}")
    need(rows > 70, f"only {rows} rows of docs/scene.md were understood")
    need(schema["required"] == ["title", "dimensions", "space", "time", "soil", "body"], f"needed at the top: {schema['required']}")

    # ---- what it accepts and refuses ----
    try:
        import jsonschema
    except ImportError:
        print("not run: no scene was validated, python3-jsonschema is missing (jobs/install.sh tests)")
        finish(77)
    jsonschema.Draft202012Validator.check_schema(schema)
    valid = jsonschema.Draft202012Validator(schema).is_valid

    # Examples and defaults lead nobody astray.
    for path, known in keys.items():
        one = jsonschema.Draft202012Validator(known)
        for value in known.get("examples", []) + ([known["default"]] if "default" in known else []):
            # The examples of tables with needed keys inside are whole, an empty default stands for all the keys' own.
            need(one.is_valid(value), f"{path}: {value!r} stands in the schema and is refused by it")

    GOOD = """title = "good"
dimensions = 3
[space]
spacing = 0.1
[time]
end = 1
[soil.sand]
density = 1850
young = 1.8e6
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }
[[wall]]
box = { low = [-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.0] }
surface = { friction_angle = 20.0 }
[effects]
gravity = [0.0, 0.0, -9.81]
artificial_stress = "auto"
[output]
fields = ["velocity"]
"""
    need(valid(parsed(GOOD)), "the good scene is refused")
    # One wrong edit for each thing that a schema can say, on every level of the tree.
    for old, new in [
        ('title = "good"', "title = 3"),
        ('title = "good"', ""),
        ('title = "good"', 'title = "good"\ncolour = 1'),
        ("dimensions = 3", "dimensions = 4"),
        ("dimensions = 3", "dimensions = 2.5"),
        ("dimensions = 3", 'dimensions = "3"'),
        ("spacing = 0.1", "spacing = 0"),
        ("spacing = 0.1", "spaceing = 0.1"),
        ("spacing = 0.1", "spacing = 0.1\nh = 3.1"),
        ("spacing = 0.1", "spacing = 0.1\nlow = [0.0, 0.0]"),
        ("spacing = 0.1", 'spacing = 0.1\nperiodic = ["w"]'),
        ("spacing = 0.1", 'spacing = 0.1\nperiodic = ["x", "x"]'),
        ("spacing = 0.1", "spacing = 0.1\nperiodic = []"),
        ("end = 1", "end = 0"),
        ("end = 1", "end = true"),
        ("end = 1", "end = 1\nretry = 1"),
        ("[soil.sand]", "[soil]"),
        ("[soil.sand]", '[soil."fine sand"]'),
        ("density = 1850", "rho = 1850"),
        ("poisson = 0.3", "poisson = 0.5"),
        ("poisson = 0.3", "poisson = 0.3\nsoftening = { cohesion = 0.0 }"),
        ("poisson = 0.3", 'poisson = 0.3\ncone = "round"'),
        ("box = { low = [0.0", "sphere = { center = [0.0, 0.0, 0.0], radius = 0.1 }\nbox = { low = [0.0"),
        ("box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }", ""),
        ("high = [1.0, 1.0, 1.0]", "high = [1.0, 1.0, 1e10]"),
        (
            'soil = "sand"\nbox = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }',
            'polygon = { points = [[0.0, 1.0, 2.0]] }\nsoil = "sand"',
        ),
        ("surface = { friction_angle = 20.0 }", 'surface = "sticky"'),
        ("surface = { friction_angle = 20.0 }", "surface = { friction_angle = 90.0 }"),
        ("surface = { friction_angle = 20.0 }", "surface = {}"),
        ('artificial_stress = "auto"', 'artificial_stress = "on"'),
        ('artificial_stress = "auto"', "artificial_stress = { epsilon = 1.5 }"),
        ('fields = ["velocity"]', 'fields = "velocity"'),
        ('fields = ["velocity"]', 'fields = ["colour"]'),
        ('fields = ["velocity"]', "picture = { range = [1.0] }"),
    ]:
        assert old in GOOD
        need(not valid(parsed(GOOD.replace(old, new, 1))), f"accepted: {new!r} for {old!r}")
    need(not valid(parsed(re.sub(r"\[\[body\]\](.|\n)*?\n\[\[wall", "[[wall", GOOD))), "accepted: no body")

    # Scenes that the reader accepts validate: as they are, and as they are written with every default.
    accepted = [*ROOT.glob("jobs/scenes/*.toml"), *ROOT.glob("tests/scenes/doubtful/*.toml"), *ROOT.glob("perf/scenes/*.toml")]
    for file in accepted:
        need(valid(parsed(file.read_text())), f"{file.relative_to(ROOT)} is refused")
    written = call("check", str(ROOT / "jobs/scenes/quickstart.toml")).stdout
    need(valid(parsed(written[written.index("\ntitle = ") :])), "a scene with every default written out is refused")
    # Whatever the schema refuses, the reader refuses: bad scenes and what fuzzing found.
    refused = 0
    for file in [*ROOT.glob("tests/scenes/bad/*.toml"), *ROOT.glob("tests/fuzz/corpus/scene/*")]:
        text = file.read_bytes().decode(errors="replace").split("\0")[0]
        tree = parsed(text)
        if tree is None:
            continue
        if valid(tree):
            # What a row of the table forbids, the schema forbids; nan, inf and 3.0 for 3 are no business of JSON's.
            said = re.search(r"^# expect: .*(known key|found nothing|did you mean|expected one of )", text)
            need(not said or "name of a soil" in text, f"{file.relative_to(ROOT)} is accepted: {text.splitlines()[0]}")
        elif file.suffix != ".toml" or file.parent.name != "bad":
            refused += 1
            done = subprocess.run([program, "check", "/dev/stdin", "--json"], input=text, capture_output=True, text=True, timeout=120)
            need(done.returncode == 2, f"{file.relative_to(ROOT)} is refused, but kuzure takes it")
    need(refused > 0, "nothing of the corpus was refused")
    finish()


if __name__ == "__main__":
    main()

"""Scenes given as nested dicts, written as the text that the program reads. What the keys mean is the program's to say."""
import json


def value(v):
    """A value as TOML: a number, a text, a list, or a dict as an inline table."""
    if hasattr(v, "tolist"):  # of numpy
        v = v.tolist()
    if isinstance(v, bool):
        return "true" if v else "false"
    if isinstance(v, str):
        return json.dumps(v, ensure_ascii=False)
    if isinstance(v, (list, tuple)):
        return "[" + ", ".join(value(x) for x in v) + "]"
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{key(k)} = {value(x)}" for k, x in v.items()) + " }"
    if isinstance(v, int):
        return str(v)
    if isinstance(v, float):
        return repr(v)
    raise TypeError(f"{v!r}: expected a number, a text, a list or a dict, found {type(v).__name__}")


def key(k):
    """A key, in quotes where it needs them."""
    bare = k and all(c.isascii() and (c.isalnum() or c in "_-") for c in k)
    return k if bare else json.dumps(k, ensure_ascii=False)


def to_toml(scene):
    """The text of a scene: `soil` holds named soils, `body`, `wall` and `event` are lists of tables, other dicts are sections."""
    tabular = lambda v: isinstance(v, (list, tuple)) and len(v) > 0 and all(isinstance(x, dict) for x in v)
    lines = [f"{key(k)} = {value(v)}" for k, v in scene.items() if not isinstance(v, dict) and not tabular(v)]
    for section, content in scene.items():
        if section == "soil":
            tables = [(f"[soil.{key(name)}]", soil) for name, soil in content.items()]
        elif tabular(content):
            tables = [(f"[[{key(section)}]]", table) for table in content]
        elif isinstance(content, dict):
            tables = [(f"[{key(section)}]", content)]
        else:
            continue
        for head, table in tables:
            lines += ["", head] + [f"{key(k)} = {value(v)}" for k, v in table.items()]
    return "\n".join(lines) + "\n"


def sets(changes, path=""):
    """`--set` words for changes: {"space.spacing": 0.1}, {"space": {"spacing": 0.1}} and {"space__spacing": 0.1} are the same."""
    words = []
    for k, v in changes.items():
        name = path + k.replace("__", ".")
        if isinstance(v, dict):
            words += sets(v, name + ".")
        else:
            words += ["--set", f"{name}={value(v)}"]
    return words

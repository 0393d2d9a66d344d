"""Print everything that a program can observe about a message type of an implementation of genpy.

Run by both sides of a comparison: imported by tests for pipros, and as a script by the Python of
genuine ROS (jobs come as JSON on stdin, answers go to stdout). So it uses nothing but the public
surface of genpy and works with whichever is installed.
"""

import ast
import io
import json
import os
import random
import subprocess
import sys

NUMBERS = {
    "bool": (0, 1), "byte": (-128, 127), "char": (0, 255), "int8": (-128, 127), "uint8": (0, 255),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1), "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1), "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip
FLOATS = [0.0, -0.0, 1.5, -2.25, 1e-30, 3.0e38, float("inf"), 0.1]
STRINGS = [
    "", "a", "hello world", "it's", 'say "hi"', "back\\slash", "\u00fcml\u00e4ut", "\u65e5\u672c",
    "tab\there",
]  # fmt: skip
STRINGS += [
    "two\nlines", "- x", "1.5", "yes", "null", "a" * 100, "many words " * 12, " lead", "trail ", "#no",
]  # fmt: skip
STRINGS += ["key: value", "\U0001f600"]


def random_value(rng, kind, class_of, depth=0):
    """Return a value for a field of a type, in JSON form."""
    if kind.endswith("]"):
        base, _, length = kind[:-1].partition("[")
        count = int(length) if length else rng.choice([0, 1, 2, 3, 7] if depth < 2 else [0, 1])
        return [random_value(rng, base, class_of, depth + 1) for _ in range(count)]
    if kind in NUMBERS:
        low, high = NUMBERS[kind]
        return rng.choice([low, high, rng.randint(low, high)])
    if kind in ("float32", "float64"):
        return rng.choice([*FLOATS, rng.uniform(-1e3, 1e3)])
    if kind == "string":
        return rng.choice(STRINGS)
    if kind == "time":
        return [rng.randint(0, 2**32 - 1), rng.randint(0, 999999999)]
    if kind == "duration":
        return [rng.randint(-(2**31), 2**31 - 1), rng.randint(0, 999999999)]
    cls = class_of(kind)
    return {
        slot: random_value(rng, slot_type, class_of, depth + 1)
        for slot, slot_type in zip(cls.__slots__, cls._slot_types, strict=True)
    }


def build(kind, value, class_of, genpy):
    """Return the Python value for a JSON value of `random_value`."""
    if isinstance(value, dict) and set(value) == {"python"}:
        return ast.literal_eval(value["python"])
    if kind.endswith("]"):
        base = kind.partition("[")[0]
        return [build(base, element, class_of, genpy) for element in value]
    if kind == "bool":
        return bool(value)
    if kind == "time":
        return genpy.Time(*value)
    if kind == "duration":
        return genpy.Duration(*value)
    if isinstance(value, dict):
        cls = class_of(kind)
        kinds = dict(zip(cls.__slots__, cls._slot_types, strict=True))
        return cls(**{slot: build(kinds[slot], part, class_of, genpy) for slot, part in value.items()})
    return value


def describe(value):
    """Return a value with the Python types of all its parts."""
    if hasattr(value, "_slot_types") and hasattr(value, "_md5sum"):
        return [value._type, {slot: describe(getattr(value, slot)) for slot in value.__slots__}]
    if hasattr(value, "nsecs"):
        return [type(value).__name__, value.secs, value.nsecs]
    if isinstance(value, (list, tuple)):
        return [type(value).__name__, [describe(element) for element in value]]
    return [type(value).__name__, repr(value)]


def written(message):
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def outcome(action):
    """Return the result of an action, or the class and text of its exception."""
    try:
        return action()
    except Exception as error:
        return ["raised", type(error).__name__, str(error)]


def examine(job, class_of, genpy):
    """Return everything observable about the type `job["type"]` with the values of the job."""
    cls = class_of(job["type"])
    answer = {
        "md5": cls._md5sum,
        "type": cls._type,
        "text": cls._full_text,
        "slots": list(cls.__slots__),
        "slot types": list(cls._slot_types),
        "has header": cls._has_header,
        "default": describe(cls()),
        "default bytes": written(cls()).hex(),
        "default shown": str(cls()),
        "default args": genpy.message.get_printable_message_args(cls()),
        "constants": {
            name: repr(value)
            for name, value in sorted(vars(cls).items())
            if isinstance(value, (bool, int, float, str)) and not name.startswith("_")
        },
    }
    answer["values"] = []
    for value in job.get("values", []):
        message = build(job["type"], value, class_of, genpy)
        data = written(message)
        read = cls().deserialize(data)
        answer["values"].append(
            {
                "bytes": data.hex(), "shown": str(message), "read": describe(read), "read shown": str(read),
                "equal": read == cls().deserialize(data),
                "behind": describe(cls().deserialize(data + b"more")) == describe(read),
            }
        )  # fmt: skip
    answer["odd"] = [
        outcome(lambda value=value: written(build(job["type"], value, class_of, genpy)).hex())
        for value in job.get("odd", [])
    ]
    answer["raw"] = [
        outcome(lambda data=data: describe(cls().deserialize(bytes.fromhex(data))))
        for data in job.get("raw", [])
    ]
    return answer


def class_finder(job, genpy):
    """Find classes in the text of the job, or among the installed ones."""
    if "text" in job:
        import genpy.dynamic

        return genpy.dynamic.generate_dynamic(job["type"], job["text"]).__getitem__
    import genpy.message

    if job.get("service"):
        service = genpy.message.get_service_class(job["service"])
        halves = {cls._type: cls for cls in (service._request_class, service._response_class)}
        return lambda kind: halves.get(kind) or genpy.message.get_message_class(kind)
    return genpy.message.get_message_class


def random_values(job, class_of):
    """Return the values for the seed of a job, the same on both sides."""
    rng = random.Random(job["seed"])  # noqa: S311
    return [random_value(rng, job["type"], class_of) for _ in range(job["count"])]


def answer(job, genpy):
    class_of = class_finder(job, genpy)
    if "seed" in job:
        job = dict(job, values=random_values(job, class_of))
    return examine(job, class_of, genpy)


def answers(jobs):
    """Examine jobs with the installed genpy."""
    import genpy
    import genpy.message

    return [outcome(lambda job=job: answer(job, genpy)) for job in jobs]


def ask(command, jobs, environment):
    """Return the output of this file when run by the Python `command`."""
    result = subprocess.run(
        [*command, __file__],
        input=json.dumps(jobs),
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(result.stdout)


def ask_genuine(jobs):
    return ask(["/usr/bin/python3"], jobs, {"PATH": "/usr/bin:/bin", "HOME": "/nowhere", "LC_ALL": "C.UTF-8"})


def ask_pipros(jobs, **variables):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    return ask([sys.executable], jobs, {**environment, **variables})


if __name__ == "__main__":
    json.dump(answers(json.load(sys.stdin)), sys.stdout)

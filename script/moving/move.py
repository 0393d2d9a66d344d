#!/usr/bin/env python3
"""Cut the repository by room: `python move.py` in a checkout with the old layout; then apply edits.py."""
import os, re, subprocess, sys
from pathlib import Path
ROOT = Path.cwd()
HERE = Path(__file__).parent
def git(*w, given=None): return subprocess.run(["git", *w], input=given, capture_output=True, text=True, check=True).stdout
FILES = git("ls-files", "-z").split("\0")[:-1]
OLD = set(FILES)
DIRS = {str(p) for f in FILES for p in Path(f).parents}
sys.path.insert(0, str(ROOT / "src"))
from pipros.basics.rooms import own_rooms
PACKAGE = {"web": "page", "bridges": "bridges", "perception": "robot", "navigation": "robot", "simulation": "robot", "data": "data", "ros2": "ros2", "fleet": "fleet", "assistants": "assistants", "wheels": "wheels", "tab": "tab"}
ROOMS = {room.name: room for room in own_rooms()}
unknown = set(ROOMS) - set(PACKAGE)
assert not unknown, unknown
SHARE = {name: PACKAGE[room.name] for room in ROOMS.values() for name in room.share}
FACADES = {name: PACKAGE[room.name] for room in ROOMS.values() for name in room.facades}
LIBRARIES = {"images", "clouds", "laser", "drivers"}
SHARE_OF_LIBRARIES = {} if "perception" in ROOMS else dict.fromkeys(["image_proc","laser_assembler","pcl_ros","rplidar_ros","stereo_image_proc","urg_node"], "robot")
TABLE = []
for line in (HERE / "table.txt").read_text().splitlines():
    if line and not line.startswith("#"):
        pattern, package = line.rsplit(None, 1)
        TABLE.append((re.compile(pattern), package))
USED = re.compile(r"pipros\.(" + "|".join(PACKAGE) + r")\b")
USED_LIB = re.compile(r"pipros\.libraries\.(images|clouds|laser|drivers)\b")
def by_content(file):
    text = (ROOT / file).read_text(errors="replace")
    found = {PACKAGE[n] for n in USED.findall(text)} | ({"robot"} if USED_LIB.search(text) else set())
    return found.pop() if len(found) == 1 else ""
def folder(package): return "packages/pipros" if package == "core" else f"packages/pipros-{package}"
def package_of(file):
    for pattern, package in TABLE:
        if pattern.search(file): return package
    parts = file.split("/")
    if parts[:2] == ["src", "pipros"]:
        if parts[2] == "share":
            rest = "/".join(parts[3:])
            for name, package in {**SHARE, **SHARE_OF_LIBRARIES}.items():
                if rest == name or rest.startswith(name + "/"): return package
            return "core"
        if parts[2] == "libraries" and len(parts) > 4 and parts[3] in LIBRARIES: return "robot"
        return PACKAGE.get(parts[2], "core")
    if parts[0] == "src": return "core"
    if parts[0] == "facades":
        if parts[1] == "internals": return "internals"
        return FACADES.get("/".join(parts[1:3]), "core")
    if parts[0] == "tests":
        if parts[1] == "unit" and len(parts) > 3:
            if parts[2] == "libraries" and parts[3] in LIBRARIES: return "robot"
            return PACKAGE.get(parts[2], "core")
        if parts[1] in ("graph","security","chaos","interop","regressions","fuzz") and file.endswith(".py") and len(parts) == 3 and parts[2] != "conftest.py":
            return by_content(file) or "core"
        return "core"
    if parts[0] == "benchmarks": return "core"
    if parts[0] == "plugins": return "data"
    return None
NEW = {}
for file in FILES:
    package = package_of(file)
    if package in (None, "stay"): continue
    rest = file
    if file.startswith("facades/"): rest = "facades/" + file.split("/", 2)[2]
    NEW[file] = f"{folder(package)}/{rest}"
# directories: where most of them is
from collections import Counter, defaultdict
where = defaultdict(Counter)
for old, new in NEW.items():
    p = Path(old)
    pkg = "/".join(new.split("/")[:2])
    for parent in p.parents:
        if str(parent) != ".": where[str(parent)][pkg] += 1
def new_of_dir(d):
    counts = where.get(d)
    if not counts: return None
    best = counts.most_common(1)[0][0] if len(counts) == 1 else ("packages/pipros" if "packages/pipros" in counts else counts.most_common(1)[0][0])
    rest = d
    if d == "facades/api" or d == "facades/internals": rest = "facades"
    elif d.startswith("facades/"): rest = "facades/" + d.split("/", 2)[2]
    return f"{best}/{rest}"
def translated(path):
    clean = path.rstrip("/")
    if clean in NEW: return NEW[clean]
    if clean in where: return new_of_dir(clean)
    return None
if __name__ == "__main__":
    mode = sys.argv[1] if len(sys.argv) > 1 else "list"
    if mode == "list":
        for old, new in sorted(NEW.items()): print(old, "->", new)
        sys.exit()
    # texts first, on the old tree
    PATH = re.compile(r"(?<![\w./-])(?:\./)?((?:src/pipros|facades/api|facades/internals|facades|tests|benchmarks|plugins)(?:/[\w.+-]+)*)")
    changed = 0
    for file in FILES:
        full = ROOT / file
        if full.is_symlink() or not full.is_file(): continue
        data = full.read_bytes()
        if b"\0" in data[:4096] or file.startswith(("script/moving/", "tests/golden/recordings", "src/pipros/web/page/vendor", "tests/long/")) or file in (".git-blame-ignore-revs", "CHANGELOG.md", "pyproject.toml"): continue
        try: text = data.decode()
        except UnicodeDecodeError: continue
        is_code = file.endswith(".py") or text.startswith(("#!/usr/bin/env python", "#!/usr/bin/python"))
        def put(m):
            path = m[1]
            before = text[max(0, m.start() - 3) : m.start()]
            # texts in code name paths as they are in `build`, unless they are values
            if is_code and (not before.endswith(('"', "'")) or before.endswith('"""') or text[m.end() : m.end() + 1] == " " or text[m.end() : m.end() + 2] == ": "): return m[0]
            tail = ""
            new = translated(path)
            while new is None and path[-1:] in ".-":
                path, tail = path[:-1], path[-1] + tail
                new = translated(path)
            if new is None or path in ("tests", "facades", "benchmarks", "plugins", "src"): return m[0]
            return m[0][: m[0].index(m[1])] + new + tail
        new_text = PATH.sub(put, text)
        if new_text != text:
            full.write_bytes(new_text.encode()); changed += 1
    print("texts changed in", changed, "files")
    made = set()
    for old, new in NEW.items():
        d = os.path.dirname(new)
        if d not in made: os.makedirs(d, exist_ok=True); made.add(d)
        os.rename(old, new)
    for d in ("src", "facades", "tests", "benchmarks", "plugins"):
        for base, dirs, names in os.walk(d, topdown=False):
            for n in names:
                if n.endswith(".pyc"): os.unlink(os.path.join(base, n))
            try: os.rmdir(base)
            except OSError: pass
    print("moved", len(NEW), "files")

#!/usr/bin/env bash
# The lab of plugins/pipros-wheels/docs/guides/pip.md, from forty packages to one `pip install` on three machines: `packages/pipros/tests/tutorial/lab.sh`, in an empty folder, with pipros installed.
# `script/fresh SUITE pip` runs it on a bare Debian. Each step that fails ends it with the line.
set -euo pipefail
trap 'echo "lab: line $LINENO failed" >&2' ERR
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../../.." && pwd)
export PIP_DISABLE_PIP_VERSION_CHECK=1
pip wheel --quiet --wheel-dir found "$here" # the page says why
sed -n '/^from pathlib import Path$/,/^```$/p' "$here/plugins/pipros-wheels/docs/guides/pip.md" | sed '$d' >make_lab.py

python make_lab.py
pipros wheel lab_ws -o wheels >wheel.log
PIP_FIND_LINKS=$PWD/found pip download --quiet --dest wheels wheels/*.whl
pipros index wheels

port=$((20000 + RANDOM % 10000))
python -m http.server --bind 127.0.0.1 --directory wheels "$port" >server.log 2>&1 &
server=$!
trap 'kill "$server"' EXIT
for machine in student ci robot; do
  python3 -m venv "$machine"
  case $machine in
  student) from=(--index-url "http://127.0.0.1:$port/simple/" --trusted-host 127.0.0.1 ros1-lab-robot) ;;
  ci) from=(--no-index --find-links wheels --require-hashes -r wheels/requirements.lock) ;;
  robot) from=(--no-index --find-links wheels ros1-lab-robot) ;;
  esac
  "$machine/bin/pip" install --quiet "${from[@]}"
  "$machine/bin/pip" check
  PATH=$PWD/$machine/bin:$PATH
  roslaunch --nodes lab_robot run.launch | grep -x /lab_robot
  python -c 'from lab_part39.msg import State; import rospy; print(State(level=3).level, rospy.__file__)'
  echo "lab: $machine done"
done

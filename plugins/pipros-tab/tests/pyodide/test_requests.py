"""The files of a program's page: few requests at the same time, and again those that get no answer."""

import json
import subprocess

from tests.support.environments import REPOSITORY

MODULE = REPOSITORY / "plugins/pipros-tab/src/pipros_tab/page/connection.mjs"
PROGRAM = f"""
import {{ Requests }} from "{MODULE}";
const response = new TextEncoder().encode("HTTP/1.1 200 OK\\r\\nContent-Length: 5\\r\\n\\r\\nfound");
let [open, most, made] = [0, 0, 0];
const connect = (port) => {{
  if (port === 3) return null;
  most = Math.max(most, ++open);
  const number = ++made;
  const connection = {{ write: () => setImmediate(() => {{
    if (port === 1) connection.onData(number % 3 === 0 ? response : response.slice(0, -number));
    open--;
    connection.onEnd();
  }}) }};
  return connection;
}};
const requests = new Requests(connect);
const one = async (port) => {{
  try {{
    const {{ status, body }} = await requests.get(port, "/file");
    return `${{status}} ${{new TextDecoder().decode(body)}}`;
  }} catch (error) {{
    return error.message;
  }}
}};
const found = [];
for (let round = 0; round < 3; round++) found.push(await one(1));
found.push(await one(2), await one(3));
made = 0;
await Promise.all(Array.from({{ length: 20 }}, () => one(2)));
console.log(JSON.stringify([found, most, made, open]));
"""


def test_a_request_without_an_answer_is_made_again_and_few_are_open_at_once() -> None:
    command = ["node", "--input-type=module", "--eval", PROGRAM]
    done = subprocess.run(command, capture_output=True, check=True, timeout=60)
    found, most, made, still_open = json.loads(done.stdout)
    assert found[:3] == ["200 found"] * 3
    assert found[3:] == ["port 2 does not answer", "no program listens at port 3"]
    assert (most, made, still_open) == (4, 60, 0)

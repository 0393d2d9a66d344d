import assert from "node:assert/strict";
import test from "node:test";
import { Silence, TICK_MS } from "../page/silence.js";

// Ticks from one time (ms) to another as the page does. Returns the first time at which `isFound` is true, or null.
function tickUntil(silence, begin, end, isFound) {
  for (let now = begin; now <= end; now += TICK_MS) if (isFound(silence.tick(now))) return now;
  return null;
}

test("a server that stops just after a message is called silent within 3 s, and never before 2 s", () => {
  for (let phase = 0; phase < TICK_MS; phase += 50) {
    const silence = new Silence();
    silence.begin(0);
    silence.hear(phase);
    const found = tickUntil(silence, 0, 10000, () => silence.seconds > 0);
    assert.ok(found - phase > 2000 && found - phase <= 3000, `${phase}: ${found}`);
    assert.equal(silence.seconds, 3);
    tickUntil(silence, found, 22000, () => false);
    assert.equal(silence.seconds, 22);
  }
});

test("a server that sends a message a second is never called silent", () => {
  const silence = new Silence();
  for (let now = 0; now < 60000; now += TICK_MS) {
    if (now % 1000 === 0) silence.hear(now);
    assert.equal(silence.tick(now), false);
    assert.equal(silence.seconds, 0);
  }
});

test("the silence ends with the next message", () => {
  const silence = new Silence();
  silence.hear(0);
  assert.equal(tickUntil(silence, 0, 10000, () => silence.seconds === 8), 7500);
  silence.hear(7600);
  silence.tick(7600);
  assert.equal(silence.seconds, 0);
});

test("a page that was suspended itself handles waiting messages before it calls the server silent", () => {
  const silence = new Silence();
  silence.begin(0);
  silence.hear(0);
  silence.tick(0);
  assert.equal(silence.tick(60000), false);
  assert.equal(silence.seconds, 0);
  silence.tick(60000 + TICK_MS);
  assert.equal(silence.seconds, 60);
});

test("a connection is replaced every 20 s while the server is silent, and while it does not accept", () => {
  for (const hears of [true, false]) {
    const silence = new Silence();
    silence.begin(0);
    if (hears) silence.hear(0);
    const renewed = [];
    for (let now = 0; now <= 50000; now += TICK_MS) if (silence.tick(now)) renewed.push(now);
    assert.deepEqual(renewed, [20250, 40500]);
    assert.equal(silence.seconds, hears ? 50 : 0);
  }
});

test("a closed connection is not called silent", () => {
  const silence = new Silence();
  silence.begin(0);
  silence.hear(0);
  silence.end();
  assert.equal(tickUntil(silence, 0, 60000, (isRenewed) => isRenewed || silence.seconds > 0), null);
});

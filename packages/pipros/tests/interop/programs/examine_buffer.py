"""Print as JSON the results of tf2_py for random frames and queries.

Arguments: a seed and the number of buffers; each is queried 200 times. Runs under either implementation.
"""

import json
import math
import os
import random
import sys

from geometry_msgs.msg import TransformStamped

import rospy
import tf2_py


def stamp_of(ns):
    return rospy.Time(*divmod(ns, 10**9))


def numbers(message):
    """Return all fields of a transform."""
    t, q = message.transform.translation, message.transform.rotation
    header = message.header
    values = [t.x, t.y, t.z, q.x, q.y, q.z, q.w, header.seq, header.stamp.secs, header.stamp.nsecs]
    return [header.frame_id, message.child_frame_id, values]


def outcome(function, *arguments):
    try:
        answer = function(*arguments)
    except Exception as error:
        return [type(error).__name__, str(error)]
    if isinstance(answer, TransformStamped):
        return numbers(answer)
    return repr(answer) if isinstance(answer, rospy.Time) else answer


def turned(draw):
    """Return a quaternion: usually normalised, sometimes not quite, sometimes invalid."""
    kind = draw.random()
    if kind < 0.15:
        return (0.0, 0.0, 0.0, 1.0)
    q = [draw.gauss(0, 1) for _ in range(4)]
    length = math.sqrt(sum(x * x for x in q))
    factor = 1.0 if kind < 0.8 else draw.uniform(0.996, 1.004) if kind < 0.95 else draw.uniform(0, 2)
    return [x / length * factor for x in q]


class Questions:
    """One buffer with random frames."""

    def __init__(self, draw):
        self.draw = draw
        self.length = draw.choice([1, 3, 10]) * 10**9
        self.buffer = tf2_py.BufferCore(rospy.Duration(*divmod(self.length, 10**9)))
        self.frames = ["f%d" % number for number in range(draw.choice([3, 6, 12]))]
        self.parents = {}
        for number, child in list(enumerate(self.frames))[1:]:
            self.parents[child] = draw.choice(self.frames[:number])
        if draw.random() < 0.1:
            self.parents[self.frames[0]] = self.frames[-1]  # a loop
        for child in list(self.parents)[1:]:
            if draw.random() < 0.1:
                del self.parents[child]  # two trees
        self.static = {child for child in self.parents if draw.random() < 0.3}
        self.begin = draw.randint(100, 200) * 10**9
        self.end = self.begin
        self.stamps = [0]

    def tell(self):
        """Set some transforms of the buffer."""
        draw = self.draw
        for _ in range(draw.randint(1, 30)):
            child = draw.choice(list(self.parents))
            message = TransformStamped()
            kind = draw.random()
            self.end += draw.choice([0, 0, 1, 20000000, 50000000, 123456789, 10**9])
            stamp = self.end if kind < 0.8 else self.end - draw.randint(0, 2 * self.length)
            message.header.stamp = stamp_of(max(stamp, 1))
            self.stamps.append(max(stamp, 1))
            message.header.frame_id, message.child_frame_id = self.parents[child], child
            if draw.random() < 0.03:
                message.header.frame_id = draw.choice(self.frames + ["", "/f0", "new"])
            if draw.random() < 0.02:
                message.child_frame_id = draw.choice(self.frames + ["", "/f1"])
            t, q = message.transform.translation, message.transform.rotation
            t.x, t.y, t.z = (draw.uniform(-10, 10) for _ in range(3))
            if draw.random() < 0.01:
                t.y = float("nan")
            q.x, q.y, q.z, q.w = turned(draw)
            is_static = (child in self.static) != (draw.random() < 0.02)
            insert = self.buffer.set_transform_static if is_static else self.buffer.set_transform
            insert(message, draw.choice(["me", "you"]))
        if draw.random() < 0.03:
            self.buffer.clear()

    def when(self):
        draw = self.draw
        kind = draw.random()
        if kind < 0.3:
            return stamp_of(0)
        if kind < 0.6:
            return stamp_of(draw.choice(self.stamps))
        return stamp_of(draw.randint(max(self.end - int(1.2 * self.length), 1), self.end + 10**8))

    def frame(self):
        return self.draw.choice(self.frames if self.draw.random() < 0.97 else ["", "/f0", "nowhere"])

    def ask(self):
        """Return one query and its result."""
        buffer, kind = self.buffer, self.draw.random()
        if kind < 0.45:
            return outcome(buffer.lookup_transform_core, self.frame(), self.frame(), self.when())
        if kind < 0.6:
            return outcome(buffer.can_transform_core, self.frame(), self.frame(), self.when())
        full = (self.frame(), self.when(), self.frame(), self.when(), self.frame())
        if kind < 0.75:
            return outcome(buffer.lookup_transform_full_core, *full)
        if kind < 0.85:
            return outcome(buffer.can_transform_full_core, *full)
        if kind < 0.9:
            return outcome(buffer.get_latest_common_time, self.frame(), self.frame())
        if kind < 0.95:
            return [buffer._frameExists(name) for name in self.frames] + [buffer._getFrameStrings()]
        listings = [buffer.all_frames_as_yaml(), buffer.all_frames_as_string(), buffer._allFramesAsDot()]
        return listings + [buffer._allFramesAsDot(stamp_of(self.end))]


def main():
    draw = random.Random(int(sys.argv[1]))  # noqa: S311 # no secret
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # tf2 prints there what it refuses
    answers = []
    for _ in range(int(sys.argv[2])):
        questions = Questions(draw)
        for number in range(200):
            if number % 10 == 0:
                questions.tell()
            answers.append(questions.ask())
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()

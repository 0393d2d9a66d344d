"""Print as JSON the results of message_filters for random sequences of messages.

Arguments: a seed and the number of sequences. Runs under either implementation, without a master.
"""

import json
import logging
import random
import sys

from std_msgs.msg import Header, String

import message_filters
import rospy


class Stamped:
    """A message with a header and a name."""

    def __init__(self, name, stamp):
        self.name = name
        self.header = Header(stamp=stamp)


def sequence(draw, kind):
    """Return the sets of a synchronizer for a random sequence, and the remaining queues."""
    count = draw.choice([1, 2, 2, 3, 3, 4])
    size = draw.choice([1, 2, 3, 5, 10])
    reset = draw.random() < 0.5
    simulated = draw.random() < 0.6
    headerless = draw.random() < 0.3
    step = draw.choice([1, 3, 10, 50]) * 1000000
    inputs = [message_filters.SimpleFilter() for _ in range(count)]
    if kind == "exact":
        made = message_filters.TimeSynchronizer(inputs, size, reset=reset)
    else:
        slop = draw.choice([0.0, 0.001, 0.005, 0.02, 0.1])
        made = message_filters.ApproximateTimeSynchronizer(inputs, size, slop, headerless, reset)
    sets = []
    name_of = lambda m: m.data if isinstance(m, String) else m.name
    made.registerCallback(
        lambda *m: sets.append([name_of(each) if each != "more" else each for each in m]), "more"
    )
    now = draw.randint(100, 200) * 10**9
    rospy.rostime.switch_to_wallclock()
    for number in range(draw.choice([20, 80])):
        if simulated:
            if draw.random() < 0.7:
                now += draw.randint(0, 5) * step
            elif draw.random() < 0.1:
                now -= draw.randint(1, 50) * step
            rospy.rostime._set_rostime(rospy.Time(*divmod(now, 10**9)))
        which = draw.randrange(count)
        name = "%d.%d" % (which, number)
        stamp = now + draw.randint(-4, 4) * step + (draw.randint(-2, 2) * 1000000 if kind != "exact" else 0)
        if simulated and kind != "exact" and draw.random() < 0.1:
            message = String(name)  # a message without a header
        else:
            message = Stamped(name, rospy.Time(*divmod(max(stamp, 0), 10**9)))
        if draw.random() < 0.95:
            inputs[which].signalMessage(message)
        else:
            made.add(message, made.queues[which])  # without the number, as old callers do
        sets.append(len(sets))
    left = [[name_of(message) for message in queue.values()] for queue in made.queues]
    return [sets, left]


def cached(draw):
    """Return the results of a cache."""
    source = message_filters.SimpleFilter()
    cache = message_filters.Cache(source, draw.choice([1, 3, 10]), draw.random() < 0.5)
    passed = []
    cache.registerCallback(lambda m: passed.append(getattr(m, "name", "without header")))
    rospy.rostime._set_rostime(rospy.Time(50))
    answers = [str(cache.getLast()), str(cache.getOldestTime()), str(cache.getLatestTime())]
    name = lambda m: getattr(m, "name", m and "without header")
    for number in range(15):
        stamp = rospy.Time(draw.randint(40, 60))
        source.signalMessage(Stamped(str(number), stamp) if draw.random() < 0.8 else String("x"))
        asked = [rospy.Time(draw.randint(40, 60)) for _ in range(2)]
        try:
            between = [name(m) for m in cache.getInterval(*asked)]
        except AssertionError:
            between = "refused"
        answers.append(
            [between, name(cache.getElemAfterTime(asked[0])), name(cache.getElemBeforeTime(asked[0]))]
        )
        answers.append(
            [
                name(cache.getLast()), str(cache.getLatestTime()), str(cache.getLastestTime()),
                str(cache.getOldestTime()),
            ]
        )  # fmt: skip
        answers.append([str(time) for time in cache.cache_times])
    return [passed, answers]


def main():
    logging.disable(logging.CRITICAL)
    rospy.rostime.set_rostime_initialized(True)
    draw = random.Random(int(sys.argv[1]))  # noqa: S311 # no secret
    answers = []
    for _ in range(int(sys.argv[2])):
        answers += [sequence(draw, "exact"), sequence(draw, "approximate"), cached(draw)]
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()

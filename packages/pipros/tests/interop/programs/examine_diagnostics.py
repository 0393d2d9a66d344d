"""Print as JSON the reports of diagnostic_updater on random events in simulated time.

Arguments: a seed and the number of sequences. Runs under either implementation, without a master.
"""

import json
import random
import sys

import diagnostic_updater as du
import rospy


def report(task):
    status = du.DiagnosticStatusWrapper()
    status.summary(2, "No message was set")
    task.run(status)
    return [status.level, status.message, [[value.key, value.value] for value in status.values]]


def sequence(draw):
    now = draw.randint(100, 200) * 1000
    rospy.rostime._set_rostime(rospy.Time(*divmod(now * 1000000, 10**9)))
    low = draw.choice([0, 1, 5])
    bounds = draw.choice([{"min": low}, {"min": low, "max": low + 5}, {"min": 5, "max": 5}])
    frequency = du.FrequencyStatus(
        du.FrequencyStatusParam(bounds, draw.choice([0, 0.1, 0.5]), draw.choice([1, 2, 5]))
    )
    stamps = du.TimeStampStatus(
        du.TimeStampStatusParam(-0.5, 1) if draw.random() < 0.5 else du.TimeStampStatusParam()
    )
    both = du.CompositeDiagnosticTask("both")
    both.addTask(frequency)
    both.addTask(stamps)
    tasks = [frequency, stamps, both, du.Heartbeat(), du.FunctionDiagnosticTask("f", lambda stat: stat)]
    found = [task.getName() for task in tasks]
    for _ in range(10):
        for _ in range(draw.randint(0, 8)):
            now += draw.randint(1, 500)
            rospy.rostime._set_rostime(rospy.Time(*divmod(now * 1000000, 10**9)))
            frequency.tick()
            if draw.random() < 0.7:
                stamp = now / 1000.0 + draw.choice([0, -0.3, -3, -9, 0.7, 2])
                stamps.tick(draw.choice([0.0, stamp, rospy.Time.from_sec(stamp)]))
        now += 1
        rospy.rostime._set_rostime(rospy.Time(*divmod(now * 1000000, 10**9)))
        found.append(report(draw.choice(tasks)))
        if draw.random() < 0.1:
            frequency.clear()
            now += 1
            rospy.rostime._set_rostime(rospy.Time(*divmod(now * 1000000, 10**9)))
    merged = du.DiagnosticStatusWrapper()
    for _ in range(5):
        merged.mergeSummary(draw.choice([0, 0, 1, 2]), draw.choice(["a", "b", ""]))
        found.append([merged.level, merged.message])
    merged.clearSummary()
    return found + [merged.level, merged.message]


def main():
    rospy.rostime.set_rostime_initialized(True)
    draw = random.Random(int(sys.argv[1]))  # noqa: S311 # no secret
    json.dump([sequence(draw) for _ in range(int(sys.argv[2]))], sys.stdout)


if __name__ == "__main__":
    main()

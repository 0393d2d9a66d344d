import math
import unittest

from vehicle_battery.assessment import CRITICAL, LOW, OK, UNKNOWN, Assessor, Limits

LIMITS = Limits(low=0.25, critical=0.10, hysteresis=0.02, minutes_left=0.0)


def levels(assessor, percentages):
    return [assessor.update(second, percentage).level for second, percentage in enumerate(percentages)]


class Levels(unittest.TestCase):
    def test_begin_at_their_limits(self):
        self.assertEqual(
            levels(Assessor(LIMITS), [1.0, 0.25, 0.24, 0.10, 0.09]), [OK, OK, LOW, LOW, CRITICAL]
        )

    def test_end_above_their_limits_by_the_hysteresis(self):
        self.assertEqual(
            levels(Assessor(LIMITS), [0.09, 0.11, 0.13, 0.26, 0.28]), [CRITICAL, CRITICAL, LOW, LOW, OK]
        )

    def test_are_unknown_without_a_charge(self):
        self.assertEqual(levels(Assessor(LIMITS), [math.nan, 0.5]), [UNKNOWN, OK])


class TimeLeft(unittest.TestCase):
    def test_is_extrapolated_from_the_charge(self):
        assessor = Assessor(LIMITS)
        for second in range(60):
            assessment = assessor.update(second, 0.9 - 0.001 * second)
        self.assertAlmostEqual(assessment.time_left, (0.9 - 0.059) / 0.001, places=3)

    def test_warns_before_the_charge_does(self):
        assessor = Assessor(Limits(minutes_left=10.0))
        self.assertEqual(levels(assessor, [0.9 - 0.002 * second for second in range(20)])[-1], LOW)

    def test_is_not_known_while_the_battery_is_charged(self):
        assessor = Assessor(LIMITS)
        for second in range(20):
            assessment = assessor.update(second, 0.5 + 0.001 * second)
        self.assertTrue(math.isnan(assessment.time_left))

    def test_restarts_when_time_jumps_back(self):
        assessor = Assessor(LIMITS)
        for second in range(20):
            assessor.update(1000 + second, 0.5 - 0.01 * second)
        self.assertTrue(math.isnan(assessor.update(3, 0.9).time_left))


class Acknowledging(unittest.TestCase):
    def test_is_valid_until_the_level_gets_worse(self):
        assessor = Assessor(LIMITS)
        assessor.update(0, 0.2)
        self.assertTrue(assessor.acknowledge().acknowledged)
        self.assertTrue(assessor.update(1, 0.15).acknowledged)
        self.assertFalse(assessor.update(2, 0.05).acknowledged)

    def test_is_valid_until_the_level_ends(self):
        assessor = Assessor(LIMITS)
        assessor.update(0, 0.2)
        assessor.acknowledge()
        self.assertFalse(assessor.update(1, 0.9).acknowledged)
        self.assertFalse(assessor.update(2, 0.2).acknowledged)

    def test_needs_something_to_acknowledge(self):
        assessor = Assessor(LIMITS)
        assessor.update(0, 0.9)
        self.assertIsNone(assessor.acknowledge())


class Texts(unittest.TestCase):
    def test_state_charge_and_remaining_time(self):
        assessor = Assessor(LIMITS)
        for second in range(11):
            assessment = assessor.update(second, 0.2 - 0.0001 * second)
        self.assertEqual(assessment.text, "battery low: 20 %, empty in 33 min")
        self.assertEqual(assessor.update(11, math.nan).text, "the charge of the battery is unknown")


if __name__ == "__main__":
    unittest.main()

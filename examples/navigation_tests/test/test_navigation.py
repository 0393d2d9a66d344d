"""Requirements for a robot in an apartment. All times are simulated."""

KITCHEN = (7.8, 1.5, 0.0)
BEDROOM = (2.5, 5.8, 1.5)
DOOR = (2.9, 1.0, 1.2)


def test_the_robot_reaches_the_kitchen(navigation_world):
    world = navigation_world("apartment", DOOR, seed=1)

    world.reaches(*KITCHEN, within_s=40)


def test_the_robot_keeps_away_from_walls(navigation_world):
    world = navigation_world("apartment", DOOR, seed=2)

    with world.never_closer_than(0.05):
        world.reaches(*BEDROOM, within_s=60)


def test_the_robot_recovers_from_kidnapping(navigation_world):
    world = navigation_world("apartment", DOOR, seed=3)

    world.recovers_from_kidnapping(*KITCHEN, within_s=60)
    world.reaches(*DOOR, within_s=60)
